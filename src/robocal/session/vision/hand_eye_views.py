"""What a camera saw of a target: corners of images or of a list, with their lens, or poses that another program measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.vision_limits import LENS_CENTRE_PRIOR, LENS_DISTORTION_PRIOR
from robocal.errors import ModelError
from robocal.files.csvtable import read_csv
from robocal.files.lens import read_lens
from robocal.files.robot_poses import RobotPoses, read_robot_poses
from robocal.files.text import InputFile
from robocal.geometry import se3
from robocal.measure.data import Observations
from robocal.progress import Watch
from robocal.session.vision.corner_table import CAMERA, CornerTable, read_corners
from robocal.session.vision.detection import Detected
from robocal.session.vision.hand_eye_images import LENS_EXPECTED, detect_corners, is_table
from robocal.session.vision.lens_fit import fit_lens, improve_lens, lens_of, plain_lens
from robocal.vision.camera import MODELS
from robocal.vision.lenses import Lens

__all__ = ["HandEyeViews", "read_views"]

PIXELS = ("fx", "fy", "cx", "cy")  # numbers of a lens that are in pixels
OF_CORNERS = ("lens", "free_lens", "size", "square", "checker", "sheet", "image", "dictionary", "charuco")
OF_POSES = ("target_units", "target_quaternion", "target_inverse")


@record(kw_only=True, eq=False)
class HandEyeViews:
    """The `names` of views, which may be numbered rows only (`named`), their `times` (s) where a column has some, and the rows; the lens,
    with the covariance to which it is known beforehand as `prior`, and in words how it is known, or how poses were read; the table of
    corners; `target`: poses as they were read, and whether they were of the camera in it; whether the shutter rolls; files, remarks."""

    names: tuple[str, ...]
    named: bool
    times: Array | None
    observations: Observations
    lens: Lens | None
    prior: Lens | None
    description: str
    table: CornerTable | None
    detected: Detected | None
    target: RobotPoses | None
    target_inverse: bool = False
    rolling: bool = False
    files: tuple[InputFile, ...]
    remarks: tuple[Any, ...]


def read_views(o: Any, watch: Watch | None = None) -> HandEyeViews:
    """Reads corners or poses of a target. Raises InputError."""
    detected = None
    if not is_table(o.corners):
        o.refuse(OF_POSES, "images have no poses of a target", "a CSV of such poses")
        detected, table = detect_corners(o, watch)
    elif _has_corners(o.corners):
        o.refuse(OF_POSES, "corners are no poses of a target", "a CSV of such poses")
        o.refuse(("dictionary", "charuco"), "the corners were detected already", "images, or corners alone")
        table = read_corners(
            o.corners, size=o.size, square=o.square, checker=o.checker, sheet=o.sheet, image=o.image, exclude=o.exclude
        )
    else:
        return _measured(o)
    lens, words, files, rolling = _lens(o, table, watch)
    prior = _knowledge(o, lens)
    found = prior if o.lens is None or not o.free_lens else improve_lens(table, prior, watch)
    obs = table.pixels
    options = {**obs.options, "camera": CAMERA, "intrinsics": found.numbers, "free": found.known}
    if found.known:
        options |= {"known": found.known, "covariance": found.covariance}
    return HandEyeViews(
        names=table.data.configurations.ids, named=True, times=None, observations=replace(obs, options=options), lens=lens, prior=prior,
        description=words, table=table, detected=detected, target=None, rolling=rolling,
        files=(*(table.files if detected is None else detected.inputs), *files),
        remarks=(*(() if detected is None else detected.remarks), *table.remarks),
    )  # fmt: skip


def _measured(o: Any) -> HandEyeViews:
    """Poses of a target in the camera."""
    o.refuse(OF_CORNERS, "measured poses need no lens and no target", "corners: columns u and v")
    read = read_robot_poses(
        o.corners,
        maker=None,
        euler=None,
        units=o.target_units,
        quaternion=o.target_quaternion,
        vector=True,
        option="--target-units",
    )
    if o.target_inverse:
        read = replace(read, pose=se3.inverse(read.pose))
    rows = tuple(f"{o.corners.name}:{i + 1}" for i in range(len(read)))
    obs = Observations("pose", np.arange(len(read)), se3.to_vector(read.pose), group="poses", source=str(o.corners))
    return HandEyeViews(
        names=read.names or rows, named=read.names is not None, times=read.times, observations=obs, lens=None, prior=None,
        description=f"poses of a target: {read.notation}", table=None, detected=None, target=read, target_inverse=o.target_inverse,
        files=read.files, remarks=(),
    )  # fmt: skip


def _has_corners(place: Path) -> bool:
    table = read_csv(place)
    return table.has("u") and table.has("v")


def _lens(o: Any, table: CornerTable, watch: Watch | None) -> tuple[Lens, str, tuple[InputFile, ...], bool]:
    """The lens of the images, in words, its file, and whether the shutter rolls."""
    size = table.size
    if o.lens is None and o.free_lens:
        return _lens_of_views(table, watch), "by these views alone, known to a prior", (), False
    if o.lens is None:
        raise ModelError("corners say where a camera is only with its lens", key="--lens", expected=LENS_EXPECTED)
    read = read_lens(o.lens, size=size)
    lens = read.lens
    if lens.size is not None and lens.size != size:
        found, expected = "{} x {}".format(*lens.size), "{} x {} px, as the corners".format(*size)
        raise ModelError("a lens of images of another size", key="--lens", found=found, expected=expected)
    how = "known to a prior" if o.free_lens or lens.known else "as it is"
    return replace(lens, size=size), f"{o.lens.name}, {lens.model}, {how}", (read.file,), read.rolling


def _lens_of_views(table: CornerTable, watch: Watch | None) -> Lens:
    """The lens that views tell without the robot. Raises ModelError where they hardly do."""
    plain = plain_lens(table.size, "brown")
    lens = lens_of(fit_lens(table, plain, (), False, watch), plain, table.size)
    off = max(lens.sigma.get(s, np.inf) for s in PIXELS)
    if not off < LENS_CENTRE_PRIOR:
        found = f"focal length or centre known to {off:.3g} px"
        expected = f"{LENS_CENTRE_PRIOR:g} px at most: tilt the target by 20 to 45 deg in many views; or --lens"
        raise ModelError("these views do not tell a lens", key="--free-lens", found=found, expected=expected)
    return lens


def _knowledge(o: Any, lens: Lens) -> Lens:
    """The lens with the covariance of what is free of it: as its file states it or the views alone tell it; of other numbers that of
    --free-lens."""
    if not o.free_lens or o.lens is None:
        return lens
    free = [*lens.known, *(s for s in MODELS[lens.model].symbols if s not in {*_unused(lens), *lens.known})]
    sigma = np.array([LENS_CENTRE_PRIOR if s in PIXELS else LENS_DISTORTION_PRIOR for s in free])
    covariance, stated = np.diag(sigma**2), len(lens.known)
    covariance[:stated, :stated] = np.array(lens.covariance).reshape(stated, stated)
    return Lens.of(lens.model, lens.numbers, lens.size, free, covariance, lens.source)


def _unused(lens: Lens) -> Sequence[str]:
    """Powers of the radius that stay zero where the file has none: four numbers say what hand-eye views show of a distortion."""
    late = ("k3", "k4", "k5", "k6") if lens.model != "fisheye" else ()
    return [s for s, v in zip(lens.kind.symbols, lens.numbers, strict=True) if s in late and v == 0]

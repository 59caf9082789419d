"""Views of a target and the robot's poses as data for `decide`: given flange poses are a machine without joints whose poses are known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.camera_changes import half_turns_open, view_poses
from robocal.diagnose.half_turns import undo_half_turns
from robocal.diagnose.limits import LENS_CENTRE_PRIOR, LENS_DISTORTION_PRIOR
from robocal.errors import ModelError
from robocal.files.csvtable import read_csv
from robocal.files.lens import read_lens
from robocal.files.robot_poses import RobotPoses, read_robot_poses
from robocal.files.text import InputFile
from robocal.fit.starts.consensus import find_flips
from robocal.geometry import se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.measure.pixels import HALF_TURNS
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.corner_table import CAMERA, CornerTable, read_corners
from robocal.session.vision.detection import Detected
from robocal.session.vision.hand_eye_images import LENS_EXPECTED, detect_corners, is_table
from robocal.session.vision.hand_eye_joints import read_joint_poses
from robocal.session.vision.hand_eye_pair import Pairs, pair_views
from robocal.session.vision.pose_pairs import tell_flips
from robocal.vision.camera import MODELS
from robocal.vision.lenses import Lens

__all__ = ["BOARD", "EYE", "HandEyeData", "open_hand_eye"]

EYE, BOARD = "camera", "board"
PLACE = (1.0, 3.0)  # of a frame that is looked for, m and rad
PIXELS = ("fx", "fy", "cx", "cy")  # numbers of a lens that are in pixels
FEWEST = 3  # tolerance: pairs of a closed form


@record(eq=False)
class HandEyeData:
    """What was opened: data and machine, pairs of views and poses, the robot's poses T_base_flange (n, 4, 4) of the data's configurations,
    the lens (None of measured poses), how its numbers are known, corners, the files and remarks."""

    data: DataSet
    robot: RobotPoses
    pairs: Pairs
    flange: Array
    inhand: bool
    inverse: bool
    lens: Lens | None
    named: str
    table: CornerTable | None
    detected: Detected | None
    arm: Any
    files: tuple[InputFile, ...]
    remarks: tuple[Any, ...]

    @property
    def machine(self) -> Any:
        """The arm whose joints were read, or the robot whose flange is where it says."""
        return Rig("robot", freedom=()) if self.arm is None else self.arm

    @property
    def hand(self) -> str:
        """What the robot's poses are of."""
        return "flange" if self.arm is None else "tool"

    @property
    def observations(self) -> Observations:
        """The one list of observations."""
        return self.data.observations[0]

    @property
    def views(self) -> tuple[str, ...]:
        """The names of the views."""
        return self.data.configurations.ids

    def with_flange(self, flange: Array) -> DataSet:
        """The data with other poses of the robot."""
        return replace(self.data, configurations=replace(self.data.configurations, start=se3.to_vector(flange)))

    def target_views(self) -> tuple[Ints, Array]:
        """The configurations (V,) of views that show the first target well, and its pose in the camera in each, (V, 4, 4)."""
        obs = self.observations
        if obs.target is not None and len(obs.targets) > 1:
            obs = obs.take(np.flatnonzero(obs.target == int(np.bincount(obs.target).argmax())))
            obs = replace(obs, targets=(), target=None)
        if obs.kind == "pose":
            return obs.configuration, se3.from_vector(obs.value)
        found = view_poses(obs)
        return found.configuration, found.pose


def open_hand_eye(o: Any, watch: Watch | None = None) -> HandEyeData:
    """Reads corners or poses of a target, the robot's poses and the lens, and pairs views with poses. Raises InputError."""
    arm, joints = None, None
    if o.arm is None:
        robot = read_robot_poses(o.robot, maker=o.maker, euler=o.euler, units=o.units, quaternion=o.quaternion)
    else:
        o.refuse(("maker", "euler", "quaternion", "inverse"), "joint values are no poses", "--arm alone")
        robot, arm, joints = read_joint_poses(o.robot, o.arm, o.units)
    detected = None
    if not is_table(o.corners):
        detected, table = detect_corners(o, watch)
    elif _has_corners(o.corners):
        o.refuse(("dictionary", "charuco"), "the corners were detected already", "images, or corners alone")
        table = read_corners(
            o.corners, size=o.size, square=o.square, checker=o.checker, sheet=o.sheet, image=o.image, exclude=o.exclude
        )
    else:
        table = None
    if table is not None:
        views, obs = table.data.configurations.ids, table.pixels
        lens, named, files = _lens(o, table.size)
        options = {**obs.options, "camera": CAMERA, "intrinsics": lens.numbers, **_knowledge(o, lens)}
        obs = replace(obs, options=options)
        files = (*(table.files if detected is None else detected.inputs), *files)
        said = (*(() if detected is None else detected.remarks), *table.remarks)
    else:
        for name in ("lens", "size", "square", "checker", "sheet", "image", "dictionary", "charuco"):
            if getattr(o, name) is not None:
                raise ModelError(
                    "measured poses need no lens and no target",
                    key=f"--{name}",
                    found=str(getattr(o, name)),
                    expected="corners: columns u and v",
                )
        seen = read_robot_poses(o.corners, maker=None, euler=None, units=o.target_units, vector=True)
        views = seen.names or tuple(f"{o.corners.name}:{i + 1}" for i in range(len(seen)))
        table, lens, named = None, None, f"poses of a target: {seen.notation}"
        obs = Observations("pose", np.arange(len(seen)), se3.to_vector(seen.pose), group="poses", source=str(o.corners))
        files, said = seen.files, ()
    pairs = pair_views(views, robot, o.pair)
    if len(pairs.view) < FEWEST:
        raise ModelError(
            "too few views have a pose of the robot",
            key="--robot",
            found=str(len(pairs.view)),
            expected=f"{FEWEST} at least, better 15 to 30",
        )
    flange = robot.pose[pairs.pose]
    if o.inverse:
        flange = se3.inverse(flange)
    inhand = o.camera == "hand"
    obs = _frames(obs, inhand)
    whole = DataSet(Configurations(tuple(views)), (obs,)).take(pairs.view)
    flipped = _flipped(whole, flange, inhand)
    if len(flipped):
        names = [whole.configurations.ids[i] for i in flipped.tolist()]
        said = (*said, *tell_flips(names, len(flange)))
        kept = np.setdiff1d(np.arange(len(flange)), flipped)
        pairs, flange, whole = (
            replace(pairs, view=pairs.view[kept], pose=pairs.pose[kept]),
            flange[kept],
            whole.take(kept),
        )
    joints = None if joints is None else joints[pairs.pose]
    where = replace(whole.configurations, joints=joints, digits=None, start=se3.to_vector(flange))
    data = replace(whole, configurations=where)
    if o.undo_half_turns:
        data, undone = _undo(Rig("robot", freedom=()) if arm is None else arm, data)
        said = (*said, *undone)
    return HandEyeData(
        data=data, robot=robot, pairs=pairs, flange=flange, inhand=inhand, inverse=o.inverse, lens=lens, named=named, table=table, arm=arm,
        detected=detected,
        files=(*files, *robot.files), remarks=said,
    )  # fmt: skip


def _flipped(data: DataSet, flange: Array, inhand: bool) -> Ints:
    """The configurations whose measured pose is the other one of a flat target; none of corners, which say it themselves."""
    (obs,) = data.observations
    if obs.kind != "pose":
        return np.zeros(0, dtype=np.int64)
    return np.unique(obs.configuration[find_flips(se3.from_vector(obs.value), flange[obs.configuration], inhand)])


def _has_corners(place: Path) -> bool:
    table = read_csv(place)
    return table.has("u") and table.has("v")


def _frames(obs: Observations, inhand: bool) -> Observations:
    """The same rows seen by a camera on the flange or the base, of a target on the other."""
    camera, target = ("tool", "base") if inhand else ("base", "tool")
    names = [t.name for t in obs.targets] or [BOARD]
    if EYE in names:
        names = [f"marker_{n}" for n in names]
    targets = tuple(Frame(n, free=(True,) * 6, mount=target, expected=PLACE) for n in names)
    which = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    frame = Frame(EYE, free=(True,) * 6, mount=camera, expected=PLACE)
    return replace(obs, frame=frame, targets=targets, target=which)


def _undo(machine: Any, data: DataSet) -> tuple[DataSet, tuple[Remark, ...]]:
    """The data where views are labelled from one end of the board, and in how many they were not."""
    (obs,) = data.observations
    if obs.kind != "pixels":
        raise ModelError("measured poses have no labels", key="--undo-half-turns", expected="corners of a board")
    asked = replace(data, observations=(replace(obs, options={**obs.options, HALF_TURNS: True}),))
    if not half_turns_open(asked.observations[0]):
        raise ModelError(
            "this target does not look the same after half a turn", key="--undo-half-turns", expected="without it"
        )
    done, turned = undo_half_turns(machine, asked)
    own = replace(done.observations[0], options=obs.options)
    count = sum(int(t.sum()) for t in turned.values())
    said = Remark.of(Code.HALF_TURNS_UNDONE, count=count, total=len(data.configurations), instruments=(obs.label,))
    return replace(done, observations=(own,)), (said,)


def _lens(o: Any, size: tuple[int, int]) -> tuple[Lens, str, tuple[InputFile, ...]]:
    """The lens of the images, in words, and its file."""
    if o.lens is None:
        raise ModelError("corners say where a camera is only with its lens", key="--lens", expected=LENS_EXPECTED)
    read = read_lens(o.lens)
    lens = read.lens
    if lens.size is not None and lens.size != size:
        found, expected = "{} x {}".format(*lens.size), "{} x {} px, as the corners".format(*size)
        raise ModelError("a lens of images of another size", key="--lens", found=found, expected=expected)
    how = "known to a prior" if o.free_lens or lens.known else "as it is"
    return replace(lens, size=size), f"{o.lens.name}, {lens.model}, {how}", (read.file,)


def _knowledge(o: Any, lens: Lens) -> dict[str, object]:
    """What is free of a lens, and how well it is known beforehand: by its file, else by the prior of --free-lens."""
    symbols = MODELS[lens.model].symbols
    if not o.free_lens:
        if not lens.known:
            return {"free": ()}
        return {"free": lens.known, "known": lens.known, "covariance": lens.covariance}
    some = [s for s in symbols if s not in _unused(lens)]
    sigma = np.array([LENS_CENTRE_PRIOR if s in PIXELS else LENS_DISTORTION_PRIOR for s in some])
    return {"free": tuple(some), "known": tuple(some), "covariance": tuple(map(tuple, np.diag(sigma**2).tolist()))}


def _unused(lens: Lens) -> Sequence[str]:
    """Powers of the radius that stay zero where the file has none: four numbers say what hand-eye views show of a distortion."""
    late = ("k3", "k4", "k5", "k6") if lens.model != "fisheye" else ()
    return [s for s, v in zip(lens.kind.symbols, lens.numbers, strict=True) if s in late and v == 0]

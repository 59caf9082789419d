"""Cameras that are bolted to one another, as a file states them: where each is on the first one, its corners and its lens.

    robocal: 1
    kind: camera-rig
    units: {length: mm, angle: deg}
    cameras:                                # the first camera is that of the command
      right: {corners: right.csv, lens: right.yaml, xyz: [60, 0, 0], prior: {length: 0.2, angle: 0.1}}    # T_first_right
      top: {corners: top.csv, lens: top.yaml, free: true}

A place that is stated holds, or stays within its prior; one that nobody states is free. Files are beside this one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from robocal._record import record
from robocal.files.datamodel import PlacePriorModel
from robocal.files.orientation import frame_vector
from robocal.files.robot import read_units
from robocal.files.schema import FileModel, FrameModel, Name, UnitsModel, Version, validate
from robocal.files.text import InputFile, read_text
from robocal.files.yamlio import parse
from robocal.measure.data import Frame

__all__ = ["CameraRig", "FurtherCamera", "read_camera_rig"]

LIMIT = 1 << 20  # bytes
PLACE = (1.0, 3.0)  # of a camera that nobody states, m and rad


class FurtherModel(FrameModel):
    """One more camera."""

    corners: str
    lens: str
    prior: PlacePriorModel | None = None


class CameraRigModel(FileModel):
    """rig.yaml as it is written."""

    robocal: Version
    kind: Literal["camera-rig"]
    units: UnitsModel
    cameras: dict[Name, FurtherModel]


@record
class FurtherCamera:
    """One more camera: T_first_camera as a frame, the files of its corners and its lens, and whether anybody states its place."""

    frame: Frame
    corners: Path
    lens: Path
    stated: bool


@record
class CameraRig:
    """The cameras beside the first, and the file."""

    cameras: tuple[FurtherCamera, ...]
    file: InputFile


def read_camera_rig(path: Path, taken: tuple[str, ...] = ()) -> CameraRig:
    """Reads such a file; names in `taken` mean something else. Raises FileError or FormatError."""
    source = read_text(path, limit=LIMIT)
    document = parse(source)
    kind = document.data.get("kind")
    document.insist(kind == "camera-rig", "these are no cameras", ("kind",), found=kind, expected="kind: camera-rig")
    given = validate(CameraRigModel, document)
    document.insist(
        given.cameras, "a rig without a further camera", ("cameras",), expected="one at least: right: {...}"
    )
    units = read_units(given.units, document)
    out = []
    for name, one in given.cameras.items():
        at = ("cameras", name)
        document.insist(name not in taken, "a name that means something else", at, found=name, expected="another name")
        free = one.free_flags(not one.given or one.prior is not None)
        prior = None
        if one.prior is not None:
            expected = "xyz beside prior"
            document.insist(one.given, "a prior around a place that nobody states", (*at, "prior"), expected=expected)
            document.insist(all(free), "a prior around a place that is fixed", (*at, "free"), expected="prior alone")
            prior = (*[units.length.to_si(one.prior.length)] * 3, *[units.angle.to_si(one.prior.angle)] * 3)
        document.insist(
            one.given or all(free),
            "a camera that is held where nobody states",
            (*at, "free"),
            expected="xyz, or free: true",
        )
        frame = Frame(name, frame_vector(one, units), free, "tool", PLACE, one.given, prior)
        folder = source.path.parent
        out.append(FurtherCamera(frame, folder / one.corners, folder / one.lens, one.given))
    return CameraRig(tuple(out), InputFile(source.path, source.sha256))

"""A rig as a file describes it: instruments that are fixed to one another, such as the cameras of a stereo head, without a robot.

    robocal: 1
    kind: rig
    name: stereo head
    units: {length: mm, angle: deg}

The base is the rig itself: frames of instruments stand on it. What they see moves as a whole, and its pose is free at every configuration.
With `poses: known` a tracker or a robot states where the rig is in every row of the data: a probe with a marker on it. Its instruments
are mounted on "tool", and the base is where its poses are measured from.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from robocal.files.opened_file import Bare
from robocal.files.robot import read_units
from robocal.files.schema import FileModel, Name, UnitsModel, Version, validate
from robocal.files.text import ROBOT_LIMIT, read_text
from robocal.files.yamlio import parse
from robocal.measure.machine import Rig

__all__ = ["read_rig"]


class RigModel(FileModel):
    """robot.yaml of a rig."""

    robocal: Version
    kind: Literal["rig"]
    name: Name
    units: UnitsModel
    poses: Literal["free", "known"] = "free"
    source: str | None = None


def read_rig(path: Path) -> Bare[Rig]:
    """The rig of a file. Raises FileError or FormatError."""
    source = read_text(path, limit=ROBOT_LIMIT)
    document = parse(source)
    model = validate(RigModel, document)
    freedom = () if model.poses == "known" else Rig.freedom
    return Bare(
        Rig(model.name, freedom=freedom), read_units(model.units, document), source.path, source.text, source.sha256, convention="rig",
        source=model.source or "",
    )  # fmt: skip

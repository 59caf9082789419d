"""A cable robot with where it came from, and what is wrong with it told where it stands."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Self

from robocal._record import record, replace
from robocal.cables.check import check
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.files.cable.cable_model import CableUnits
from robocal.files.cable.pose_lists import COLUMNS
from robocal.files.text import InputFile
from robocal.files.units import Unit
from robocal.files.yamlio import Path_, YamlDocument, path_text
from robocal.remarks.remark import Remark

__all__ = ["CableFile", "robot_remarks"]

Place = tuple[Path_, Unit]


@record
class CableFile:
    """A cable robot with where it came from. `places` says where in the text a parameter stands and in which unit;
    `format` is yaml, published or caspr; `warnings` are what is odd about it; `beside` are other files that it was read from."""

    robot: CableRobot
    units: CableUnits
    path: Path | None
    text: str
    sha256: str
    format: str = "yaml"
    warnings: tuple[Remark, ...] = ()
    places: Mapping[str, Place] | None = None
    beside: tuple[InputFile, ...] = ()

    @property
    def machine(self) -> CableRobot:
        """The robot, as what an identification is made of."""
        return self.robot

    def with_machine(self, machine: CableRobot) -> Self:
        """Another robot of the same file."""
        return replace(self, robot=machine)

    @property
    def convention(self) -> str:
        """What kind of machine the file describes, with its degrees of freedom."""
        return f"cable {self.robot.degrees}"

    @property
    def source(self) -> str:
        """Where the numbers come from."""
        return self.robot.sources.get("", "")


def robot_remarks(robot: CableRobot, document: YamlDocument, where: Mapping[str, Path_]) -> tuple[Remark, ...]:
    """What `cables.check` says of a robot, located in its file; `where` says under which keys another format has mass,
    tension and whatever else it has for all cables at once."""
    for name in robot.cables:
        if name in COLUMNS or set(name) & set("[]"):
            message = "not a usable name for a cable: lists have a column of this name"
            expected = "one that is no column of a list (id, x, rx, fx, margin, ...) and has no brackets"
            at = _place_of(f"{name}.name", robot, document, where)
            document.fail(message, at, found=name, expected=expected)
    try:
        return tuple(doubt.of_file(document.path) for doubt in check(robot))
    except ModelError as error:
        path = _place_of(str(error.key), robot, document, where)
        raise error.of_file(document.path, row=document.row(path), key=path_text(path) or error.key) from None


def _place_of(key: str, robot: CableRobot, document: YamlDocument, where: Mapping[str, Path_]) -> Path_:
    """The key path that a complaint of the model speaks of."""
    owner, _, what = key.partition(".")
    if (what or key) in where:
        return where[what or key]
    if owner not in robot.cables:
        return ("platform", key) if key in ("mass", "inertia") else (key,)
    i = robot.cables.index(owner)
    for path in (("cables", i, what), ("every_cable", what), ("cables", i), ("frame_anchors", i), ("frame_anchors",)):
        if path in document.lines:
            return path
    return ()

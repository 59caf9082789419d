"""A machine with where it came from, whatever it is: the file of an arm, of a cable robot, or none at all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from robocal.errors import InputError
from robocal.files.robot import Robot, render_robot
from robocal.files.runfolder import ROBOTS, find_run
from robocal.files.units import Unit, Units, number
from robocal.files.yamlio import load, quoted
from robocal.measure.machine import Machine
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.files.cable.cablefile import CableFile

__all__ = ["Bare", "Opened", "Speaks", "cable_file", "rendered"]

M = TypeVar("M", bound=Machine)


class Speaks(Protocol):
    """The units in which a file and its reports speak."""

    def of(self, si: str, /) -> Unit:
        """The unit for a quantity whose SI unit is `si`."""


@dataclass(frozen=True)
class Bare(Generic[M]):
    """A machine without a file, as somebody made it in Python; `text` describes its parameters."""

    machine: M
    units: Units = field(default_factory=Units)
    path: Path | None = None
    text: str = ""
    sha256: str = ""
    format: str = "yaml"
    warnings: tuple[Remark, ...] = ()
    convention: str = ""
    source: str = ""


class Opened(Protocol):
    """A machine, the units and the text of its file."""

    @property
    def machine(self) -> Machine: ...
    @property
    def units(self) -> Speaks: ...
    @property
    def path(self) -> Path | None: ...
    @property
    def format(self) -> str: ...
    @property
    def warnings(self) -> tuple[Remark, ...]: ...
    @property
    def convention(self) -> str: ...
    @property
    def source(self) -> str: ...


def cable_file(name: str | os.PathLike[str]) -> CableFile | None:
    """The cable robot of a file or of a run folder, or None where the file is of something else, or there is none. Raises InputError for
    whatever is wrong with a cable robot."""
    place = Path(name)
    run = find_run(place) if place.exists() else None
    if place.is_dir():
        place = place / ROBOTS[0]
    if not place.is_file() or not _of_cables(place):
        return None
    from robocal.files.cable.robot import read_cable

    file = read_cable(place)
    return file if run is None else replace(file, warnings=(*file.warnings, *run.doubts))


def _of_cables(place: Path) -> bool:
    """Whether a file is of a cable robot: robot.yaml, the YAML of a published robot, or CASPR's X_cables.xml."""
    if place.name.endswith("_cables.xml"):
        return True
    if place.suffix.lower() not in (".yaml", ".yml"):
        return False
    try:
        data = load(place).data
    except InputError:
        return False
    return data.get("kind") == "cable" or (not {"robocal", "kind"} & set(data) and "frame_anchors" in data)


def rendered(file: Opened, values: Mapping[str, float]) -> tuple[str, tuple[str, ...]]:
    """The text of the file with other parameter values (SI, by name), and the names that it cannot hold."""
    if isinstance(file, Robot):
        return render_robot(file, dict(values))
    from robocal.files.cable.cablefile import CableFile
    from robocal.files.cable.write import render_cable

    if isinstance(file, CableFile):
        return render_cable(file, values)
    lines = [f"name: {quoted(file.machine.name)}", "parameters:"]
    for p in file.machine.table.rows:
        unit = file.units.of(p.unit)
        lines.append(f"  {p.name}: {{value: {number(unit.from_si(values.get(p.name, p.value)))}, unit: {unit.name}}}")
    return "\n".join(lines) + "\n", ()

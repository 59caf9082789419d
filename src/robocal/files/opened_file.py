"""The file of a machine, whichever it is; the machine that has none; and of which kind a file is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Generic, Protocol, Self, TypeVar

from robocal._record import field, record, replace
from robocal.errors import InputError
from robocal.files.units import Unit, Units, number
from robocal.files.yamlio import load, quote
from robocal.measure.machine import Model
from robocal.remarks.remark import Remark

__all__ = ["Bare", "MachineFile", "Speaks", "machine_kind", "parameter_text"]

M = TypeVar("M", bound=Model)


class Speaks(Protocol):
    """The units in which a file and its reports speak."""

    def of(self, si: str, /) -> Unit:
        """The unit for a quantity whose SI unit is `si`."""


class MachineFile(Protocol[M]):
    """A machine, the units and the text of its file, and what is odd about it."""

    @property
    def machine(self) -> M: ...
    @property
    def units(self) -> Speaks: ...
    @property
    def path(self) -> Path | None: ...
    @property
    def text(self) -> str: ...
    @property
    def sha256(self) -> str: ...
    @property
    def format(self) -> str: ...
    @property
    def warnings(self) -> tuple[Remark, ...]: ...
    @property
    def convention(self) -> str: ...
    @property
    def source(self) -> str: ...
    def with_machine(self, machine: M, /) -> Self: ...


@record
class Bare(Generic[M]):
    """A machine as a program made it, or as a file of its own describes it; `text` describes its parameters."""

    machine: M
    units: Speaks = field(default_factory=Units)
    path: Path | None = None
    text: str = ""
    sha256: str = ""
    format: str = "yaml"
    warnings: tuple[Remark, ...] = ()
    convention: str = ""
    source: str = ""

    def with_machine(self, machine: M) -> Self:
        """Another machine of the same file."""
        return replace(self, machine=machine)


def machine_kind(place: Path) -> str:
    """Of which kind of machine a file is, by its key `kind`: cable, of CASPR's X_cables.xml and the YAML of a published robot; arm,
    where it says nothing, is no YAML or not there."""
    if place.name.endswith("_cables.xml"):
        return "cable"
    if place.suffix.lower() not in (".yaml", ".yml") or not place.is_file():
        return "arm"
    try:
        data = load(place).data
    except InputError:
        return "arm"
    if not {"robocal", "kind"} & set(data) and "frame_anchors" in data:
        return "cable"
    return str(data.get("kind", "arm"))


def parameter_text(file: MachineFile[M], values: Mapping[str, float]) -> str:
    """A machine without a format of its own as text: its kind, where its file says one, its name and parameters (SI, by name)."""
    lines = ["robocal: 1", *([f"kind: {quote(file.convention)}"] if file.convention else [])]
    lines += [f"name: {quote(file.machine.name)}", "parameters:"]
    for p in file.machine.table.rows:
        unit = file.units.of(p.unit)
        lines.append(f"  {p.name}: {{value: {number(unit.from_si(values.get(p.name, p.value)))}, unit: {unit.name}}}")
    return "\n".join(lines) + "\n"

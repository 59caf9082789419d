"""What a machine that is not quite its model would record, for any machine: who draws, measures and writes is beside the machine."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from robocal._record import record
from robocal.errors import ModelError, nearest
from robocal.files.opened_file import Speaks
from robocal.files.units import finite, numbers_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.simulation.rigs import STANDS

__all__ = ["LABEL", "Errors", "Request", "Simulator", "errors_of", "parse_frame", "true_model"]

M = TypeVar("M", bound=Model)
LABEL = "# SIMULATED by robocal simulate, not measured: "


@record
class Errors:
    """How the true machine differs: normal errors of lengths and angles of its geometry, and values set by name (all
    SI)."""

    length: float = 3e-4
    angle: float = 1e-3
    values: tuple[tuple[str, float], ...] = ()


@record
class Request:
    """What is to be simulated, in SI; None where nobody said. `at` is a file of configurations that are not to be drawn."""

    at: str | None = None
    kind: str | None = None
    noise: float | None = None
    angle_noise: float | None = None
    length_noise: float | None = None
    frame: str = "auto"


class Simulator(ABC, Generic[M]):
    """Draws configurations of one machine, measures them on a true one, and writes what a person would hand in."""

    usual: ClassVar[Errors] = Errors()
    kind: str  # what is measured
    noise: float  # its standard deviation in SI

    def __init__(self, machine: M, units: Speaks, request: Request) -> None:
        self.machine, self.units, self.request = machine, units, request

    @property
    def imperfect(self) -> Sequence[str]:
        """The parameters that differ in a true machine: what its making leaves."""
        return self.machine.geometric

    @abstractmethod
    def draw(self, count: int, rng: np.random.Generator) -> Any:
        """Where the machine is to be measured: as many configurations, drawn, or those of a file."""

    @abstractmethod
    def measure(self, truth: M, where: Any, rng: np.random.Generator) -> DataSet:
        """What is recorded there of a true machine."""

    @abstractmethod
    def largest_error(self, truth: M, where: Any) -> float:
        """How far the model is off there, in m."""

    @abstractmethod
    def robot_files(self, truth: M, label: str) -> Mapping[str, str]:
        """The texts of the model and of the truth, by file name; the truth begins with the label."""

    @abstractmethod
    def data_files(self, data: DataSet, label: str, stem: str = "") -> Mapping[str, str]:
        """The texts of data by file name, each with the label, its name with `stem` before it; a frame that is to be found is at zero."""


def errors_of(
    model: Model, units: Speaks, usual: Errors, length: float | None, angle: float | None, settings: Sequence[str]
) -> Errors:
    """How the true machine differs, in SI; settings NAME=VALUE in the units of its file. Raises ModelError for unknown names."""
    values = tuple(_setting(text, model, units) for text in settings)
    return Errors(usual.length if length is None else length, usual.angle if angle is None else angle, values)


def _setting(text: str, model: Model, units: Speaks) -> tuple[str, float]:
    name, _, number = text.partition("=")
    name, table, value = name.strip(), model.table, finite(number)
    if value is None:
        raise ModelError("not a setting", key="--set", found=text, expected="NAME=VALUE such as j2.r=1.5")
    if name not in table:
        raise ModelError("no parameter has this name", key="--set", found=name, suggestion=nearest(name, table.names))
    return name, units.of(table[name].unit).to_si(value)


def true_model(model: M, names: Sequence[str], errors: Errors, rng: np.random.Generator) -> M:
    """The machine as it is said to be: these parameters off, then the values that were set. Raises ModelError for an
    unknown name."""
    size = {"m": errors.length, "rad": errors.angle}
    rows = (model.table[name] for name in names)
    moved = {p.name: p.value + rng.normal() * size.get(p.unit, 0.0) for p in rows}
    return model.with_values(moved | dict(errors.values))


def parse_frame(text: str, units: Speaks) -> tuple[float, ...] | None:
    """auto, none, or six numbers in the robot file's units. Raises ModelError."""
    if text in ("auto", "none"):
        return STANDS if text == "auto" else None
    x, y, z, *turn = numbers_of(text, "x,y,z,rx,ry,rz or none", key="--frame")
    return (*map(units.of("m").to_si, (x, y, z)), *map(units.of("rad").to_si, turn))

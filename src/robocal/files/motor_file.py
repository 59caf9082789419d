"""motor.yaml: the cogging and the friction of one motor, as `robocal drive identify` writes and `robocal drive compensate` reads it.

robocal: 1
kind: motor
name: sweep
method: harmonics                 # or seed: a table for each direction
unit: A                           # of what follows: A, or Nm
torque_constant: {value: 0.561, unit: Nm/A}
lag: {value: 0.00085, unit: rad}
eccentric: {cos: 0, sin: 0, unit: rad}
friction: {offset: -0.0005, coulomb: 0.0537}
orders: [{order: 72, cos: 0.18, sin: 0.03, sigma: 0.002}, ...]      # cos_change and sin_change: what each direction adds
table: {forward: [...], reverse: [...]}                             # of the method seed: cells of equal width from 0, at their middles
verdict: improved                 # or not_improved, refused: what its logs prove
source: what it was made from
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, FiniteFloat, PositiveFloat, PositiveInt

from robocal._record import record
from robocal._types import Array
from robocal.drives.cogging import Cogging
from robocal.errors import FileError
from robocal.files.schema import FileModel, Version, validate
from robocal.files.text import InputFile
from robocal.files.units import number
from robocal.files.yamlio import load, quote

__all__ = ["FILE", "MotorFile", "motor_text", "read_motor"]

FILE = "motor.yaml"
VerdictWord = Literal["improved", "not_improved", "refused", ""]
UNITS = {"A": "A", "Nm": "N m"}
FEWEST = 12  # grid: cells of a table


@record(eq=False)
class MotorFile:
    """A motor as its file has it, in N m or A (`unit`): its harmonics, or a table (2, C) for forward and reverse with friction in it;
    offset and Coulomb friction; the torque constant (N m/A); the verdict of its run, where that is known."""

    name: str
    unit: str
    cogging: Cogging
    offset: float
    coulomb: float
    table: Array | None = None
    torque_constant: float | None = None
    sigma: tuple[float, ...] = ()
    source: str = ""
    file: InputFile | None = None
    verdict: str = ""  # improved, not_improved, refused; of a file that nobody identified there is none

    def curves(self, cells: int) -> Array:
        """Cogging (2, cells) at angles 0, 360/cells, ... deg, forward and reverse, without friction and offset."""
        angle = 2 * np.pi * np.arange(cells) / cells
        if self.table is None:
            return np.stack([self.cogging.at(angle, d) for d in (1.0, -1.0)])
        own = self.table - self.table.mean(axis=1, keepdims=True)
        middles = (np.arange(own.shape[1]) + 0.5) * 2 * np.pi / own.shape[1]
        return np.stack([np.interp(angle, middles, row, period=2 * np.pi) for row in own])


class MotorNumberModel(FileModel):
    """A number with its unit."""

    value: FiniteFloat
    unit: str


class EccentricModel(FileModel):
    """The two numbers of an eccentric encoder."""

    cos: FiniteFloat
    sin: FiniteFloat
    unit: Literal["rad"]


class LogFrictionModel(FileModel):
    """Friction of the log."""

    offset: FiniteFloat
    coulomb: FiniteFloat


class OrderModel(FileModel):
    """One order."""

    order: PositiveInt
    cos: FiniteFloat
    sin: FiniteFloat
    sigma: PositiveFloat | None = None
    cos_change: FiniteFloat | None = None
    sin_change: FiniteFloat | None = None


class TableModel(FileModel):
    """A table for each direction."""

    forward: list[FiniteFloat]
    reverse: list[FiniteFloat]


class MotorModel(FileModel):
    """motor.yaml."""

    robocal: Version
    kind: Literal["motor"]
    name: str
    method: Literal["harmonics", "seed"]
    unit: Literal["A", "Nm"]
    torque_constant: MotorNumberModel | None = None
    lag: MotorNumberModel
    eccentric: EccentricModel
    friction: LogFrictionModel
    orders: list[OrderModel] = Field(default_factory=list)
    table: TableModel | None = None
    verdict: VerdictWord = ""
    source: str = ""


def read_motor(path: Path) -> MotorFile:
    """The motor of a run folder or of motor.yaml. Raises FileError or FormatError."""
    place = path / FILE if path.is_dir() else path
    if path.is_dir() and not place.exists():
        motors = sorted(p.parent.name for p in path.glob(f"*/{FILE}"))
        expected = f"the folder of one motor: {', '.join(motors)}" if motors else "a folder of robocal drive identify"
        raise FileError(f"the folder has no {FILE}", file=path, expected=expected)
    document = load(place)
    kind = document.data.get("kind")
    document.insist(
        kind == "motor", "this is no motor", ("kind",), found=kind, expected="kind: motor, of robocal drive identify"
    )
    m = validate(MotorModel, document)
    document.insist(
        m.lag.unit == "rad", "the unit is of another quantity", ("lag", "unit"), found=m.lag.unit, expected="rad"
    )
    each = [o.order for o in m.orders]
    document.insist(len(set(each)) == len(each), "an order stands twice", ("orders",), found=", ".join(map(str, each)))
    document.insist(bool(m.orders) == (m.method == "harmonics") or not m.orders, "a table has no orders", ("orders",))
    table = None
    if m.method == "seed":
        document.insist(m.table is not None, "a key is missing", ("table",))
        assert m.table is not None
        sizes = len(m.table.forward), len(m.table.reverse)
        document.insist(
            sizes[0] == sizes[1] >= FEWEST, "the tables differ in size, or are too short", ("table",), found=str(sizes)
        )
        table = np.array([m.table.forward, m.table.reverse])
    constant = None
    if m.torque_constant is not None:
        unit = document.unit(m.torque_constant.unit, None, ("torque_constant", "unit"))
        document.insist(
            unit.si == "N m/A" and m.torque_constant.value > 0, "not a torque constant", ("torque_constant",)
        )
        constant = unit.to_si(m.torque_constant.value)
    changes = [o.cos_change is not None and o.sin_change is not None for o in m.orders]
    document.insist(all(changes) or not any(changes), "all orders have phases per direction, or none", ("orders",))
    by = bool(changes) and all(changes)
    cogging = Cogging(
        tuple(each), tuple(o.cos for o in m.orders), tuple(o.sin for o in m.orders), m.lag.value,
        tuple(o.cos_change or 0.0 for o in m.orders) if by else (), tuple(o.sin_change or 0.0 for o in m.orders) if by else (),
        (m.eccentric.cos, m.eccentric.sin),
    )  # fmt: skip
    sigma = tuple(o.sigma or float("nan") for o in m.orders)
    own = InputFile(place, document.sha256)
    return MotorFile(
        m.name, UNITS[m.unit], cogging, m.friction.offset, m.friction.coulomb, table, constant, sigma, m.source, own, m.verdict
    )  # fmt: skip


def motor_text(motor: MotorFile) -> str:
    """The text of motor.yaml."""
    c = motor.cogging
    unit = motor.unit.replace(" ", "")
    lines = [
        "robocal: 1", "kind: motor", f"name: {quote(motor.name)}", f"method: {'harmonics' if motor.table is None else 'seed'}",
        f"unit: {unit}    # of all that follows, but angles",
    ]  # fmt: skip
    if motor.torque_constant is not None:
        lines.append(f"torque_constant: {{value: {number(motor.torque_constant)}, unit: Nm/A}}")
    lines += [
        f"lag: {{value: {number(c.lag)}, unit: rad}}",
        f"eccentric: {{cos: {number(c.eccentric[0])}, sin: {number(c.eccentric[1])}, unit: rad}}",
        f"friction: {{offset: {number(motor.offset)}, coulomb: {number(motor.coulomb)}}}",
    ]
    if motor.table is None:
        lines.append("orders:" if c.orders else "orders: []")
    for i, n in enumerate(c.orders if motor.table is None else ()):
        parts = {"order": str(n), "cos": number(c.cosine[i]), "sin": number(c.sine[i])}
        if i < len(motor.sigma) and np.isfinite(motor.sigma[i]):
            parts["sigma"] = number(motor.sigma[i])
        if c.by_direction:
            parts |= {"cos_change": number(c.cosine_change[i]), "sin_change": number(c.sine_change[i])}
        lines.append("  - {" + ", ".join(f"{k}: {v}" for k, v in parts.items()) + "}")
    if motor.table is not None:
        lines.append("table:    # cells of equal width from 0, at their middles; friction is in them")
        for word, row in zip(("forward", "reverse"), motor.table, strict=True):
            lines.append(f"  {word}: [{', '.join(number(float(v)) for v in row)}]")
    if motor.verdict:
        lines.append(f"verdict: {motor.verdict}")
    lines.append(f"source: {quote(motor.source)}")
    return "\n".join(lines) + "\n"

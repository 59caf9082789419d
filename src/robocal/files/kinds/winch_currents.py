"""Currents of winches, one column for each cable, one row for each place of the platform, which stands still or moves slowly.

current: {columns: [i1, i2, ...], unit: A, sigma: 0.02}
speed: {columns: [v1, v2, ...], unit: mm/s}     how fast each cable runs out, or ran out last; without it friction has no direction
winch: {gear: 4, radius: {value: 104, unit: mm}, torque_constant: {value: 0.561, unit: Nm/A, prior: 0.056}, coulomb: {...}, viscous: {...}}
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field, FiniteFloat, PositiveFloat

from robocal._record import replace
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ValueModel
from robocal.files.kinds.kind import Around, KindFile, Part, Values
from robocal.files.kinds.lengths import each_cable, each_row, write_each
from robocal.files.schema import FileModel, Name
from robocal.files.yamlio import YamlDocument
from robocal.measure.cable.winch_tensions import FRICTION

__all__ = ["WINCHES"]

STATED = {"torque_constant": ("kt", "N m/A"), "coulomb": ("coulomb", "N m"), "viscous": ("viscous", "N m s/rad")}
OUT = "how fast the cable runs out; below 0 where it is wound in"


class WinchNumberModel(FileModel):
    """A number with its unit, and how far it may be off: with a prior, or free, it is identified."""

    value: FiniteFloat = 0.0
    unit: str
    prior: PositiveFloat | None = None
    free: bool | None = None


class DrumRadiusModel(FileModel):
    """A length with its unit."""

    value: PositiveFloat
    unit: str


class WinchModel(FileModel):
    """What all winches are made of; friction is that of each, at its motor."""

    gear: PositiveFloat = 1.0
    radius: DrumRadiusModel
    torque_constant: WinchNumberModel
    coulomb: WinchNumberModel | None = None
    viscous: WinchNumberModel | None = None


class WinchesModel(DataModel):
    """Currents of motors that pull, the speeds of the cables, and which of `mass`, `cx`, `cy`, `cz` of the platform are free."""

    current: ValueModel = ValueModel.model_construct()
    speed: ValueModel | None = None
    winch: WinchModel
    name: Name = "winches"
    free: list[str] = Field(default_factory=list)


def read_winches(model: WinchesModel, table: CsvTable, document: YamlDocument) -> Values:
    """Currents (k, cables) in A, with speeds in m/s beside them, and what the winches are made of."""
    values = each_cable("current", "A", model.current, table, document)
    w = model.winch
    radius = document.unit(w.radius.unit, "m", ("winch", "radius", "unit")).to_si(w.radius.value)
    known: dict[str, float] = {}
    priors: dict[str, float] = {}
    free: list[str] = []
    for key, (symbol, si) in STATED.items():
        given: WinchNumberModel | None = getattr(w, key)
        if given is None:
            continue
        unit = document.unit(given.unit, si, ("winch", key, "unit"))
        known[symbol] = float(unit.to_si(given.value))
        if given.prior is not None:
            document.insist(
                given.free is not False,
                "a prior of a number that is fixed",
                ("winch", key, "prior"),
                expected="prior, or free: false",
            )
            priors[symbol] = float(unit.to_si(given.prior))
        if given.free or given.prior is not None:
            free.append(symbol)
    if not known["kt"] > 0:
        document.fail("a torque constant is above 0", ("winch", "torque_constant", "value"), found=known["kt"])
    body = ("mass", "cx", "cy", "cz")
    for word in model.free:
        document.insist_known(word, body, "no such number of the platform", ("free",))
    if model.speed is None and (rubs := [s for s in FRICTION if s in free or known.get(s)]):
        expected = f"speed: {{columns: [...], unit: mm/s}}, {OUT}"
        document.fail("friction without a direction", ("speed",), found=", ".join(rubs), expected=expected)
    speed = np.zeros_like(values.value)
    if model.speed is not None:
        read = each_cable("speed", "m/s", model.speed, table, document)
        speed = read.value
        if speed.shape != values.value.shape:
            document.fail(
                "wrong number of columns",
                ("speed", "columns"),
                found=speed.shape[1],
                expected=str(values.value.shape[1]),
            )
    if values.sigma is not None and np.ptp(values.sigma) > 0:
        document.fail(
            "the currents have one standard deviation",
            ("current", "sigma"),
            expected="one number for all motors and rows",
        )
    options = {
        "winches": model.name, "ratio": w.gear / radius, "values": known, "priors": priors, "free": (*free, *model.free),
    }  # fmt: skip
    return replace(values.with_options(options), extra={"speed": speed})


def winch_parts(model: WinchesModel, values: Values, around: Around) -> Sequence[Part]:
    """Every motor of every row is an observation."""
    around.refuse_taken(model.name, ("name",))
    return each_row(model, values, around)


WINCHES_KEYS = """current: {{columns: [i1, i2, i3, i4], unit: A, sigma: 0.02}}    # of every motor, above 0 where it pulls
speed: {{columns: [v1, v2, v3, v4], unit: {length}/s}}    # how fast each cable runs out, or ran out last
winch:
  gear: 4
  radius: {{value: 104, unit: {length}}}
  torque_constant: {{value: 0.561, unit: Nm/A, prior: 0.056}}    # with a prior: identified
  coulomb: {{value: 0, unit: Nm, prior: 0.3}}    # friction of each motor
  viscous: {{value: 0, unit: Nm s/rad, free: false}}
"""
WINCHES = KindFile(WinchesModel, read_winches, write_each, WINCHES_KEYS, parts=winch_parts)

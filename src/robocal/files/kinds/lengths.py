"""What is read of every cable, one column for each, one row for each place of the platform: lengths as their sensors say, the
angles by which pulleys swivel, and the tensions that load cells read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from robocal.errors import ModelError
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ScalarModel, ValueModel
from robocal.files.kinds.kind import Around, KindFile, KindOutput, Part, QuantityColumns, Values, scalar
from robocal.files.schema import FileModel, Name
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["CARRIAGE", "COMPUTED", "CURRENTS", "LENGTHS", "LOAD", "SWIVEL", "each_cable", "each_row", "write_each"]

COMPUTED, CURRENTS = "computed", "currents"
CARRIAGE = "carriage of "  # and the name of the cable: what `extra` of lengths has of it


class GainModel(ScalarModel):
    """How much longer a cable is than its sensor shows, of all drums or of each."""

    each: bool = False


class CarriageModel(FileModel):
    """Where the carriages on the rails of some cables stood: columns, and the cables that they are of."""

    columns: list[str | int]
    cables: list[Name]
    unit: str | None = None


class LengthsModel(DataModel):
    """Lengths of all cables, in the robot's order or in columns that are called as its cables are, and the tensions under which they
    stretched: read, computed for the platform's weight, or from the currents of winches. `zeros` names the power-up whose zeros these
    are, not the robot's; `carriage` says where anchors on rails stood."""

    lengths: ValueModel = ValueModel.model_construct()
    tension: ValueModel | Literal["computed", "currents"] | None = None
    zeros: Name | None = None
    carriage: CarriageModel | None = None
    gain: GainModel | None = None


class SwivelModel(DataModel):
    """Angles by which the pulleys of all cables swivel, and where their encoders count from: free unless stated."""

    swivel: ValueModel = ValueModel.model_construct()
    zero: ScalarModel | None = None


class LoadModel(DataModel):
    """Tensions that load cells read while the platform is at rest, and which of `mass`, `cx`, `cy`, `cz` of the platform are free."""

    load: ValueModel = ValueModel.model_construct()
    free: list[Literal["mass", "cx", "cy", "cz"]] = Field(default_factory=list)


def each_cable(key: str, si: str, given: ValueModel, table: CsvTable, document: YamlDocument) -> Values:
    """Numbers (k, cables) of a quantity, and the names of their columns."""
    at = (key, "columns")
    if given.columns is None:
        document.fail("a key is missing", at, expected="a column for each cable of the robot")
    names = tuple(str(table.label(table.find(c))) for c in given.columns)
    again = sorted({n for n in names if names.count(n) > 1})
    if again:
        document.fail("a column is named twice", at, found=", ".join(again), expected="one for each cable")
    return QuantityColumns(key, names, (), si).values(given, table, document).with_options({"columns": names})


def _pulls(key: str, given: ValueModel, table: CsvTable, document: YamlDocument) -> Values:
    """Tensions (k, cables) in N."""
    pulls = each_cable(key, "N", given, table, document)
    found, expected = pulls.value, "a tension of 0 or above"
    table.insist(found >= 0, given.columns, "a cable does not push", found, expected=expected)
    return pulls


def read_lengths(model: LengthsModel, table: CsvTable, document: YamlDocument) -> Values:
    """Lengths (k, cables) in m."""
    values = each_cable("lengths", "m", model.lengths, table, document)
    if model.zeros is not None:
        values = values.with_options({"zeros": model.zeros})
    if model.carriage is not None:
        values = _with_carriages(values, model.carriage, table, document)
    if isinstance(model.tension, str):
        return values.with_options({"tension": model.tension})
    if model.tension is None:
        return values
    pulls = _pulls("tension", model.tension, table, document).value
    found, expected = pulls.shape[1], values.value.shape[1]
    if found != expected:
        document.fail("wrong number of columns", ("tension", "columns"), found=found, expected=str(expected))
    return replace(values, extra={**values.extra, "tension": pulls})


def _with_carriages(values: Values, given: CarriageModel, table: CsvTable, document: YamlDocument) -> Values:
    """Lengths with where the carriages stood, one column of `extra` for each, under its cable's name."""
    at, names = ("carriage", "cables"), given.cables
    columns, again = len(given.columns), sorted({n for n in names if names.count(n) > 1})
    document.insist(
        len(names) == columns,
        "wrong number of cables",
        at,
        found=len(names),
        expected=f"{columns}, one for each column",
    )
    document.insist(
        not again, "a cable is named twice", at, found=", ".join(again), expected="one column for each cable"
    )
    where = QuantityColumns("carriage", tuple(names), (), "m")
    read = where.numbers(ValueModel(columns=given.columns, unit=given.unit), table, document)[0]
    extra = {
        f"{CARRIAGE}{n}": np.repeat(read[:, i : i + 1], values.value.shape[1], axis=1) for i, n in enumerate(names)
    }
    return replace(values, extra={**values.extra, **extra})


def read_swivel(model: SwivelModel, table: CsvTable, document: YamlDocument) -> Values:
    """Angles (k, cables) in rad."""
    return each_cable("swivel", "rad", model.swivel, table, document)


def length_parts(model: LengthsModel, values: Values, around: Around) -> Sequence[Part]:
    """As of every cable, with the gain of the drums."""
    if model.gain is None:
        return each_row(model, values, around)
    if model.gain.value is not None and not model.gain.value > 0:
        around.document.fail("a gain is above 0", ("gain", "value"), found=model.gain.value, expected="a number near 1")
    options = {**scalar(model.gain, "1", "gain", around), "each": model.gain.each}
    return each_row(model, values.with_options(options), around)


def read_load(model: LoadModel, table: CsvTable, document: YamlDocument) -> Values:
    """Tensions (k, cables) in N."""
    values = _pulls("load", model.load, table, document)
    if values.sigma is not None and np.ptp(values.sigma) > 0:
        expected = "one number for all cells and rows"
        document.fail("load cells have one standard deviation", ("load", "sigma"), expected=expected)
    return values.with_options({"free": tuple(model.free)})


def swivel_parts(model: SwivelModel, values: Values, around: Around) -> Sequence[Part]:
    """As of lengths; the zero that is stated, or none, is that of every encoder."""
    return each_row(model, values.with_options(scalar(model.zero, "rad", "zero", around, "swivel")), around)


def each_row(model: DataModel, values: Values, around: Around) -> Sequence[Part]:
    """Every cable of every row is an observation."""
    rows, many = values.value.shape
    sigma = None if values.sigma is None else values.sigma.reshape(-1, 1)
    extra = {"cable": np.tile(np.arange(many, dtype=float), rows), **{k: v.ravel() for k, v in values.extra.items()}}
    each = replace(values, value=values.value.reshape(-1, 1), sigma=sigma, extra=extra)
    return [Part(np.repeat(np.arange(rows), many), each, targeted=False)]


def write_each(obs: Observations, units: Units) -> KindOutput:
    """Raises ModelError: such a table has one row for each place, not for each cable."""
    raise ModelError("this kind cannot be written to a table", found=obs.kind)


LENGTHS_KEYS = """lengths: {{columns: [c1, c2, c3, c4], unit: {length}, sigma: 1}}    # a column for each cable of the robot
# tension: {{columns: [t1, t2, t3, t4], unit: N}}    # or tension: computed, or tension: currents (kind: winches beside it)
# gain: {{name: drums, each: true}}    # each drum winds up a little more or less than it shows; without each, all alike
# carriage: {{columns: [s3, s4], cables: [c3, c4], unit: {length}}}    # where anchors on rails stood, else as the robot's file says
# zeros: evening    # the sensors were set anew: zeros of their own, free, shared by all files that say so
"""
LENGTHS = KindFile(LengthsModel, read_lengths, write_each, LENGTHS_KEYS, parts=length_parts, lengths="lengths")

SWIVEL_KEYS = """swivel: {{columns: [s1, s2, s3, s4], unit: {angle}, sigma: 0.1}}    # a column for each cable of the robot
# zero: {{value: 0, unit: {angle}, free: false}}    # where the encoders count from; left out: found, for each cable
"""
SWIVEL = KindFile(SwivelModel, read_swivel, write_each, SWIVEL_KEYS, parts=swivel_parts)

LOAD_KEYS = """load: {{columns: [t1, t2, t3, t4], unit: N, sigma: 1}}    # a load cell in every cable, the platform at rest
# free: [mass, cx, cy, cz]    # of the platform: else as the robot's file states them
"""
LOAD = KindFile(LoadModel, read_load, write_each, LOAD_KEYS, parts=each_row)

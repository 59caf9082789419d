"""A cable by itself under loads: how far it hangs between two level ends, and how much longer it is than without load.

sag: {columns: [sag], unit: mm, sigma: 0.5}               the middle below the line between the ends
elongation: {columns: [elongation], unit: mm}             from wherever the gauge begins: its offset is found
tension: {columns: [tension], unit: N}
span: {value: 4925, unit: mm}     of a sag, or columns    length: {value: 2200, unit: mm}     of an elongation, without load
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import FiniteFloat

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ScalarModel, ValueModel
from robocal.files.kinds.kind import Around, KindFile, KindOutput, Part, QuantityColumns, Values, scalar
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["ELONGATION", "LOADS", "SAG"]

LOADS = {"sag": "span", "elongation": "length"}  # kinds, and the length that each of them needs
PULL = QuantityColumns("tension", ("tension",), (), "N")


class AmountModel(ValueModel):
    """A quantity in a column, or one value for all rows."""

    value: FiniteFloat | None = None


class SagModel(DataModel):
    """How far the middle of a level cable hangs below the line between its ends, under a horizontal tension."""

    sag: ValueModel = ValueModel.model_construct()
    tension: ValueModel = ValueModel.model_construct()
    span: AmountModel = AmountModel.model_construct()


class ElongationModel(DataModel):
    """How much longer a cable is under a tension; the gauge's offset is found unless it is stated."""

    elongation: ValueModel = ValueModel.model_construct()
    tension: ValueModel = ValueModel.model_construct()
    length: AmountModel = AmountModel.model_construct()
    offset: ScalarModel | None = None


def _above(
    found: Array,
    table: CsvTable,
    column: str | int,
    message: str,
    expected: str,
    *,
    zero: bool = False,
    shown: Array | None = None,
) -> None:
    good = found >= 0 if zero else found > 0
    table.insist(good[:, None], [column], message, (found if shown is None else shown)[:, None], expected=expected)


def _pulls(model: SagModel | ElongationModel, table: CsvTable, document: YamlDocument, zero: bool) -> Array:
    found = PULL.numbers(model.tension, table, document)[0][:, 0]
    expected = "0 N or more" if zero else "above 0 N"
    _above(
        found,
        table,
        (model.tension.columns or PULL.names)[0],
        "such a load does not tighten a cable",
        expected,
        zero=zero,
    )
    return found


def _length(key: str, given: AmountModel, table: CsvTable, document: YamlDocument) -> Array:
    """The length (k,) in m that a load needs: of every row, or one for all. Raises FormatError."""
    if given.value is not None:
        document.insist(given.columns is None, "a value, and columns too", (key,), expected="one of them")
        if given.unit is None:
            document.fail("the unit is missing", (key, "unit"), expected="mm, m, ...")
        unit = document.unit(given.unit, "m", (key, "unit"))
        document.insist(given.value > 0, "a length is above 0", (key, "value"), found=given.value)
        return np.full(len(table), unit.to_si(given.value))
    if given.columns is None and not table.has(key):
        document.fail("a key is missing", (key,), expected=f"{key}: {{value: ..., unit: mm}}, or a column {key} [mm]")
    found = QuantityColumns(key, (key,), ()).numbers(given, table, document)[0][:, 0]
    _above(found, table, (given.columns or [key])[0], "a length is above 0", "above 0")
    return found


def read_sag(model: SagModel, table: CsvTable, document: YamlDocument) -> Values:
    """Sags (k, 1) in m."""
    values = QuantityColumns("sag", ("sag",), ("s_sag",)).read(model, table, document)
    named = (model.sag.columns or ["sag"])[0]
    _above(values.value[:, 0], table, named, "a cable hangs down", "how far the middle is below its ends", zero=True)
    span = _length("span", model.span, table, document)
    sag = values.value[:, 0]
    _above(span - sag, table, named, "no cable hangs by more than its span", "a sag in its own unit", shown=sag)
    return replace(values, extra={"span": span, "tension": _pulls(model, table, document, False)})


def read_elongation(model: ElongationModel, table: CsvTable, document: YamlDocument) -> Values:
    """Elongations (k, 1) in m."""
    values = QuantityColumns("elongation", ("elongation",), ("s_elongation",)).read(model, table, document)
    length = _length("length", model.length, table, document)
    named = (model.elongation.columns or ["elongation"])[0]
    longer = values.value[:, 0]
    _above(length - longer, table, named, "no cable doubles its length", "an elongation in its own unit", shown=longer)
    return replace(values, extra={"length": length, "tension": _pulls(model, table, document, True)})


def elongation_parts(model: ElongationModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one gauge, whose offset nobody knows unless it is stated."""
    options = scalar(model.offset or ScalarModel(free=True), "m", "offset", around)
    return [Part(np.arange(len(values.value)), values.with_options(options), targeted=False)]


def sag_parts(model: SagModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one cable."""
    return [Part(np.arange(len(values.value)), values, targeted=False)]


def write_load(obs: Observations, units: Units) -> KindOutput:
    """Raises ModelError: no rig shows a cable by itself."""
    raise ModelError("this kind cannot be written to a table", found=obs.kind)


SAG_KEYS = """sag: {{columns: [sag], unit: {length}, sigma: 0.5}}    # the middle of a level cable below the line between its ends
tension: {{columns: [tension], unit: N}}
span: {{value: 4925, unit: {length}}}    # or columns
"""
SAG = KindFile(SagModel, read_sag, write_load, SAG_KEYS, parts=sag_parts)

ELONGATION_KEYS = """elongation: {{columns: [elongation], unit: {length}}}    # how much longer the cable is, from wherever the gauge begins
tension: {{columns: [tension], unit: N}}
length: {{value: 2200, unit: {length}}}    # without load; or columns
# offset: {{value: 0, unit: {length}, free: false}}    # of the gauge; left out: found
"""
ELONGATION = KindFile(ElongationModel, read_elongation, write_load, ELONGATION_KEYS, parts=elongation_parts)

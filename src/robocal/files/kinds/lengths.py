"""Lengths of cables, as their sensors say: one column for each cable, one row for each place of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robocal.errors import ModelError
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ValueModel
from robocal.files.kinds.base import Around, KindFile, Part, Values, Written, quantity
from robocal.files.units import Units
from robocal.files.yamlio import Document
from robocal.measure.data import Observations

__all__ = ["COMPUTED", "LENGTHS"]

COMPUTED = "computed"


class LengthsModel(DataModel):
    """Lengths of all cables, in the robot's order or in columns that are called as its cables are, and the tensions under which they
    stretched: read, or computed for the platform's weight."""

    lengths: ValueModel = ValueModel()
    tension: ValueModel | Literal["computed"] | None = None


def read_lengths(model: LengthsModel, table: CsvTable, document: Document) -> Values:
    """Lengths (k, cables) in m."""
    given = model.lengths
    if given.columns is None:
        document.fail("a key is missing", ("lengths", "columns"), expected="a column for each cable of the robot")
    many = len(given.columns)
    names = [str(table.label(table.find(c))) for c in given.columns]
    value, sigma, units = quantity(given, table, document, ("lengths",), ("m",) * many, names)
    extra: dict[str, NDArray[np.float64]] = {}
    options: dict[str, object] = {"columns": tuple(names)}
    if isinstance(model.tension, str):
        options["tension"] = COMPUTED
    elif isinstance(model.tension, ValueModel):
        if model.tension.columns is None:
            document.fail("a key is missing", ("tension", "columns"), expected="a column for each cable, as of lengths")
        pulls = [str(table.label(table.find(c))) for c in model.tension.columns]
        if len(pulls) != many:
            document.fail("wrong number of columns", ("tension", "columns"), found=len(pulls), expected=str(many))
        pull = quantity(model.tension, table, document, ("tension",), ("N",) * many, pulls)[0]
        table.insist(pull >= 0, pulls, "a cable does not push", pull, expected="a tension of 0 or above")
        extra["tension"] = pull
    return Values(value, sigma, units[0], extra=extra, options=options)


def parts(model: LengthsModel, values: Values, around: Around) -> Sequence[Part]:
    """Every cable of every row is an observation."""
    rows, many = values.value.shape
    sigma = None if values.sigma is None else values.sigma.reshape(-1, 1)
    extra = {"cable": np.tile(np.arange(many, dtype=float), rows), **{k: v.ravel() for k, v in values.extra.items()}}
    return [
        Part(
            np.repeat(np.arange(rows), many), values.value.reshape(-1, 1), sigma, extra, values.options, targeted=False
        )
    ]


def write_lengths(obs: Observations, units: Units) -> Written:
    """Raises ModelError: a table of lengths has one row for each place, not for each length."""
    raise ModelError("this kind cannot be written to a table", found=obs.kind)


LENGTHS = KindFile(
    "lengths",
    LengthsModel,
    read_lengths,
    write_lengths,
    """lengths: {{columns: [c1, c2, c3, c4], unit: {length}, sigma: 1}}    # a column for each cable of the robot
# tension: {{columns: [t1, t2, t3, t4], unit: N}}    # or tension: computed
""",
    parts=parts,
    lengths="lengths",
)

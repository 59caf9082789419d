"""What every reader of a kind of measurement shares: its values, its place in the registry, units and sigmas of columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, SigmaModel, ValueModel
from robocal.files.units import Unit, parse_unit
from robocal.files.yamlio import Document, Path_

__all__ = ["KindReader", "Values", "column_units", "sigmas"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Values:
    """One kind's numbers in SI: value (k, d), sigma (k, d) or None; the unit of lengths and angles in the file, for
    frames and reports."""

    value: Array
    sigma: Array | None
    length: Unit | None = None
    angle: Unit | None = None
    extra: Mapping[str, Array] = field(default_factory=dict)
    options: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class KindReader:
    """A kind of measurement: the model of its data.yaml, its reader, and which parts of a target it can see."""

    name: str
    model: type[DataModel]
    read: Callable[[Any, CsvTable, Document], Values]
    sees: tuple[bool, ...] = (True,) * 6


def column_units(
    table: CsvTable,
    columns: Sequence[str | int],
    stated: str | Sequence[str] | None,
    si: Sequence[str],
    document: Document,
    at: Path_,
) -> list[Unit]:
    """The unit of every column, from its header or as stated; `si` is the quantity of each. Raises FormatError when
    it is missing or said twice and differently.
    """
    out = []
    for i, column in enumerate(columns):
        index = table.find(column)
        label, header = table.label(index), table.units[index]
        said = stated if stated is None or isinstance(stated, str) else stated[i]
        if header is None and said is None:
            # A direction cosine or a part of a quaternion has none.
            if si[i] == "1":
                out.append(parse_unit("1"))
                continue
            word = {"m": "mm", "rad": "deg"}.get(si[i], "K")
            hint = f"`unit` in the data file, or a header such as {label} [{word}]"
            if not document.text:
                raise table.fail("the unit is missing", None, label, expected=f"a header such as {label} [{word}]")
            document.fail("the unit is missing", (*at, "unit"), column=label, expected=hint)
        found = (
            None
            if said is None
            else parse_unit(said, si[i], file=document.path, row=document.row((*at, "unit")), key=f"{at[0]}.unit")
        )
        if header is not None:
            named = parse_unit(header, si[i], file=table.path, column=label)
            if found is not None and found != named:
                raise table.fail(
                    "the header states another unit than the data file", None, label, found=header, expected=found.name
                )
            found = named
        assert found is not None
        out.append(found)
    return out


def sigmas(
    model: ValueModel, table: CsvTable, units: Sequence[Unit], si: str, document: Document, at: Path_
) -> Array | None:
    """Standard deviations (k, 3) in SI: a number, one column for all, or one column each; None when not stated."""
    if model.sigma is None:
        return None
    if not isinstance(model.sigma, SigmaModel):
        return np.full((len(table), 3), model.sigma * units[0].factor)
    columns = model.sigma.columns
    if len(columns) not in (1, 3):
        document.fail("wrong number of columns", (*at, "sigma", "columns"), found=len(columns), expected="1 or 3")
    numbers = table.numbers(columns)
    bad = np.argwhere(numbers <= 0)
    if len(bad):
        row, i = (int(v) for v in bad[0])
        column = table.label(table.find(columns[i]))
        raise table.fail(
            "a standard deviation must be above 0",
            row,
            column,
            found=float(numbers[row, i]),
            expected="a number above 0",
        )
    stated = [table.unit(c) for c in columns]
    factors = [u.factor if s is None else parse_unit(s, si, file=table.path, column=str(c)).factor
               for u, s, c in zip(units, stated, columns, strict=False)]  # fmt: skip
    return np.broadcast_to(numbers * np.array(factors), (len(table), 3)).copy()

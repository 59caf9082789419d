"""A listing as CSV: names with their units in the headers, in the units of a file."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from robocal.files.csvtable import csv_text
from robocal.files.opened_file import Speaks
from robocal.files.units import number
from robocal.quantities import Column, Listing

__all__ = ["in_units", "listing_text"]

SI = ("m", "rad", "N", "kg", "1/N", "N/m")  # what a file has a unit of its own for


def in_units(listing: Listing, units: Speaks) -> Listing:
    """The same with every number that is in SI in the unit of a file."""
    return Listing(tuple(_convert(c, units) if c.unit in SI else c for c in listing.columns))


def _convert(column: Column, units: Speaks) -> Column:
    unit = units.of(column.unit)
    # One by one where some are not known: an array of such is no array of numbers.
    values = [None if v is None else unit.from_si(np.asarray(v, float)).tolist() for v in column.plain]
    return replace(column, unit=unit.name, values=values)


def listing_text(listing: Listing, units: Speaks | None = None) -> str:
    """The text of the CSV, in the units of a file where these are given; what is not known is an empty cell."""
    rounded = Listing(tuple(_round(c) if c.si_decimals is not None else c for c in listing.columns))
    shown = rounded if units is None else in_units(rounded, units)
    cells = [[_cell(v, column) for v in column.plain] for column in shown.columns]
    return csv_text([column.header for column in shown.columns], list(zip(*cells, strict=True)))


def _round(column: Column) -> Column:
    return replace(column, values=np.round(np.asarray(column.values, float), column.si_decimals or 0))


def _cell(value: Any, column: Column) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    value = value if column.decimals is None else round(value, column.decimals)
    return number(value if column.digits >= 15 else float(f"{value:.{column.digits}g}"))

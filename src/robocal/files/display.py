"""From what was found, in SI, to what a document shows: the one conversion of whole trees.

`to_display(Part, found)` makes a Part of whatever has the names of its fields (the same class in SI, or another): every number by what it
is (`robocal.quantities`) in the unit in force, which a field of the part names; parts within parts, remarks as data, a tuple of
numbers as the part whose fields they are. What has another name, or is no copy, is given beside it; nothing is left to a default.

A listing becomes a CSV: names with their units in the headers, in the units of a file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import NoneType, SimpleNamespace, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from robocal._record import record
from robocal.diagnose.outliers import Outlier
from robocal.files.csvtext import csv_columns
from robocal.files.evidence_parts import OutlierRow
from robocal.files.opened_file import Speaks
from robocal.files.parts import RemarkPart
from robocal.files.text import harmless
from robocal.files.units import UNITS, Unit, Units, number
from robocal.measure.base import KINDS
from robocal.quantities import AMOUNT, DISPLAY, MEAN, OWN, VALUE, Column, Listing

__all__ = ["display_unit", "in_units", "listing_text", "outlier", "to_display"]

P = TypeVar("P")
MM_AND_DEG = Units()
ERRORS = {"m": UNITS["mm"], "rad": UNITS["deg"]}


@record
class _Scope:
    units: Speaks  # those of the robot's file
    unit: Unit  # the one in force


Convert = Callable[[Any, _Scope], Any]
_PLANS: dict[type[Any], dict[str, Any]] = {}


def display_unit(si: str) -> Unit:
    """The unit in which errors in an SI unit are shown: mm and deg, px, and what has no other name as it is."""
    return MM_AND_DEG.of(si or "1")


def to_display(part: type[P], found: object, speaks: Speaks = MM_AND_DEG, /, **beside: Any) -> P:
    """A part of a document, of what was found in SI (in m, where it names no unit); `speaks` are the units of the robot's file."""
    return _build_part(part, found, _Scope(speaks, ERRORS["m"]), beside)


def outlier(o: Outlier) -> OutlierRow:
    """A strange row, its value in the units in which people read it."""
    units = [display_unit(u) for a, b, u in KINDS[o.kind].parts for _ in range(a, b)]
    value = [v / u.factor for v, u in zip(o.value, units, strict=False)]
    return to_display(
        OutlierRow, o, source=Path(o.source).name, value=value, units=[u.name for u in units[: len(value)]]
    )


def _build_part(part: type[P], found: object, scope: _Scope, beside: dict[str, Any]) -> P:
    plan = _PLANS.get(part) or _PLANS.setdefault(part, _plan(part))
    if isinstance(found, tuple):
        found = SimpleNamespace(**dict(zip(plan, found, strict=True)))
    if (own := plan.get("unit")) in (DISPLAY, OWN):
        si = getattr(found, "unit", scope.unit.si)
        scope = _Scope(scope.units, scope.units.of(si) if own is OWN else display_unit(si))
        beside = {"unit": scope.unit.name, **beside}
    told = {name: convert(getattr(found, name), scope) for name, convert in plan.items() if name not in beside}
    return part(**told, **beside)


def _plan(part: type[Any]) -> dict[str, Any]:
    """The fields of a part: how each is converted, or of a unit, which."""
    hints = get_type_hints(part, include_extras=True)
    plan: dict[str, Any] = {}
    for f in fields(part):
        marks = get_args(hints[f.name])[1:] if get_origin(hints[f.name]) is Annotated else ()
        plan[f.name] = marks[0] if marks and marks[0] in (DISPLAY, OWN) else _converter(hints[f.name])
    return plan


def _converter(hint: Any) -> Convert:
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return {AMOUNT: _amount, VALUE: _value, MEAN: _mean}.get(inner[1]) or _converter(inner[0])
    if origin in (Union, UnionType) and len(inner) == 2 and NoneType in inner:
        of = _converter(next(i for i in inner if i is not NoneType))
        return lambda value, scope: None if value is None else _finite(of(value, scope))
    if origin in (list, tuple):
        each, made = _converter(inner[0]), origin
        return lambda values, scope: made(each(v, scope) for v in values)
    if hint in (float, str):
        return lambda value, scope: hint(value)
    if hint is RemarkPart:
        return lambda value, scope: RemarkPart.of(value)
    if is_dataclass(hint):
        return lambda value, scope: _build_part(hint, value, scope, {})  # type: ignore[arg-type]
    return lambda value, scope: value


def _amount(value: float, scope: _Scope) -> float:
    return float(value * (1.0 / scope.unit.factor))


def _value(value: float, scope: _Scope) -> float:
    return float(scope.unit.from_si(value))


def _mean(value: Any, scope: _Scope) -> float:
    return _amount(value.mean, scope)


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


# --- listings ---------------------------------------------------------------------------------------------------------------

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
    cells = [_cells(column.plain, column) for column in shown.columns]
    return csv_columns([str(harmless(column.header)) for column in shown.columns], cells)


def _round(column: Column) -> Column:
    return replace(column, values=np.round(np.asarray(column.values, float), column.si_decimals or 0))


def _cells(values: list[Any], column: Column) -> list[str]:
    """The cells of a column; numbers alone are written at once, as are those beside cells that are empty."""
    kinds = set(map(type, values))
    if kinds <= {float, type(None)} and len(kinds) == 2:
        known = iter(_cells([v for v in values if v is not None], column))
        return ["" if v is None else next(known) for v in values]
    if kinds != {float}:
        return [_cell(v, column) for v in values]
    if column.decimals is not None:
        values = [round(v, column.decimals) for v in values]
    text = _written(values, min(column.digits, 15))
    cells = text.split()
    if "e" in text or "n" in text or "-0 " in text:
        # A point and no large exponent: the cell stands as it is.
        cells = [c if "." in c and "+" not in c else _unusual(v, c, column) for v, c in zip(values, cells, strict=True)]
    return cells


def _unusual(value: float, text: str, column: Column) -> str:
    if text == "nan":
        return ""
    return _cell(value, column) if "e" in text or "n" in text or text == "-0" else text


def _written(values: list[float], digits: int) -> str:
    return f"%.{digits}g " * len(values) % tuple(values)


def _cell(value: Any, column: Column) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(harmless(str(value)))
    value = value if column.decimals is None else round(value, column.decimals)
    return number(value if column.digits >= 15 else float(f"{value:.{column.digits}g}"))

"""The columns of residuals.csv as the series that every picture shows: before, after (configurations of the fit), held
out; and, apart from these, the rows that were set aside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array, Bools
from robocal.report.numbers import finite
from robocal.report.sections import Mark

__all__ = ["ASIDE", "Series", "column", "is_aside", "is_held_out", "is_word", "numbers", "ordinals", "pairs", "three"]

Columns = Mapping[str, Sequence[object]]
ASIDE: Mark = "aside"  # the key of the series that has no mean: gross rows


@record(eq=False)
class Series:
    """One series: its class in the style sheet, its name, and for each of its points the configuration's ordinal (from 1)
    and the error, (n,) each."""

    key: Mark
    name: str
    at: NDArray[np.int64]
    values: Array

    @property
    def mean(self) -> float:
        """The mean error."""
        return float(self.values.mean())


def column(residuals: Columns, name: str) -> list[object]:
    """A column as long as the table, with None where values or the whole column are missing."""
    rows = max((len(c) for c in residuals.values()), default=0)
    found = list(residuals.get(name, ()))
    return found + [None] * (rows - len(found))


def numbers(residuals: Columns, name: str) -> Array:
    """A column as numbers (rows,), NaN wherever there is no usable one (`numbers.finite`)."""
    cells = column(residuals, name)
    usual = set(map(type, cells)) <= {float, type(None)}
    found = np.array(cells if usual else [finite(v) for v in cells], dtype=float)  # None becomes NaN
    found[~np.isfinite(found)] = np.nan
    return found


def is_word(residuals: Columns, name: str, word: str) -> Bools:
    """For each row, whether a column has this word, (rows,)."""
    return np.array([cell == word for cell in column(residuals, name)], dtype=bool)


def is_held_out(residuals: Columns) -> Bools:
    """For each row, whether the identification never saw it, (rows,)."""
    return is_word(residuals, "set", "held_out")


def is_aside(residuals: Columns) -> Bools:
    """For each row, whether it was set aside as gross: it is in no mean; (rows,)."""
    return is_word(residuals, "set_aside", "yes")


def ordinals(residuals: Columns) -> NDArray[np.int64]:
    """For each row, the place of its configuration in the order of the file, from 1; (rows,)."""
    seen: dict[tuple[bool, str], int] = {}
    names = [(c is None, str(i if c is None else c)) for i, c in enumerate(column(residuals, "configuration"))]
    return np.array([seen.setdefault(name, len(seen) + 1) for name in names], dtype=np.int64)


def three(residuals: Columns, quantity: str = "", unit: str = "mm") -> list[Series]:
    """Before, after and held out, and what was set aside, without those that have no point; `quantity` is "" for distances
    or "angle_" for angles."""
    before, after, held = (numbers(residuals, f"{quantity}{s}_{unit}") for s in ("before", "after", "held_out"))
    if np.isnan(before).all() and np.isnan(after).all() and np.isnan(held).all():
        return []
    out, aside = is_held_out(residuals), is_aside(residuals)
    gross = np.where(aside, after, np.nan)
    before, after, held = (np.where(aside, np.nan, v) for v in (before, after, held))
    if np.isnan(held).all():
        held = np.where(out, after, np.nan)
    after = np.where(out, np.nan, after)
    at, last = ordinals(residuals), "held out" if out.any() else "held out in turn"
    found: list[Series] = []
    every: tuple[tuple[Mark, str, Array], ...] = (
        ("before", "before", before),
        ("after", "after, seen by the fit", after),
        ("held", last, held),
        (ASIDE, "set aside", gross),
    )
    for key, name, values in every:
        known = ~np.isnan(values)
        if known.any():
            found.append(Series(key, name, at[known], values[known]))
    return found


def pairs(residuals: Columns) -> tuple[str, list[tuple[float, float]]]:
    """The errors before and after of the same measurements: of those held out, or held out in turn, or else of
    the fit; and which."""
    before = np.where(is_aside(residuals), np.nan, numbers(residuals, "before_mm"))
    out = is_held_out(residuals)
    held, after = numbers(residuals, "held_out_mm"), numbers(residuals, "after_mm")
    for name, values, rows in (
        ("held out", held, out),
        ("held out", after, out),
        ("held out in turn", held, ~out),
        ("seen by the fit", after, ~out),
    ):
        known = rows & ~np.isnan(values) & ~np.isnan(before)
        if known.any():
            return name, list(zip(before[known].tolist(), values[known].tolist(), strict=True))
    return "", []

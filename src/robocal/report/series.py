"""The columns of residuals.csv as the series that every picture shows: before, after (configurations of the fit), held
out; and, apart from these, the rows that were set aside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from robocal.report.numbers import finite

__all__ = ["ASIDE", "Series", "column", "is_aside", "is_held_out", "ordinals", "pairs", "three"]

Columns = Mapping[str, Sequence[object]]
ASIDE = "aside"  # the key of the series that has no mean: gross rows


@dataclass(frozen=True)
class Series:
    """One series: its class in the style sheet, its name, and for each point the configuration's ordinal (from 1) and
    the error."""

    key: str
    name: str
    at: tuple[int, ...]
    values: tuple[float, ...]

    @property
    def mean(self) -> float:
        """The mean error."""
        return sum(self.values) / len(self.values)


def column(residuals: Columns, name: str) -> list[object]:
    """A column as long as the table, with None where values or the whole column are missing."""
    rows = max((len(c) for c in residuals.values()), default=0)
    found = list(residuals.get(name, ()))
    return found + [None] * (rows - len(found))


def is_held_out(residuals: Columns) -> list[bool]:
    """For each row, whether the identification never saw it."""
    return [s == "held_out" for s in column(residuals, "set")]


def is_aside(residuals: Columns) -> list[bool]:
    """For each row, whether it was set aside as gross: it is in no mean."""
    return [s == "yes" for s in column(residuals, "set_aside")]


def ordinals(residuals: Columns) -> list[int]:
    """For each row, the place of its configuration in the order of the file, from 1."""
    seen: dict[str, int] = {}
    names = [f"row {i}" if c is None else f"named {c}" for i, c in enumerate(column(residuals, "configuration"))]
    return [seen.setdefault(name, len(seen) + 1) for name in names]


def three(residuals: Columns, quantity: str = "", unit: str = "mm") -> list[Series]:
    """Before, after and held out, and what was set aside, without those that have no point; `quantity` is "" for distances
    or "angle_" for angles."""
    at = ordinals(residuals)
    out = is_held_out(residuals)
    aside = is_aside(residuals)
    before, after, held = (
        [finite(v) for v in column(residuals, f"{quantity}{stage}_{unit}")] for stage in ("before", "after", "held_out")
    )
    gross = [a if s else None for a, s in zip(after, aside, strict=True)]
    before, after, held = ([None if s else v for v, s in zip(c, aside, strict=True)] for c in (before, after, held))
    if not any(v is not None for v in held):
        held = [a if o else None for a, o in zip(after, out, strict=True)]
    after = [None if o else a for a, o in zip(after, out, strict=True)]
    last = "held out" if any(out) else "held out in turn"
    found = []
    for key, name, values in (
        ("before", "before", before),
        ("after", "after, seen by the fit", after),
        ("held", last, held),
        (ASIDE, "set aside", gross),
    ):
        pairs = [(i, v) for i, v in zip(at, values, strict=True) if v is not None]
        if pairs:
            found.append(Series(key, name, tuple(i for i, _ in pairs), tuple(v for _, v in pairs)))
    return found


def pairs(residuals: Columns) -> tuple[str, list[tuple[float, float]]]:
    """The errors before and after of the same measurements: of those held out, or held out in turn, or else of
    the fit; and which."""
    aside = is_aside(residuals)
    before = [None if a else finite(v) for v, a in zip(column(residuals, "before_mm"), aside, strict=True)]
    out = is_held_out(residuals)
    for name, after, rows in (
        ("held out", column(residuals, "held_out_mm"), out),
        ("held out", column(residuals, "after_mm"), out),
        ("held out in turn", column(residuals, "held_out_mm"), [not o for o in out]),
        ("seen by the fit", column(residuals, "after_mm"), [not o for o in out]),
    ):
        numbers = [finite(v) if use else None for v, use in zip(after, rows, strict=True)]
        found = [(b, a) for b, a in zip(before, numbers, strict=True) if b is not None and a is not None]
        if found:
            return name, found
    return "", []

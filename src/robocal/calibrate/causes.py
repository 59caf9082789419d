"""The likely cause of a row that does not belong to the others, from what was measured and what the others predict.

    zero      every number is exactly 0: a dropped beam
    copy      the reading is another row's, to the last digit: an instrument that got stuck
    target    it is where another target of the same configuration is: two labels swapped
    swapped   it fits another row's configuration, and that row's reading fits this one
    elsewhere it fits another row's configuration: rows that were moved or shifted
    shifted   one column holds what the row before or after should read, in several rows
    sign      one column fits with the other sign
    column    one column alone is off

A match counts only where it would hardly happen by chance: where places lie closer together than the noise, another row's
reading fits anything, and nothing is said.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Cause", "Named", "causes_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SURE = 1e-3  # chance that a row which fits is taken for one that does not
LUCK = 0.05  # how many other rows may fit by chance, where one does
SEVERAL = 2  # rows whose column is shifted alike
MOST = 1000  # flagged rows that are looked at


class Cause(StrEnum):
    """What makes a row strange."""

    ZERO = "zero"
    COPY = "copy"
    TARGET = "target"
    SWAPPED = "swapped"
    ELSEWHERE = "elsewhere"
    SHIFTED = "shifted"
    SIGN = "sign"
    COLUMN = "column"


WORDS = {
    Cause.ZERO: Code.ROW_ZERO,
    Cause.COPY: Code.ROW_COPY,
    Cause.TARGET: Code.ROW_TARGET,
    Cause.SWAPPED: Code.ROW_SWAPPED,
    Cause.ELSEWHERE: Code.ROW_ELSEWHERE,
    Cause.SHIFTED: Code.ROW_SHIFTED,
    Cause.SIGN: Code.ROW_SIGN,
    Cause.COLUMN: Code.ROW_COLUMN,
}


@dataclass(frozen=True)
class Named:
    """The cause of one row: the row whose reading or configuration it is (`partner`), the target, the column (from 0), where
    the cause has one; each the index that the arrays have."""

    row: int
    cause: Cause
    partner: int | None = None
    target: int | None = None
    column: int | None = None

    def remark(self, rows: Ints | None = None, targets: tuple[str, ...] = ()) -> Remark:
        """In words; `rows` are the numbers that the file gives its rows."""

        def line(i: int | None) -> int | None:
            return None if i is None else int(i if rows is None else rows[i])

        target = None if self.target is None else targets[self.target] if targets else str(self.target)
        column = None if self.column is None else self.column + 1
        return Remark.of(
            WORDS[self.cause], row=line(self.row), partner=line(self.partner), target=target, column=column
        )


def causes_of(
    flagged: Ints, value: Array, predicted: Array, spread: Array, *, of_targets: Array | None = None,
    target: Ints | None = None,
) -> tuple[Named, ...]:  # fmt: skip
    """The cause of every flagged row (m,) that has a likely one.

    value and predicted (k, d) of all rows in file order, lengths or angles that do not wrap; spread (d,) is the standard
    deviation of rows that are in order. `of_targets` (k, T, d) is what each target would read, `target` (k,) which one the
    row says.
    """
    flagged = np.asarray(flagged, dtype=np.int64)[:MOST]
    rows = _Rows(value, predicted, spread, flagged)
    out: dict[int, Named] = {}
    for i in map(int, flagged):
        named = _plain(rows, i) or _labels(rows, i, of_targets, target)
        if named is not None:
            out[i] = named
    rest = np.array([i for i in flagged if int(i) not in out], dtype=np.int64)
    out |= _elsewhere(rows, rest)
    out |= _columns(rows, np.array([i for i in rest if int(i) not in out], dtype=np.int64))
    return tuple(out[i] for i in sorted(out))


class _Rows:
    """Values and predictions in units of the noise."""

    def __init__(self, value: Array, predicted: Array, spread: Array, flagged: Ints) -> None:
        scale = np.maximum(spread, 1e-300)
        self.raw, self.value, self.predicted = value, value / scale, predicted / scale
        self.flagged = flagged
        # A prediction is not certain either: the radius is that of a difference.
        self.radius = math.sqrt(2 * float(special.chdtri(value.shape[1], SURE)))
        self.width = math.sqrt(2 * float(special.chdtri(1, SURE)))

    def fits(self, i: int, predicted: Array) -> NDArray[np.bool_]:
        """Which of some predictions (n, d) row i fits."""
        return np.asarray(np.linalg.norm(self.value[i] - predicted, axis=-1) < self.radius)


def _plain(rows: _Rows, i: int) -> Named | None:
    """Zeros and copies: what needs no prediction."""
    if (rows.raw[i] == 0).all():
        return Named(i, Cause.ZERO)
    same = np.flatnonzero((rows.raw == rows.raw[i]).all(axis=1))
    others = [int(j) for j in same if j != i and bool(rows.fits(int(j), rows.predicted[j]))]
    if others and rows.raw.shape[1] > 1:
        return Named(i, Cause.COPY, min(others, key=lambda j: abs(j - i)))
    return None


def _labels(rows: _Rows, i: int, of_targets: Array | None, target: Ints | None) -> Named | None:
    """Another target that stands where this one should."""
    if of_targets is None or target is None or of_targets.shape[1] < 2:
        return None
    scale = rows.raw[i] / np.where(rows.value[i] != 0, rows.value[i], 1.0)
    scale = np.where(rows.value[i] != 0, scale, 1.0)
    fits = rows.fits(i, of_targets[i] / scale)
    fits[target[i]] = False
    # Targets that cannot be told apart explain nothing.
    return Named(i, Cause.TARGET, target=int(np.flatnonzero(fits)[0])) if fits.sum() == 1 else None


def _elsewhere(rows: _Rows, some: Ints) -> dict[int, Named]:
    """Rows that fit the configuration of another row."""
    match: dict[int, set[int]] = {}
    luck = 0.0
    for i in map(int, some):
        fits = rows.fits(i, rows.predicted)
        fits[i] = False
        match[i] = set(map(int, np.flatnonzero(fits)))
        near = np.linalg.norm(rows.predicted - rows.predicted[i], axis=1) < rows.radius
        luck += float(near.sum() - 1) / max(len(some), 1)
    out: dict[int, Named] = {}
    for i, found in match.items():
        mutual = sorted(j for j in found if i in match.get(j, ()))
        if mutual and luck < 1:
            out[i] = Named(i, Cause.SWAPPED, mutual[0])
        elif found and luck < LUCK:
            nearest = min(found, key=lambda j: float(np.linalg.norm(rows.value[i] - rows.predicted[j])))
            out[i] = Named(i, Cause.ELSEWHERE, nearest)
    return out


def _columns(rows: _Rows, some: Ints) -> dict[int, Named]:
    """Rows of which one column alone is off."""
    off: dict[int, int] = {}
    shift: dict[int, set[int]] = {}
    k, d = rows.value.shape
    for i in map(int, some):
        wrong = np.flatnonzero(np.abs(rows.value[i] - rows.predicted[i]) > rows.width)
        if d < 2 or len(wrong) != 1:
            continue
        c = off[i] = int(wrong[0])
        shift[i] = {
            s for s in (-1, 1) if 0 <= i + s < k and abs(rows.value[i, c] - rows.predicted[i + s, c]) < rows.width
        }
    count = Counter((off[i], s) for i, found in shift.items() for s in found)
    out: dict[int, Named] = {}
    for i, c in off.items():
        alike = [s for s in shift[i] if count[c, s] >= SEVERAL]
        if alike:
            out[i] = Named(i, Cause.SHIFTED, i + alike[0], column=c)
        elif abs(rows.value[i, c] + rows.predicted[i, c]) < rows.width:
            out[i] = Named(i, Cause.SIGN, column=c)
        else:
            out[i] = Named(i, Cause.COLUMN, column=c)
    return out

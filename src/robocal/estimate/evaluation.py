"""Residuals of a term at many vectors: some rows at a time, so that what they pass through stays in the cache."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.estimate.terms import ProblemTerm, Residuals

__all__ = ["CHUNK", "evaluate_all", "evaluate_pieces", "greatest_length"]

# Doubles per chunk of Jacobian: small enough to stay in the second-level cache.
CHUNK = 1 << 16
POSE = 16  # numbers
PIECES = 8  # of which a part of many rows is made at least
TOGETHER = 64  # rows


def evaluate_pieces(term: ProblemTerm, x: Array, step: int = 1) -> Iterator[tuple[slice, Array]]:
    """Residuals (B, rows, d) of a term without Jacobian at x (B, P); of many vectors some rows at a time: what a row passes through, a
    pose at most, stays in the cache."""
    every, m = np.arange(len(x)), len(term.scale)
    rows = max(m, 1) if len(x) == 1 else max(1, CHUNK // (POSE * len(x)))
    if step > 1:  # those of one piece are much alike
        rows = max(1, min(rows, m // (PIECES * step)))
    for first in range(0, max(m, 1), step * rows):
        last = min(first + rows, m)
        yield slice(first, last), term.evaluate(x, every, first, last - first)[0]


def _evaluate_own(term: ProblemTerm, x: Array, own: Ints) -> Array:
    """Residuals (m, d) of each row of a term at its own one of x (B, P), own (m,), NaN below 0; some rows at a time, of which most lie
    at few of x."""
    out = np.full(term.scale.shape, np.nan)
    for first in range(0, len(own), TOGETHER):
        mine = own[first : first + TOGETHER]
        asked, at = np.unique(mine[mine >= 0], return_inverse=True)
        rows = np.flatnonzero(mine >= 0)
        if len(rows):
            out[first + rows] = term.evaluate(x[asked], asked, first, len(mine))[0][at, rows]
    return out


def evaluate_all(term: ProblemTerm, x: Array, own: Ints | None) -> Array:
    """Residuals of all rows of a term, as `Problem.residuals` has them."""
    if own is not None:
        return _evaluate_own(term, x, own[term.configuration])
    parts = [r for _, r in evaluate_pieces(term, x)]
    r = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
    return np.asarray(r[0] if len(x) == 1 else r)


def greatest_length(every: Sequence[Residuals], counted: Bools, batch: int, unit: str) -> Array:
    """The greatest length (batch,) of the readings in a unit, of configurations that are counted (U,); see `Problem.greatest_error`."""
    worst, lengths = np.zeros(batch), False
    for rows in every:
        for part, (_, _, own) in enumerate(rows.parts):
            some = rows.used & counted[rows.configuration]
            if own != unit or not rows.reading or not some.any():
                continue
            lengths = True
            error = rows.length(part).reshape(batch, -1)[:, some]
            worst = np.maximum(worst, error.max(axis=1))
    if not lengths:
        raise ModelError(
            "nothing that was measured is a length, so there is no error to stop at", key="tolerance",
            expected="no tolerance, or data with positions, poses, ranges or lengths",
        )  # fmt: skip
    return worst

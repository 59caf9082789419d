"""Jacobians whose rows lie together by what they touch, as those of many markers do: of some rows at a time few columns count."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._types import Array, Ints

__all__ = ["ROWS", "blocks_of", "product"]

ROWS = 500  # grid: rows at once
GLANCE = 64  # rows from one to the next that is looked at before all of them are
FEW = 0.75  # grid: of the columns: where more are touched, leaving out the rest costs what it saves


def blocks_of(j: Array) -> Iterator[tuple[slice, Ints | slice]]:
    """Rows of j (N, n), some at a time, and the columns that they touch, (k,); all of them where these are most."""
    wide = j.shape[1]
    for first in range(0, len(j), ROWS):
        at = slice(first, first + ROWS)
        if np.count_nonzero(j[at][::GLANCE].any(axis=0)) <= FEW * wide:
            felt = np.flatnonzero(j[at].any(axis=0))
            if len(felt) <= FEW * wide:
                yield at, felt
                continue
        yield at, slice(None)


def product(j: Array, w: Array) -> Array:
    """J W (N, m), of J (N, n) and W (n, m)."""
    out = np.empty((len(j), w.shape[1]))
    for at, felt in blocks_of(j):
        np.matmul(j[at, felt], w[felt], out=out[at])
    return out

"""Covariances of corners in a table, as `vision detect` writes them: `suv` of u and v, `cu_u0` to `cv_v3` with all corners of a marker."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.files.csvtable import CsvTable
from robocal.measure.sights.correlations import COVARIANCES, SQUARE_CORNER

__all__ = ["COVARIANCE", "SIGMAS", "WITH_OTHERS", "corner_covariances"]

SIGMAS = "su", "sv"
COVARIANCE = "suv"
WITH_OTHERS = tuple(f"c{a}_{b}{j}" for a in "uv" for j in range(4) for b in "uv")
PLACE = "marker", "corner"
ROUNDED = 1e-3  # tolerance: of a variance, that the covariances say once more


def corner_covariances(table: CsvTable, columns: Sequence[str | int] | None, sigma: Array | None) -> dict[str, Array]:
    """What `Observations.extra` has of correlated corners, where standard deviations sigma (k, 2) are read from `columns` su and sv, and
    covariances stand beside them; rows without these are independent. Raises FormatError for a cell that is no number, or no covariance."""
    if sigma is None or tuple(columns or ()) != SIGMAS or not table.has(COVARIANCE):
        return {}
    row = np.arange(len(table))
    out, square = np.zeros((len(table), 2, 8)), np.column_stack([row, np.zeros_like(row)]).astype(float)
    own, both = _numbers(table, [COVARIANCE])[:, 0], sigma[:, 0] * sigma[:, 1]
    table.insist(
        ~(np.abs(own) > both * (1 + ROUNDED)), [COVARIANCE], "no covariance of u and v", own, expected="at most su sv"
    )
    out[:, 0, 0], out[:, 1, 1] = (sigma**2).T
    out[:, 0, 1] = out[:, 1, 0] = np.nan_to_num(own)
    if all(map(table.has, (*PLACE, *WITH_OTHERS))):
        _with_others(table, sigma, out, square)
    return {COVARIANCES: out, SQUARE_CORNER: square}


def _with_others(table: CsvTable, sigma: Array, out: Array, square: Array) -> None:
    """The correlations with the other corners of a marker, of rows that have them."""
    marker, names = (table.strip(table.find(name)) for name in PLACE)
    corner = np.array([int(n) if n in ("0", "1", "2", "3") else -1 for n in names])
    every = _numbers(table, WITH_OTHERS).reshape(-1, 2, 4, 2)
    told = np.flatnonzero(np.isfinite(every).all(axis=(1, 2, 3)) & (corner >= 0))
    # Those of a row with itself are the squares of su and sv: else nobody knows in which pixels they are.
    mine = every[told, :, corner[told]]
    close = np.abs(mine[:, [0, 1], [0, 1]] / sigma[told] ** 2 - 1) < ROUNDED
    told = told[close.all(axis=1)]
    number = {name: len(table) + i for i, name in enumerate(dict.fromkeys(marker))}
    square[told] = np.column_stack([[number[marker[i]] for i in told.tolist()], corner[told]]).reshape(-1, 2)
    out[told] = every[told].reshape(-1, 2, 8)


def _numbers(table: CsvTable, columns: Sequence[str]) -> Array:
    """Numbers (k, n) of some columns, NaN where a cell is empty."""
    out, lacking = np.full((len(table), len(columns)), np.nan), np.zeros(len(table), dtype=bool)
    lacking[table.lacking(columns)] = True
    if not lacking.all():
        out[~lacking] = (table.without(lacking) if lacking.any() else table).numbers(columns)
    return out

"""Covariances of corners in a table, as `vision detect` writes them: `suv` of u and v, `cu_u0` to `cv_v3` with all corners of a marker."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.files.csvtable import CsvTable
from robocal.measure.data import Observations
from robocal.measure.sights.correlations import COVARIANCES, SQUARE_CORNER

__all__ = ["COVARIANCE", "SIGMAS", "WITH_OTHERS", "columns_of", "corner_covariances"]

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


def columns_of(obs: Observations) -> dict[str, Array]:
    """What a table needs beside su and sv for the correlations of its rows; nothing where they have none. Rows whose standard deviations
    are others than those of their covariances are written as independent."""
    if COVARIANCES not in obs.extra or obs.sigma is None:
        return {}
    covariance, square = obs.extra[COVARIANCES].copy(), obs.extra[SQUARE_CORNER]
    corner, row = square[:, 1].astype(np.int64), np.arange(len(obs))
    mine = np.stack([covariance[row, i, 2 * corner + i] for i in (0, 1)], axis=1)
    other = (np.abs(mine / obs.sigma**2 - 1) >= ROUNDED).any(axis=1)
    covariance[other] = 0.0
    for i in (0, 1):
        covariance[row[other], i, 2 * corner[other] + i] = obs.sigma[other, i] ** 2
    _, marker = np.unique(square[:, 0], return_inverse=True)
    every = covariance.reshape(len(obs), 16).T
    out = {PLACE[0]: marker.ravel(), PLACE[1]: corner, COVARIANCE: covariance[row, 0, 2 * corner + 1]}
    return out | dict(zip(WITH_OTHERS, every, strict=True))


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

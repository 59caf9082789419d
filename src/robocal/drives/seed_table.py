"""The seed document's own method: a table for each direction, smoothed by Savitzky and Golay, and repaired from the other direction.

    tau_e = tau - mean(tau)                                                   (1.1)

Efforts of one direction are averaged in cells of the turn; through the cells within half a window a polynomial of degree 2 or 3 is
fitted, and its value at the middle is the table's. Cells without a reading have no weight, so that with all of them it is their filter
exactly. Where the rotor escaped, the other direction's tau_e stands with the own mean. Source: seed document, 1.3 to 1.4.2, figures 1.4
to 1.7; Savitzky and Golay (1964).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array, Bools
from robocal.drives.cogging import Cogging
from robocal.drives.drive_sweep import Sweep

__all__ = ["SeedTable", "seed_table", "table_harmonics"]

CELLS = 3600  # of a turn: a tenth of a degree, fifty in the window of the document
HIGHEST = 300  # grid: orders of a table that are kept as harmonics
SMALL = 1e-5  # grid: of the variance, that such harmonics may leave
NEAR = 0.5  # grid: of half a window, within which there is a reading


@record(eq=False)
class SeedTable:
    """Efforts (2, C) at the middles of C cells of the turn, forward and reverse, as they are to be added to a command; `repaired`
    (2, C) are cells that were taken from the other direction, `lost` (2, C) those that neither had, `raw` (2, C) the averages
    before they were smoothed (NaN: no reading)."""

    values: Array
    raw: Array
    repaired: Bools
    lost: Bools

    @property
    def means(self) -> Array:
        """The mean of each direction, (2,): friction, with its sign, and what else is constant."""
        count = np.maximum((~self.lost).sum(axis=1), 1)
        return np.asarray(np.where(self.lost, 0.0, self.values).sum(axis=1) / count)

    @property
    def coulomb(self) -> float:
        """Half the difference of the means."""
        forward, reverse = self.means
        return float(forward - reverse) / 2

    def at(self, angle: ArrayLike, direction: ArrayLike = 0.0) -> Array:
        """The table without its means at angles (...), moved to in directions (...): 1, -1; 0 takes the mean of both."""
        theta, d = np.broadcast_arrays(np.asarray(angle, float), np.asarray(direction, float))
        own = self.values - self.means[:, None]
        place = np.mod(theta, 2 * np.pi) / (2 * np.pi) * CELLS - 0.5
        left = np.floor(place).astype(np.int64)
        share, one, two = place - left, left % CELLS, (left + 1) % CELLS
        each = own[:, one] * (1 - share) + own[:, two] * share
        return np.asarray(np.where(d > 0, each[0], np.where(d < 0, each[1], each.mean(axis=0))))


def seed_table(sweep: Sweep, escaped: Bools, degree: int, window: float) -> SeedTable:
    """The table of a sweep without the rows that escaped; `window` in rad."""
    cell = np.floor(np.mod(sweep.angle, 2 * np.pi) / (2 * np.pi) * CELLS).astype(np.int64) % CELLS
    values, raw, weights = np.empty((2, CELLS)), np.full((2, CELLS), np.nan), np.empty((2, CELLS))
    for i, d in enumerate((1, -1)):
        some = sweep.used & ~escaped & (sweep.direction == d)
        weights[i] = np.bincount(cell[some], minlength=CELLS) > 0
        count = np.maximum(np.bincount(cell[some], minlength=CELLS), 1)
        mean = np.bincount(cell[some], sweep.effort[some], CELLS) / count
        raw[i, weights[i] > 0] = mean[weights[i] > 0]
        values[i] = _smooth(mean * (weights[i] > 0), weights[i], degree, window)
    known = np.isfinite(values)
    centre = np.array([np.nanmean(v) if k.any() else 0.0 for v, k in zip(values, known, strict=True)])
    repaired = ~known & known[::-1]
    lost = ~known & ~known[::-1]
    other = values[::-1] - centre[::-1, None] + centre[:, None]
    values = np.where(known, values, np.where(repaired, other, centre[:, None]))
    return SeedTable(values, raw, repaired, lost)


def _smooth(values: Array, weights: Array, degree: int, window: float) -> Array:
    """The value at the middle of a polynomial through the cells around each, (C,); NaN where too few have a reading."""
    half = max(degree, round(window / (2 * np.pi) * CELLS / 2))
    x: Array = np.arange(-half, half + 1, dtype=float) / half
    moments = np.stack([_around(weights, x**k) for k in range(2 * degree + 1)])
    right = np.stack([_around(values * weights, x**k) for k in range(degree + 1)])
    powers = np.arange(degree + 1)
    a = moments[powers[:, None] + powers].transpose(2, 0, 1)
    # As many on both sides as it has powers, and one near: a polynomial says nothing of where it has no readings.
    ahead, behind, near = (_around(weights, side.astype(np.float64)) for side in (x >= 0, x <= 0, np.abs(x) <= NEAR))
    told = (ahead >= degree) & (behind >= degree) & (near > 0)
    out = np.full(CELLS, np.nan)
    if told.any():
        out[told] = np.linalg.solve(a[told], right.T[told][..., None])[:, 0, 0]
    return out


def _around(values: Array, kernel: Array) -> Array:
    """sum_j kernel_j values_(i + j), around the turn, j from -half to half."""
    half = len(kernel) // 2
    padded = np.concatenate([values[-half:], values, values[:half]])
    return np.correlate(padded, kernel, mode="valid")


def table_harmonics(values: Array) -> Cogging:
    """The harmonics of tables (2, C) at the middles of their cells, forward and reverse, without their means; the strongest, until what
    is left is small."""
    cells = values.shape[1]
    n = np.arange(1, min(HIGHEST, cells // 2 - 1) + 1)
    middles = (np.arange(cells) + 0.5) * 2 * np.pi / cells
    wave = np.exp(-1j * np.outer(n, middles))
    forward, reverse = 2 / cells * (wave @ values.T).T
    power = np.abs(forward) ** 2 + np.abs(reverse) ** 2
    order = np.argsort(-power)
    many = int(np.searchsorted(np.cumsum(power[order]), (1 - SMALL) * power.sum())) + 1
    kept = np.sort(order[:many])
    mean, change = (forward + reverse)[kept] / 2, (forward - reverse)[kept] / 2
    parts = (mean.real, -mean.imag)
    changes = (change.real, -change.imag)
    a, b, da, db = (tuple(map(float, p)) for p in (*parts, *changes))
    return Cogging(tuple(map(int, n[kept])), a, b, 0.0, da, db)

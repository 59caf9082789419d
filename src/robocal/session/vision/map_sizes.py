"""Markers that look larger or smaller beside the others than their edges say: a wrong size, or a print at another scale.

    ds = (b_s - A_sp A_pp^-1 b_p) / c,   c = A_ss - A_sp A_pp^-1 A_ps,   gain = ds^2 c        s the log of the edge, p the marker's pose

The sums A = J^T J / sigma^2 and b = -J^T r / sigma^2 go over all sights of a marker, the views and the lens as they were fitted. The
size of all markers together shows in no image.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.limits import MARKER_MOVED_VIEWS, MARKER_SIZE, MARKER_SIZE_SURE
from robocal.session.vision.map_moved import marker_columns
from robocal.vision.map_start import MarkerSights

__all__ = ["MarkerSize", "find_sizes"]


@record
class MarkerSize:
    """The number of a marker, its edge in --size and beside the others (m), and by how much chi2 falls with the latter."""

    marker: int
    size: float
    apparent: float
    gain: float


def find_sizes(sights: MarkerSights, lens: Array, views: Array, markers: Array, sigma: float) -> list[MarkerSize]:
    """Of sights through a lens, with T_camera_map (V, 4, 4), T_map_marker (M, 4, 4), and sigma (px) of a coordinate."""
    j, r, place = marker_columns(sights, lens, views, markers, sigma)
    column = np.einsum("sckd,scd->sck", j[:, :, :, :3], place).reshape(len(r), 8, 1)
    j = np.concatenate([j.reshape(len(r), 8, 6), column], axis=2)
    a, b = np.swapaxes(j, 1, 2) @ j, -np.einsum("sri,sr->si", j, r)
    out = []
    for m in range(len(markers)):
        own = np.flatnonzero(sights.marker == m)
        if len(own) < MARKER_MOVED_VIEWS:
            continue
        total, slope = a[own].sum(axis=0), b[own].sum(axis=0)
        solved = np.linalg.lstsq(total[:6, :6], np.column_stack([total[:6, 6], slope[:6]]), rcond=None)[0]
        left = total[6, 6] - total[6, :6] @ solved[:, 0]
        step = (slope[6] - total[6, :6] @ solved[:, 1]) / max(left, 1e-30)
        gain = float(step**2 * left)
        if abs(step) > MARKER_SIZE and gain > MARKER_SIZE_SURE**2:
            edge = float(np.ptp(sights.points[own[0]], axis=0).max())
            out.append(MarkerSize(m, edge, edge * float(np.exp(step)), gain))
    return out

"""Markers that are at two places: they moved while images were taken, or two markers have one number.

    (dx)_s = A_s^-1 b_s,   A_s = J_s^T J_s / sigma^2,   b_s = -J_s^T r_s / sigma^2        of one sight s, the views as they were fitted
    gain(k) = b_1 A_1^-1 b_1 + b_2 A_2^-1 b_2 - b A^-1 b                                  sums before the k-th sight and from it on

The gain is the fall of chi2 when a marker may have another place from one view on; of two markers with one number, whose views
alternate, the sights are put in the order of where they see it.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.limits import MARKER_MOVED, MARKER_MOVED_VIEWS
from robocal.vision.camera import project
from robocal.vision.map_start import Sights

__all__ = ["MovedMarker", "find_moved"]


@record
class MovedMarker:
    """The number of a marker, the views (numbers) that see it at another place, whether these are all views from one on, and how far that
    place is (m, rad)."""

    marker: int
    views: tuple[int, ...]
    later: bool
    apart: float
    turned: float


def find_moved(sights: Sights, lens: Array, views: Array, markers: Array, sigma: float) -> list[MovedMarker]:
    """Of sights through a lens, with T_camera_map (V, 4, 4), T_map_marker (M, 4, 4), and sigma (px) of a coordinate."""
    a, b, alone = _squares(sights, lens, views, markers, sigma)
    out = []
    for m in range(len(markers)):
        own = np.flatnonzero(sights.marker == m)
        own = own[np.argsort(sights.view[own], kind="stable")]
        if len(own) < 2 * MARKER_MOVED_VIEWS:
            continue
        found = _split(a[own], b[own], len(own))
        later = True
        # Where most sights are far from each other, along the direction in which they scatter most.
        place = alone[own, :3]
        line = np.linalg.svd(place - np.median(place, axis=0), full_matrices=False)[2][0]
        order = np.argsort(place @ line, kind="stable")
        other = _split(a[own][order], b[own][order], len(own))
        if other[0] > 2 * found[0]:
            found, own, later = other, own[order], False
        gain, k, step = found
        if gain > MARKER_MOVED**2:
            some = own[k:] if later or 2 * k > len(own) else own[:k]
            views_ = tuple(np.sort(sights.view[some]).tolist())
            out.append(MovedMarker(m, views_, later, float(np.linalg.norm(step[:3])), float(np.linalg.norm(step[3:]))))
    return out


def _squares(sights: Sights, lens: Array, views: Array, markers: Array, sigma: float) -> tuple[Array, Array, Array]:
    """A (S, 6, 6), b (S, 6) and the motion (S, 6) of the marker that each sight alone would like, in map axes."""
    seen = views[sights.view]
    t = seen @ markers[sights.marker]
    turned = np.einsum("sij,skj->ski", markers[sights.marker][:, :3, :3], sights.points)
    uv, by, _ = project(np.einsum("sij,skj->ski", t[:, :3, :3], sights.points) + t[:, None, :3, 3], lens)
    by = by @ seen[:, None, :3, :3]
    cross = np.zeros((*turned.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = turned[..., 2], -turned[..., 1], turned[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    j = np.concatenate([by, by @ cross], axis=3).reshape(len(t), 8, 6) / sigma
    r = (uv - sights.corners).reshape(len(t), 8) / sigma
    a, b = np.swapaxes(j, 1, 2) @ j, -np.einsum("sri,sr->si", j, r)
    scale = np.sqrt(np.einsum("sii->si", a))
    alone = np.linalg.solve(a / (scale[:, :, None] * scale[:, None]) + 1e-9 * np.eye(6), (b / scale)[..., None])[..., 0]
    return a, b, alone / scale


def _split(a: Array, b: Array, count: int) -> tuple[float, int, Array]:
    """The largest fall of chi2 by two places instead of one, from which sight on, and the motion between them (6,)."""
    first_a, first_b = np.cumsum(a, axis=0)[:-1], np.cumsum(b, axis=0)[:-1]
    whole_a, whole_b = a.sum(axis=0), b.sum(axis=0)
    one, two = _solve(first_a, first_b), _solve(whole_a - first_a, whole_b - first_b)
    alone = float(whole_b @ _solve(whole_a[None], whole_b[None])[0])
    gain = np.sum(first_b * one, axis=1) + np.sum((whole_b - first_b) * two, axis=1) - alone
    fewest = int(MARKER_MOVED_VIEWS)
    inside = np.arange(fewest - 1, count - fewest)
    k = int(inside[gain[inside].argmax()])
    return float(gain[k]), k + 1, two[k] - one[k]


def _solve(a: Array, b: Array) -> Array:
    scale = np.sqrt(np.einsum("sii->si", a))
    scaled = a / (scale[:, :, None] * scale[:, None]) + 1e-9 * np.eye(6)
    return np.asarray(np.linalg.solve(scaled, (b / scale)[..., None])[..., 0] / scale)

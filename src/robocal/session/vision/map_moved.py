"""Markers that are at two places: they moved while images were taken, or two markers have one number.

    (dx)_s = A_s^-1 b_s,   A_s = J_s^T J_s / sigma^2,   b_s = -J_s^T r_s / sigma^2        of one sight s, the views as they were fitted
    gain(k) = b_1 A_1^-1 b_1 + b_2 A_2^-1 b_2 - b A^-1 b                                  sums before the k-th sight and from it on

The gain is the fall of chi2 when a marker may have another place from one view on; of two markers with one number, whose views
alternate, the sights are put in the order of where they see it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.vision_limits import MARKER_MOVED, MARKER_MOVED_VIEWS
from robocal.errors import ModelError
from robocal.vision.camera import project
from robocal.vision.map_start import MapStart, MarkerSights

__all__ = ["MarkerMotion", "find_moved", "marker_columns", "refuse_moved"]

TWICE = 2.0  # tolerance: times, that another order has to explain more
TYPICAL = 50.0  # tolerance: of chi2: one gross view gains more than all others together, and is no motion
FINEST = 0.3  # tolerance: px: of a start
FAR = 0.1  # tolerance: of a sight's extent
ALONE = 0.1  # tolerance: of the other sights in these views
SHOWN = 6  # grid: views that a sentence names


@record
class MarkerMotion:
    """The number of a marker, the views (numbers) that see it at another place, whether these are all views from one on, how far that
    place is (m, rad), and by how much chi2 falls with it."""

    marker: int
    views: tuple[int, ...]
    later: bool
    distance: float
    turned: float
    gain: float = 0.0


def find_moved(sights: MarkerSights, lens: Array, views: Array, markers: Array, sigma: float) -> list[MarkerMotion]:
    """Of sights through a lens, with T_camera_map (V, 4, 4), T_map_marker (M, 4, 4), and sigma (px) of a coordinate."""
    a, b, alone, left = _squares(sights, lens, views, markers, sigma)
    out = []
    for m in range(len(markers)):
        own = np.flatnonzero(sights.marker == m)
        own = own[np.argsort(sights.view[own], kind="stable")]
        if len(own) < 2 * MARKER_MOVED_VIEWS:
            continue
        found = _split(a[own], b[own])
        later = True
        # Of two markers views alternate: put in order along the direction in which they would scatter most.
        place = alone[own, :3]
        line = np.linalg.svd(place - np.median(place, axis=0), full_matrices=False)[2][0]
        order = np.argsort(place @ line, kind="stable")
        other = _split(a[own][order], b[own][order])
        if other.gain > TWICE * found.gain:
            found, own, later = other, own[order], False
        if found.gain > MARKER_MOVED**2 and found.typical > TYPICAL:
            k = found.first
            some = own[k:] if later or left[own[k:]].mean() > left[own[:k]].mean() else own[:k]
            apart, turned = (float(np.linalg.norm(v)) for v in (found.step[:3], found.step[3:]))
            out.append(MarkerMotion(m, tuple(np.sort(sights.view[some]).tolist()), later, apart, turned, found.gain))
    return out


def refuse_moved(sights: MarkerSights, start: MapStart, lens: Array, ids: Sequence[str], names: Sequence[str]) -> None:
    """Raises ModelError where a marker begins at two places that are further apart than it is large: no fit is worth its time."""
    if not np.isfinite(start.views[sights.view]).all() or not np.isfinite(start.markers).all():
        return
    left = start.errors * sights.extent
    found = find_moved(sights, lens, start.views, start.markers, max(float(np.median(left)), FINEST))
    for m in found:
        edge = float(np.ptp(sights.points[sights.marker == m.marker][0], axis=0).max())
        far = start.errors[(sights.marker == m.marker) & np.isin(sights.view, m.views)]
        others = start.errors[(sights.marker != m.marker) & np.isin(sights.view, m.views)]
        # A map that begins torn is off by whole groups of markers, and the fit mends it.
        if m.distance > edge and np.median(far) > FAR and np.mean(others > FAR) < ALONE:
            shown = ", ".join(ids[v] for v in m.views[:SHOWN])
            told = f"marker {names[m.marker]}; {len(m.views)} views, as {shown}, see it elsewhere than the others"
            raise ModelError(
                "a marker is at two places", key="marker", found=told,
                expected="numbers that are there once, and edges as in --size; --without this marker, or --exclude views before it moved",
            )  # fmt: skip


def marker_columns(
    sights: MarkerSights, lens: Array, views: Array, markers: Array, sigma: float
) -> tuple[Array, Array, Array]:
    """Derivatives (S, 4, 2, 6) of corners by small motions of their markers in map axes, what is left of the corners (S, 8), both in
    sigma, and the corners from the middles of their markers (S, 4, 3), in map axes."""
    seen = views[sights.view]
    t = seen @ markers[sights.marker]
    turned = np.einsum("sij,skj->ski", markers[sights.marker][:, :3, :3], sights.points)
    uv, by, _ = project(np.einsum("sij,skj->ski", t[:, :3, :3], sights.points) + t[:, None, :3, 3], lens)
    by = by @ seen[:, None, :3, :3]
    cross = np.zeros((*turned.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = turned[..., 2], -turned[..., 1], turned[..., 0]
    cross -= np.swapaxes(cross, -1, -2)
    j = np.concatenate([by, by @ cross], axis=3) / sigma
    return j, (uv - sights.corners).reshape(len(t), 8) / sigma, turned


def _squares(
    sights: MarkerSights, lens: Array, views: Array, markers: Array, sigma: float
) -> tuple[Array, Array, Array, Array]:
    """A (S, 6, 6), b (S, 6), the motion (S, 6) of the marker that each sight alone would like, in map axes, and r^T r (S,)."""
    j, r, _ = marker_columns(sights, lens, views, markers, sigma)
    j = j.reshape(len(r), 8, 6)
    a, b = np.swapaxes(j, 1, 2) @ j, -np.einsum("sri,sr->si", j, r)
    scale = np.sqrt(np.einsum("sii->si", a))
    alone = np.linalg.solve(a / (scale[:, :, None] * scale[:, None]) + 1e-9 * np.eye(6), (b / scale)[..., None])[..., 0]
    return a, b, alone / scale, np.sum(r**2, axis=1)


@record
class _Split:
    """The largest fall of chi2 by two places instead of one, from which sight on the second holds, the motion (6,) between them, and how
    much most sights gain, of the places that gain less by it."""

    gain: float
    first: int
    step: Array
    typical: float


def _split(a: Array, b: Array) -> _Split:
    """Of the sights of a marker in their order."""
    first_a, first_b = np.cumsum(a, axis=0)[:-1], np.cumsum(b, axis=0)[:-1]
    whole_a, whole_b = a.sum(axis=0), b.sum(axis=0)
    one, two = _solve(first_a, first_b), _solve(whole_a - first_a, whole_b - first_b)
    alone = float(whole_b @ _solve(whole_a[None], whole_b[None])[0])
    gain = np.sum(first_b * one, axis=1) + np.sum((whole_b - first_b) * two, axis=1) - alone
    fewest = int(MARKER_MOVED_VIEWS)
    inside = np.arange(fewest - 1, len(a) - fewest)
    k = int(inside[gain[inside].argmax()])

    def typical(some: slice, here: Array, there: Array) -> float:
        """The fall of chi2 (median) of sights at their own place, beside the other one."""
        cost = [np.einsum("sij,i,j->s", a[some], x, x) - 2 * b[some] @ x for x in (here, there)]
        return float(np.median(cost[1] - cost[0]))

    least = min(typical(slice(k + 1), one[k], two[k]), typical(slice(k + 1, None), two[k], one[k]))
    return _Split(float(gain[k]), k + 1, two[k] - one[k], least)


def _solve(a: Array, b: Array) -> Array:
    scale = np.sqrt(np.einsum("sii->si", a))
    scaled = a / (scale[:, :, None] * scale[:, None]) + 1e-9 * np.eye(6)
    return np.asarray(np.linalg.solve(scaled, (b / scale)[..., None])[..., 0] / scale)

"""Inner corners of a checkerboard: where two edges cross, from all pixels of the four squares around."""

from __future__ import annotations

import numpy as np

from robocal._jit import as_kernel_array
from robocal._types import Array, Ints
from robocal.vision.camera import project
from robocal.vision.checker._kernels import SIZE, fit_crossing, sum_crossing
from robocal.vision.marker.bend import OTHER_LENS, bend_of, ideal_points, without_distortion
from robocal.vision.sightings import BOARD, FAINT, METHODS, MISFIT, WHITE, Sighting

__all__ = ["fit_saddles"]

CLEAR = 2.5  # blur widths that stay away from the next edges
FIRST_BLUR = 1.0  # px
FURTHEST = 12.0  # px from the crossing: a lens bends what is longer
QUANTUM = 0.3  # grey levels: the step of a camera's numbers, as noise
ROUNDS, PASSES, STILL = 20, 3, 1e-3  # px
ASTRAY = 0.25  # of a square, that a fit may move from where the search was


def fit_saddles(levels: Array, numbers: Ints, start: Array, columns: int, lens: Array | None = None) -> Sighting | None:
    """Inner corners of a board near start (k, 2), by number (k,) along rows of so many; None where fewer than four can be fitted.

    Those that cannot are left out. The covariance (2 k, 2 k) has a block for each corner. With a lens (n,), as in `vision.camera`, edges
    are straight where there is no distortion; without one the covariance carries what a wide lens may bend.
    """
    at = {int(n): p for n, p in zip(numbers, start if lens is None else ideal_points(start, lens), strict=True)}
    kept, places, blocks, rest = [], [], [], []
    for number, place in at.items():
        right, down = _side(at, number, 1, columns), _side(at, number, columns, columns)
        if right is None or down is None:
            continue
        one = _fit(levels, place, right, down, lens)
        if one is not None:
            kept.append(number)
            places.append(one[0])
            blocks.append(one[1])
            rest.append(one[2])
    if len(kept) < 4:
        return None
    covariance = np.zeros((2 * len(kept), 2 * len(kept)))
    for k, block in enumerate(blocks):
        covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
    blur, noise, contrast, white = np.median(rest, axis=0).tolist()
    order = np.array(kept, dtype=np.int64)
    return Sighting(BOARD, order, np.array(places), covariance, blur, noise, contrast, METHODS[2], white=white)


def _side(at: dict[int, Array], number: int, step: int, columns: int) -> Array | None:
    """The edge of a square from a corner on, along rows or down: the mean of what leads to its neighbours on both sides."""
    ends = [at.get(number + s * step) for s in (1, -1) if step > 1 or (number + s) // columns == number // columns]
    ways = [e - at[number] for e in ends if e is not None]
    ways = [w * np.sign(w @ ways[0]) for w in ways]
    return np.mean(ways, axis=0) if ways else None


def _fit(
    levels: Array, place: Array, right: Array, down: Array, lens: Array | None
) -> tuple[Array, Array, tuple[float, float, float, float]] | None:
    h, w = levels.shape
    turn = np.stack([right, down], axis=1)
    if abs(np.linalg.det(turn)) < 4.0:
        return None
    inverse = np.linalg.inv(turn)
    reach = np.minimum(np.abs(right) + np.abs(down), FURTHEST)
    seen, by_ideal = (place, np.eye(2)) if lens is None else _distorted(place, lens)
    reach = reach if lens is None else np.abs(by_ideal) @ reach + 1.0
    low = np.clip(np.floor(seen - reach), 0, (w, h)).astype(int)
    high = np.clip(np.ceil(seen + reach) + 1, 0, (w, h)).astype(int)
    box = int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])
    if min(box[2:]) < 1:
        return None
    u, v = without_distortion(box, lens)[0].T
    grey = as_kernel_array(levels[low[1] : high[1], low[0] : high[0]].ravel())
    p, a = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    p[:2], p[2], p[3] = place, np.arctan2(right[1], right[0]), np.arctan2(down[1], down[0])
    p[4], limit, noise = FIRST_BLUR, np.inf, 0.0
    for step in range(PASSES):
        away = np.stack([u, v], axis=1) - p[:2]
        x, y = inverse @ away.T
        clear = CLEAR * np.sqrt(p[4] ** 2 + 1 / 12) * np.hypot(*inverse.T)
        inside = (np.abs(x) < 1 - clear[0]) & (np.abs(y) < 1 - clear[1]) & (np.hypot(*away.T) < FURTHEST)
        if inside.sum() < 2 * SIZE:
            return None
        shown, su, sv = grey[inside], as_kernel_array(u[inside]), as_kernel_array(v[inside])
        if step == 0:
            dark, bright = np.percentile(shown, [10, 90])
            p[5], limit = 0.5 * (dark + bright), 0.3 * (bright - dark)
            xy = np.sign(x[inside] * y[inside])
            p[8] = 0.5 * (bright - dark) * (1.0 if np.sum(xy * (shown - p[5])) > 0 else -1.0)
            # z1 grows down, z2 to the left: their product is black where x and y agree, if that is white.
            p[8] = -p[8]
        cost = fit_crossing(as_kernel_array(shown), su, sv, p, limit, ROUNDS, STILL, a)
        if not cost >= 0:
            return None
        noise = float(np.sqrt(2 * cost / (len(shown) - SIZE)))
        limit = 3 * max(noise, QUANTUM)
    contrast, side = 2 * abs(float(p[8])), min(np.hypot(*right), np.hypot(*down))
    if contrast < FAINT or noise > MISFIT * contrast or np.hypot(*(p[:2] - place)) > max(ASTRAY * side, 1.5):
        return None
    try:
        spread = np.linalg.inv(np.tril(a) + np.tril(a, -1).T)[:2, :2]
    except np.linalg.LinAlgError:
        return None
    bright = grey > p[5]
    white = float((grey[bright] >= WHITE).mean()) if bright.any() else 0.0
    facts = float(p[4]), noise, contrast, white
    if lens is None:
        return p[:2].copy(), noise**2 * spread + _may_bend(shown, su, sv, p, limit, levels.shape), facts
    found, by_ideal = _distorted(p[:2], lens)
    return found, noise**2 * by_ideal @ spread @ by_ideal.T, facts


def _may_bend(grey: Array, u: Array, v: Array, p: Array, limit: float, shape: tuple[int, ...]) -> Array:
    """The covariance (2, 2) of what a common lens, not known, would move a crossing by: the step of the fit if its pixels were bent."""
    bent, left = bend_of(np.stack([u, v], axis=1), p[None, :2], shape)
    g, a = np.empty(SIZE), np.empty((SIZE, SIZE))
    at_u, at_v = as_kernel_array(u - bent[:, 0], v - bent[:, 1])
    sum_crossing(grey, at_u, at_v, p, limit, g, a)
    moved = left[0] - np.linalg.solve(np.tril(a) + np.tril(a, -1).T, g)[:2]
    return np.asarray(np.outer(moved, moved) + OTHER_LENS**2 * (moved @ moved) / 2 * np.eye(2))


def _distorted(place: Array, lens: Array) -> tuple[Array, Array]:
    """Where a lens shows what would lie at a place (2,) without distortion, and the derivative (2, 2)."""
    found, by, _ = project(np.array([[*((place - lens[2:4]) / lens[:2]), 1.0]]), lens)
    return found[0], by[0, :, :2] / lens[:2]

"""From base to tool along the axes of the joints: what a picture of an arm shows, whatever convention wrote it."""

from __future__ import annotations

import numpy as np

from robocal._types import Array

__all__ = ["line_along", "lines_of_axes"]

PARALLEL = 0.1  # tolerance: sine of the angle below which two axes have no common perpendicular worth drawing


def lines_of_axes(jacobian: Array, end: Array) -> tuple[Array, Array]:
    """A point (m, n, 3) of each joint's axis and its direction (m, n, 3), from the geometric Jacobian (m, 6, n) of the tool at `end`
    (m, 3) m.

        w = rate of turn, v = w x (end - point): point = end - (v x w) / |w|^2

    A sliding joint has a direction and no place: its point is NaN.
    """
    v, w = jacobian[:, :3].swapaxes(1, 2), jacobian[:, 3:].swapaxes(1, 2)
    turn = np.sum(w * w, axis=-1, keepdims=True)
    slides = turn < 1e-12
    with np.errstate(divide="ignore", invalid="ignore"):
        point = np.where(slides, np.nan, end[:, None] - np.cross(v, w) / turn)
        along = np.where(slides, v, w)
        return point, along / np.linalg.norm(along, axis=-1, keepdims=True)


def line_along(points: Array, directions: Array, start: Array, end: Array) -> Array:
    """The way (m, 2 n + 2, 3) from `start` (m, 3) along n axes to `end` (m, 3): on each axis from where the one before is nearest to
    where the next is nearest. Parallel axes are met where the way comes from."""
    way, here = [start], start
    count = points.shape[1]
    for i in range(count):
        d, p = directions[:, i], np.where(np.isnan(points[:, i]), here, points[:, i])
        here = p + np.sum((here - p) * d, axis=1, keepdims=True) * d
        way.append(here)
        if np.isnan(points[:, i]).any():  # a slide goes as far along as what comes behind the slides asks
            reach = np.sum((_behind(points, directions, i, here, end) - here) * d, axis=1)
        elif i + 1 < count:
            e, q = directions[:, i + 1], np.where(np.isnan(points[:, i + 1]), here, points[:, i + 1])
            cosine = np.sum(d * e, axis=1)
            across = 1.0 - cosine**2
            reach = np.sum((q - here) * (d - cosine[:, None] * e), axis=1)
            reach = np.where(across < PARALLEL**2, 0.0, reach / np.maximum(across, PARALLEL**2))
        else:
            reach = np.sum((end - here) * d, axis=1)
        here = here + reach[:, None] * d
        way.append(here)
    return np.stack([*way, end], axis=1)


def _behind(points: Array, directions: Array, slide: int, here: Array, end: Array) -> Array:
    """The point (m, 3) nearest to `here` on the next axis that turns, or the end where none does."""
    for i in range(slide + 1, points.shape[1]):
        p, d = points[:, i], directions[:, i]
        if not np.isnan(p).any():
            return np.asarray(p + np.sum((here - p) * d, axis=1, keepdims=True) * d)
    return end

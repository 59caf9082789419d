"""How space is seen on paper: a camera that looks at the middle of a scene, and the direction from which cables are told
apart best. turn.js uses the same formulas.

    right = (-sin a, cos a, 0)   up = (-sin e cos a, -sin e sin a, cos e)   towards the eye = (cos e cos a, cos e sin a, sin e)

A point with depth d towards an eye at distance D is drawn D / (D - d) times larger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["View", "best", "fitted"]

Array = NDArray[np.float64]
# Planar robots are seen straight on: azimuth and elevation, degrees.
PLANES = {"xz": (-90.0, 0.0), "xy": (-90.0, 90.0)}
AWAY = 3.5  # distance of the eye, in radii of the scene


@dataclass(frozen=True)
class View:
    """Azimuth and elevation in degrees, the point (3,) m that stands at `at` (px), px per m, and the distance of the eye in
    px: infinite for a parallel projection."""

    azimuth: float
    elevation: float
    middle: Array
    at: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0
    eye: float = math.inf

    @property
    def axes(self) -> Array:
        """Rows: right, up, towards the eye."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        sa, ca, se, ce = math.sin(a), math.cos(a), math.sin(e), math.cos(e)
        return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])

    def local(self, points: Array) -> Array:
        """Points (..., 3) m about the middle, in px: what turn.js turns."""
        return np.asarray((np.asarray(points, float) - self.middle) * self.scale)

    def flat(self, points: Array) -> tuple[Array, Array]:
        """Where points (..., 3) m are drawn, (..., 2) px, and how near they are, (...,) px."""
        seen = self.local(points) @ self.axes.T
        near = 1.0 if math.isinf(self.eye) else self.eye / (self.eye - seen[..., 2:])
        return np.asarray(self.at) + seen[..., :2] * near * [1.0, -1.0], seen[..., 2]


def best(middle: Array, start: Array, end: Array) -> View:
    """The direction from which cables from `start` (m, 3) to `end` (m, 3) lie farthest apart on paper, from above.

    Distances between all pairs are taken at quarters of the cables; near ones count most.
    """
    share = np.linspace(0.1, 1.0, 7)[:, None, None]
    points = start + share * (end - start)
    size = float(np.linalg.norm(np.ptp(np.concatenate([start, end]), axis=0))) or 1.0
    i, j = np.triu_indices(len(start), 1)
    found = []
    for elevation in (14.0, 18.0, 22.0, 26.0):
        for azimuth in range(-175, 185, 5):
            view = View(float(azimuth), elevation, middle, eye=AWAY / 2 * size)
            xy, _ = view.flat(points)
            gap = np.linalg.norm(xy[:, i] - xy[:, j], axis=-1) / size
            # Front views in which x goes right and y goes away read most easily; they win where little is lost.
            habit = 0.02 * math.cos(math.radians(azimuth + 60.0))
            found.append((float(np.log(gap + 0.01).mean()) + habit, view))
    return max(found, key=lambda pair: pair[0])[1]


def fitted(view: View, points: Array, box: tuple[float, float, float, float], turning: bool) -> View:
    """The view scaled so that all points (n, 3) m stay inside box (left, top, right, bottom) px; if `turning`, from every
    azimuth."""
    left, top, right, bottom = box
    radius = float(np.linalg.norm(points - view.middle, axis=1).max()) or 1.0
    one = replace(view, scale=1.0, at=(0.0, 0.0), eye=AWAY * radius if turning else math.inf)
    turns = [view.azimuth + t for t in range(0, 360, 15)] if turning else [view.azimuth]
    every = np.concatenate([replace(one, azimuth=t).flat(points)[0] for t in turns])
    low, high = every.min(axis=0), every.max(axis=0)
    low[0], high[0] = (-max(-low[0], high[0]), max(-low[0], high[0])) if turning else (low[0], high[0])
    span = np.maximum(high - low, 1e-9 * radius)
    scale = float(min((right - left) / span[0], (bottom - top) / span[1]))
    middle = (low + high) / 2 * scale
    at = ((left + right) / 2 - float(middle[0]), (top + bottom) / 2 - float(middle[1]))
    return replace(one, scale=scale, at=at, eye=one.eye * scale)

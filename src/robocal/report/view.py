"""How space is seen on paper: a camera that looks at the middle of a scene, and the direction from which cables are separated
best. turn.js uses the same formulas.

    right = (-sin a, cos a, 0)   up = (-sin e cos a, -sin e sin a, cos e)   towards the eye = (cos e cos a, cos e sin a, sin e)

A point with depth d towards an eye at distance D is drawn D / (D - d) times larger.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._record import record, replace
from robocal._types import Array

__all__ = ["PLANES", "Box", "View", "best", "fit_view"]

Box = tuple[float, float, float, float]  # left, top, right, bottom, px
# Planar robots are seen straight on: azimuth and elevation, degrees.
PLANES = {"xz": (-90.0, 0.0), "yz": (0.0, 0.0), "xy": (-90.0, 90.0)}
AWAY = 3.5  # distance of the eye, in radii of the scene


@record
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

    Greatest mean logarithm of the distances between all pairs, taken at seven places along them: near ones count most.
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
            habit = 0.05 * math.cos(math.radians(azimuth + 60.0))
            found.append((float(np.log(gap + 0.01).mean()) + habit, view))
    return max(found, key=lambda pair: pair[0])[1]


def fit_view(view: View, groups: list[tuple[Array, Box]], perspective: bool) -> View:
    """The view with the greatest scale at which all points (n, 3) m of each group stay inside the group's box."""
    every = np.concatenate([points for points, _ in groups])
    radius = float(np.linalg.norm(every - view.middle, axis=1).max()) or 1.0
    one = replace(view, scale=1.0, at=(0.0, 0.0), eye=AWAY * radius if perspective else math.inf)
    places = [(one.flat(points)[0], box) for points, box in groups if len(points)]
    least = np.array([xy.min(axis=0) for xy, _ in places])  # (groups, 2), at scale 1
    most = np.array([xy.max(axis=0) for xy, _ in places])
    start, end = np.split(np.array([box for _, box in places]), 2, axis=1)
    # Every pair of groups, one at the start of its box and one at the end of its own, bounds the scale.
    wide, room = most[None] - least[:, None], end[None] - start[:, None]
    scale = max(float((room[wide > 0] / wide[wide > 0]).min(initial=1e6 / radius)), 0.0)
    x, y = ((np.max(start - scale * least, axis=0) + np.min(end - scale * most, axis=0)) / 2).tolist()
    return replace(one, scale=scale, at=(x, y), eye=one.eye * scale)

"""Markers on a floor, and which of them a camera on a platform shows whole."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.geometry import se3, so3
from robocal.vision.camera import project

__all__ = ["MarkerGrid", "MarkerView", "Sight", "corners_of", "draw_markers", "sightings"]


@record
class MarkerGrid:
    """A grid of (columns, rows) markers on a floor (m): jitter of their places, standard deviations of height (m) and tilt (rad)."""

    grid: tuple[int, int]
    size: tuple[float, float]
    jitter: float
    height: float
    tilt: float


@record
class Sight:
    """What counts as seen: rays below an angle (rad) from the axis, a border (px), sides of a marker above a length (px)."""

    angle: float
    border: float
    side: float


@record(eq=False)
class MarkerView:
    """Marker number `marker` in view number `view`: its corners (4, 2) in px."""

    view: int
    marker: int
    corners: Array


def draw_markers(floor: MarkerGrid, rng: np.random.Generator) -> Array:
    """T_base_marker (M, 4, 4); marker 0 is the one in the middle."""
    place = [(np.arange(k) + 0.5) / k * size - size / 2 for k, size in zip(floor.grid, floor.size, strict=True)]
    xy = np.stack(np.meshgrid(*place, indexing="ij"), axis=-1).reshape(-1, 2)
    count = len(xy)
    tilt = np.column_stack([rng.normal(scale=floor.tilt, size=(count, 2)), np.zeros(count)])
    turn = np.column_stack([np.zeros((count, 2)), rng.uniform(-np.pi, np.pi, count)])
    t = np.tile(np.eye(4), (count, 1, 1))
    t[:, :3, :3] = so3.exp(tilt) @ so3.exp(turn)
    t[:, :2, 3] = xy + rng.uniform(-floor.jitter, floor.jitter, xy.shape)
    t[:, 2, 3] = rng.normal(scale=floor.height, size=count)
    first = int(np.argmin(np.hypot(*xy.T)))
    return np.concatenate([t[[first]], np.delete(t, first, axis=0)])


def corners_of(edge: float) -> Array:
    """Corners of a marker of this edge, (4, 3) m, in the order of detection: as OpenCV has them."""
    return edge / 2 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])


def sightings(
    camera: Array, markers: Array, edge: float, lens: Array, size: Sequence[int], sight: Sight
) -> tuple[MarkerView, ...]:
    """The markers T_base_marker (M, 4, 4) that cameras T_base_camera (k, 4, 4) show whole through a lens (9,), in images of
    (width, height) px."""
    inside = np.einsum("pij,mjk->pmik", se3.inverse(camera), markers)
    points = np.einsum("pmij,cj->pmci", inside[..., :3, :3], corners_of(edge)) + inside[..., None, :3, 3]
    z = np.maximum(points[..., 2], 1e-3)  # tolerance: m, before the camera
    steep = np.hypot(points[..., 0], points[..., 1]) / z < np.tan(sight.angle)
    uv = project(np.concatenate([points[..., :2], z[..., None]], axis=-1), lens)[0]
    whole = ((uv > sight.border) & (uv < np.array(size) - sight.border)).all(axis=-1)
    side = np.linalg.norm(uv - np.roll(uv, 1, axis=2), axis=-1).min(axis=-1)
    good = (steep & whole & (points[..., 2] > 0.1)).all(axis=-1) & (side > sight.side)
    return tuple(MarkerView(int(p), int(m), uv[p, m]) for p, m in np.argwhere(good))

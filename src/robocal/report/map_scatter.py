"""Pictures of how maps of the same markers scatter, over the distance from a reference marker."""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.report.cable.drawing import figure
from robocal.report.numbers import significant
from robocal.report.svg import AxisScale, axes, circles, crosses, label, line, path, polyline
from robocal.vision.map_comparison import MapComparison

__all__ = ["draw_axes", "draw_distances"]

WIDE, HIGH, PANEL = 700.0, 320.0, 190.0  # px
LEFT, RIGHT = 62.0, 14.0
AIR = 1.05  # of what is drawn


def draw_distances(found: MapComparison) -> str:
    """How far the middles of one marker are from one another in every two maps, over its distance from the reference marker."""
    aligned, anchored = (1e3 * v for v in found.pair_distances)
    x = _across(found)
    y = AxisScale(0.0, AIR * float(max(aligned.max(), anchored.max(), 1e-6)), HIGH - 44, 34.0)
    at = np.broadcast_to(found.distance, aligned.shape)
    parts = [
        axes(x, y, "distance from the reference marker, m", "apart, mm"),
        path(crosses(_places(x, y, at, anchored), 2.6), "aside"),
        path(circles(_places(x, y, at, aligned), 2.4), "found"),
        line(WIDE - 330, 16, WIDE - 322, 16, "aside"),
        label(WIDE - 316, 20, "aligned on the reference", "name"),
        path(circles([(WIDE - 152.0, 16.0)], 2.4), "found"),
        label(WIDE - 142, 20, "aligned on all markers", "name"),
    ]
    text = f"{len(found.names)} markers in {len(found.maps)} maps: up to {significant(float(aligned.max()))} mm apart."
    return figure("map scatter", WIDE, HIGH, parts, title="Scatter over distance", text=text)


def draw_axes(found: MapComparison) -> str:
    """What each map has corners off their mean along the axes of the reference marker, with two predicted sigmas."""
    scatter = 1e3 * found.scatter
    reach = np.linalg.norm(found.mean - found.mean[found.names.index(found.reference)].mean(axis=0), axis=2)
    most = AIR * float(np.abs(scatter).max())
    if found.predicted is not None:
        most = max(most, AIR * 2e3 * float(found.predicted.max()))
    most = max(most, 1e-6)
    x, parts = _across(found, reach), []
    order = np.argsort(found.distance)
    for k, axis in enumerate("xyz"):
        y = AxisScale(-most, most, (k + 1) * PANEL - 34, k * PANEL + 24)
        parts.append(axes(x, y, "distance from the reference marker, m" if k == 2 else "", f"{axis}, mm"))
        if found.predicted is not None:
            for sign in (-2e3, 2e3):
                ends = _places(x, y, found.distance[order], sign * found.predicted[order, k])
                parts.append(path(polyline(ends), "axis"))
        at = np.broadcast_to(reach, scatter.shape[:3])
        parts.append(path(circles(_places(x, y, at, scatter[..., k]), 1.9), "found"))
        parts.append(line(x.start, y(0.0), x.end, y(0.0), "axis"))
    sizes = ", ".join(f"{a} {significant(float(np.abs(scatter[..., k]).max()))}" for k, a in enumerate("xyz"))
    text = f"Corners of {len(found.names)} markers in {len(found.maps)} maps: at most {sizes} mm off their mean."
    return figure("map scatter", WIDE, 3 * PANEL + 12, parts, title="Scatter along the axes", text=text)


def _across(found: MapComparison, reach: Array | None = None) -> AxisScale:
    most = float(found.distance.max() if reach is None else reach.max())
    return AxisScale(0.0, AIR * max(most, 1e-6), LEFT, WIDE - RIGHT)


def _places(x: AxisScale, y: AxisScale, at: Array, values: Array) -> list[tuple[float, float]]:
    return list(zip(x.many(at.ravel()).tolist(), y.many(values.ravel()).tolist(), strict=True))

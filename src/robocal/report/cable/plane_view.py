"""A plane of the base on paper: the same scale both ways, axes in the unit of a ruler, and the marks that plane pictures share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.report.cable.drawing import brief
from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.marks import place_labels
from robocal.report.svg import AxisScale, bottom_axis, label, left_axis, num, path

__all__ = ["Plane", "anchors", "cross", "plane"]

LEFT, TOP, FOOT = 60.0, 50.0, 44.0


@dataclass(frozen=True)
class Plane:
    """Two axes of the base (0 x, 1 y, 2 z), their scales in the unit of the ruler, and the size of the picture in px."""

    axes: tuple[int, int]
    x: AxisScale
    y: AxisScale
    width: float
    height: float
    unit: LengthUnit = METRE

    def flat(self, points: Array) -> Array:
        """Where points (n, 3) m are drawn, (n, 2) px."""
        p = np.asarray(points, float).reshape(-1, 3) / self.unit.metres
        return np.array([[self.x(u), self.y(v)] for u, v in p[:, list(self.axes)].tolist()]).reshape(-1, 2)

    def across(self, u: float) -> float:
        """Where a coordinate in m along the first axis is drawn, px."""
        return self.x(u / self.unit.metres)

    def up(self, v: float) -> float:
        """The same along the second."""
        return self.y(v / self.unit.metres)

    @property
    def frame(self) -> str:
        """Axes, grid lines and their titles."""
        i, j = ("xyz"[k] for k in self.axes)
        return (
            bottom_axis(self.x, self.y.start, self.y.end, self.unit.title(i))
            + left_axis(self.y, self.x.start, self.x.end)
            + label(self.x.start - 36, self.y.end - 12, self.unit.title(j), "axis-title")
        )

    def line(self, points: Array, cls: str, closed: bool = False) -> str:
        """Points (n, 3) m joined."""
        xy = self.flat(points).tolist()
        return path("M" + "L".join(f"{num(x)} {num(y)}" for x, y in xy) + ("z" if closed else ""), cls) if xy else ""


def plane(
    axes: tuple[int, int],
    points: Array,
    *,
    right: float = 16.0,
    most: tuple[float, float] = (760.0, 560.0),
    ruler: LengthUnit = METRE,
) -> Plane:
    """The plane that shows all points (n, 3) m with some air, `right` px of room beside it; no larger than `most` px."""
    p = points[:, list(axes)] / ruler.metres
    low, high = p.min(axis=0), p.max(axis=0)
    air = 0.06 * float(max((high - low).max(), 1e-6 / ruler.metres))
    low, high = low - air, high + air
    # What is seen as a line still gets a strip, and words their room.
    short = np.maximum(np.array([0.55, 0.15]) * float((high - low).max()) - (high - low), 0.0) / 2
    low, high = low - short, high + short
    scale = float(min(most[0] / (high[0] - low[0]), most[1] / (high[1] - low[1])))
    wide, tall = scale * float(high[0] - low[0]), scale * float(high[1] - low[1])
    x = AxisScale(float(low[0]), float(high[0]), LEFT, LEFT + wide)
    y = AxisScale(float(low[1]), float(high[1]), TOP + tall, TOP)
    return Plane(axes, x, y, LEFT + wide + right, TOP + tall + FOOT, ruler)


def anchors(robot: CableRobot, at: Plane) -> str:
    """The frame anchors, with the names of all cables that leave the frame where they are seen."""
    xy = at.flat(robot.a)
    groups: list[tuple[Array, list[str]]] = []
    for p, name in zip(xy, robot.cables, strict=True):
        near = next((g for g in groups if np.linalg.norm(g[0] - p) < 10.0), None)
        if near is None:
            groups.append((p, [brief(name)]))
        else:
            near[1].append(brief(name))
    texts = [", ".join(names) for _, names in groups]
    wide = np.array([7.4 * len(text) for text in texts])
    middle = np.array([(at.x.start + at.x.end) / 2, (at.y.start + at.y.end) / 2])
    box = (at.x.start, at.y.end, at.x.end, at.y.start)
    where, side = place_labels(np.array([p for p, _ in groups]), wide, middle, box)
    words = [
        label(x, y, text, "name halo-text", "end" if s < 0 else "start")
        for (x, y), s, text in zip(where.tolist(), side.tolist(), texts, strict=True)
    ]
    squares = "".join(f"M{num(x - 4)} {num(y - 4)}h8v8h-8z" for x, y in xy.tolist())
    return path(squares, "anchor") + "".join(words)


def cross(points: Sequence[Sequence[float]], size: float) -> str:
    """Crosses at points (px) as the text of one path."""
    return "".join(
        f"M{num(x - size)} {num(y - size)}l{num(2 * size)} {num(2 * size)}m0 {num(-2 * size)}l{num(-2 * size)} {num(2 * size)}"
        for x, y in points
    )

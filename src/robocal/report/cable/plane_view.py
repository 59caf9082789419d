"""A plane of the base on paper: the same scale both ways, axes in the unit of a ruler, and the marks that plane pictures share."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.report.cable.drawing import brief
from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.marks import place_labels
from robocal.report.cable.segment_robot import segment_robot
from robocal.report.svg import AxisScale, axes, label, num, path, polyline

__all__ = ["Plane", "anchors", "plane"]

LEFT, TOP, FOOT = 60.0, 50.0, 44.0
HIGHEST = 560.0


@record
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
        return self.place(np.asarray(points, float).reshape(-1, 3)[:, list(self.axes)])

    def place(self, coordinates: Array) -> Array:
        """Where coordinates (..., 2) m along the two axes are drawn, (..., 2) px."""
        u, v = np.moveaxis(coordinates / self.unit.metres, -1, 0)
        return np.stack([self.x.many(u), self.y.many(v)], axis=-1)

    @property
    def frame(self) -> str:
        """Axes, grid lines and their titles."""
        return axes(self.x, self.y, *(self.unit.title("xyz"[k]) for k in self.axes))

    def line(self, points: Array, cls: str, closed: bool = False) -> str:
        """Points (n, 3) m joined."""
        return path(polyline(self.flat(points).tolist(), closed), cls)


def plane(
    shown: tuple[int, int], points: Array, *, right: float = 16.0, widest: float = 760.0, ruler: LengthUnit = METRE
) -> Plane:
    """The plane of the `shown` axes with all points (n, 3) m and some air, `right` px of room beside it; no wider than `widest` px."""
    p = points[:, list(shown)] / ruler.metres
    low, high = p.min(axis=0), p.max(axis=0)
    air = 0.06 * float(max((high - low).max(), 1e-6 / ruler.metres))
    low, high = low - air, high + air
    # What is seen as a line still gets a strip, and words their room.
    short = np.maximum(np.array([0.55, 0.15]) * float((high - low).max()) - (high - low), 0.0) / 2
    low, high = low - short, high + short
    wide, tall = (float((np.array([widest, HIGHEST]) / (high - low)).min()) * (high - low)).tolist()
    (left, bottom), (end, top) = low.tolist(), high.tolist()
    x, y = AxisScale(left, end, LEFT, LEFT + wide), AxisScale(bottom, top, TOP + tall, TOP)
    return Plane(shown, x, y, LEFT + wide + right, TOP + tall + FOOT, ruler)


def anchors(robot: CableRobot, at: Plane) -> str:
    """The frame anchors, with the names of all cables that leave the frame where they are seen."""
    robot = segment_robot(robot)
    xy = at.flat(robot.a)
    groups: dict[int, list[str]] = {}  # by the first of the anchors that are seen in one place
    for p, name in zip(xy, robot.cables, strict=True):
        groups.setdefault(int((np.linalg.norm(xy - p, axis=1) < 10.0).argmax()), []).append(brief(name))
    texts = [", ".join(names) for names in groups.values()]
    wide = np.array([7.4 * len(text) for text in texts])
    middle = np.array([(at.x.start + at.x.end) / 2, (at.y.start + at.y.end) / 2])
    box = (at.x.start, at.y.end, at.x.end, at.y.start)
    where, side = place_labels(xy[list(groups)], wide, middle, box)
    words = [
        label(x, y, text, "name halo-text", "end" if s < 0 else "start")
        for (x, y), s, text in zip(where.tolist(), side.tolist(), texts, strict=True)
    ]
    squares = "".join(f"M{num(x - 4)} {num(y - 4)}h8v8h-8z" for x, y in xy.tolist())
    return path(squares, "anchor") + "".join(words)

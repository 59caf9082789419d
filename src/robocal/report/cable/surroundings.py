"""Where a robot stands: the box of its frame, a floor with squares of a round size, the axes of the base, and from where it is
seen."""

from __future__ import annotations

import math

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.marks import Mark
from robocal.report.svg import AxisScale, axes, nice_ticks, num
from robocal.report.view import PLANES, Box, View, best, fit_view

__all__ = ["Surroundings", "build_surroundings"]

LABELS = 104.0  # px beside an anchor for its name and tension


@record(eq=False)
class Surroundings:
    """The view, the height of the picture (px), what lies below everything (`floor`, with `ticks`), the frame, names that stay at
    their points, a line of words, and whether it can be turned."""

    view: View
    height: float
    floor: tuple[Mark, ...]
    ticks: str
    frame: tuple[Mark, ...]
    names: str
    foot: str
    turns: bool


def build_surroundings(
    robot: CableRobot, ends: Array, others: Array, box: Box, ruler: LengthUnit = METRE
) -> Surroundings:
    """The stage for a robot with platform anchors at `ends` (m, 3) m and `others` (n, 3) m to be shown; no larger than the box.
    Numbers on it are in the unit of the ruler."""
    if robot.planar:
        return _plane(robot, np.concatenate([ends, others]), box, ruler)
    return _spatial(robot, ends, others, box, ruler)


def _plane(robot: CableRobot, others: Array, box: Box, ruler: LengthUnit) -> Surroundings:
    i, j = ("xyz".index(axis) for axis in robot.plane)
    corners = np.repeat(robot.a.mean(axis=0)[None], 4, axis=0)
    corners[:, [i, j]] = _ring(robot.a[:, [i, j]].min(axis=0), robot.a[:, [i, j]].max(axis=0))
    left, top, right, bottom = box[0] + 46, box[1] + 22, box[2] - 10, box[3] - 44
    inner = (left + LABELS, top + 20, right - LABELS, bottom - 20)
    view = View(*PLANES[robot.plane], np.concatenate([robot.a, others]).mean(axis=0))
    near = (left + 14, top + 8, right - 14, bottom - 8)
    view = fit_view(view, [(corners, inner), (others, near)], perspective=False)
    view, bottom = _shift_down(view, np.concatenate([corners, others]), top + 20, bottom - 20)
    bottom += 20
    (x0, y0), size = view.at, view.scale
    across, up = (float(view.middle[k]) / ruler.metres for k in (i, j))
    size *= ruler.metres
    x = AxisScale(across + (left - x0) / size, across + (right - x0) / size, left, right)
    y = AxisScale(up + (y0 - bottom) / size, up + (y0 - top) / size, bottom, top)
    ticks = axes(x, y, *map(ruler.title, robot.plane))
    frame = (Mark(corners, "wire", closed=True, lift=-3e3), *_anchors(robot))
    return Surroundings(view, bottom + 44, (), ticks, frame, "", "", False)


def _shift_down(view: View, points: Array, top: float, bottom: float) -> tuple[View, float]:
    """The view moved up so that the points begin at `top`, and where they end: no taller than needed."""
    y = view.flat(points)[0][:, 1]
    least, most = float(y.min()), float(y.max())
    end = min(max(top + most - least, top + 160.0), bottom)
    x0, y0 = view.at
    return replace(view, at=(x0, y0 + (top + end) / 2 - (least + most) / 2)), end


def _spatial(robot: CableRobot, ends: Array, others: Array, box: Box, ruler: LengthUnit) -> Surroundings:
    every = np.concatenate([robot.a, ends, others])
    low, high = every.min(axis=0), every.max(axis=0)
    wide = max(float(np.ptp(every[:, :2], axis=0).max()), 1e-6)
    # A frame whose anchors hang above the base's zero stands on it.
    if 0.0 < low[2] < 1.5 * max(float(high[2] - low[2]), 0.3 * wide):
        low[2] = 0.0
    step = _step(wide / ruler.metres) * ruler.metres
    near, far = np.floor(low[:2] / step + 0.05) * step, np.ceil(high[:2] / step - 0.05) * step
    floor_low, floor_high = np.minimum(near, low[:2]), np.maximum(far, high[:2])
    ring = _ring(robot.a.min(axis=0), robot.a.max(axis=0))
    corners = np.array([[x, y, z] for z in (low[2], robot.a[:, 2].max()) for x, y in ring])
    ground = np.array([[x, y, low[2]] for x, y in _ring(floor_low, floor_high)])
    origin, at_origin = _origin(low, high)
    arrow = min(0.8 * step, 0.2 * wide)
    tips = origin + 1.18 * arrow * np.eye(3)
    left, top, right, bottom = box
    inner = (left + LABELS, top + 20, right - LABELS, bottom - 20)
    outer = (left + 34, top + 12, right - 34, bottom - 26)
    whole = np.concatenate([corners, ground, ends, others, tips])
    # Numbers stand around the floor, and names beyond them.
    numbered = np.array([[x, y, low[2]] for x, y in _ring(floor_low - 0.25 * step, floor_high + 0.25 * step)])
    half, room = (floor_low + floor_high) / 2, (floor_high - floor_low) / 2 + 0.6 * step
    named = np.array([[*(half + room * way), low[2]] for way in ((-1, 0), (1, 0), (0, -1), (0, 1))])
    groups = [(robot.a, inner), (whole, outer), (numbered, (left + 16, top, right - 16, bottom - 14))]
    groups.append((named, (left + 24, top, right - 24, bottom - 14)))
    view = fit_view(best((low + high) / 2, robot.a, ends), groups, perspective=True)
    view, end = _shift_down(view, np.concatenate([whole, robot.a, numbered, named]), top + 14, bottom - 26)
    frame = [Mark(corners[[s + k, s + (k + 1) % 4]], "wire", lift=-1.0) for s in (0, 4) for k in range(4)]
    frame += [Mark(np.linspace(corners[k], corners[4 + k], 5)[s : s + 2], "wire") for k in range(4) for s in range(4)]
    frame += [Mark(np.array([origin, origin + arrow * axis]), f"axis-{'xyz'[k]}") for k, axis in enumerate(np.eye(3))]
    z, unit = [ruler.text(float(v), 2) for v in (low[2], robot.a[:, 2].min(), robot.a[:, 2].max())], ruler.name
    foot = f"floor at z = {z[0]} {unit}, squares of {ruler.tick(step)} {unit}; "
    foot += f"frame anchors z = {z[1]} to {z[2]} {unit}"
    if not at_origin:
        foot += "; base origin outside, its axes at a corner"
    floor = (Mark(ground, "ground", closed=True), *_grid(floor_low, floor_high, float(low[2]), step))
    names = "".join(_place_label(view, p, name, f"strong name-{name}") for p, name in zip(tips, "xyz", strict=True))
    ticks = _numbers(floor_low, floor_high, float(low[2]), step, view, ruler)
    return Surroundings(view, end + 60, floor, ticks, (*frame, *_anchors(robot)), names, foot, True)


def _anchors(robot: CableRobot) -> tuple[Mark, ...]:
    return tuple(
        Mark(p[None], "anchor", size=4.0, lift=8.0, hint=name) for p, name in zip(robot.a, robot.cables, strict=True)
    )


def _origin(low: Array, high: Array) -> tuple[Array, bool]:
    """Where the axes of the base are drawn: at its origin, or at a corner where that lies far outside."""
    air = 0.25 * float((high - low).max())
    inside = bool(((low - air <= 0.0) & (high + air >= 0.0)).all())
    return (np.zeros(3), True) if inside else (low.copy(), False)


def _ring(low: Array, high: Array) -> list[tuple[float, float]]:
    return [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]


def _step(size: float) -> float:
    ticks = nice_ticks(0.0, size, 5)
    return ticks[1] - ticks[0] if len(ticks) > 1 else size


def _lines(low: float, high: float, step: float) -> list[float]:
    return [k * step for k in range(math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6) + 1)]


def _grid(low: Array, high: Array, z: float, step: float) -> list[Mark]:
    out = [Mark(np.array([[x, low[1], z], [x, high[1], z]]), "grid") for x in _lines(low[0], high[0], step)]
    return out + [Mark(np.array([[low[0], y, z], [high[0], y, z]]), "grid") for y in _lines(low[1], high[1], step)]


def _numbers(low: Array, high: Array, z: float, step: float, view: View, ruler: LengthUnit) -> str:
    """Numbers and names along the edges of the floor; those of edges away from the viewer are hidden."""
    out = []
    for k in (0, 1):
        for side, edge in ((-1.0, low[1 - k]), (1.0, high[1 - k])):
            normal = np.zeros(3)
            normal[1 - k] = side
            words = [(v, 0.25, ruler.tick(v), "tick") for v in _lines(low[k], high[k], step)]
            words.append(((low[k] + high[k]) / 2, 0.6, ruler.title("xy"[k]), "axis-title"))
            for v, beyond, text, cls in words:
                p = np.full(3, z)
                p[k], p[1 - k] = v, edge + beyond * step * side
                out.append(_place_label(view, p, text, cls, normal))
    return "".join(out)


def _place_label(view: View, at: Array, text: str, cls: str, normal: Array | None = None) -> str:
    """Words that stay at their point; with a normal, only while that looks towards the viewer."""
    x, y = view.flat(at)[0].tolist()
    data = " ".join(num(c) for c in view.local(at).tolist())
    side = "" if normal is None else f' data-n="{num(normal[0])} {num(normal[1])}"'
    hidden = "" if normal is None or float(view.axes[2] @ normal) > 0.0 else ' visibility="hidden"'
    return f'<text class="{cls}" x="{num(x)}" y="{num(y + 4)}" text-anchor="middle"{hidden}{side} data-p="{data}">{text}</text>'

"""Where a robot stands: the box of its frame, a floor with squares of a round size, the axes of the base, and from where it is
seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.report.cable.marks import Mark
from robocal.report.cable.view import PLANES, View, best, fitted
from robocal.report.numbers import fixed
from robocal.report.svg import Scale, bottom_axis, left_axis, nice_ticks, num, tick_text

__all__ = ["Stage", "stage"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stage:
    """The view, what lies below everything (`floor`, with `ticks`), the frame, a line of words, and whether it can be turned."""

    view: View
    floor: tuple[Mark, ...]
    ticks: str
    frame: tuple[Mark, ...]
    foot: str
    turns: bool


def stage(robot: CableRobot, ends: Array, others: Array, box: tuple[float, float, float, float]) -> Stage:
    """The stage for a robot with platform anchors at `ends` (m, 3) m and `others` (n, 3) m to be shown, inside box (left, top,
    right, bottom) px."""
    every = np.concatenate([robot.a, ends, others])
    return _spatial(robot, ends, every, box) if robot.degrees == "3R3T" else _plane(robot, every, box)


def _plane(robot: CableRobot, every: Array, box: tuple[float, float, float, float]) -> Stage:
    azimuth, elevation = PLANES[robot.plane]
    i, j = (0, 1) if robot.plane == "xy" else (0, 2)
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    corners = np.repeat(((low + high) / 2)[None], 4, axis=0)
    corners[:, i], corners[:, j] = np.array([low, high, high, low])[:, i], np.array([low, low, high, high])[:, j]
    view = fitted(View(azimuth, elevation, every.mean(axis=0)), np.concatenate([every, corners]), box, turning=False)
    left, top, right, bottom = box[0] - 56, box[1] - 14, box[2] + 96, box[3] + 8
    at, size = np.asarray(view.at), view.scale
    x = Scale(
        float(view.middle[i] + (left - at[0]) / size), float(view.middle[i] + (right - at[0]) / size), left, right
    )
    y = Scale(
        float(view.middle[j] + (at[1] - bottom) / size), float(view.middle[j] + (at[1] - top) / size), bottom, top
    )
    axes = bottom_axis(x, bottom, top, f"{'xyz'[i]}, m") + left_axis(y, left, right, f"{'xyz'[j]}, m")
    frame = [Mark(corners, "wire", closed=True, lift=-3e3)]
    frame += [Mark(p[None], "anchor", size=4.0, lift=8.0) for p in robot.a]
    return Stage(view, (), axes, tuple(frame), "", False)


def _spatial(robot: CableRobot, ends: Array, every: Array, box: tuple[float, float, float, float]) -> Stage:
    low, high = every.min(axis=0), every.max(axis=0)
    tall = float(high[2] - low[2])
    # A frame whose anchors hang above the base's zero stands on it.
    if 0.0 < low[2] < 1.5 * max(tall, 0.3 * float(np.ptp(every[:, :2], axis=0).max())):
        low[2] = 0.0
    step = _step(float(max(np.ptp(every[:, :2], axis=0).max(), 1e-6)))
    floor_low, floor_high = np.floor(low[:2] / step - 1e-9) * step, np.ceil(high[:2] / step + 1e-9) * step
    a_low, a_high = robot.a.min(axis=0), robot.a.max(axis=0)
    a_low[2] = low[2]
    corners = np.array([[x, y, z] for z in (a_low[2], a_high[2]) for x, y in _ring(a_low, a_high)])
    ground = np.array([[x, y, low[2]] for x, y in _ring(floor_low, floor_high)])
    middle = (low + high) / 2
    points = np.concatenate([every, corners, ground])
    view = fitted(best(middle, robot.a, ends), points, box, turning=True)
    frame = [Mark(corners[[k, (k + 1) % 4]], "wire", lift=-1.0) for k in range(4)]
    frame += [Mark(corners[[4 + k, 4 + (k + 1) % 4]], "wire", lift=-1.0) for k in range(4)]
    frame += [Mark(np.linspace(corners[k], corners[4 + k], 5)[s : s + 2], "wire") for k in range(4) for s in range(4)]
    frame += [Mark(p[None], "anchor", size=4.0, lift=8.0) for p in robot.a]
    sides = " × ".join(fixed(v, 2) for v in (high - low).tolist())
    foot = (
        f"floor: squares of {tick_text(step)} m at z = {fixed(low[2], 2)} m; all that is drawn: {sides} m (x × y × z)"
    )
    floor = [Mark(ground, "ground", closed=True), *_grid(floor_low, floor_high, float(low[2]), step)]
    return Stage(
        view,
        (*floor, *_triad(low, high, step)),
        _numbers(floor_low, floor_high, float(low[2]), step, view),
        tuple(frame),
        foot,
        True,
    )


def _ring(low: Array, high: Array) -> list[tuple[float, float]]:
    return [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]


def _step(size: float) -> float:
    ticks = nice_ticks(0.0, size, 6)
    return ticks[1] - ticks[0] if len(ticks) > 1 else size


def _lines(low: float, high: float, step: float) -> list[float]:
    return [round(low / step) * step + k * step for k in range(round((high - low) / step) + 1)]


def _grid(low: Array, high: Array, z: float, step: float) -> list[Mark]:
    out = [Mark(np.array([[x, low[1], z], [x, high[1], z]]), "grid") for x in _lines(low[0], high[0], step)]
    return out + [Mark(np.array([[low[0], y, z], [high[0], y, z]]), "grid") for y in _lines(low[1], high[1], step)]


def _triad(low: Array, high: Array, step: float) -> list[Mark]:
    """The axes of the base at its origin."""
    return [Mark(np.array([np.zeros(3), 0.8 * step * axis]), f"axis-{'xyz'[k]}") for k, axis in enumerate(np.eye(3))]


def _numbers(low: Array, high: Array, z: float, step: float, view: View) -> str:
    """Numbers along the edges of the floor; those of edges away from the viewer are hidden."""
    out = []
    for k in (0, 1):
        for side, edge in ((-1.0, low[1 - k]), (1.0, high[1 - k])):
            normal = np.zeros(3)
            normal[1 - k] = side
            shown = float(view.axes[2] @ normal) > 0.0
            for v in _lines(low[k], high[k], step):
                p = np.zeros(3)
                p[k], p[1 - k], p[2] = v, edge + 0.22 * step * side, z
                x, y = view.flat(p)[0].tolist()
                data = " ".join(num(c) for c in view.local(p).tolist())
                hidden = "" if shown else ' visibility="hidden"'
                out.append(
                    f'<text class="tick floor" x="{num(x)}" y="{num(y + 4)}" text-anchor="middle"{hidden} data-p="{data}" '
                    f'data-n="{num(normal[0])} {num(normal[1])}">{tick_text(v)}</text>'
                )
    return "".join(out)

"""The machine beside its measurements: the shape that result.json holds, placed in a picture of space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.report.numbers import significant

__all__ = ["HALF", "Region3D", "RobotLines", "box_of", "place_robots", "space_around"]

HALF = 200.0  # px: half of the drawn space, from the middle to the farthest corner
FARTHEST = 2.4  # radii of the measured box that a picture shows around it: beyond, arrows would be specks
NEAR = 1e-3  # of the picture's radius; points nearer than that are one


@record(eq=False)
class Region3D:
    """The part of space that a picture shows: its middle (3,) mm and its radius in mm."""

    middle: Array
    radius: float


@record(eq=False)
class RobotLines:
    """Lines and dots in mm about the middle, times a scale: `arm` and `cables` are lines (k, 3), `joints` dots (n, 3); `rays` (k, 3)
    lead towards instruments, whose `names` stand at `ends` (k, 3). `caption` says what is drawn."""

    arm: tuple[Array, ...]
    cables: tuple[Array, ...]
    joints: Array
    rays: tuple[Array, ...]
    ends: Array
    names: tuple[str, ...]
    caption: str


def box_of(shapes: Sequence[Any]) -> Array:
    """The ends (2, 3) mm of all lines of some shapes."""
    points = np.concatenate([np.array(line.points) for shape in shapes for line in shape.lines])
    return np.stack([points.min(axis=0), points.max(axis=0)])


def space_around(box: Array, shapes: Sequence[Any]) -> Region3D:
    """What to show of a machine around the box (2, 3) mm of its measurements: all of it, where the box stays large enough."""
    middle, own = box.mean(axis=0), float(np.linalg.norm(box[1] - box[0])) / 2
    if not shapes:
        return Region3D(middle, own)
    ends = np.concatenate([box, box_of(shapes)])
    low, high = ends.min(axis=0), ends.max(axis=0)
    whole = float(np.linalg.norm(high - low)) / 2
    if own <= 0:
        return Region3D((low + high) / 2, whole)
    radius = min(whole, FARTHEST * own)
    gap = (low + high) / 2 - middle
    share = min(1.0, (radius - own) / max(float(np.linalg.norm(gap)), 1e-12))
    return Region3D(middle + share * gap, radius)


def place_robots(shapes: Sequence[Any], space: Region3D) -> tuple[RobotLines, ...]:
    """The lines of shapes (mm) in a picture; an instrument beyond the space gets a ray that leads to it."""
    scale = HALF / space.radius if space.radius > 0 else 1.0
    return tuple(_place(shape, space, scale) for shape in shapes)


def _place(shape: Any, space: Region3D, scale: float) -> RobotLines:
    lines = [(np.array(line.points) - space.middle) * scale for line in shape.lines]
    tool = (np.array(shape.tool) - space.middle) * scale
    reach = space.radius * scale
    driven = [_simplify(line, NEAR * reach) for line, told in zip(lines, shape.lines, strict=True) if not told.name]
    cables = [line for line, told in zip(lines, shape.lines, strict=True) if told.name]
    spokes = [np.stack([tool, line[0]]) for line in cables]
    joints = np.concatenate([*(line[1:-1] for line in driven), *cables, np.empty((0, 3))])
    rays, ends, names = [], [], []
    for told in shape.instruments:
        at = (np.array(told.points[0]) - space.middle) * scale
        away = float(np.linalg.norm(at))
        if away <= reach:
            rays.append(at[None])
            names.append(told.name)
        else:
            way = at / away
            rays.append(np.stack([0.8 * reach * way, reach * way]))
            names.append(f"{told.name}, {significant(away / scale / 1e3, 2)} m away")
        ends.append(rays[-1][-1])
    what = "platform with its cables" if cables else "arm along the axes of its joints"
    caption = f"The {what} is drawn as found, at {shape.configuration}."
    return RobotLines(
        (*driven, *spokes), tuple(cables), joints, tuple(rays), np.array(ends).reshape(-1, 3), tuple(names), caption
    )


def _simplify(line: Array, least: float) -> Array:
    """A line (k, 3) without points that lie on the one before."""
    kept = [line[0]]
    for point in line[1:]:
        if np.linalg.norm(point - kept[-1]) > least:
            kept.append(point)
    return np.array(kept)

"""A cable robot at a pose: frame, platform and cables coloured by tension; on request the surface of a workspace and poses.

Spatial robots are drawn in perspective from the side that keeps their cables apart, planar ones in their plane.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import replace
from robocal._types import Array
from robocal.cables.boundary import Outline, Surface
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.report.cable.drawing import brief, figure
from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.marks import Mark, draw, labels
from robocal.report.cable.scene_rows import SceneRows, row_data, some_rows
from robocal.report.cable.segment_robot import of_segments, segment_robot
from robocal.report.cable.solids import courses, decimate, hull_loops, wheels
from robocal.report.cable.surroundings import Surroundings, build_surroundings
from robocal.report.cable.tension_colours import STATES, ColouredTensions, colour_tensions, of_each_cable
from robocal.report.numbers import significant
from robocal.report.svg import label, num, path

__all__ = ["scene"]

WIDE, HIGH, SIDE = 940.0, 640.0, 132.0
MOST_POSES = 1500
LIGHT = np.array([0.30, -0.45, 0.84])
Boundary: TypeAlias = "Surface | Outline | None"


def scene(
    robot: CableRobot,
    pose: ArrayLike,
    *,
    tension: ArrayLike | None = None,
    surface: Boundary = None,
    poses: ArrayLike | None = None,
    ghosts: ArrayLike | None = None,
    rows: SceneRows | None = None,
    caption: str = "",
    ruler: LengthUnit = METRE,
) -> str:
    """The picture (SVG) of a robot at pose (4, 4).

    tension (m,) N, NaN for none: colours the cables, and tells slack ones and those over their limits; without it they are plain.
    surface: the boundary of a workspace, or the outline of a section. poses (n, 4, 4): where else the platform stands; the first
    1500 are drawn. ghosts (k, 4, 4): platforms in outline, their origins joined to the pose's in order: the first before it, the others
    behind it. rows: poses, the drawn one among them, through which a slider leads on a page with scripts.
    Numbers are in the unit of the ruler. Raises ModelError for shapes that do not fit.
    """
    of = robot.segments.cable[of_segments(robot)]
    pull, robot = None if tension is None else of_each_cable(robot, tension)[of], segment_robot(robot)
    if rows is not None and rows.tension is not None:
        rows = replace(rows, tension=rows.tension[:, of])
    at = np.asarray(pose, float)
    if at.shape != (4, 4) or not np.isfinite(at).all():
        raise ModelError("a pose to be drawn", expected="(4, 4), finite", found=at.shape)
    held = None if pull is None else colour_tensions(robot, pull)
    cloud = np.zeros((0, 3)) if poses is None else np.asarray(poses, float).reshape(-1, 4, 4)[:, :3, 3]
    spots = cloud[np.isfinite(cloud).all(axis=1)][:MOST_POSES]
    ends = at[:3, 3] + robot.b @ at[:3, :3].T
    pale = np.zeros((0, 4, 4)) if ghosts is None else np.asarray(ghosts, float).reshape(-1, 4, 4)
    beside = pale[:, None, :3, 3] + robot.b @ pale[:, :3, :3].swapaxes(1, 2)
    right = WIDE - (SIDE if held is not None else 0.0)
    top = 34.0 if caption else 8.0
    led = None if rows is None or len(rows.poses) < 2 else some_rows(rows)
    reached = (
        np.zeros((0, 3)) if led is None else (led.poses[:, None, :3, 3] + robot.b @ led.poses[:, :3, :3].swapaxes(1, 2))
    )
    others = np.concatenate([_around(surface), spots, beside.reshape(-1, 3), reached.reshape(-1, 3)])
    seen = build_surroundings(robot, ends, others, (0.0, top, right, HIGH), ruler)
    marks = [
        *_platform(robot, ends, at),
        *_cables(robot, ends, held, led is not None),
        *_boundary(surface, behind=not seen.turns),
        *(Mark(p[None], "spot", size=1.7) for p in spots),
        *_ghosts(beside, pale[:, :3, 3], at[:3, 3]),
        *seen.frame,
    ]
    words = [(brief(name), "" if held is None else held.describe(i)) for i, name in enumerate(robot.cables)]
    parts = [
        label(14, 22, brief(caption, 120), "strong caption") if caption else "",
        f'<g data-part="floor">{draw(seen.floor, seen.view, ordered=False)}{seen.ticks}</g>',
        f'<g data-part="marks">{draw(marks, seen.view)}</g>',
        f'<g data-part="names">{labels(robot.a, words, seen.view, (4.0, top, right, seen.height - 22))}{seen.names}</g>',
    ]
    if held is not None:
        parts += [held.scale(robot.cables, WIDE - SIDE + 26, *_bar_ends(held, seen.height)), _legend(held, seen.height)]
    if seen.foot:
        parts.append(label(14, seen.height - 14, seen.foot, "tick"))
    said = _describe(robot, held, surface, len(spots), len(pale), caption)
    title = caption or f"{robot.name} at a pose"
    more = _camera(seen, right, top) if seen.turns or led is not None else ""
    if led is not None:
        more += row_data(robot, led, seen.view, _notch(held, seen.height))
    return figure("scene", WIDE, seen.height, parts, title=title, text=said, more=more)


def _bar_ends(held: ColouredTensions, height: float) -> tuple[float, float]:
    """Top and bottom of the colour scale, px."""
    return 66.0, height - (130.0 if _legend(held, height) else 50.0)


def _notch(held: ColouredTensions | None, height: float) -> Callable[[float], float | None]:
    """Where a tension stands on the colour scale, px; None of one that is not known."""
    if held is None:
        return lambda value: None
    top, bottom = _bar_ends(held, height)
    return lambda value: None if np.isnan(value) else round(held.height_of(value, top, bottom), 1)


def _camera(seen: Surroundings, right: float, top: float) -> str:
    """What turn.js needs to know."""
    v = seen.view
    # A parallel projection stays as it is.
    eye, still = (num(v.eye), "") if seen.turns else ("1e9", ' data-still=""')
    return (
        f' data-eye="{eye}"{still} data-view="{num(v.azimuth)} {num(v.elevation)}" data-at="{num(v.at[0])} {num(v.at[1])}" '
        f'data-room="{num(right)} {num(seen.height)} {num(top)}"'
    )


def _around(surface: Boundary) -> Array:
    """What must stay inside the picture for a boundary."""
    if surface is None:
        return np.zeros((0, 3))
    found = surface.points if isinstance(surface, Outline) else surface.vertices[np.unique(surface.faces)]
    return np.asarray(found, float).reshape(-1, 3)


def _platform(robot: CableRobot, ends: Array, at: Array) -> Iterator[Mark]:
    loops = hull_loops(ends)
    where = [
        f' data-b="{" ".join(str(int(np.linalg.norm(ends - p, axis=1).argmin())) for p in loop)}"' for loop in loops
    ]
    for loop, more in zip(loops, where, strict=True):
        if len(loop) > 2:
            # A plate has two sides, and the one that is seen is lit.
            shade = _shades(loop[None])[0] if len(loops) > 1 else 6
            yield Mark(loop, f"body b{shade}", closed=True, more=more)
        elif len(loop) == 2:
            yield Mark(loop, "body rod", more=more)
    for i, p in enumerate(ends):
        yield Mark(p[None], "joint", size=2.4, lift=3.0, more=f' data-b="{i}"')
    yield Mark(at[None, :3, 3], "origin", size=2.2, lift=6.0, more=' data-o=""')


def _shades(corners: Array) -> list[int]:
    """How bright faces (f, n, 3) are, 0 to 7, by the side that they turn to the light."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    lit = np.where(size > 0.0, normal @ LIGHT / np.where(size > 0.0, size, 1.0), 0.0)
    found: list[int] = np.clip(np.round(3.5 + 3.5 * lit), 0, 7).astype(int).tolist()
    return found


def _cables(robot: CableRobot, ends: Array, held: ColouredTensions | None, moves: bool) -> Iterator[Mark]:
    for i, (name, points) in enumerate(zip(robot.cables, courses(robot, ends), strict=True)):
        state = "plain" if held is None else held.state(i)
        colour = f' stroke="{held.colour(i)}"' if held is not None and state != "none" else ""
        hint = name if held is None else f"{name}: {held.describe(i)}"
        for k in range(len(points) - 1):
            # What carries no load is drawn with gaps.
            bare = bool(k % 2) and state in ("slack", "none")
            if bare and not moves:
                continue
            more = f' data-c="{i} {k}"{" visibility=" + chr(34) + "hidden" + chr(34) if bare else ""}' if moves else ""
            yield Mark(points[k : k + 2], "gap", lift=-0.5, more=more)
            yield Mark(points[k : k + 2], f"rope {state}", more=f'{more} data-cable="{i + 1}"{colour}', hint=hint)
    for i, rim in enumerate(wheels(robot, ends)):
        yield Mark(rim, "pulley", more=f' data-r="{i}"')


def _boundary(surface: Boundary, behind: bool) -> Iterator[Mark]:
    if isinstance(surface, Outline) and len(surface.points):
        # The marks of a planar robot are all as near: its workspace goes behind them.
        yield Mark(np.asarray(surface.points, float), "edge", closed=True, lift=-2e3 if behind else 0.0)
    elif isinstance(surface, Surface) and len(surface.faces):
        vertices, faces = decimate(surface)
        corners = vertices[faces]
        for triangle, shade in zip(corners, _shades(corners), strict=True):
            yield Mark(triangle, f"face s{shade}", closed=True)


def _ghosts(ends: Array, origins: Array, here: Array) -> Iterator[Mark]:
    """Platforms in outline, and the way through them."""
    for corners in ends:
        for loop in hull_loops(corners):
            yield Mark(loop, "ghost", closed=len(loop) > 2)
    if len(origins):
        yield Mark(np.concatenate([origins[:1], here[None], origins[1:]]), "passage", lift=4.0)


def _legend(held: ColouredTensions, height: float) -> str:
    """The states that occur, beside the colour scale."""
    parts = []
    for row, state in enumerate(s for s in STATES if s != "held" and s in held.states):
        x, y = WIDE - SIDE + 16, height - 78 + 20 * row
        parts.append(path(f"M{num(x)} {num(y)}h{'22' if state == 'over' else '7m8 0h7'}", f"rope {state} key"))
        parts.append(label(x + 30, y + 4, STATES[state], "name"))
    return "".join(parts)


def _describe(
    robot: CableRobot, held: ColouredTensions | None, surface: Boundary, cloud: int, pale: int, caption: str
) -> str:
    """The picture in words."""
    parts = [f"{robot.name}: {len(robot.cables)} cables, {robot.degrees}."]
    if held is not None:
        known: Sequence[float] = held.values[np.isfinite(held.values)].tolist()
        if len(known):
            parts.append(f"Tensions from {significant(min(known))} to {significant(max(known))} N.")
        for state, word in STATES.items():
            those = [n for n, s in zip(robot.cables, held.states, strict=True) if s == state != "held"]
            if those:
                parts.append(f"{word.capitalize()}: {', '.join(those)}.")
    if isinstance(surface, Surface) and len(surface.faces):
        parts.append(f"The workspace seen from its start has {significant(surface.volume)} m³.")
    if isinstance(surface, Outline) and len(surface.points):
        parts.append(f"The section of the workspace seen from its start has {significant(surface.area)} m².")
    if cloud:
        parts.append(f"{cloud} other poses.")
    if pale:
        parts.append(f"{pale} other platforms in outline, joined by the way.")
    return " ".join(parts) if not caption else f"{caption}. {' '.join(parts)}"

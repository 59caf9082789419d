"""A cable robot at a pose: frame, platform and cables coloured by tension; on request the surface of a workspace and poses.

Spatial robots are drawn in perspective from the side that keeps their cables apart, planar ones in their plane.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.cables.boundary import Outline, Surface
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.report.cable.marks import Mark, draw, labels
from robocal.report.cable.paint import brief, figure
from robocal.report.cable.solids import hull_loops, thinned
from robocal.report.cable.stage import Stage, stage
from robocal.report.cable.tension import STATES, Tensions, tensions_of
from robocal.report.numbers import significant
from robocal.report.svg import label, num

__all__ = ["scene"]

Array = NDArray[np.float64]
WIDE, HIGH, SIDE = 940.0, 600.0, 128.0
PIECES = 24  # of a cable, so that what lies around it can hide a part of it
MOST_POSES = 1500
LIGHT = np.array([0.30, -0.45, 0.84])


def scene(
    robot: CableRobot,
    pose: ArrayLike,
    *,
    tension: ArrayLike | None = None,
    surface: Surface | Outline | None = None,
    poses: ArrayLike | None = None,
    caption: str = "",
) -> str:
    """The picture (SVG) of a robot at pose (4, 4).

    tension (m,) N, NaN for none: colours the cables, and tells slack ones and those over their limits; without it they are plain.
    surface: the boundary of a workspace, or the outline of a section. poses (n, 4, 4): where else the platform stands.
    Raises ModelError for shapes that do not fit.
    """
    at = np.asarray(pose, float)
    m = len(robot.cables)
    if at.shape != (4, 4) or not np.isfinite(at).all():
        raise ModelError("a pose to be drawn", expected="(4, 4), finite", found=at.shape)
    values = None if tension is None else np.asarray(tension, float)
    if values is not None and values.shape != (m,):
        raise ModelError("tensions to be drawn", expected=f"one per cable, ({m},)", found=values.shape)
    cloud = np.zeros((0, 3)) if poses is None else np.asarray(poses, float).reshape(-1, 4, 4)[:MOST_POSES, :3, 3]
    held = None if values is None else tensions_of(values, robot.limits)
    around = _outlined(surface)
    ends = at[:3, 3] + robot.b @ at[:3, :3].T
    right = WIDE - (SIDE if held is not None else 0.0)
    seen = stage(robot, ends, np.concatenate([around, cloud]), (110.0, 30.0, right - 110.0, HIGH - 52.0))
    marks = [*_platform(ends, at), *_cables(robot, ends, held), *_boundary(surface, seen), *_cloud(cloud)]
    parts = [
        f'<g data-part="floor">{draw(seen.floor, seen.view, ordered=False)}{seen.ticks}</g>',
        f'<g data-part="marks">{draw([*marks, *seen.frame], seen.view)}</g>',
        f'<g data-part="names">{labels(robot.a, _words(robot, held), seen.view, right, HIGH)}</g>',
    ]
    if held is not None:
        parts += [held.scale(robot.cables, WIDE - SIDE + 24, 60.0, HIGH - 150.0), _legend(held)]
    if seen.foot:
        parts.append(label(14, HIGH - 12, seen.foot, "tick"))
    said = _said(robot, held, surface, len(cloud), caption)
    text = figure("scene", WIDE, HIGH, parts, title=caption or f"{robot.name} at a pose", text=said)
    return text.replace("<svg ", f"<svg {_camera(seen)} ", 1) if seen.turns else text


def _camera(seen: Stage) -> str:
    """What turn.js needs to know."""
    v = seen.view
    return f'data-eye="{num(v.eye)}" data-view="{num(v.azimuth)} {num(v.elevation)}" data-at="{num(v.at[0])} {num(v.at[1])}"'


def _outlined(surface: Surface | Outline | None) -> Array:
    if surface is None:
        return np.zeros((0, 3))
    found = surface.points if isinstance(surface, Outline) else surface.vertices
    return np.asarray(found, float).reshape(-1, 3)


def _platform(ends: Array, at: Array) -> Iterator[Mark]:
    for loop in hull_loops(ends):
        if len(loop) > 2:
            normal = np.cross(loop[1] - loop[0], loop[2] - loop[0])
            size = float(np.linalg.norm(normal))
            shade = round(3.5 + 3.5 * float(normal @ LIGHT) / size) if size > 0 else 4
            yield Mark(loop, f"body p{min(max(shade, 0), 7)}", closed=True)
        elif len(loop) == 2:
            yield Mark(loop, "body rod")
    for p in ends:
        yield Mark(p[None], "joint", size=2.6, lift=3.0)
    yield Mark(at[None, :3, 3], "origin", size=2.2, lift=6.0)


def _cables(robot: CableRobot, ends: Array, held: Tensions | None) -> Iterator[Mark]:
    share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    for i, name in enumerate(robot.cables):
        points = ends[i] + share * (robot.a[i] - ends[i])
        state = "plain" if held is None else held.state(i)
        colour = f' stroke="{held.colour(i)}"' if held is not None and state != "none" else ""
        hint = name if held is None else f"{name}: {held.said(i)}"
        more = f' data-cable="{i + 1}"{colour}'
        for k in range(PIECES):
            # What carries no load is drawn with gaps.
            if k % 2 and state in ("slack", "none"):
                continue
            yield Mark(points[k : k + 2], "gap", lift=-0.5)
            yield Mark(points[k : k + 2], f"rope {state}", more=more, hint=hint)


def _boundary(surface: Surface | Outline | None, seen: Stage) -> Iterator[Mark]:
    if isinstance(surface, Outline) and len(surface.points):
        yield Mark(np.asarray(surface.points, float), "edge", closed=True, lift=-2.0 * max(WIDE, HIGH))
    elif isinstance(surface, Surface) and len(surface.faces):
        vertices, faces = thinned(surface)
        x = vertices[faces]
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        size = np.linalg.norm(normal, axis=1)
        lit = np.where(size > 0, normal @ LIGHT / np.where(size > 0, size, 1.0), 0.0)
        shade = np.clip(np.round(3.5 + 3.5 * lit), 0, 7).astype(int)
        for corners, s in zip(x, shade.tolist(), strict=True):
            yield Mark(corners, f"face s{s}", closed=True)


def _cloud(points: Array) -> Iterator[Mark]:
    for p in points:
        yield Mark(p[None], "spot", size=1.6)


def _words(robot: CableRobot, held: Tensions | None) -> list[tuple[str, str]]:
    return [(brief(name), "" if held is None else held.said(i)) for i, name in enumerate(robot.cables)]


def _legend(held: Tensions) -> str:
    """The states that occur, beside the colour scale."""
    found = [s for s in STATES if s != "held" and any(held.state(i) == s for i in range(len(held.values)))]
    parts = []
    for row, state in enumerate(found):
        y = HIGH - 112 + 20 * row
        x = WIDE - SIDE + 16
        parts.append(f'<path class="rope {state}" d="M{num(x)} {num(y)}h8m6 0h8"/>')
        parts.append(label(x + 30, y + 4, STATES[state], "name"))
    return "".join(parts)


def _said(robot: CableRobot, held: Tensions | None, surface: Surface | Outline | None, cloud: int, caption: str) -> str:
    """The picture in words."""
    parts = [f"{robot.name}: {len(robot.cables)} cables, {robot.degrees}."]
    if held is not None:
        known: Sequence[float] = held.values[np.isfinite(held.values)].tolist()
        if len(known):
            parts.append(f"Tensions from {significant(min(known))} to {significant(max(known))} N.")
        for state, word in STATES.items():
            those = [n for i, n in enumerate(robot.cables) if state != "held" and held.state(i) == state]
            if those:
                parts.append(f"{word.capitalize()}: {', '.join(those)}.")
    if isinstance(surface, Surface) and len(surface.faces):
        parts.append(f"The workspace seen from its start has {significant(surface.volume)} m³.")
    if isinstance(surface, Outline) and len(surface.points):
        parts.append(f"The section of the workspace seen from its start has {significant(surface.area)} m².")
    if cloud:
        parts.append(f"{cloud} other poses.")
    return " ".join(parts) if not caption else f"{caption}. {' '.join(parts)}"

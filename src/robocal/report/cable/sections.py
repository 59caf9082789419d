"""A plane section of a workspace: margins as colours with their zero, outlines, frame anchors and X_0."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.cables.boundary import Outline
from robocal.cables.geometry import CableRobot
from robocal.cables.workspace import Grid
from robocal.report.cable.contours import contour
from robocal.report.cable.paint import figure
from robocal.report.cable.plane import Plane, anchors, cross, plane
from robocal.report.numbers import fixed, significant
from robocal.report.svg import Scale, label, nice_ticks, num, path, tick_text

__all__ = ["section"]

Array = NDArray[np.float64]
STEPS = 6  # classes of margin on either side of zero


def section(
    robot: CableRobot,
    outlines: Sequence[Outline],
    grid: Grid | None,
    axes: tuple[int, int],
    *,
    points: ArrayLike | None = None,
) -> str:
    """The picture (SVG) of a section in the plane of two axes (0 x, 1 y, 2 z): margins of the grid's layer at the first outline's
    start (its middle layer without one), or which cells are held; outlines on top; points (n, 3) m as dots."""
    across = 3 - sum(axes)
    start = outlines[0].start if outlines else robot.home[:3, 3]
    dots = np.zeros((0, 3)) if points is None else np.asarray(points, float).reshape(-1, 3)
    shown = [robot.a, robot.home[None, :3, 3], dots, *(o.points for o in outlines)]
    layer, level = (0, float(start[across])) if grid is None else _layer(grid, across, outlines)
    if grid is not None:
        shown.append(_corners(grid, axes))
    every = np.concatenate([np.asarray(p, float).reshape(-1, 3) for p in shown])
    margin = None if grid is None or grid.margin is None else _flat(grid.margin, axes, across, layer)
    at = plane(axes, every, right=150.0 if margin is not None else 16.0)
    parts = [at.frame]
    if grid is not None and margin is not None:
        parts += [_cells(grid, axes, _classes(margin), at), _zero(grid, axes, margin, at), _scale(margin, at)]
    elif grid is not None:
        inside = _flat(grid.inside, axes, across, layer)
        parts.append(_cells(grid, axes, np.where(inside, 1, 0), at, prefix="in"))
    parts += [at.line(o.points, f"outline o{k % 4}", closed=True) for k, o in enumerate(outlines)]
    parts.append(path("".join(f"M{num(x)} {num(y)}h0" for x, y in at.flat(dots).tolist()), "dots"))
    home = at.flat(robot.home[None, :3, 3]).tolist()
    parts += [
        path(cross(home, 5.0), "home"),
        label(home[0][0] + 9, home[0][1] + 4, "X₀", "strong halo-text"),
        anchors(robot, at),
    ]
    where = "" if robot.degrees != "3R3T" else f" at {'xyz'[across]} = {fixed(level, 2)} m"
    title = f"Section in the plane {'xyz'[axes[0]]}{'xyz'[axes[1]]}{where}"
    return figure(
        "section",
        at.width,
        at.height,
        [label(at.x.start, 14, title, "strong"), *parts],
        title=title,
        text=_said(outlines, margin),
    )


def _layer(grid: Grid, across: int, outlines: Sequence[Outline]) -> tuple[int, float]:
    """Which layer of the grid is shown, and where it lies."""
    at = grid.axes[across]
    layer = int(np.abs(at - outlines[0].start[across]).argmin()) if outlines else len(at) // 2
    return layer, float(at[layer])


def _flat(values: NDArray[np.generic], axes: tuple[int, int], across: int, layer: int) -> NDArray[np.generic]:
    """A layer of (nx, ny, nz) as (along the first axis, along the second)."""
    cut: NDArray[np.generic] = np.take(values, layer, axis=across)
    return cut if axes[0] < axes[1] else cut.T


def _corners(grid: Grid, axes: tuple[int, int]) -> Array:
    out = np.zeros((2, 3))
    for k in range(3):
        half = grid.cell[k] / 2
        out[:, k] = grid.axes[k][0] - half, grid.axes[k][-1] + half
    return out


def _top(margin: NDArray[np.generic]) -> float:
    """The margin at which the colours end: the largest, or the largest that is missing where nothing can be held."""
    found = np.asarray(margin, float)
    found = found[np.isfinite(found)]
    if not len(found):
        return 1.0
    return float(found.max()) if found.max() > 0 else float(np.abs(found).max()) or 1.0


def _edges(margin: NDArray[np.generic]) -> list[float]:
    """The borders of the classes above zero: round numbers."""
    ticks = [t for t in nice_ticks(0.0, _top(margin), STEPS) if t > 0]
    return ticks[:STEPS]


def _classes(margin: NDArray[np.generic]) -> NDArray[np.int64]:
    """Class of each cell: 1 upwards from zero, -1 downwards, 0 where there is no number."""
    values, edges = np.asarray(margin, float), np.array(_edges(margin))
    size = (
        np.minimum(np.searchsorted(edges, np.abs(np.where(np.isfinite(values), values, 0.0)), side="right"), STEPS - 1)
        + 1
    )
    found = np.where(values >= 0, size, -size)
    return np.asarray(np.where(np.isfinite(values), found, np.where(values == -np.inf, -STEPS, 0)), np.int64)


def _name(step: int) -> str:
    return f"m{step}" if step > 0 else f"n{-step}"


def _cells(grid: Grid, axes: tuple[int, int], classes: NDArray[np.int64], at: Plane, prefix: str = "") -> str:
    """One path per class; neighbours in a row are one rectangle."""
    u, v = grid.axes[axes[0]], grid.axes[axes[1]]
    half = grid.cell[axes[0]] / 2, grid.cell[axes[1]] / 2
    found: dict[int, list[str]] = {}
    for j, y in enumerate(v.tolist()):
        row = classes[:, j]
        breaks = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
        top, bottom = at.y(y + half[1]), at.y(y - half[1])
        for a, b in itertools.pairwise(breaks):
            if row[a]:
                left, right = at.x(float(u[a]) - half[0]), at.x(float(u[b - 1]) + half[0])
                # A hair wider than the cells, so that no seam shows.
                found.setdefault(int(row[a]), []).append(
                    f"M{left:.2f} {top:.2f}H{right + 0.2:.2f}V{bottom + 0.2:.2f}H{left:.2f}z"
                )
    return "".join(path("".join(d), prefix or _name(k)) for k, d in sorted(found.items()))


def _zero(grid: Grid, axes: tuple[int, int], margin: NDArray[np.generic], at: Plane) -> str:
    pieces = contour(grid.axes[axes[0]], grid.axes[axes[1]], np.asarray(margin, float))
    return path(
        "".join(f"M{num(at.x(a))} {num(at.y(b))}L{num(at.x(c))} {num(at.y(d))}" for (a, b), (c, d) in pieces.tolist()),
        "zero",
    )


def _scale(margin: NDArray[np.generic], at: Plane) -> str:
    """The classes upright beside the picture, with their borders in N."""
    edges = [0.0, *_edges(margin)][:STEPS]
    count = len(edges)
    x, top, bottom = at.x.end + 26, at.y.end + 24, at.y.start
    y = Scale(-count, count, bottom, top)
    parts = [label(x, top - 14, "margin, N", "strong")]
    for k in range(-count, count):
        step = k + 1 if k >= 0 else k
        parts.append(
            f'<rect class="{_name(step)}" x="{num(x)}" y="{y(k + 1):.2f}" width="16" height="{y(k) - y(k + 1) + 0.3:.2f}"/>'
        )
    for k, edge in enumerate(edges):
        parts.append(label(x + 23, y(k) + 4, tick_text(edge), "strong" if k == 0 else "tick"))
        if k:
            parts.append(label(x + 23, y(-k) + 4, tick_text(-edge), "tick"))
    parts.append(f'<path class="zero" d="M{num(x - 3)} {num(y(0))}h22"/>')
    parts += [label(x + 50, y(count / 2) + 4, "held", "name"), label(x + 50, y(-count / 2) + 4, "not held", "name")]
    return "".join(parts)


def _said(outlines: Sequence[Outline], margin: NDArray[np.generic] | None) -> str:
    parts = [f"The outline encloses {significant(o.area)} m²." for o in outlines]
    if margin is not None:
        found = np.asarray(margin, float)
        good = found[np.isfinite(found)]
        if len(good):
            held = 100 * float((found >= 0).mean())
            ends = " to ".join(significant(float(v)) for v in (good.min(), good.max()))
            parts.append(f"Margins from {ends} N; {held:.0f} % of the cells are held.")
    return " ".join(parts) or "Frame anchors and X₀."

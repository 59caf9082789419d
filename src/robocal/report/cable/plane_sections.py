"""A plane section of a workspace: margins as colours with their zero, outlines, frame anchors and X_0."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._types import Array
from robocal.cables.boundary import Outline
from robocal.cables.geometry import CableRobot
from robocal.cables.workspace import Grid
from robocal.report.cable.drawing import figure
from robocal.report.cable.length_unit import METRE, LengthUnit
from robocal.report.cable.plane_view import Plane, anchors, plane
from robocal.report.contour import contour
from robocal.report.numbers import significant
from robocal.report.svg import AxisScale, crosses, label, nice_ticks, num, path, rect, segments, tick_text

__all__ = ["section"]

STEPS = 6  # classes of margin on either side of zero


def section(
    robot: CableRobot,
    outlines: Sequence[Outline],
    grid: Grid | None,
    axes: tuple[int, int],
    *,
    points: ArrayLike | None = None,
    ruler: LengthUnit = METRE,
    closure: bool = False,
) -> str:
    """The picture (SVG) of a section in the plane of two axes (0 x, 1 y, 2 z): margins (of `closure` tension factors) of the grid's
    layer at the first outline's start (its middle layer without one), or which cells are held; outlines on top; points (n, 3) m as
    dots."""
    across = 3 - sum(axes)
    home, dots = robot.home[None, :3, 3], np.reshape([] if points is None else np.asarray(points, float), (-1, 3))
    start = outlines[0].start[None] if outlines else home
    layer, level = 0, float(start[0, across])
    if grid is not None:
        layer = int(np.abs(grid.axes[across] - level).argmin())  # the nearest
        level = float(grid.axes[across][layer])
    shown = [
        robot.frame_points,
        start,
        dots,
        *(o.points for o in outlines),
        *([] if grid is None else [_corners(grid)]),
    ]
    every = np.concatenate([np.asarray(p, float).reshape(-1, 3) for p in shown])
    margin = None if grid is None or grid.margin is None else np.asarray(_flat(grid.margin, axes, across, layer), float)
    at = plane(axes, every, right=160.0 if margin is not None else 16.0, ruler=ruler)
    parts = [at.frame]
    if grid is not None and margin is not None:
        edges = _edges(margin)
        parts.append(_cells(grid, axes, _classes(margin, edges), at, _names(len(edges))))
        parts += ["" if closure else _zero(grid, axes, margin, at), _scale(edges, at, closure)]
    elif grid is not None:
        inside = np.where(_flat(grid.inside, axes, across, layer), 1, 0)
        parts.append(_cells(grid, axes, inside, at, {1: "in"}))
    parts += [at.line(o.points, f"outline o{k % 4}", closed=True) for k, o in enumerate(outlines)]
    parts.append(path("".join(f"M{num(x)} {num(y)}h0" for x, y in at.flat(dots).tolist()), "dots"))
    x, y = at.flat(start)[0].tolist()
    word = "X₀" if np.allclose(start[0], home[0], atol=1e-9) else "start"
    parts += [path(crosses([(x, y)], 5.0), "home"), label(x + 9, y + 4, word, "strong halo-text"), anchors(robot, at)]
    where = "" if robot.planar else f" at {'xyz'[across]} = {ruler.text(level, 2)} {ruler.name}"
    title = f"Section in the plane {'xyz'[axes[0]]}{'xyz'[axes[1]]}{where}"
    parts.append(label(at.x.start, 16, title, "strong"))
    return figure("section", at.width, at.height, parts, title=title, text=_describe(outlines, margin, closure))


def _flat(values: NDArray[np.generic], axes: tuple[int, int], across: int, layer: int) -> NDArray[np.generic]:
    """A layer of (nx, ny, nz) as (along the first axis, along the second)."""
    cut: NDArray[np.generic] = np.take(values, layer, axis=across)
    return cut if axes[0] < axes[1] else cut.T


def _corners(grid: Grid) -> Array:
    """The lower and the upper corner of a grid, (2, 3)."""
    return np.array([[x[0] - c / 2, x[-1] + c / 2] for x, c in zip(grid.axes, grid.cell.tolist(), strict=True)]).T


def _edges(margin: Array) -> list[float]:
    """The lower borders of the classes above zero, N: round numbers from 0 to the largest margin; to the largest that is missing
    where nothing is held."""
    found = margin[np.isfinite(margin)]
    top = float(found.max()) if len(found) and found.max() > 0.0 else float(np.abs(found).max(initial=0.0))
    return nice_ticks(0.0, top, STEPS)[:STEPS] if top > 0.0 else [0.0]


def _classes(margin: Array, edges: Sequence[float]) -> NDArray[np.int64]:
    """Class of each cell: 1 upwards from zero, -1 downwards, 0 where there is no number."""
    size = np.clip(np.searchsorted(np.array(edges), np.abs(margin), side="right"), 1, len(edges))
    found = np.where(margin >= 0.0, size, -size)
    return np.asarray(np.where(np.isnan(margin), 0, found), np.int64)


def _names(count: int) -> dict[int, str]:
    """Colours of the classes -count to count, spread over the palette."""
    share = {k: 1 + round((k - 1) * (STEPS - 1) / max(count - 1, 1)) for k in range(1, count + 1)}
    return {k: f"m{c}" for k, c in share.items()} | {-k: f"n{c}" for k, c in share.items()}


def _cells(grid: Grid, axes: tuple[int, int], classes: NDArray[np.int64], at: Plane, names: dict[int, str]) -> str:
    """One path per class; neighbours in a row are one rectangle."""
    centre = np.stack(np.meshgrid(*(grid.axes[k] for k in axes), indexing="ij"), axis=-1)
    half = grid.cell[list(axes)] / 2
    low, high = at.place(centre - half), at.place(centre + half)
    found: dict[int, list[str]] = {}
    for j, row in enumerate(classes.T):
        for a, b in itertools.pairwise([0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]):
            if row[a]:
                (left, bottom), (right, top) = low[a, j].tolist(), high[b - 1, j].tolist()
                # A hair wider than the cells, so that no seam shows.
                found.setdefault(int(row[a]), []).append(
                    f"M{left:.2f} {top:.2f}H{right + 0.2:.2f}V{bottom + 0.2:.2f}H{left:.2f}z"
                )
    return "".join(path("".join(d), names[k]) for k, d in sorted(found.items()))


def _zero(grid: Grid, axes: tuple[int, int], margin: Array, at: Plane) -> str:
    pieces = at.place(contour(grid.axes[axes[0]], grid.axes[axes[1]], margin))
    return path(segments(pieces.reshape(-1, 4).tolist()), "zero")


def _scale(edges: Sequence[float], at: Plane, closure: bool) -> str:
    """The classes upright beside the picture, with their borders in N; those of tension factors have one side."""
    count, names = len(edges), _names(len(edges))
    x, top, bottom = at.x.end + 26, at.y.end + 16, at.y.start
    y = AxisScale(0 if closure else -count, count, bottom, top)
    parts = [label(x, top - 14, "tension factor" if closure else "margin, N", "strong")]
    for k in (*(() if closure else range(-count, 0)), *range(1, count + 1)):
        parts.append(rect(x, y(k + 1 if k < 0 else k), 16, y(0) - y(1) + 0.3, names[k]))
    for k, edge in enumerate(edges):
        parts.append(label(x + 23, y(k) + 4, tick_text(edge), "strong" if k == 0 else "tick"))
        if k and not closure:
            parts.append(label(x + 23, y(-k) + 4, tick_text(-edge), "tick"))
    if closure:
        return "".join(parts)
    parts.append(f'<path class="zero" d="M{num(x - 3)} {num(y(0))}h22"/>')
    parts += [label(x + 23, y(count - 0.5) + 4, "held", "name"), label(x + 23, y(0.5 - count) + 4, "not held", "name")]
    return "".join(parts)


def _describe(outlines: Sequence[Outline], margin: Array | None, closure: bool) -> str:
    parts = [f"The outline encloses {significant(o.area)} m²." for o in outlines]
    if margin is not None and np.isfinite(margin).any():
        good = margin[np.isfinite(margin)]
        ends = " to ".join(significant(float(v)) for v in (good.min(), good.max()))
        what = f"Tension factors from {ends}" if closure else f"Margins from {ends} N"
        parts.append(f"{what}; {100 * float((margin >= 0.0).mean()):.0f} % of the cells are held.")
    return " ".join(parts) or "Frame anchors and X₀."

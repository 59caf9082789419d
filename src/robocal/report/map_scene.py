"""The picture of a map of markers: squares with their numbers, coloured by what they may be off by, its ellipses, and cameras.

Drawn for one view, from the side to which most markers are turned; cable/turn.js turns it in the browser.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.report.cable.drawing import bar, brief, figure, tint
from robocal.report.cable.marks import Mark, draw
from robocal.report.numbers import plain, significant
from robocal.report.svg import AxisScale, label, num, span, tick_text
from robocal.report.view import View, fit_view
from robocal.vision.maps import MarkerMap

__all__ = ["draw_map"]

WIDE, HIGH, SIDE, TOP, FOOT = 940.0, 600.0, 118.0, 16.0, 30.0  # px
MOST_CAMERAS = 300  # that are drawn; of more, every so many
LARGE = 15.0  # px: an edge that has room for a number of this height
RING = 28  # corners of an ellipse
DECADES = 10.0  # ratio of sigmas from which their colours are logarithmic
FRONT = 24.0, 18.0  # deg beside and above the direction to which most markers are turned
LOWEST, HIGHEST = 8.0, 75.0  # deg of elevation


def draw_map(
    known: MarkerMap,
    cameras: ArrayLike | None = None,
    *,
    title: str = "The map",
    marked: Collection[str] = (),
    what: str = "sigma",
) -> str:
    """The picture (SVG) of a map, with cameras T_map_camera (V, 4, 4) as pyramids; `marked` are names to be seen at once, as of markers
    that moved; `what` is the word for what its covariance says."""
    at = np.zeros((0, 4, 4)) if cameras is None else np.asarray(cameras, float).reshape(-1, 4, 4)
    some = at[:: max(1, -(-len(at) // MOST_CAMERAS))]
    edge = float(np.median(known.size))
    cones = [_cone(t, edge) for t in some]
    every = np.concatenate([known.corners.reshape(-1, 3), *cones])
    low, high = every.min(axis=0), every.max(axis=0)
    sigma = None if known.covariance is None else _widest(known.covariance)
    right = WIDE - (SIDE if sigma is not None else 0.0)
    view = _view_of(known, every, (14.0, TOP, right - 14.0, HIGH - FOOT))
    scale = None if sigma is None else _scale_of(1e3 * sigma)
    times = 0.0 if known.covariance is None else _times(known.covariance, edge)
    arrows = _axes(low, high)
    marks = [
        *_squares(known, sigma, scale, marked, what),
        *([] if known.covariance is None else _ellipses(known, times)),
        *(Mark(c, "camera") for c in cones),
        *(Mark(line, f"axis-{k}") for k, line in zip("xyz", arrows, strict=True)),
    ]
    room = edge * view.scale
    parts = [f'<g data-part="marks">{draw(marks, view)}</g>']
    tips = _words(arrows[:, 1], "xyz", view, LARGE, tuple(f"strong name-{k}" for k in "xyz"))
    parts.append(f'<g data-part="names">{tips}{_numbers(known, view, room)}</g>')
    if scale is not None:
        parts.append(_colours(scale, WIDE - SIDE + 26, what))
    size = " x ".join(significant(float(v), 2) for v in high - low)
    ring = f"; ellipses {plain(times)} times as large" if times else ""
    drawn = "" if len(some) == len(at) else f", {len(some)} of them drawn"
    foot = f"{size} m{f'; {len(at)} cameras{drawn}' if len(at) else ''}{ring}"
    parts.append(label(14, HIGH - 10, foot, "tick"))
    worst = (
        ""
        if sigma is None
        else f" {what.capitalize()} of their middles: {significant(1e3 * float(sigma.max()))} mm at most."
    )
    text = f"{len(known.names)} markers in {foot}.{worst}"
    if marked:
        text += f" Marked: {', '.join(marked)}."
    more = (
        f' data-eye="{num(view.eye)}" data-view="{num(view.azimuth)} {num(view.elevation)}" '
        f'data-at="{num(view.at[0])} {num(view.at[1])}" data-room="{num(right)} {num(HIGH)} {num(TOP)}"'
    )
    return figure("map", WIDE, HIGH, parts, title=title, text=text, more=more)


def _view_of(known: MarkerMap, every: Array, box: tuple[float, float, float, float]) -> View:
    """From before the printed sides, a little beside and above them."""
    x, y, z = known.poses[:, :3, 2].mean(axis=0).tolist()
    azimuth = np.degrees(np.arctan2(y, x)) - FRONT[0] if np.hypot(x, y) > 1e-6 else -90.0 + FRONT[0]
    tilt = float(np.degrees(np.arctan2(z, np.hypot(x, y))))
    elevation = min(max(tilt + FRONT[1] if tilt < 45 else tilt - FRONT[1], LOWEST), HIGHEST)
    middle = (every.min(axis=0) + every.max(axis=0)) / 2
    return fit_view(View(float(azimuth), elevation, middle), [(every, box)], perspective=True)


def _widest(covariance: Array) -> Array:
    """Of each marker's middle the standard deviation along the worst direction, (M,) m."""
    own = np.stack([covariance[i : i + 3, i : i + 3] for i in range(0, len(covariance), 6)])
    return np.asarray(np.sqrt(np.linalg.eigvalsh(own)[:, -1].clip(0.0)))


def _scale_of(sigma: Array) -> AxisScale:
    """Colours 0 to 1 over sigmas in mm."""
    low, high = span(sigma.tolist()) or (0.1, 1.0)
    return AxisScale(low, high, 0.0, 1.0, log=high > DECADES * low)


def _squares(
    known: MarkerMap, sigma: Array | None, scale: AxisScale | None, marked: Collection[str], what: str
) -> Iterator[Mark]:
    for i, (name, corners) in enumerate(zip(known.names, known.corners, strict=True)):
        colour, said = "", name
        if sigma is not None and scale is not None:
            colour = f' fill="{tint(scale(max(1e3 * float(sigma[i]), scale.low)))}"'
            said = f"{name}: {what} {significant(1e3 * float(sigma[i]))} mm"
        cls = "tag moved" if name in marked else "tag" if colour else "tag blank"
        yield Mark(corners, cls, closed=True, more=colour, hint=said)
        # A stroke along its top says how it is turned.
        top = corners[:2] + 0.12 * (corners[[3, 2]] - corners[:2])
        yield Mark(top, "tag-top", lift=0.5)


def _times(covariance: Array, edge: float) -> float:
    """A round magnification that draws ellipses about as large as markers."""
    typical = float(np.percentile(_widest(covariance), 90))
    if not typical > 0:
        return 0.0
    raw = 0.5 * edge / typical
    power = 10.0 ** np.floor(np.log10(raw))
    return float(max(s * power for s in (1, 2, 5) if s * power <= raw * 1.0001))


def _ellipses(known: MarkerMap, times: float) -> Iterator[Mark]:
    """Of each marker's middle one standard deviation, `times` as large, across the direction that is known best."""
    assert known.covariance is not None
    turn = np.linspace(0, 2 * np.pi, RING, endpoint=False)
    round_ = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for i, p in enumerate(known.vector[:, :3]):
        values, along = np.linalg.eigh(known.covariance[6 * i : 6 * i + 3, 6 * i : 6 * i + 3])
        axes = along[:, 1:] * (times * np.sqrt(values[1:].clip(0.0)))
        yield Mark(p + round_ @ axes.T, "ellipse", closed=True, lift=1.0)


def _cone(pose: Array, edge: float) -> Array:
    """A camera as one line (11, 3) along the edges of a pyramid that opens where it looks."""
    x, y, z = 0.4 * edge, 0.3 * edge, 0.6 * edge
    base = np.array([[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]])
    apex = np.zeros(3)
    way = np.stack([base[0], base[1], base[2], base[3], base[0], apex, base[2], apex, base[1], apex, base[3]])
    return np.asarray(way @ pose[:3, :3].T + pose[:3, 3])


def _axes(low: Array, high: Array) -> Array:
    """The axes of the map as lines (3, 2, 3): at its origin where that is inside, else at a corner."""
    air = 0.1 * float((high - low).max())
    origin = np.zeros(3) if bool(((low - air <= 0) & (high + air >= 0)).all()) else low
    arrow = 0.12 * float((high - low).max())
    return np.stack([[origin, origin + arrow * axis] for axis in np.eye(3)])


def _numbers(known: MarkerMap, view: View, room: float) -> str:
    """The names at the middles, as large as squares permit; none where they would be specks (the pointer shows them)."""
    size = min(max(0.55 * room, 6.0), LARGE)
    if room < 7.0:
        return ""
    names = [brief(name, 5) for name in known.names]
    return _words(known.vector[:, :3], names, view, size, ("number",) * len(names))


def _words(points: Array, texts: Sequence[str], view: View, size: float, classes: Sequence[str]) -> str:
    """Texts in the middle of points (n, 3), which turn.js moves with them."""
    xy, out = view.flat(points)[0], []
    for text, cls, (x, y), local in zip(texts, classes, xy.tolist(), view.local(points).tolist(), strict=True):
        data = " ".join(num(v) for v in local)
        out.append(
            f'<text class="{cls}" style="font-size:{num(size)}px" x="{num(x)}" y="{num(y + 4)}" text-anchor="middle" '
            f'data-p="{data}">{escape(text)}</text>'
        )
    return "".join(out)


def _colours(scale: AxisScale, x: float, what: str) -> str:
    top, bottom = 50.0, HIGH - 50.0
    y = AxisScale(scale.low, scale.high, bottom, top, log=scale.log)
    ticks = "".join(label(x + 20, y(t) + 4, tick_text(t), "tick") for t in y.ticks)
    return label(x, top - 14, f"{what}, mm", "strong") + bar(x, top, bottom) + ticks

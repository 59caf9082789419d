"""Pictures of a sweep: an error against what was varied, a curve for each of the rest, beside the prediction of theory; and lines of equal
error where two numbers were varied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.report import svg
from robocal.report.contour import contour
from robocal.report.svg import AxisScale, axes, drawing, label, left_axis, line, num, path, points

__all__ = ["Axis", "Curve", "contours", "curves", "levels"]

WIDTH, LEFT, RIGHT, HEAD = 560.0, 62.0, 420.0, 40.0
UPPER, LOWER = 250.0, 90.0  # heights of the two panels
TURN, STROKE = 24.0, 9.0  # degrees of words below an axis; half of a stroke in place of a line
WIDE = 8.0  # from the least to the greatest: more is drawn by the logarithm
NOTHING = 1e-9  # of the greatest value: what digits leave, and not drawn
SHAPES = tuple(svg.MARKS)


@record(eq=False)
class Axis:
    """What was varied: its title with the unit, its values (k,), and words in their place where it is no number."""

    title: str
    values: Array
    labels: tuple[str, ...] = ()

    def scale(self, start: float, end: float) -> AxisScale:
        """By the logarithm where the values span much."""
        v = self.values
        if self.labels:
            return AxisScale(-0.5, len(v) - 0.5, start, end)
        log = float(v.min()) > 0 and float(v.max()) > WIDE * float(v.min())
        air = 0.0 if log or v.max() == v.min() else 0.04 * float(v.max() - v.min())
        return AxisScale(float(v.min()) - air, float(v.max()) + air, start, end, log)

    def below(self, scale: AxisScale, y: float, top: float) -> str:
        """The axis under a panel."""
        if not self.labels:
            return svg.bottom_axis(scale, y, top, self.title)
        told = [label(scale(i) + 4, y + 16, word, "tick", "end", -TURN) for i, word in enumerate(self.labels)]
        title = label(scale.end + 14, y + 4, self.title, "axis-title")
        return "".join([line(scale.start, y, scale.end, y, "axis"), *told, title])

    @property
    def label_space(self) -> float:
        """What the axis takes below a panel: turned words, about as wide as half their height."""
        return 44.0 + (3.6 * max(map(len, self.labels)) if self.labels else 0.0)

    def line(self, x: AxisScale, y: AxisScale, values: Array) -> str:
        """Finite values in order as a line; of words, each as a short stroke: nothing lies between them."""
        order = np.argsort(self.values, kind="stable")
        fine = order[np.isfinite(values[order])]
        if y.log:
            fine = fine[values[fine] >= y.low]
        at = np.stack([x.many(self.values[fine]), y.many(values[fine])], axis=1).tolist()
        if self.labels:
            return "".join(f"M{num(a - STROKE)} {num(b)}h{num(2 * STROKE)}" for a, b in at)
        return svg.polyline(at)

    def curve(self, x: AxisScale, y: AxisScale, values: Array, shape: str, shown: Bools) -> str:
        """Values as a line, of words none, with a mark at each that is shown."""
        at = np.stack([x.many(self.values[shown]), y.many(values[shown])], axis=1)
        return ("" if self.labels else path(self.line(x, y, values), f"mean {shape}")) + points(at.tolist(), shape)


@record(eq=False)
class Curve:
    """One of a picture's curves: its name, its values (k,), their prediction by theory (k,), and how far single trials scatter (k,)."""

    name: str
    values: Array
    theory: Array | None = None
    scatter: Array | None = None


def curves(
    x: Axis, found: Sequence[Curve], title: str, said: str, key: str, wanted: tuple[float, str] | None = None
) -> str:
    """A picture (SVG): values with a mark at each, predicted ones as a dotted line, single trials as bars of one standard deviation,
    and a line at what is wanted, with its name. Below it, the difference of found and predicted ones, where there are some. Nothing
    ("") where no value is above zero."""
    tops = [c.values + c.scatter for c in found if c.scatter is not None]
    every = np.concatenate([*(c.values for c in found), *(c.theory for c in found if c.theory is not None), *tops])
    known = every[np.isfinite(every)]
    room = svg.span(v for v in known.tolist() if v > NOTHING * known.max())
    if room is None:
        return ""
    low, high = room
    log = high > WIDE * 1.25**2 * low
    bottom = HEAD + UPPER
    across, y = x.scale(LEFT, RIGHT), AxisScale(low if log else 0.0, high, bottom, HEAD, log)
    parts = [left_axis(y, LEFT, RIGHT, title)]
    told = any(c.theory is not None for c in found)
    below = bottom + 58  # where the lower panel begins
    if told:
        # Grids lie under the marks.
        parts += [line(across(v), bottom, across(v), HEAD, "grid") for v in ([] if x.labels else across.ticks)]
        parts += [line(LEFT, bottom, RIGHT, bottom, "axis"), x.below(across, below + LOWER, below)]
    else:
        parts.append(x.below(across, bottom, HEAD))
    parts.append(line(LEFT, bottom, LEFT, HEAD, "axis"))
    if wanted is not None:
        level, name = wanted
        parts += [line(LEFT, y(level), RIGHT, y(level), "mid"), label(LEFT + 4, y(level) - 4, name, "tick")]
    names = _apart([_end(c, y) for c in found])
    for i, (c, at) in enumerate(zip(found, names, strict=True)):
        shape = SHAPES[i % len(SHAPES)]
        if c.theory is not None:
            parts.append(path(x.line(across, y, c.theory), "curve p95"))
        seen = np.isfinite(c.values) & (c.values > (NOTHING * known.max() if log else -np.inf))
        if c.scatter is not None:
            parts.append(_bars(x, across, y, c, seen))
        parts.append(x.curve(across, y, c.values, shape, seen))
        if c.name:
            parts += [points([(RIGHT + 14, at - 4)], shape), label(RIGHT + 24, at, c.name, "name")]
    height = bottom + x.label_space
    if told:
        off = []
        for c in found:
            if c.theory is not None:
                fine = (c.theory > 0) & (c.values > NOTHING * known.max())
                off.append(np.where(fine, 100 * (c.values / np.where(fine, c.theory, 1.0) - 1), np.nan))
        parts.append(_below(x, across, off, below))
        height = below + LOWER + x.label_space
    return drawing(WIDTH, height, parts, title=title, text=said, key=key)


def _bars(x: Axis, across: AxisScale, y: AxisScale, c: Curve, seen: Bools) -> str:
    """How far single trials scatter about the values that are seen, as far as the panel goes."""
    assert c.scatter is not None
    fine = seen & (c.scatter > 0)
    ends = np.clip([c.values[fine] - c.scatter[fine], c.values[fine] + c.scatter[fine]], y.low, y.high)
    at = np.stack([across.many(x.values[fine]), *y.many(ends)], axis=1).tolist()
    return path("".join(f"M{num(a - 3)} {num(b)}h6m-3 0V{num(t)}m-3 0h6" for a, b, t in at), "scatter")


def _below(x: Axis, across: AxisScale, off: Sequence[Array], top: float) -> str:
    """The panel of differences, in percent."""
    every = np.concatenate([o[np.isfinite(o)] for o in off])
    if not len(every):
        return label(LEFT, top + 12, "nothing to compare", "tick")
    y = AxisScale(min(-1.0, float(every.min()) * 1.15), max(1.0, float(every.max()) * 1.15), top + LOWER, top)
    parts = [left_axis(y, LEFT, RIGHT, "found over foretold [%]"), line(LEFT, top + LOWER, LEFT, top, "axis")]
    parts += [line(LEFT, top + LOWER, RIGHT, top + LOWER, "axis"), line(LEFT, y(0.0), RIGHT, y(0.0), "mid")]
    for i, o in enumerate(off):
        parts.append(x.curve(across, y, o, SHAPES[i % len(SHAPES)], np.isfinite(o)))
    return "".join(parts)


def _end(curve: Curve, y: AxisScale) -> float:
    """Where a name stands: at the height of the last value that is one."""
    fine = curve.values[np.isfinite(curve.values)]
    return y(min(max(float(fine[-1]), y.low), y.high)) + 4 if len(fine) else y.start


def _apart(heights: Sequence[float], least: float = 17.0) -> list[float]:
    """The same heights, in their order, no two nearer than a line of text."""
    out, last = [0.0] * len(heights), -np.inf
    for i in np.argsort(heights, kind="stable").tolist():
        out[i] = last = max(heights[i], last + least)
    return out


def levels(x: Axis, y: Axis, found: Array, told: Array | None, unit: str, said: str, key: str) -> str:
    """A picture (SVG): lines of equal `found` (len(x), len(y)) over two numbers, those of the prediction by theory dotted."""
    bottom = HEAD + UPPER + 20
    across, up = x.scale(LEFT, RIGHT - 20), y.scale(bottom, HEAD)
    parts = [axes(across, up, x.title, y.title), line(LEFT, bottom, LEFT, HEAD, "axis")]
    fine = found[np.isfinite(found)]
    if not len(fine):
        return ""
    for level in [t for t in svg.nice_ticks(float(fine.min()), float(fine.max()), 8) if t > fine.min()]:
        for values, kind in ((told, "curve p95"), (found, "curve")):
            if values is None:
                continue
            pairs = contour(x.values, y.values, values - level, unknown=True)
            at = np.stack([across.many(pairs[..., 0]), up.many(pairs[..., 1])], axis=-1).reshape(-1, 4)
            parts.append(path(svg.segments(at.tolist()), kind))
            if kind == "curve" and len(at):
                right, top = at[np.argmin(at[:, 1]), :2].tolist()  # at its upper end
                parts.append(label(right + 4, top - 4, f"{svg.tick_text(level)} {unit}", "tick"))
    return drawing(WIDTH, bottom + 44, parts, title=f"{x.title} and {y.title}", text=said, key=key)


def contours(found: Sequence[tuple[str, Array]], titles: tuple[str, str], said: str, key: str) -> str:
    """A picture (SVG): lines of equal error over two noises, figures C.1 to C.6 of the thesis behind `examples/cable-laval`; each
    (n, 2) with what stands on it, from the smallest error to the largest."""
    across, up = titles
    right, top = (1.12 * np.max([c.max(axis=0) for _, c in found], axis=0)).tolist()
    x, y = AxisScale(0, right, 58, 376), AxisScale(0, top, 276, HEAD)
    parts = [axes(x, y, across, up), line(x.start, y.start, x.start, y.end, "axis")]
    for name, curve in found:
        at = [(x(a), y(b)) for a, b in curve.tolist()]
        left, upper = at[len(at) // 2]
        parts += [path(svg.polyline(at), "curve"), label(left + 4, upper - 5, name, "tick")]
    return drawing(400, 330, parts, title=f"{across} and {up}", text=said, key=key)

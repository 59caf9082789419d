"""Small drawing tools: escaped text, scales with ticks, and marks gathered into one path per series, so a thousand
points stay small."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.report.numbers import plain, scientific

__all__ = [
    "MARKS", "AxisScale", "Places", "axes", "bottom_axis", "circles", "count_axis", "crosses", "drawing", "label",
    "left_axis", "line", "log_ticks", "nice_ticks", "num", "path", "points", "polyline", "rect", "segments", "span",
    "tick_text",
]  # fmt: skip

Places = Iterable[Sequence[float]]  # (x, y), px


def num(value: float) -> str:
    """A coordinate with one decimal."""
    text = f"{value:.1f}"
    return text[:-2] if text.endswith(".0") else text


def drawing(
    width: float,
    height: float,
    parts: Iterable[str],
    *,
    title: str,
    text: str,
    key: str,
    cls: str = "",
    style: str = "",
    more: str = "",
) -> str:
    """A whole picture with its alternative text; `key` makes the identifiers of title and description unique in a
    page, `more` are further attributes."""
    own = f"<style>{style}</style>" if style else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {num(width)} {num(height)}" width="{num(width)}" height="{num(height)}" '
        f'class="{escape(f"picture {cls}".strip())}" role="img" aria-labelledby="{key}-t {key}-d"{more}>'
        f'<title id="{key}-t">{escape(title)}</title>'
        f'<desc id="{key}-d">{escape(text)}</desc>{own}{"".join(parts)}</svg>'
    )


def label(x: float, y: float, text: str, cls: str = "", anchor: str = "start", turn: float = 0) -> str:
    """A piece of text."""
    turned = f' transform="rotate({num(turn)} {num(x)} {num(y)})"' if turn else ""
    end = f' text-anchor="{anchor}"' if anchor != "start" else ""
    klass = f' class="{cls}"' if cls else ""
    return f'<text x="{num(x)}" y="{num(y)}"{klass}{end}{turned}>{escape(text)}</text>'


def line(x1: float, y1: float, x2: float, y2: float, cls: str) -> str:
    """A straight line."""
    return f'<path class="{cls}" d="M{num(x1)} {num(y1)}L{num(x2)} {num(y2)}"/>'


def path(d: str, cls: str) -> str:
    """One path, or nothing when it is empty."""
    return f'<path class="{cls}" d="{d}"/>' if d else ""


def rect(x: float, y: float, width: float, height: float, cls: str) -> str:
    """A rectangle from its upper left corner."""
    return f'<rect class="{cls}" x="{num(x)}" y="{num(y)}" width="{num(width)}" height="{num(height)}"/>'


def polyline(places: Places, closed: bool = False) -> str:
    """Places joined by straight lines, as the text of a path."""
    text = "L".join(f"{num(x)} {num(y)}" for x, y in places)
    return f"M{text}{'z' if closed else ''}" if text else ""


def segments(ends: Iterable[Iterable[float]]) -> str:
    """Straight lines apart from one another, each from (x, y) to (x, y), as the text of a path."""
    return "".join("M{} {}L{} {}".format(*map(num, each)) for each in ends)


def circles(places: Places, radius: float) -> str:
    """Circles as the text of a path."""
    arcs = f"a{radius:g} {radius:g} 0 1 0 {2 * radius:g} 0a{radius:g} {radius:g} 0 1 0-{2 * radius:g} 0z"
    return "".join(f"M{num(x - radius)} {num(y)}{arcs}" for x, y in places)


def crosses(places: Places, size: float) -> str:
    """Crosses as the text of a path, `size` from the middle to each side."""
    strokes = f"l{2 * size:g} {2 * size:g}m0-{2 * size:g}l-{2 * size:g} {2 * size:g}"
    return "".join(f"M{num(x - size)} {num(y - size)}{strokes}" for x, y in places)


def _diamonds(places: Places) -> str:
    return "".join(f"M{num(x)} {num(y - 4.1)}l4.1 4.1l-4.1 4.1l-4.1-4.1z" for x, y in places)


# Each series has a shape of its own, so that no one needs the colour.
MARKS: dict[str, Callable[[Places], str]] = {
    "before": partial(circles, radius=2.4),
    "after": partial(circles, radius=1.9),
    "held": _diamonds,
    "aside": partial(crosses, size=3.2),
}


def points(places: Places, series: str) -> str:
    """All marks of one series as one path."""
    return path(MARKS[series](places), f"mark {series}")


@record
class AxisScale:
    """Maps low..high to start..end, linearly or by the logarithm."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def __call__(self, value: float) -> float:
        return float(self.many(value))

    def many(self, values: ArrayLike) -> Array:
        """The same of values (n,)."""
        low, high, at = self.low, self.high, np.asarray(values, float)
        if self.log:
            low, high, at = math.log10(low), math.log10(high), np.log10(np.clip(at, low, high))
        share = (at - low) / (high - low) if high > low else np.full(at.shape, 0.5)
        return np.asarray(self.start + share * (self.end - self.start))

    @property
    def ticks(self) -> list[float]:
        """Round values inside."""
        return log_ticks(self.low, self.high) if self.log else nice_ticks(self.low, self.high)


def nice_ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten; two at least, for one alone shows no scale."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(s * power for s in (1, 2, 5, 10) if s * power >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [i * step for i in range(first, last + 1)] if last > first else nice_ticks(low, high, 2 * about)


def log_ticks(low: float, high: float) -> list[float]:
    """Powers of ten, with 2 and 5 between them while there are few."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    steps: tuple[int, ...] = (1,) if last - first > 3 else (1, 2, 5)
    found = [s * 10.0**e for e in range(first, last + 1) for s in steps]
    inside = [t for t in found if low * 0.999 <= t <= high * 1.001]
    return inside[:: max(1, math.ceil(len(inside) / 8))]


def span(values: Iterable[float], share: float = 1e-9) -> tuple[float, float] | None:
    """A range on a logarithmic axis that holds all positive values with some air, down to a share of the largest; never narrower than
    half a decade."""
    positive = [v for v in values if v > 0]
    if not positive:
        return None
    least, most = (min(max(v, 1e-200), 1e200) for v in (min(positive), max(positive)))
    low, high = max(least, most * share) / 1.25, most * 1.25
    if high / low < 3.2:
        middle = math.sqrt(low * high)
        low, high = middle / 1.8, middle * 1.8
    return low, high


def tick_text(value: float) -> str:
    """A tick's number: plain while short, else 10⁷ or 2·10⁷."""
    if value == 0 or 1e-4 <= abs(value) < 1e5:
        return plain(value)
    mantissa, power = scientific(value, 0).split("·")
    return power if mantissa == "1" else f"{mantissa}·{power}"


def bottom_axis(scale: AxisScale, y: float, top: float, title: str = "") -> str:
    """Ticks, numbers and grid lines below a plot."""
    parts = [line(scale.start, y, scale.end, y, "axis")]
    for t in scale.ticks:
        x = scale(t)
        parts += [line(x, y, x, top, "grid"), label(x, y + 15, tick_text(t), "tick", "middle")]
    if title:
        parts.append(label((scale.start + scale.end) / 2, y + 32, title, "axis-title", "middle"))
    return "".join(parts)


def left_axis(scale: AxisScale, x: float, right: float, title: str = "") -> str:
    """Ticks, numbers and grid lines left of a plot; the title stands above."""
    parts = []
    for t in scale.ticks:
        y = scale(t)
        parts += [line(x, y, right, y, "grid"), label(x - 7, y + 4, tick_text(t), "tick", "end")]
    if title:
        parts.append(label(max(4, x - 36), scale.end - 14, title, "axis-title"))
    return "".join(parts)


def axes(x: AxisScale, y: AxisScale, across: str, up: str = "") -> str:
    """Both axes of a plot with their titles."""
    return bottom_axis(x, y.start, y.end, across) + left_axis(y, x.start, x.end, up)


def count_axis(x: AxisScale, ticks: Iterable[float], y: float, ends: tuple[float, float], title: str) -> str:
    """An axis of whole numbers from one end to the other, without grid lines."""
    left, right = ends
    marks = "".join(label(x(t), y + 16, str(int(t)), "tick", "middle") for t in ticks if t == int(t))
    return line(left, y, right, y, "axis") + marks + label((left + right) / 2, y + 36, title, "axis-title", "middle")

"""Tensions over a list of poses: a strip per cable, the limits as a band, and where no tensions hold the platform."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._types import Array
from robocal.errors import ModelError
from robocal.report.cable.drawing import brief, figure
from robocal.report.numbers import significant
from robocal.report.svg import AxisScale, circles, label, line, nice_ticks, num, path, polyline, rect, tick_text

__all__ = ["tensions"]

RIGHT, TOP, STRIP, GAP = 914.0, 44.0, 56.0, 12.0
MOST = 1200  # poses that are drawn one by one; of more, each column of the picture shows the least and the most


def tensions(names: Sequence[str], tension: ArrayLike, limits: ArrayLike, cables: Sequence[str]) -> str:
    """The picture (SVG) of tension (k, m) N over the poses `names` (k,), with limits (m, 2) N; a row with NaN is a pose at which
    nothing holds. Raises ModelError for shapes that do not fit."""
    t, band = np.asarray(tension, float), np.asarray(limits, float)
    if t.ndim != 2 or t.shape != (len(names), len(cables)) or band.shape != (len(cables), 2) or not len(names):
        expected = f"({len(names)}, {len(cables)}) and limits ({len(cables)}, 2)"
        raise ModelError("tensions to be drawn", expected=expected, found=(t.shape, band.shape))
    k = len(names)
    bad = ~np.isfinite(t).all(axis=1)
    left = 58.0 + 7.9 * max(len(brief(c)) for c in cables)
    x = AxisScale(0.5, k + 0.5, left, RIGHT)
    limit, most = (float(v[np.isfinite(v)].max(initial=0.0)) for v in (band, t))
    low = float(min(0.0, t[np.isfinite(t)].min(initial=0.0)))
    # Small tensions are worth more room than a limit that is far away.
    top = (1.5 * most if 0.0 < most < 0.4 * limit else max(limit, most)) or 1.0
    height = TOP + len(cables) * (STRIP + GAP) + 40
    legend = _legend(left, bool(bad.any()), limit if limit > 1.06 * top else None)
    strips, values = [], []
    for i, cable in enumerate(cables):
        upper = TOP + i * (STRIP + GAP)
        y = AxisScale(low, 1.06 * top, upper + STRIP, upper)
        strips.append(_strip(brief(cable), band[i], x, y))
        values.append(_values(t[:, i], x, y, band[i]))
    parts = [label(left, 16, "tension, N", "strong"), legend, *strips, _columns(bad, x, TOP, height - 40 - GAP)]
    parts += [*values, _poses(names, x, height - 40 - GAP)]
    said = f"{k} poses, {int(bad.sum())} of them without tensions that hold the platform."
    if not bad.all():
        said += f" Tensions from {significant(float(np.nanmin(t)))} to {significant(float(np.nanmax(t)))} N."
    return figure("series", RIGHT + 26, height, parts, title="Tensions over the list of poses", text=said)


def _strip(cable: str, band: Array, x: AxisScale, y: AxisScale) -> str:
    parts = [label(x.start - 44, (y.start + y.end) / 2 + 4, cable, "strong", "end")]
    least, most = (min(max(v, y.low), y.high) for v in np.nan_to_num(band, nan=y.low, posinf=y.high).tolist())
    parts.append(rect(x.start, y(most), x.end - x.start, y(least) - y(most), "band"))
    parts += [line(x.start, y(v), x.end, y(v), "border") for v in (least, most) if v < y.high]
    parts.append(line(x.start, y.start, x.end, y.start, "axis"))
    parts += [label(x.start - 7, y(t) + 4, tick_text(t), "tick", "end") for t in nice_ticks(0.0, y.high, 2)]
    return "".join(parts)


def _values(t: Array, x: AxisScale, y: AxisScale, band: Array) -> str:
    """Dots, joined by a thin line wherever the pose before has tensions too."""
    k = len(t)
    if k > MOST:
        return _envelope(t, x, y)
    at = np.stack([x.many(np.arange(1.0, k + 1)), y.many(t)], axis=1)
    fine = np.isfinite(t)
    runs = [run[np.isfinite(run[:, 1])] for run in np.split(at, np.flatnonzero(~fine))]
    air = 1e-6 * float(np.abs(band).max())
    size = 2.4 if k <= 150 else 1.4
    beyond = fine & ((t < band[0] - air) | (t > band[1] + air))
    groups = {"value": fine & ~beyond, "value beyond": beyond}
    dots = (path(circles(at[those].tolist(), size), cls) for cls, those in groups.items())
    return path("".join(polyline(run.tolist()) for run in runs), "join") + "".join(dots)


def _envelope(t: Array, x: AxisScale, y: AxisScale) -> str:
    edges = np.linspace(0, len(t), 601).astype(int)
    d = []
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part = t[a:b][np.isfinite(t[a:b])]
        if len(part):
            d.append(f"M{num(x((a + b + 1) / 2))} {num(y(float(part.min())) + 0.6)}V{num(y(float(part.max())) - 0.6)}")
    return path("".join(d), "envelope")


def _columns(bad: NDArray[np.bool_], x: AxisScale, top: float, bottom: float) -> str:
    """A column through all strips for every run of poses at which nothing holds."""
    d = []
    for a, b in np.flatnonzero(np.diff([0, *bad.astype(int), 0])).reshape(-1, 2).tolist():
        left, right = x(a + 0.5), x(b + 0.5)
        short = max(1.2 - (right - left), 0.0) / 2
        left, right = max(left - short, x.start), min(right + short, x.end)
        d.append(f"M{num(left)} {num(top)}H{num(right)}V{num(bottom)}H{num(left)}z")
    return path("".join(d), "lost")


def _poses(names: Sequence[str], x: AxisScale, y: float) -> str:
    """Names of the poses where they fit, or their ordinals."""
    k = len(names)
    if max(len(n) for n in names) * 7 + 8 <= (x.end - x.start) / k:
        ticks, title = dict(enumerate(names, 1)), "pose"
    else:
        ticks = {round(t): tick_text(t) for t in nice_ticks(1, k, 8) if t >= 1 and abs(t - round(t)) < 1e-9}
        title = f"pose, in the order of the list ({brief(names[0])} to {brief(names[-1])})"
    told = "".join(label(x(at), y + 17, word, "tick", "middle") for at, word in ticks.items())
    return told + label((x.start + x.end) / 2, y + 36, title, "axis-title", "middle")


def _legend(left: float, lost: bool, above: float | None) -> str:
    word = "within the limits" + (f" (up to {tick_text(above)} N, above the strips)" if above is not None else "")
    text = rect(left + 100, 6, 16, 11, "band") + label(left + 122, 16, word, "name")
    if not lost:
        return text
    x = left + 152 + 6.8 * len(word)
    return text + rect(x, 6, 16, 11, "lost") + label(x + 22, 16, "no tensions hold the platform", "name")

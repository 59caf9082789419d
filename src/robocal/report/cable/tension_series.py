"""Tensions over a list of poses: a strip per cable, the limits as a band, and where no tensions hold the platform."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._types import Array
from robocal.errors import ModelError
from robocal.report.cable.drawing import brief, figure
from robocal.report.numbers import significant
from robocal.report.svg import AxisScale, label, line, nice_ticks, num, path, tick_text

__all__ = ["tensions"]

RIGHT, TOP, STRIP, GAP = 914.0, 44.0, 56.0, 12.0
MOST = 1200  # poses that are drawn one by one; of more, each column of the picture shows the least and the most


def tensions(names: Sequence[str], tension: ArrayLike, limits: ArrayLike, cables: Sequence[str]) -> str:
    """The picture (SVG) of tension (k, m) N over the poses `names` (k,), with limits (m, 2) N; a row with NaN is a pose at which
    nothing holds. Raises ModelError for shapes that do not fit."""
    t, band = np.asarray(tension, float), np.asarray(limits, float)
    if t.ndim != 2 or t.shape != (len(names), len(cables)) or band.shape != (len(cables), 2) or not len(names):
        raise ModelError(
            "tensions to be drawn",
            expected=f"({len(names)}, {len(cables)}) and limits ({len(cables)}, 2)",
            found=(t.shape, band.shape),
        )
    k = len(names)
    bad = ~np.isfinite(t).all(axis=1)
    left = 58.0 + 7.9 * max(len(brief(c)) for c in cables)
    x = AxisScale(0.5, k + 0.5, left, RIGHT)
    limit, most = (float(v[np.isfinite(v)].max(initial=0.0)) for v in (band, t))
    low = float(min(0.0, t[np.isfinite(t)].min(initial=0.0)))
    # Small tensions are worth more room than a limit that is far away.
    top = (1.5 * most if 0.0 < most < 0.4 * limit else max(limit, most)) or 1.0
    height = TOP + len(cables) * (STRIP + GAP) + 40
    parts = [
        label(left, 16, "tension, N", "strong"),
        _legend(left, bool(bad.any()), limit if limit > 1.06 * top else None),
    ]
    strips, values = [], []
    for i, cable in enumerate(cables):
        upper = TOP + i * (STRIP + GAP)
        y = AxisScale(low, 1.06 * top, upper + STRIP, upper)
        strips.append(_strip(brief(cable), band[i], x, y))
        values.append(_values(t[:, i], x, y, band[i]))
    parts += [*strips, _columns(bad, x, TOP, height - 40 - GAP), *values]
    parts.append(_poses(names, x, height - 40 - GAP))
    said = f"{k} poses, {int(bad.sum())} of them without tensions that hold the platform."
    if not bad.all():
        said += f" Tensions from {significant(float(np.nanmin(t)))} to {significant(float(np.nanmax(t)))} N."
    return figure("series", RIGHT + 26, height, parts, title="Tensions over the list of poses", text=said)


def _strip(cable: str, band: Array, x: AxisScale, y: AxisScale) -> str:
    parts = [label(x.start - 44, (y.start + y.end) / 2 + 4, cable, "strong", "end")]
    least, most = (min(max(v, y.low), y.high) for v in np.nan_to_num(band, nan=y.low, posinf=y.high).tolist())
    parts.append(
        f'<rect class="band" x="{num(x.start)}" y="{num(y(most))}" width="{num(x.end - x.start)}" height="{num(y(least) - y(most))}"/>'
    )
    parts += [line(x.start, y(v), x.end, y(v), "border") for v in (least, most) if v < y.high]
    parts.append(line(x.start, y.start, x.end, y.start, "axis"))
    for t in nice_ticks(0.0, y.high, 2):
        parts.append(label(x.start - 7, y(t) + 4, tick_text(t), "tick", "end"))
    return "".join(parts)


def _values(t: Array, x: AxisScale, y: AxisScale, band: Array) -> str:
    """Dots, joined by a thin line wherever the pose before has tensions too."""
    k = len(t)
    if k > MOST:
        return _envelope(t, x, y)
    fine = np.isfinite(t)
    at = [(x(i + 1), y(v)) if ok else None for i, (v, ok) in enumerate(zip(t.tolist(), fine.tolist(), strict=True))]
    d, before = [], None
    for p in at:
        if p is not None:
            d.append(f"{'L' if before else 'M'}{num(p[0])} {num(p[1])}")
        before = p
    air = 1e-6 * float(np.abs(band).max())
    out = fine & ((np.nan_to_num(t) < band[0] - air) | (np.nan_to_num(t) > band[1] + air))
    size = 2.4 if k <= 150 else 1.4
    dots = ["", ""]
    for p, bad in zip(at, out.tolist(), strict=True):
        if p is not None:
            dots[bad] += (
                f"M{num(p[0] - size)} {num(p[1])}a{size} {size} 0 1 0 {2 * size} 0a{size} {size} 0 1 0 {-2 * size} 0z"
            )
    return path("".join(d), "join") + path(dots[0], "value") + path(dots[1], "value beyond")


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
    edge = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(int), [0]])))
    d = []
    for a, b in zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True):
        left, right = x(a + 0.5), x(b + 0.5)
        short = max(1.2 - (right - left), 0.0) / 2
        left, right = max(left - short, x.start), min(right + short, x.end)
        d.append(f"M{num(left)} {num(top)}H{num(right)}V{num(bottom)}H{num(left)}z")
    return path("".join(d), "lost")


def _poses(names: Sequence[str], x: AxisScale, y: float) -> str:
    """Names of the poses where they fit, or their ordinals."""
    k = len(names)
    room = (x.end - x.start) / k
    if max(len(n) for n in names) * 7 + 8 <= room:
        return "".join(label(x(i + 1), y + 17, n, "tick", "middle") for i, n in enumerate(names)) + label(
            (x.start + x.end) / 2, y + 36, "pose", "axis-title", "middle"
        )
    ticks = [t for t in nice_ticks(1, k, 8) if t >= 1 and abs(t - round(t)) < 1e-9]
    return "".join(label(x(t), y + 17, tick_text(t), "tick", "middle") for t in ticks) + label(
        (x.start + x.end) / 2,
        y + 36,
        f"pose, in the order of the list ({brief(names[0])} to {brief(names[-1])})",
        "axis-title",
        "middle",
    )


def _legend(left: float, lost: bool, above: float | None) -> str:
    word = "within the limits" + (f" (up to {tick_text(above)} N, above the strips)" if above is not None else "")
    parts = [
        f'<rect class="band" x="{num(left + 100)}" y="6" width="16" height="11"/>',
        label(left + 122, 16, word, "name"),
    ]
    if lost:
        x = left + 152 + 6.8 * len(word)
        parts += [
            f'<rect class="lost" x="{num(x)}" y="6" width="16" height="11"/>',
            label(x + 22, 16, "no tensions hold the platform", "name"),
        ]
    return "".join(parts)

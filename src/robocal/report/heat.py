"""Slices through the workspace as coloured cells: how wrong the nominal model is, and how well the corrected one is
known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.report.numbers import significant, with_unit
from robocal.report.series import is_word, numbers
from robocal.report.svg import AxisScale, drawing, label, line, log_ticks, nice_ticks, num, tick_text

__all__ = ["COLOURS", "WIDTH", "colour_bar", "colour_scale", "colour_steps", "heat"]

Columns = Mapping[str, Sequence[object]]
# Ten steps of viridis (Smith and van der Walt, 2015): even in lightness, readable in grey and by every eye.
COLOURS = (
    "#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725",
)  # fmt: skip
QUANTITIES = {"nominal_error_mm": "error of the nominal model", "band_mm": "95 % band of the corrected model"}
SLICES = {"horizontal": ("x", "y", "z"), "vertical": ("x", "z", "y")}
NEAR = 0.22  # share of a scale that its ends' numbers need
WIDTH, GAP, LEFT, TOP = 400.0, 78.0, 58.0, 58.0


def heat(columns: Columns) -> str:
    """One row of two pictures per slice, each quantity on a logarithmic scale of its own, above it; empty text without cells."""
    slices = {name: found for name in SLICES if len(found := _cells(columns, name))}
    if not slices:
        return ""
    everything = np.concatenate(list(slices.values()))
    side = float(everything[0, 2])
    scales = [colour_scale(everything[:, 3 + k]) for k in (0, 1)]
    half = max(float(np.abs(everything[:, 0]).max()), 1e-9) + side
    parts, y = [colour_bar(scale, LEFT + k * (WIDTH + GAP)) for k, scale in enumerate(scales)], TOP
    for k, title in enumerate(QUANTITIES.values()):
        parts.append(label(LEFT + k * (WIDTH + GAP), TOP - 12, f"{title}, mm", "strong"))
    for name, cells in slices.items():
        low, high = float(cells[:, 1].min()) - side, float(cells[:, 1].max()) + side
        height = WIDTH * (high - low) / (2 * half)
        across = numbers(columns, f"{SLICES[name][2]}_mm")[is_word(columns, "slice", name)]
        level = next((v for v in across.tolist() if not math.isnan(v)), 0.0)
        for k in (0, 1):
            x = AxisScale(-half, half, LEFT + k * (WIDTH + GAP), LEFT + k * (WIDTH + GAP) + WIDTH)
            shown = cells[:, [0, 1, 2, 3 + k]]
            parts.append(_panel(name, shown, scales[k], x, AxisScale(low, high, y + height, y), level))
        y += height + 62
    told = zip(QUANTITIES.values(), everything[:, 3:].max(axis=0), everything[:, 3:].mean(axis=0), strict=True)
    said = " ".join(
        f"{title}: up to {with_unit(significant(float(most)), 'mm')}, mean {with_unit(significant(float(mean)), 'mm')}."
        for title, most, mean in told
    )
    wide, title = LEFT + 2 * WIDTH + GAP + 16, "Accuracy over the workspace"
    return drawing(wide, y, parts, title=title, text=said, key="heat", cls="wide")


def _cells(columns: Columns, name: str) -> Array:
    """Of each cell of a slice its centre along u and v, its side, and its two values, (n, 5) mm."""
    u, v, _ = SLICES[name]
    found = np.stack([numbers(columns, n) for n in (f"{u}_mm", f"{v}_mm", "side_mm", *QUANTITIES)], axis=1)
    fine = ~np.isnan(found).any(axis=1) & (found[:, 2] > 0) & (found[:, 3:] >= 0).all(axis=1)
    return found[fine & is_word(columns, "slice", name)]


def colour_scale(values: Array, decades: float = 4.0) -> AxisScale:
    """From values to steps of colour, 0 to their number; so many decades at most."""
    top = float(values.max())
    low, high = (float(values[values > top * 10**-decades].min()), top) if top > 0 else (1.0, 10.0)
    return AxisScale(low, max(high, 1.2 * low), 0.0, float(len(COLOURS)), log=True)


def colour_steps(scale: AxisScale, values: Array) -> NDArray[np.int64]:
    """Which of the colours each value (n,) has."""
    return np.minimum(scale.many(np.maximum(values, scale.low)).astype(np.int64), len(COLOURS) - 1)


def _panel(name: str, cells: Array, scale: AxisScale, x: AxisScale, y: AxisScale, level: float) -> str:
    u, v, w = SLICES[name]
    across, up, side, values = cells.T
    steps = colour_steps(scale, values)
    left, top = x.many(across - side / 2), y.many(up + side / 2)
    # A hair wider than the cell, so that no seam shows.
    wide, high = x.many(across + side / 2) - left + 0.3, y.many(up - side / 2) - top + 0.3
    marks: dict[int, list[str]] = {}
    for step, *at in zip(*(a.tolist() for a in (steps, left, top, wide, high)), strict=True):
        marks.setdefault(step, []).append("M{0:.2f} {1:.2f}h{2:.2f}v{3:.2f}H{0:.2f}z".format(*at))
    parts = [f'<path fill="{COLOURS[i]}" d="{"".join(d)}"/>' for i, d in sorted(marks.items())]
    # The axis of the base.
    parts.append(line(x(0), y.start, x(0), y.end, "mid"))
    if name == "horizontal" and y.low < 0 < y.high:
        parts.append(line(x.start, y(0), x.end, y(0), "mid"))
    for t in nice_ticks(x.low, x.high, 4):
        parts += [
            line(x(t), y.start, x(t), y.start + 4, "axis"),
            label(x(t), y.start + 17, tick_text(t), "tick", "middle"),
        ]
    for t in nice_ticks(y.low, y.high, 4):
        parts += [
            line(x.start - 4, y(t), x.start, y(t), "axis"),
            label(x.start - 7, y(t) + 4, tick_text(t), "tick", "end"),
        ]
    parts += [line(x.start, y.start, x.end, y.start, "axis"), line(x.start, y.start, x.start, y.end, "axis")]
    where = f"{name} slice at {w} = {with_unit(f'{level:.0f}', 'mm')}; {u} to the right, {v} {'up' if v == 'z' else 'away'}, mm"
    parts.append(label((x.start + x.end) / 2, y.start + 34, where, "axis-title", "middle"))
    return "".join(parts)


def colour_bar(scale: AxisScale, left: float) -> str:
    """A scale of colours, in mm."""
    step = WIDTH / len(COLOURS)
    parts = [
        f'<rect x="{num(left + i * step)}" y="2" width="{step + 0.3:.1f}" height="10" fill="{colour}"/>'
        for i, colour in enumerate(COLOURS)
    ]
    room = NEAR * len(COLOURS)
    ticks = [t for t in log_ticks(scale.low, scale.high) if room <= scale(t) <= len(COLOURS) - room]
    parts += [label(left + scale(t) * step, 26, f"{tick_text(t)} mm", "tick", "middle") for t in ticks]
    for end, at, anchor in ((scale.low, left, "start"), (scale.high, left + WIDTH, "end")):
        parts.append(label(at, 26, with_unit(significant(end, 2), "mm"), "tick", anchor))
    return "".join(parts)

"""Slices through the workspace as coloured cells: how wrong the nominal model is, and how well the corrected one is
known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from robocal.report.numbers import finite, significant, with_unit
from robocal.report.series import column
from robocal.report.svg import AxisScale, drawing, label, line, log_ticks, nice_ticks, num, tick_text

__all__ = ["heat"]

Columns = Mapping[str, Sequence[object]]
# Ten steps of viridis (Smith and van der Walt, 2015): even in lightness, readable in grey and by every eye.
COLOURS = (
    "#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725",
)  # fmt: skip
QUANTITIES = (("nominal_error_mm", "error of the nominal model"), ("band_mm", "95 % band of the corrected model"))
SLICES = {"horizontal": ("x", "y", "z"), "vertical": ("x", "z", "y")}
WIDTH, GAP, LEFT, TOP = 400.0, 78.0, 58.0, 58.0


@dataclass(frozen=True)
class Cell:
    """A cell of one slice: its centre along u and v, its side, and its two values (mm)."""

    u: float
    v: float
    side: float
    values: tuple[float, float]


def heat(columns: Columns) -> str:
    """One row of two pictures per slice, both on one logarithmic scale, so that one colour is one error; empty text without
    cells."""
    slices = {name: found for name in SLICES if (found := _cells(columns, name))}
    if not slices:
        return ""
    everything = [c for cells in slices.values() for c in cells]
    scale = _scale([v for c in everything for v in c.values])
    half = max(max(abs(c.u) for c in everything), 1e-9) + everything[0].side
    parts, y = [_legend(scale)], TOP
    for k, (_, title) in enumerate(QUANTITIES):
        parts.append(label(LEFT + k * (WIDTH + GAP), TOP - 12, f"{title}, mm", "strong"))
    for name, cells in slices.items():
        low, high = min(c.v for c in cells) - cells[0].side, max(c.v for c in cells) + cells[0].side
        height = WIDTH * (high - low) / (2 * half)
        for k in (0, 1):
            x = AxisScale(-half, half, LEFT + k * (WIDTH + GAP), LEFT + k * (WIDTH + GAP) + WIDTH)
            parts.append(_panel(name, cells, k, scale, x, AxisScale(low, high, y + height, y), _level(columns, name)))
        y += height + 62
    said = " ".join(
        f"{title}: up to {with_unit(significant(max(c.values[k] for c in everything)), 'mm')}, mean "
        f"{with_unit(significant(math.fsum(c.values[k] for c in everything) / len(everything)), 'mm')}."
        for k, (_, title) in enumerate(QUANTITIES)
    )
    return drawing(
        LEFT + 2 * WIDTH + GAP + 16, y, parts, title="Accuracy over the workspace", text=said, key="heat", cls="wide"
    )  # fmt: skip


def _cells(columns: Columns, name: str) -> list[Cell]:
    u, v, _ = SLICES[name]
    names = (f"{u}_mm", f"{v}_mm", "side_mm", *(q for q, _ in QUANTITIES))
    rows = zip(column(columns, "slice"), *(column(columns, n) for n in names), strict=True)
    out = []
    for slice_, *values in rows:
        found = [finite(x) for x in values]
        numbers = [x for x in found if x is not None]
        if slice_ == name and len(numbers) == len(found) and numbers[2] > 0 and min(numbers[3:]) >= 0:
            out.append(Cell(numbers[0], numbers[1], numbers[2], (numbers[3], numbers[4])))
    return out


def _level(columns: Columns, name: str) -> float:
    """Where a slice cuts."""
    across = column(columns, f"{SLICES[name][2]}_mm")
    found = [finite(v) for s, v in zip(column(columns, "slice"), across, strict=True) if s == name]
    return next((v for v in found if v is not None), 0.0)


def _scale(values: Sequence[float]) -> AxisScale:
    """From values to steps of colour, 0 to their number; four decades at most."""
    top = max(values)
    positive = [v for v in values if v > top * 1e-4]
    low, high = (min(positive), top) if positive else (1.0, 10.0)
    return AxisScale(low, max(high, 1.2 * low), 0.0, float(len(COLOURS)), log=True)


def _panel(name: str, cells: Sequence[Cell], k: int, scale: AxisScale, x: AxisScale, y: AxisScale, level: float) -> str:
    u, v, w = SLICES[name]
    marks: dict[int, list[str]] = {}
    for c in cells:
        step = min(int(scale(max(c.values[k], scale.low))), len(COLOURS) - 1)
        left, upper = x(c.u - c.side / 2), y(c.v + c.side / 2)
        # A hair wider than the cell, so that no seam shows.
        marks.setdefault(step, []).append(
            f"M{left:.2f} {upper:.2f}h{x(c.u + c.side / 2) - left + 0.3:.2f}v{y(c.v - c.side / 2) - upper + 0.3:.2f}H{left:.2f}z"
        )
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


def _legend(scale: AxisScale) -> str:
    """The one scale of colours."""
    left, step = LEFT, (2 * WIDTH + GAP) / len(COLOURS)
    parts = [
        f'<rect x="{num(left + i * step)}" y="2" width="{step + 0.3:.1f}" height="10" fill="{colour}"/>'
        for i, colour in enumerate(COLOURS)
    ]
    ticks = [t for t in log_ticks(scale.low, scale.high) if scale.low <= t <= scale.high]
    parts += [label(left + scale(t) * step, 26, f"{tick_text(t)} mm", "tick", "middle") for t in ticks]
    return "".join(parts)

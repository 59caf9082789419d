"""Error arrows at the tool's positions in two panels, before and after: drawn here once, turned by viewer.js in the
browser.

The view is orthographic (`view.py` has the formulas). Both sides use the same formulas and numbers, so a page without scripts,
or on paper, shows the script's first view.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from robocal._types import Array
from robocal.report.numbers import plain, significant, with_decimals
from robocal.report.sections import Figure, Mark
from robocal.report.series import column, is_aside, is_held_out, numbers
from robocal.report.svg import drawing, label, num, segments
from robocal.report.view import View

__all__ = ["arrows"]

Rows: TypeAlias = Sequence[Sequence[float]]  # of three numbers

WIDE, HIGH = 460.0, 440.0
HALF = 200.0  # half of the drawn space, from the middle to the farthest corner
FAR = 1e9  # mm; beyond this it is no position
MOST = 2000  # arrows of a picture
LONG = 34.0  # the 90th percentile of arrows is drawn this long
VIEW = View(-55.0, 24.0, np.zeros(3), (WIDE / 2, HIGH / 2 - 14))
BARBED = "M%.1f %.1fL%.1f %.1fM%.1f %.1fL%.1f %.1fL%.1f %.1f"
WHOLE = re.compile(r"\.0(?![0-9])")  # as `svg.num` leaves it out


CONTROLS = """<div class="controls" id="arrow-controls" hidden>
<label>Arrow length <input type="range" id="arrow-length" min="-1" max="1" step="0.05" value="0"></label>
<label><input type="checkbox" id="arrow-same"> same magnification in both</label>
<span><button type="button" id="arrow-in" aria-label="Zoom in">+</button>
<button type="button" id="arrow-out" aria-label="Zoom out">\u2212</button>
<button type="button" id="arrow-reset">Reset</button></span>
<span>Drag, or use the arrow keys, to turn; Ctrl and wheel to zoom; point at an arrow for its name.</span></div>"""
CAPTION = (
    "Left: before; right: after. Each arrow starts at the tool's predicted position and shows its error, enlarged as written "
    "below it. The panels may differ in magnification: compare the scale bars. Errors with a pattern can be corrected by a "
    "model; what remains should look random. The box holds all positions: {box}. {share}"
)


def arrows(residuals: Mapping[str, Sequence[object]]) -> Figure | None:
    """Two pictures, with the numbers that viewer.js needs (JSON, safe inside a script element). Draws all rows that have a
    position and an error before and after, but those set aside, whose arrows would leave the others no length; None when
    there are none."""
    names = [f"{axis}_mm" for axis in "xyz"] + [f"d{axis}_{k}_mm" for k in ("before", "after") for axis in "xyz"]
    table = np.stack([numbers(residuals, name) for name in names], axis=1)
    table[~(np.abs(table) < FAR)] = np.nan
    used = ~np.isnan(table).any(axis=1) & ~is_aside(residuals)
    if not used.any():
        return None
    table, held = table[used], is_held_out(residuals)[used]
    corners = np.stack([table[:, :3].min(axis=0), table[:, :3].max(axis=0)])
    every, step = len(table), -(-len(table) // MOST)
    drawn = np.arange(every) % step == 0  # more would be one black cloud
    for k in (3, 6):  # but the largest error before and after is to be seen
        drawn[np.linalg.norm(table[:, k : k + 3], axis=1).argmax()] = True
    rows, middle, radius = table[drawn], corners.mean(axis=0), math.dist(*corners.tolist()) / 2
    scale = HALF / radius if radius > 0 else 1.0
    bounds, at = _round((corners - middle) * scale, 4), _round((rows[:, :3] - middle) * scale, 4)
    errors = (_round(rows[:, 3:6], 5), _round(rows[:, 6:], 5))
    out = held[drawn].astype(int).tolist()
    names = [str(name) for name in np.array(column(residuals, "configuration"), dtype=object)[used][drawn]]
    magnification = (_magnify(errors[0], scale), _magnify(errors[1], scale))
    data = {
        "at": at,
        "before": errors[0],
        "after": errors[1],
        "out": out,
        "names": names,
        "bounds": bounds,
        "scale": scale,
        "view": [VIEW.azimuth, VIEW.elevation],
        "mag": magnification,
    }
    # Whatever a configuration is called, it does not end the script element.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    pictures = [_panel(k, at, errors[k], out, bounds, scale, magnification[k]) for k in (0, 1)]
    ends = zip("xyz", *corners.tolist(), strict=True)
    box = ", ".join(f"{a} from {with_decimals(u, 0)} to {with_decimals(v, 0)}" for a, u, v in ends)
    share = f"Of {every} rows one in {step} is drawn, and those with the largest errors. " if step > 1 else ""
    svg = (
        f'<div id="arrows"><div class="pair"><div>{pictures[0]}</div><div>{pictures[1]}</div></div>{CONTROLS}'
        f'<script type="application/json" id="arrow-data">{text}</script></div>'
    )
    legend: tuple[tuple[Mark, str], ...] = (("after", "fit"), ("held", "held out (bold)")) if any(out) else ()
    return Figure(svg, CAPTION.format(box=f"{box} mm", share=share).strip(), "Where the errors point", legend)


def _round(rows: Array, digits: int) -> list[list[float]]:
    """The same numbers with so many significant digits."""
    told = (f"%.{digits}g " * rows.size) % tuple(rows.ravel().tolist())
    rounded: list[list[float]] = np.array(told.split(), dtype=float).reshape(rows.shape).tolist()
    return rounded


def _magnify(errors: Rows, scale: float) -> float:
    """A round magnification that draws the 90th percentile about LONG."""
    sizes = sorted(math.hypot(*e) for e in errors)
    typical = sizes[int(0.9 * (len(sizes) - 1))] or sizes[-1]
    if typical <= 0:
        return 1.0
    return float(f"{_round_down(LONG / (typical * scale)):.1g}")


def _round_down(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(s * power for s in (1, 2, 5) if s * power <= value * 1.0001)


def _flat(points: Array) -> Array:
    """Points (n, 3) on the page, (n, 2)."""
    return VIEW.flat(points)[0]


def _arrows(points: Array, errors: Array, factor: float) -> list[str]:
    """For each point (n, 3) and error a shaft with two barbs, or a dot where the arrow would be shorter than a pixel."""
    start, tip = _flat(points), _flat(points + factor * errors)
    shaft = tip - start
    long = np.hypot(*shaft.T)
    share = np.minimum(5.0, long * 0.45) / np.maximum(long, 1e-300)
    foot = tip - shaft * share[:, None]
    out = shaft[:, ::-1] * share[:, None] * [0.5, -0.5]
    rows = np.concatenate([start, tip, foot + out, foot - out], axis=1).tolist()
    return [
        f"M{num(x)} {num(y)}h0" if dot else BARBED % (x, y, u, v, a, b, u, v, c, d)
        for (x, y, u, v, a, b, c, d), dot in zip(rows, (long < 1).tolist(), strict=True)
    ]


def _box(bounds: Rows) -> tuple[str, list[tuple[str, float, float]]]:
    """The edges of the measured box, and where the names of its axes stand: at the high end of an outer edge."""
    low, high = bounds
    corners = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
    edges = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]
    flat: list[tuple[float, float]] = _flat(np.array(corners)).tolist()
    d = segments((*flat[i], *flat[j]) for i, j in edges)
    names = []
    for k in range(3):
        start, end = max((e for e in edges if e[0] ^ e[1] == 1 << k), key=lambda e: _outside(flat[e[0]], flat[e[1]]))
        (x0, y0), (x1, y1) = flat[start], flat[end]
        long = math.hypot(x1 - x0, y1 - y0) or 1.0
        names.append(("xyz"[k], x1 + 11 * (x1 - x0) / long, y1 + 11 * (y1 - y0) / long + 4))
    return d, names


def _outside(a: tuple[float, float], b: tuple[float, float]) -> float:
    """How far out an edge lies, the lower of two equal ones first."""
    x, y = (a[0] + b[0]) / 2 - WIDE / 2, (a[1] + b[1]) / 2 - HIGH / 2 + 14
    return math.hypot(x, y) + 0.05 * y


def _panel(k: int, at: Rows, errors: Rows, out: Sequence[int], bounds: Rows, scale: float, magnification: float) -> str:
    key = ("before", "after")[k]
    factor = scale * magnification
    edges, names = _box(bounds)
    classes = (key, "held" if k else key)
    shapes = _arrows(np.array(at), np.array(errors), factor)
    bodies = [WHOLE.sub("", "".join(d for d, o in zip(shapes, out, strict=True) if o == which)) for which in (0, 1)]
    value, foot = _round_down(90 / factor), HIGH - 14  # mm, the length of the scale bar
    parts = [f'<path class="box" data-part="box" d="{edges}"/>']
    parts += [label(x, y, name, "tick axis-name", "middle") for name, x, y in names]
    parts += [f'<path class="arrow {classes[w]}" data-part="{w}" d="{bodies[w]}"/>' for w in (0, 1)]
    parts += [
        f'<path class="axis bar-line" data-part="bar" d="M14 {num(foot)}m0-4v8m0-4h{num(value * factor)}m0-4v8"/>',
        f'<text data-part="bar-text" class="strong" x="14" y="{num(foot - 10)}">error of {plain(value)} mm</text>',
        f'<text data-part="mag" class="tick" text-anchor="end" x="{num(WIDE - 8)}" y="{num(foot + 4)}">'
        f"arrows × {plain(magnification)}</text>",
        '<text data-part="said" class="strong" x="14" y="20" aria-live="polite"></text>',
    ]
    sizes = [math.hypot(*e) for e in errors]
    said = (
        f"{len(errors)} arrows at the tool's positions, drawn {plain(magnification)} times longer than in reality; "
        f"mean length {significant(sum(sizes) / len(sizes))} mm, largest {significant(max(sizes))} mm."
    )
    title = ("Error arrows of the nominal model", "Error arrows that remain after calibration")[k]
    more = f' data-panel="{key}"'
    return drawing(WIDE, HIGH, parts, title=title, text=said, key=f"arrows-{key}", cls="space", more=more)

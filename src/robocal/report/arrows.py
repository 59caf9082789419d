"""Error arrows at positions, in panels side by side such as before and after: drawn here once, turned by viewer.js in the browser.

The view is orthographic (`view.py` has the formulas). Both sides use the same formulas and numbers, so a page without scripts,
or on paper, shows the script's first view.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import TypeAlias

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.report.numbers import plain, significant, with_decimals
from robocal.report.sections import Figure, Mark
from robocal.report.series import column, is_aside, is_held_out, numbers
from robocal.report.svg import drawing, label, num, segments
from robocal.report.view import View

__all__ = ["Panel", "arrows", "turned_arrows"]

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
<label><input type="checkbox" id="arrow-same"> same magnification in all</label>
<span><button type="button" id="arrow-in" aria-label="Zoom in">+</button>
<button type="button" id="arrow-out" aria-label="Zoom out">\u2212</button>
<button type="button" id="arrow-reset">Reset</button></span>
<span>Drag, or use the arrow keys, to turn; Ctrl and wheel to zoom; point at an arrow for its name.</span></div>"""
CAPTION = (
    "Left: before; right: after. Each arrow starts at the tool's predicted position and shows its error, enlarged as written "
    "below it. The panels may differ in magnification: compare the scale bars. Errors with a pattern can be corrected by a "
    "model; what remains should look random. The box holds all positions: {box}. {share}"
)


@record(eq=False)
class Panel:
    """One picture of arrows: its key, a title for those who cannot see it, errors (n, 3) mm, the classes of arrows that are not and that
    are held out, and a name that is written in it."""

    key: str
    title: str
    errors: Array
    marks: tuple[str, str]
    name: str = ""


def arrows(residuals: Mapping[str, Sequence[object]]) -> Figure | None:
    """Two pictures, before and after. Draws all rows that have a position and an error before and after, but those set aside, whose arrows
    would leave the others no length; None when there are none."""
    names = [f"{axis}_mm" for axis in "xyz"] + [f"d{axis}_{k}_mm" for k in ("before", "after") for axis in "xyz"]
    table = np.stack([numbers(residuals, name) for name in names], axis=1)
    table[~(np.abs(table) < FAR)] = np.nan
    used = ~np.isnan(table).any(axis=1) & ~is_aside(residuals)
    if not used.any():
        return None
    table, held = table[used], is_held_out(residuals)[used]
    panels = (
        Panel("before", "Error arrows of the nominal model", table[:, 3:6], ("before", "before")),
        Panel("after", "Error arrows that remain after calibration", table[:, 6:], ("after", "held")),
    )
    every, step = len(table), -(-len(table) // MOST)
    share = f"Of {every} rows one in {step} is drawn, and those with the largest errors. " if step > 1 else ""
    caption = CAPTION.format(box=_box_text(table[:, :3]), share=share).strip()
    names = [str(name) for name in np.array(column(residuals, "configuration"), dtype=object)[used]]
    legend: tuple[tuple[Mark, str], ...] = (("after", "fit"), ("held", "held out (bold)")) if held.any() else ()
    return Figure(turned_arrows(table[:, :3], panels, names, held), caption, "Where the errors point", legend)


def turned_arrows(places: Array, panels: Sequence[Panel], names: Sequence[str], held: Bools | None = None) -> str:
    """A picture for each panel with arrows at places (n, 3) mm, with the numbers that viewer.js needs (JSON, safe inside a script
    element): of many rows an even selection, and the largest error of each panel."""
    drawn = np.arange(len(places)) % -(-len(places) // MOST) == 0  # more would be one black cloud
    for panel in panels:
        drawn[np.linalg.norm(panel.errors, axis=1).argmax()] = True
    corners = np.stack([places.min(axis=0), places.max(axis=0)])
    middle, radius = corners.mean(axis=0), math.dist(*corners.tolist()) / 2
    scale = HALF / radius if radius > 0 else 1.0
    bounds, at = _round((corners - middle) * scale, 4), _round((places[drawn] - middle) * scale, 4)
    errors = [_round(panel.errors[drawn], 5) for panel in panels]
    out = np.zeros(len(at), int).tolist() if held is None else held[drawn].astype(int).tolist()
    magnification = [_magnify(e, scale) for e in errors]
    data = {
        "at": at,
        "panels": [panel.key for panel in panels],
        **{panel.key: e for panel, e in zip(panels, errors, strict=True)},
        "out": out,
        "names": [name for name, used in zip(names, drawn.tolist(), strict=True) if used],
        "bounds": bounds,
        "scale": scale,
        "view": [VIEW.azimuth, VIEW.elevation],
        "mag": magnification,
    }
    # Whatever a configuration is called, it does not end the script element.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    each = zip(panels, errors, magnification, strict=True)
    pictures = "".join(f"<div>{_panel(p, at, e, out, bounds, scale, m)}</div>" for p, e, m in each)
    return (
        f'<div id="arrows"><div class="pair">{pictures}</div>{CONTROLS}'
        f'<script type="application/json" id="arrow-data">{text}</script></div>'
    )


def _box_text(places: Array) -> str:
    ends = zip("xyz", places.min(axis=0), places.max(axis=0), strict=True)
    return ", ".join(f"{a} from {with_decimals(u, 0)} to {with_decimals(v, 0)}" for a, u, v in ends) + " mm"


def _round(rows: Array, digits: int) -> list[list[float]]:
    """The same numbers with so many significant digits."""
    return [[float(f"{v:.{digits}g}") for v in row] for row in rows.tolist()]


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


def _panel(
    panel: Panel, at: Rows, errors: Rows, out: Sequence[int], bounds: Rows, scale: float, magnification: float
) -> str:
    factor, classes = scale * magnification, panel.marks
    edges, names = _box(bounds)
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
        f'<text data-part="said" class="strong" x="14" y="20" aria-live="polite">{escape(panel.name)}</text>',
    ]
    sizes = [math.hypot(*e) for e in errors]
    said = (
        f"{len(errors)} arrows at the tool's positions, drawn {plain(magnification)} times longer than in reality; "
        f"mean length {significant(sum(sizes) / len(sizes))} mm, largest {significant(max(sizes))} mm."
    )
    more = f' data-panel="{panel.key}"'
    return drawing(WIDE, HIGH, parts, title=panel.title, text=said, key=f"arrows-{panel.key}", cls="space", more=more)

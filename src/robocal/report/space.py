"""Space in panels: positions, what is drawn at each, the box around them and the machine; drawn here once, turned by viewer.js in
the browser.

The view is orthographic (`view.py` has the formulas). Both sides use the same formulas and numbers, so a page without scripts,
or on paper, shows the script's first view.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from html import escape
from typing import TypeAlias

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.report.numbers import plain, significant
from robocal.report.robot_lines import HALF, Region3D, RobotLines, space_around
from robocal.report.svg import drawing, label, num, polyline, segments
from robocal.report.view import View

__all__ = ["Panel", "draw_space"]

Rows: TypeAlias = Sequence[Sequence[float]]  # of three numbers

WIDE, HIGH = 460.0, 440.0
LONG = 34.0  # the 90th percentile of arrows is drawn this long
AZIMUTH, ELEVATION = -55.0, 24.0
BARBED = "M%.1f %.1fL%.1f %.1fM%.1f %.1fL%.1f %.1fL%.1f %.1f"
WHOLE = re.compile(r"\.0(?![0-9])")  # as `svg.num` leaves it out

CONTROLS = """<div class="controls" id="arrow-controls" hidden>{more}
<span><button type="button" id="arrow-in" aria-label="Zoom in">+</button>
<button type="button" id="arrow-out" aria-label="Zoom out">\u2212</button>
<button type="button" id="arrow-reset">Reset</button></span>
<span>Drag, or use the arrow keys, to turn; Ctrl and wheel to zoom; point at {mark} for its name.</span></div>"""
LENGTH = """<label>Arrow length <input type="range" id="arrow-length" min="-1" max="1" step="0.05" value="0"></label>
<label><input type="checkbox" id="arrow-same"> same magnification in all</label>"""
SLIDER = """<label>Row <input type="range" id="arrow-row" min="0" max="{last}" step="1" value="0">
<output id="arrow-row-name">{first}</output></label>"""


@record(eq=False)
class Panel:
    """One picture of the positions: the errors (n, 3) mm that arrows show there, or None for a dot at each; its title, what is said of
    it, and the classes of what was fitted and of what was held out, and a name that is written in it."""

    key: str
    title: str
    errors: Array | None
    marks: tuple[str, str]
    name: str = ""


def draw_space(
    panels: Sequence[Panel],
    at: Array,
    names: Sequence[str],
    out: Bools | None = None,
    box: Array | None = None,
    space: Region3D | None = None,
    robots: Sequence[RobotLines] = (),
) -> str:
    """The panels side by side, with the numbers that viewer.js needs (JSON, safe inside a script element).

    at (n, 3) mm are positions with names, `out` (n,) those that were held out, `box` (2, 3) mm holds them, `space` is what is shown
    around it; `robots` is the machine: at one of them, or at each (then a slider goes through them); none where it is not known.
    """
    out = np.zeros(len(at), dtype=bool) if out is None else out
    box = np.stack([at.min(axis=0), at.max(axis=0)]) if box is None else box
    shown = space or space_around(box, ())
    scale = HALF / shown.radius if shown.radius > 0 else 1.0
    bounds, places = _round((box - shown.middle) * scale, 4), _round((at - shown.middle) * scale, 4)
    errors = {p.key: None if p.errors is None else _round(p.errors, 5) for p in panels}
    each = [None if e is None else _magnify(e, scale) for e in errors.values()]
    data = {
        "at": places,
        **errors,
        "panels": list(errors),
        "out": out.astype(int).tolist(),
        "names": list(names),
        "bounds": bounds,
        "scale": scale,
        "view": [AZIMUTH, ELEVATION],
        "mag": each,
        "robots": [{part: [_round(v, 4) for v in lines] for part, lines in _parts(r)} for r in robots],
        "ends": [_round(r.ends, 4) for r in robots],
    }
    # Whatever a configuration is called, it does not end the script element.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    drawn = _Space(places, data["out"], bounds, scale, robots[0] if robots else None)
    pictures = "".join(
        f"<div>{drawn.panel(p, e, m)}</div>" for p, e, m in zip(panels, errors.values(), each, strict=True)
    )
    arrows = any(e is not None for e in errors.values())
    more = LENGTH if arrows else ""
    if len(robots) > 1:
        more += SLIDER.format(last=len(robots) - 1, first=escape(names[0]))
    pair = "pair" if len(panels) > 1 else "alone"
    return (
        f'<div id="arrows"><div class="{pair}">{pictures}</div>{CONTROLS.format(more=more, mark="an arrow" if arrows else "a position")}'
        f'<script type="application/json" id="arrow-data">{text}</script></div>'
    )


@record(eq=False)
class _Space:
    """What all panels share: positions (px about the middle), what was held out, the box, px per mm, the machine."""

    at: Rows
    out: Sequence[int]
    bounds: Rows
    scale: float
    robot: RobotLines | None

    @property
    def view(self) -> View:
        return View(AZIMUTH, ELEVATION, np.zeros(3), (WIDE / 2, HIGH / 2 - 14))

    def flat(self, points: Array) -> Array:
        """Points (n, 3) on the page, (n, 2)."""
        return self.view.flat(points)[0]

    def panel(self, told: Panel, errors: Rows | None, magnification: float | None) -> str:
        """One picture."""
        factor = self.scale * (magnification or 1.0)
        edges, names = self._box()
        still = [[0.0] * 3] * len(self.at)
        shapes = self._arrows(np.array(self.at).reshape(-1, 3), np.array(errors or still).reshape(-1, 3), factor)
        bodies = ["".join(d for d, o in zip(shapes, self.out, strict=True) if o == which) for which in (0, 1)]
        value, foot = _round_down(90 / factor), HIGH - 14  # mm, the length of the scale bar
        word = "" if errors is None else "error of "
        parts = [f'<path class="box" data-part="box" d="{edges}"/>']
        parts += [label(x, y, name, "tick axis-name", "middle") for name, x, y in names]
        parts += [] if self.robot is None else self._draw_robot(self.robot)
        parts += [
            f'<path class="arrow {told.marks[w]}" data-part="{w}" d="{WHOLE.sub("", bodies[w])}"/>' for w in (0, 1)
        ]
        parts += [
            '<path class="robot here" data-part="here" d=""/>',
            f'<path class="axis bar-line" data-part="bar" d="M14 {num(foot)}m0-4v8m0-4h{num(value * factor)}m0-4v8"/>',
            f'<text data-part="bar-text" class="strong" x="14" y="{num(foot - 10)}">{word}{plain(value)} mm</text>',
            f'<text data-part="mag" class="tick" text-anchor="end" x="{num(WIDE - 8)}" y="{num(foot + 4)}">'
            f"{'' if magnification is None else f'arrows × {plain(magnification)}'}</text>",
            f'<text data-part="said" class="strong" x="14" y="20" aria-live="polite">{escape(told.name)}</text>',
        ]
        more, key = f' data-panel="{told.key}"', f"arrows-{told.key}"
        said = self._words(errors, magnification)
        return drawing(WIDE, HIGH, parts, title=told.title, text=said, key=key, cls="space", more=more)

    def _words(self, errors: Rows | None, magnification: float | None) -> str:
        if not errors or magnification is None:
            return f"{len(self.at)} positions. {self.robot.caption if self.robot else ''}".strip()
        sizes = [math.hypot(*e) for e in errors]
        return (
            f"{len(errors)} arrows at the tool's positions, drawn {plain(magnification)} times as long as in reality; "
            f"mean length {significant(sum(sizes) / len(sizes))} mm, largest {significant(max(sizes))} mm."
        )

    def _arrows(self, points: Array, errors: Array, factor: float) -> list[str]:
        """For each point (n, 3) and error a shaft with two barbs, or a dot where the arrow would be shorter than a pixel."""
        start, tip = self.flat(points), self.flat(points + factor * errors)
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

    def _box(self) -> tuple[str, list[tuple[str, float, float]]]:
        """The edges of the measured box, and where the names of its axes stand: at the high end of an outer edge."""
        low, high = self.bounds
        corners = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
        edges = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]
        flat: list[tuple[float, float]] = self.flat(np.array(corners)).tolist()
        d = segments((*flat[i], *flat[j]) for i, j in edges)
        names = []
        for k in range(3):
            start, end = max(
                (e for e in edges if e[0] ^ e[1] == 1 << k), key=lambda e: self._outside(flat[e[0]], flat[e[1]])
            )
            (x0, y0), (x1, y1) = flat[start], flat[end]
            long = math.hypot(x1 - x0, y1 - y0) or 1.0
            names.append(("xyz"[k], x1 + 11 * (x1 - x0) / long, y1 + 11 * (y1 - y0) / long + 4))
        return d, names

    def _outside(self, a: tuple[float, float], b: tuple[float, float]) -> float:
        """How far out an edge lies, the lower of two equal ones first."""
        x, y = (a[0] + b[0]) / 2 - WIDE / 2, (a[1] + b[1]) / 2 - HIGH / 2 + 14
        return math.hypot(x, y) + 0.05 * y

    def _draw_robot(self, robot: RobotLines) -> list[str]:
        """The machine below the arrows, and the names of its instruments."""
        out = []
        for part, lines in _parts(robot):
            # A dot is a line without length with round ends.
            d = "".join(polyline(self.flat(v).tolist()) + ("h0" if len(v) == 1 else "") for v in lines)
            out.append(f'<path class="robot {part}" data-part="{part}" d="{d}"/>')
        for (x, y), name in zip(self.flat(robot.ends).tolist(), robot.names, strict=True):
            # Beyond the end of a ray, so that the name lies on neither ray nor machine.
            side, below = ("end" if x > WIDE / 2 else "start"), y > HIGH / 2 - 14
            out.append(label(x, y + (16 if below else -8), name, "name instrument-name", side))
        return out


def _parts(robot: RobotLines) -> list[tuple[str, list[Array]]]:
    """The parts of a machine as lines (k, 3) by the name under which viewer.js finds them; a line of one point is a dot."""
    dots = [p[None] for p in robot.joints]
    return [("cables", list(robot.cables)), ("arm", list(robot.arm)), ("joints", dots), ("rays", list(robot.rays))]


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

"""How a tension is shown: its colour, whether a cable is slack, over its limit or has none, and the scale beside a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.report.cable.drawing import bar, tint
from robocal.report.numbers import significant
from robocal.report.svg import AxisScale, label, num, tick_text

__all__ = ["STATES", "ColouredTensions", "colour_tensions", "of_each_cable"]

WIDE = 20.0  # ratio of the limits from which the scale is logarithmic
STATES = {"held": "", "slack": "slack", "over": "over limit", "none": "no tension"}


@record(eq=False)
class ColouredTensions:
    """Tensions (m,) N, NaN where there are none, limits (m, 2) N where they are known, and the ends of the colour scale, N."""

    values: Array
    limits: Array | None
    low: float
    high: float

    def colour(self, i: int) -> str:
        """The colour of cable i; none without a tension."""
        value = float(self.values[i])
        return "" if math.isnan(value) else tint(self._along(0.0, 1.0)(value))

    def _along(self, start: float, end: float) -> AxisScale:
        """The scale; logarithmic where its ends are far apart, or small tensions would all look alike."""
        return AxisScale(self.low, self.high, start, end, log=0.0 < WIDE * self.low < self.high)

    def state(self, i: int) -> str:
        """A key of STATES: a solution may lie on a limit, so rounding is forgiven."""
        value = float(self.values[i])
        if math.isnan(value):
            return "none"
        low, high = (0.0, math.inf) if self.limits is None else self.limits[i].tolist()
        air = 1e-6 * max(abs(low), 0.0 if math.isinf(high) else high, 1e-9)
        if value < low - air or value <= 0.0:
            return "slack"
        return "over" if value > high + air else "held"

    @property
    def states(self) -> list[str]:
        """The states of all cables."""
        return [self.state(i) for i in range(len(self.values))]

    def describe(self, i: int) -> str:
        """A tension in words, such as `45.2 N` or `3.10 N, slack`."""
        word, value = STATES[self.state(i)], float(self.values[i])
        known = "" if math.isnan(value) else f"{significant(value)}\u00a0N"
        return ", ".join(w for w in (known, word) if w)

    def height_of(self, value: float, top: float, bottom: float) -> float:
        """Where a tension stands on the upright scale, px."""
        return self._along(bottom, top)(min(max(value, self.low), self.high))

    def scale(self, names: Sequence[str], x: float, top: float, bottom: float) -> str:
        """The colour scale upright at x (px): ticks in N, the limits where all cables share them, and a notch per cable."""
        y = self._along(bottom, top)
        parts = [label(x, top - 12, "tension, N", "strong"), bar(x, top, bottom)]
        taken = []
        if self.limits is not None and np.ptp(self.limits, axis=0).max() <= 1e-9 * np.abs(self.limits).max():
            for value, word in zip(self.limits[0].tolist(), ("min", "max"), strict=True):
                if self.low <= value <= self.high:
                    taken.append(y(value))
                    parts.append(f'<path class="limit" d="M{num(x - 3)} {num(y(value))}h20"/>')
                    rounded = tick_text(float(f"{value:.3g}"))
                    parts.append(label(x + 22, y(value) + 4, f"{word} {rounded}", "name"))
        for t in y.ticks:
            if all(abs(y(t) - other) > 13 for other in taken):
                parts.append(label(x + 22, y(t) + 4, tick_text(t), "tick"))
        for value, name in zip(self.values.tolist(), names, strict=True):
            at = bottom if math.isnan(value) else self.height_of(value, top, bottom)
            hidden = ' visibility="hidden"' if math.isnan(value) else ""
            parts.append(
                f'<path class="notch"{hidden} d="M{num(x - 2)} {num(at)}l-7-3.5v7z"><title>{escape(name)}</title></path>'
            )
        return "".join(parts)


def of_each_cable(robot: CableRobot, tension: ArrayLike) -> Array:
    """The tensions (m,) N of the cables. Raises ModelError for another shape."""
    values, m = np.asarray(tension, float), len(robot.cables)
    if values.shape != (m,):
        raise ModelError("tensions to be drawn", expected=f"one per cable, ({m},)", found=values.shape)
    return values


def colour_tensions(robot: CableRobot, tension: ArrayLike) -> ColouredTensions:
    """The scale of tension (m,) N reaches from the least limit to the greatest, or over the tensions where no limits are known.
    Raises ModelError for another shape."""
    values, limits = of_each_cable(robot, tension), robot.limits
    known = values[np.isfinite(values)]
    ends = known if limits is None else limits[np.isfinite(limits)]
    if not len(ends):
        ends = np.array([0.0, 1.0])
    low, high = float(ends.min()), float(ends.max())
    if not high > low:
        low, high = low - 0.5 * abs(low) - 0.5, high + 0.5 * abs(high) + 0.5
    return ColouredTensions(np.where(np.isfinite(values), values, np.nan), limits, low, high)

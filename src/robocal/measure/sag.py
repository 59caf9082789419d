"""The sag of a level cable under loads: r = h(span, t; w) - y, h as in `cables/straightness.py`.

value (k, 1) in m is how far the middle hangs below the line between the ends, extra["span"] (k,) in m, extra["tension"] (k,) in N
(horizontal). w is the rope's weight per metre.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.rope import WEIGHT
from robocal.cables.straightness import level_sag, sag_slope
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import METRES, Kind, Rows, register

__all__ = ["SAG"]


class SagRows(Rows):
    """One term for all rows; the rope's weight is its only number."""

    reading = True  # of the rope, which nothing carries

    def __init__(self, builder: Builder, obs: Observations) -> None:
        super().__init__((), obs, np.arange(len(obs)), builder.rows([WEIGHT]))
        self.span, self.tension = obs.extra["span"], obs.extra["tension"]

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        part = slice(first, first + rows)
        loads = self.span[part], self.tension[part], x[:, self.numbers]  # (B, 1) against (m,)
        r = level_sag(*loads)[..., None] - self.values_at(which, first, rows)
        jac = sag_slope(*loads)[..., None, None][..., self.own]
        return r, jac, np.zeros((*r.shape, 0))


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all rows."""
    return [SagRows(builder, obs)] if len(obs) else []


SAG = register(Kind("sag", 1, terms, parts=METRES, unstated=1e-3))

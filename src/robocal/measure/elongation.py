"""How much longer a hanging cable is under loads: r = L s(t) + offset - y, s the rope's strain (`cables/rope.py`).

value (k, 1) in m, extra["length"] (k,) in m is the length without load, extra["tension"] (k,) in N. options["offset"] names the gauge,
whose `offset` is in m: a height gauge begins where a first weight has straightened the cable, so the line misses the origin.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.rope import ELASTICITY, EXPONENT, Rope, strain_slopes
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import METRES, Kind, Number, Rows, number_names, register

__all__ = ["ELONGATION", "OFFSET"]

OFFSET = Number("offset", "offset", expected=0.05)  # m


class ElongationRows(Rows):
    """One term for all rows; its numbers are elasticity, exponent and, where there is one, the offset."""

    reading = True  # of the rope, which nothing carries

    def __init__(self, builder: Builder, obs: Observations) -> None:
        rope = builder.machine.part(Rope)
        if rope is None:
            raise ModelError(
                "elongations are of a cable by itself", found=builder.machine.name, expected="a cable under loads"
            )
        super().__init__((), obs, np.arange(len(obs)), builder.rows([ELASTICITY, EXPONENT, *number_names(obs)]))
        self.length, self.tension, self.reference = obs.extra["length"], obs.extra["tension"], rope.reference

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        part = slice(first, first + rows)
        e, p, *offset = x[:, self.numbers, None].swapaxes(0, 1)
        by_e, by_p = strain_slopes(self.tension[part], e, p, self.reference)
        length = self.length[part]
        told = length * e * by_e + (offset[0] if offset else 0.0)
        slopes = np.stack([length * by_e, length * by_p, *(np.ones_like(by_e) for _ in offset)], axis=-1)
        r = told[..., None] - self.values_at(which, first, rows)
        return r, slopes[:, :, None, self.own], np.zeros((*r.shape, 0))


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all rows."""
    return [ElongationRows(builder, obs)] if len(obs) else []


ELONGATION = register(Kind("elongation", 1, terms, parts=METRES, owner="offset", numbers=(OFFSET,), unstated=1e-3))

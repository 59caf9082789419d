"""Touch on a sphere: r = |p_tip - p_place| - (R + y).

value y (k, 1) in m, normally 0, sigma (k, 1). A probe on the tool touches a sphere on the base from many sides.
`options["place"]` is the sphere's centre as a frame on the base, the target the centre of the stylus ball (default: the
tool's origin); `options["radius"]` names the pair, and its parameter `NAME.radius` R (m) is the radius of the sphere
plus that of the stylus. A known R gives the scale; the orientation of the place is never seen.
The residual is that of a ballbar whose length is R (see `distance`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Between, Kind, Number, Rows, number_names, numbers, place_of, places_of, register
from robocal.parameters import Parameter

__all__ = ["SPHERE"]

UNSTATED = (1e-4,)
NUMBERS = (Number("radius", "radius", value=0.01, expected=0.01),)


class SphereRows(Between):
    """Distance from the centre minus the radius."""

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        length, j, jl = self.length(x, first, rows)
        length = length - self.values_at(which, first, rows) - x[:, None, self.numbers]
        return length, np.concatenate([j, np.full((*j.shape[:3], len(self.own)), -1.0)], axis=3), jl


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target."""
    own = builder.rows(number_names(obs, NUMBERS))
    return [SphereRows(builder.between(place_of(obs), obs, t, i), obs, i, UNSTATED, own) for t, i in builder.split(obs)]


def parameters(obs: Observations) -> Sequence[Parameter]:
    """The radius. Raises ModelError when it has no name."""
    if not obs.options.get("radius"):
        raise ModelError("a sphere needs a radius", key=obs.label, expected="the name of a radius")
    return numbers(obs, NUMBERS)


SPHERE = register(Kind("sphere", 1, terms, parameters, ((0, 1, "m"),), frames=places_of, contact=True, owner="radius"))

"""Touch on a sphere: r = |p_tip - p_place| - (R + y).

value y (k, 1) in m, normally 0, sigma (k, 1). A probe on the tool touches a sphere on the base from many sides.
`options["place"]` is the sphere's centre as a frame on the base, the target the centre of the stylus ball (default: the
tool's origin); `options["radius"]` names the pair, and its parameter `NAME.radius` R (m) is the radius of the sphere
plus that of the stylus. A known R gives the scale; the orientation of the place is never seen.
The residual is that of a ballbar whose length is R (see `distance`).
"""

from __future__ import annotations

from collections.abc import Sequence

from robocal.errors import ModelError
from robocal.measure.builder import Builder, places_of
from robocal.measure.data import Observations
from robocal.measure.distance import DistanceRows
from robocal.measure.rows import METRES, Kind, Number, numbers, per_target, register
from robocal.parameters import Parameter

__all__ = ["SPHERE"]

NUMBERS = (Number("radius", "radius", value=0.01, expected=0.01),)


def parameters(obs: Observations) -> Sequence[Parameter]:
    """The radius. Raises ModelError when it has no name."""
    if not obs.options.get("radius"):
        raise ModelError("a sphere needs a radius", key=obs.label, expected="the name of a radius")
    return numbers(obs, NUMBERS)


ROWS = per_target(DistanceRows, Builder.between)
SPHERE = register(
    Kind("sphere", 1, ROWS, parameters, METRES, frames=places_of, contact=True, owner="radius", numbers=NUMBERS)
)

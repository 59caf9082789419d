"""What a cable is by itself, from loads: its weight per metre, and how it lengthens.

    s(t) = e t (t / t0)^(p - 1)        strain of a cable under tension t; p = 1 is a constant elasticity e, p < 1 stiffens

e is the strain per tension at t0. A fibre rope stiffens: the catalogue of the seed's annex A has 0.46, 0.70 and 0.96 % at 10, 20 and
30 % of the breaking force, which is p = 0.67; a constant from there is too small at low tension. A table of loads tells e and p best
where t0 is in the middle of the loads.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.geometry.path.placeless import Placeless
from robocal.parameters import Parameter, ParameterTable

__all__ = ["CABLE", "ELASTICITY", "EXPONENT", "WEIGHT", "Rope", "rope", "strain", "strain_slopes"]

CABLE = "cable"
WEIGHT, ELASTICITY, EXPONENT = f"{CABLE}.weight", f"{CABLE}.elasticity", f"{CABLE}.exponent"
TENSION = 100.0  # N, where nobody says at which tension the elasticity is told
# What nobody has measured: as little as a hair, as stiff as a rod.
ANY_WEIGHT, ANY_ELASTICITY, ANY_EXPONENT = 1.0, 1e-4, 0.5
LEAST = 1e-9  # N, of a tension whose logarithm is taken


def strain(tension: ArrayLike, elasticity: ArrayLike, exponent: ArrayLike = 1.0, reference: float = TENSION) -> Array:
    """Strain (...) under tensions (...) in N, of an elasticity in 1/N at `reference` in N."""
    t = np.asarray(tension, float)
    return np.asarray(elasticity * t * (np.maximum(t, LEAST) / reference) ** (np.asarray(exponent, float) - 1))


def strain_slopes(tension: Array, elasticity: Array, exponent: Array, reference: float) -> tuple[Array, Array]:
    """Derivatives (...) of the strain by the elasticity and by the exponent."""
    by_elasticity = strain(tension, 1.0, exponent, reference)
    return by_elasticity, elasticity * by_elasticity * np.log(np.maximum(tension, LEAST) / reference)


@record(eq=False)
class Rope(Placeless):
    """A cable that is tested by itself: its weight (N/m), its elasticity (1/N) at the tension `reference` (N), the exponent of the law."""

    table: ParameterTable
    reference: float = TENSION
    name: str = CABLE

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """Itself, as a rope."""
        return {"rope": (self.name,)}

    def strain(self, tension: ArrayLike) -> Array:
        """Its strain (...) under tensions (...) in N."""
        return strain(tension, self.table[ELASTICITY].value, self.table[EXPONENT].value, self.reference)


def rope(
    weight: float = 0.0,
    elasticity: float = 0.0,
    exponent: float = 1.0,
    reference: float = TENSION,
    free: tuple[str, ...] = (),
) -> Rope:
    """A rope from its numbers; `free` are the names of those that are to be found."""
    values = (
        (WEIGHT, weight, "N/m", ANY_WEIGHT),
        (ELASTICITY, elasticity, "1/N", ANY_ELASTICITY),
        (EXPONENT, exponent, "1", ANY_EXPONENT),
    )
    return Rope(
        ParameterTable(tuple(Parameter(n, v, u, n in free, expected=far) for n, v, u, far in values)), reference
    )

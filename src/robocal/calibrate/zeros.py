"""A joint's zero instead of a length, where the data cannot tell one from the other and no making leaves the length.

A joint that lost its zero may be off by any angle, a length by what making leaves. Of two columns that say the same, the one with
the larger effect of its expected error is kept, often the length; once it has moved by more than ALIKELY times that error, the
zero is the likelier cause, and the one that a controller takes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

from robocal.calibrate.bands import total_of
from robocal.measure.machine import Machine

if TYPE_CHECKING:
    from robocal.calibrate.fit import Fit

__all__ = ["with_zeros"]

M = TypeVar("M", bound=Machine)
ALIKELY = 10.0  # times what was expected: 10 mm, 3 deg
SURE = 5.0  # standard deviations


def with_zeros(model: M, fit: Fit) -> M | None:
    """The model with those zeros preferred that look like what moved too far; None where there are none."""
    off = total_of(fit)
    sigma = dict(zip(off.names, off.sigma, strict=True))
    table, x = fit.problem.table, fit.solution.x[0]
    moved = set()
    for n in set(fit.problem.free) & (set(model.geometric) - model.anywhere):
        change = abs(float(x[table.index[n]]) - model.table[n].value)
        if change > max(ALIKELY * model.table[n].scale, SURE * sigma[n]):
            moved.add(n)
    zeros = {z.parameter for z in model.open_zeros}
    alike = {
        c.name: max(model.table[n].preference for n in model.table.names) + 1
        for c in fit.identifiability.combinations
        if c.name in zeros and moved & {n for n, _ in c.partners} and not model.table[c.name].preference
    }
    if not alike:
        return None
    # Every machine is frozen data with a table.
    made: M = replace(cast(Any, model), table=model.table.with_preferences(alike))
    return made

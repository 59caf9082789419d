"""A joint's zero that may be lost, where a length that looks like it moved as no making leaves it.

A joint that lost its zero may be off by any angle, a length by what making leaves. What looks alike is kept by the effect of its
expected error, often the length; once that has moved by more than ZERO_CHANGE times its own, the zero is the likelier cause, and the
one that a controller takes: it is expected to be off by ZERO_LOST, and the fit is made again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from robocal.diagnose.limits import ZERO_CHANGE, ZERO_LOST, ZERO_SIGMA
from robocal.measure.machine import Model
from robocal.prove.bands import total_of

if TYPE_CHECKING:
    from robocal.fit.fit import Fit

__all__ = ["with_zeros"]

M = TypeVar("M", bound=Model)


def with_zeros(model: M, fit: Fit) -> M | None:
    """The model with those zeros expected to be lost that look like what moved too far; None where there are none."""
    table, x = fit.problem.table, fit.solution.x[0]
    own = set(fit.problem.free) & (set(model.geometric) - model.anywhere)
    change = {n: abs(float(x[table.index[n]]) - model.table[n].value) for n in own}
    far = {n for n in own if change[n] > ZERO_CHANGE * model.table[n].scale}
    if not far:
        return None
    # A zero with a stated prior is where its owner says.
    moving = model.mechanism
    if moving is None:
        return None
    zeros = {z.parameter: model.table[z.parameter] for z in moving.open_zeros}
    lost = {
        n: ZERO_LOST[z.unit]
        for n, z in zeros.items()
        if z.prior is None and z.unit in ZERO_LOST and z.scale < ZERO_LOST[z.unit]
    }
    alike = {c.name: far & {n for n, _ in c.partners} for c in fit.identifiability.combinations if c.name in lost}
    if not any(alike.values()):
        return None
    off = total_of(fit)
    sigma = dict(zip(off.names, off.sigma, strict=True))
    likely = {name: lost[name] for name, like in alike.items() if any(change[n] > ZERO_SIGMA * sigma[n] for n in like)}
    if not likely:
        return None
    return model.with_table(model.table.with_expected(likely))

"""Numbers of drives that no machine has below zero: friction brakes, and a motor that pulls has a torque constant above zero.

    z = -x / sigma        of a number x, sigma what it may be off by

Viscous friction is none of them: where friction falls with speed, as at low speeds, its slope is below zero.
"""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose.check_registry import Context, Finding, When, check, refuse
from robocal.diagnose.limits import NEGATIVE_SIGMA
from robocal.measure.machine import Model
from robocal.remarks.english import declare

__all__ = ["NEGATIVE"]

NEGATIVE = declare(
    "negative-number",
    "{name} is {z:.0f} standard deviations below zero: friction never drives, and a motor that pulls has a current above zero",
    "Check which torques or currents, or which speeds, count the other way, and turn these columns around.",
)
SYMBOLS = ("coulomb", "kt")


@check("negative-number", When.PROOF, order=35, needs=("fit",))
def negative_numbers(context: Context[Model]) -> Iterator[Finding]:
    """The number that is farthest below zero."""
    fit = context.need_fit
    sigma = dict(zip(fit.total.names, fit.total.sigma.tolist(), strict=True))
    at = fit.problem.table.index
    below = {
        n: -float(fit.solution.x[0, at[n]]) / s
        for n, s in sigma.items()
        if n.rpartition(".")[2] in SYMBOLS and n in at and s > 0
    }
    name = max(below, key=lambda n: below[n], default="")
    if name and below[name] > NEGATIVE_SIGMA:
        yield refuse(NEGATIVE, name=name, z=below[name])

"""What the fit leaves of every instrument, beside the noise that was stated."""

from __future__ import annotations

from collections.abc import Iterator

from scipy import special

from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.diagnose.implausible import implausible_changes
from robocal.diagnose.limits import COMPUTED_ERROR, COMPUTED_FREEDOM, NOISE_ABOVE, NOISE_BELOW, NOISE_CHANCE
from robocal.diagnose.stated_numbers import reads
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["noise_findings"]


@check("stated-noise", When.FIT, order=100, needs=("fit",))
def noise_findings(context: Context[Model]) -> Iterator[Finding]:
    """Model error far above the stated noise, noise that is not in the data, and data that were computed."""
    # A known distance between sockets is no reading; and of an arm that was bent to a point everything is exact.
    bent = implausible_changes(context)
    read = {o.label for o in context.need_data.observations if reads(o)} if not bent else set()
    for g in context.need_fit.groups:
        if g.stated is not None:
            amounts = {"left": Quantity(g.rms, g.unit), "stated": Quantity(g.stated, g.unit)}
            if g.tau > NOISE_ABOVE * g.stated:
                yield doubt(Code.ABOVE_STATED_NOISE, group=g.name, **amounts)
            if g.name in read and g.chi2 is not None and special.chdtr(g.dof, NOISE_BELOW**2 * g.chi2) < NOISE_CHANCE:
                yield doubt(Code.BELOW_STATED_NOISE, group=g.name, **amounts)
        if g.name in read and g.unit == "m" and g.rms < COMPUTED_ERROR and g.dof > COMPUTED_FREEDOM:
            yield doubt(Code.COMPUTED, group=g.name, left=Quantity(g.rms))

"""How linear an identification was: the step that was needed, the step that all free parameters would have taken, and the
curvature within the sigmas; with the words that a reader should not miss."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from robocal._types import Array
from robocal.diagnose.check_registry import Finding, When, check, doubt, note, once
from robocal.diagnose.limits import CURVATURE, STEP_MISLEADS
from robocal.estimate.linearity import Curvature, Step, curvature, one_step
from robocal.estimate.uncertainty import Uncertainty
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.prove.decision import Decision
from robocal.prove.judge import units_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["Linearity", "linearity", "linearity_of"]


@dataclass(frozen=True)
class Linearity:
    """One linear step from the baseline in the fitted parameters, and one in everything free without priors (the seed's
    linear estimate), and the curvature at the solution."""

    fitted: Step
    everything: Step | None
    bend: Curvature | None

    @property
    def unit(self) -> str:
        """The SI unit of both steps."""
        return self.fitted.unit

    @property
    def curvature(self) -> float | None:
        """The largest relative curvature within one sigma."""
        return None if self.bend is None else self.bend.value

    @property
    def curvature_parameter(self) -> str:
        """What such a step moves most."""
        return "" if self.bend is None else self.bend.parameter

    @property
    def misleads(self) -> bool:
        """Whether one step in the fitted parameters leaves clearly more than it promises and than the noise is."""
        return not self.fitted.left <= STEP_MISLEADS * max(self.fitted.promised, self.fitted.noise)

    @property
    def ruins(self) -> bool:
        """Whether one step in everything that is free leaves more than there was before."""
        e = self.everything
        return e is not None and not e.left <= max(e.before, e.noise)


def linearity(fit: Fit, start: Array, u: Uncertainty, units: tuple[str, ...]) -> Linearity | None:
    """Of a fit that began at x (1, P), in the first SI unit that was measured; None with local blocks."""
    if not units:
        return None
    loose = replace(fit.problem, priors=False).with_free(fit.problem.table.free)
    # What overflows or cannot be factored tells nothing; the verdict says what is wrong with such numbers.
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        if fit.problem.blocks:
            return None
        lin = loose.with_weights(None).linearize(start)
        fitted = one_step(fit.problem, start, units[0], lin.columns(loose.column_of[fit.problem.index]))
        if fitted is not None:
            bend = curvature(fit.problem, fit.solution.x, u.covariance * u.factor**2)
            return Linearity(fitted, one_step(loose, start, units[0], lin), bend)
    return None


@once
def linearity_of(context: Decision[Model]) -> Linearity | None:
    """Of the fit to everything, with the covariance of its method where that has one of its own."""
    fit, u = context.need_fit, context.need_fit.uncertainty
    if fit.covariance is not None:
        u = replace(u, covariance=fit.covariance)
    assert context.start is not None
    return linearity(fit, context.start, u, units_of(context.need_proofs.base))


@check("linearity", When.FIT, order=190, needs=("proven",))
def doubt_linearity(context: Decision[Model]) -> Iterator[Finding]:
    """What one linear step would have done, where it would mislead."""
    found = linearity_of(context)
    if found is None:
        return

    def amounts(step: Step) -> dict[str, Quantity]:
        return {"promised": Quantity(step.promised, step.unit), "left": Quantity(step.left, step.unit)}

    if found.misleads:
        yield note(Code.NOT_LINEAR, **amounts(found.fitted), before=None)
    if found.ruins and found.everything is not None:
        before = Quantity(found.everything.before, found.fitted.unit)
        yield note(Code.ONE_STEP_MISLEADS, **amounts(found.everything), before=before)
    if found.curvature is not None and found.curvature > CURVATURE:
        yield doubt(Code.CURVED, curvature=found.curvature, parameter=found.curvature_parameter)

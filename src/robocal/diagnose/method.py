"""What the method of the fit ignored, could not do, or had to begin again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, Level, When, check, doubt, note, of_remarks
from robocal.fit.estimators import estimator
from robocal.measure.machine import Model
from robocal.remarks.code import Code

__all__ = ["notes", "priors_without_effect", "restarts"]


@check("ignored-priors", When.FIT, order=130, needs=("fit", "options"))
def priors_without_effect(context: Context[Model]) -> Iterator[Finding]:
    """Priors and bounds of which the method takes no notice."""
    assert context.options is not None
    problem, method = context.need_fit.problem, context.options.method
    rows = [problem.table[n] for n in problem.free]
    if estimator(method).blind and any(p.prior or np.isfinite([p.lower, p.upper]).any() for p in rows):
        yield doubt(Code.PRIORS_IGNORED, method=method)


@check("method-notes", When.FIT, order=140, needs=("fit",))
def notes(context: Context[Model]) -> Iterator[Finding]:
    """What the method says of its own end."""
    yield from of_remarks(context.need_fit.notes, Level.DOUBT)


@check("restarts", When.FIT, order=180, needs=("fit",))
def restarts(context: Context[Model]) -> Iterator[Finding]:
    """Starts that were needed before the fit converged."""
    if context.need_fit.restarted:
        yield note(Code.RESTARTED, starts=context.need_fit.restarted)

"""Rows that do not belong to the others, counted by instrument."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Finding, When, check, doubt, once
from robocal.diagnose.outliers import Outlier, find_outliers
from robocal.measure.machine import Model
from robocal.prove.decision import Decision
from robocal.prove.judge import units_of
from robocal.remarks.code import Code

__all__ = ["outliers"]


@once
def outliers(context: Decision[Model]) -> tuple[Outlier, ...]:
    """Rows that are far from a fit to all others, of the fit that excluded more of them."""
    whole, part, best = context.need_fit, context.need_proofs.part, context.proof
    seen = max(whole, part, key=lambda f: f.problem.aside)
    counted = {u: best.errors(u)[2] for u in units_of(context.need_proofs.base)} if best else None
    return find_outliers(context.model, context.need_data, seen, counted, context.leverage if seen is whole else None)


@check("outliers", When.FIT, order=160, needs=("proven",))
def doubt_outliers(context: Decision[Model]) -> Iterator[Finding]:
    """Rows that were excluded, and rows that are far and were used all the same."""
    for group in dict.fromkeys(o.group for o in outliers(context)):
        mine = [o for o in outliers(context) if o.group == group]
        total = sum(len(t.configuration) for t in context.need_fit.problem.terms if t.group == group)
        for code, some in (
            (Code.OUTLIERS, [o for o in mine if o.set_aside]),
            (Code.STRANGE, [o for o in mine if not o.set_aside]),
        ):
            if some:
                first, far = some[0].configuration, some[0].distance if np.isfinite(some[0].distance) else None
                counted = sum(o.counted for o in some) if code is Code.OUTLIERS else 0
                yield doubt(
                    code, group=group, count=len(some), total=total, configuration=first, distance=far, counted=counted or None
                )  # fmt: skip

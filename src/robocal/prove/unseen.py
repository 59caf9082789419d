"""Whether unseen measurements can be judged at all: the first of these findings ends it, and no gain is computed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Finding, Given, When, check, qualify, refuse
from robocal.diagnose.gross import share
from robocal.diagnose.limits import GROSS_SHARE, MEAN_RIVAL, PROOF_PLACES, ROUNDING_MARGIN, UNEXPLAINED_MOST
from robocal.measure.machine import Model
from robocal.prove.decision import Decision, rms
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__: list[str] = []


@check("one-place", When.UNSEEN, order=10, given=Given.NOTHING, needs=("proven",))
def one_place(context: Decision[Model]) -> Iterator[Finding]:
    """All measurements were taken at one place."""
    if len(np.unique(context.places)) < 2:
        yield refuse(Code.ONE_PLACE)


@check("excluded-share", When.UNSEEN, order=20, given=Given.NOTHING, needs=("proven",))
def share_of_excluded(context: Decision[Model]) -> Iterator[Finding]:
    """So many rows are excluded that they are no outliers. A fit that did not see all rows may see more clearly which are gross."""
    excluded = max(share(context.need_data), context.need_proofs.part.problem.aside)
    if excluded > GROSS_SHARE:
        yield refuse(Code.TOO_MANY_ASIDE, share=excluded, most=GROSS_SHARE)


@check("nothing-unseen", When.UNSEEN, order=30, given=Given.NOTHING, needs=("proven",))
def nothing_unseen(context: Decision[Model]) -> Iterator[Finding]:
    """Nothing was held out, or nothing that was held out proves anything."""
    if context.proof is None:
        yield qualify(Code.NOTHING_HELD_OUT)
    elif not context.errors[2].any() and len(np.unique(context.places)) < PROOF_PLACES:
        yield qualify(Code.FEW_UNSEEN, least=PROOF_PLACES)
    elif not context.errors[2].any():
        yield qualify(Code.NOTHING_MEASURED_THERE)


@check("exact-nominal", When.UNSEEN, order=40, given=Given.NOTHING, needs=("proven",))
def exact_nominal(context: Decision[Model]) -> Iterator[Finding]:
    """The nominal model leaves nothing but rounding."""
    before, _, counted = context.errors
    if context.digits is not None and (left := rms(before[counted])) <= ROUNDING_MARGIN * context.digits:
        yield qualify(Code.NOMINAL_EXACT, left=Quantity(left), digits=Quantity(context.digits))


@check("nothing-observable", When.UNSEEN, order=50, given=Given.NOTHING, needs=("evidence",))
def nothing_observable(context: Decision[Model]) -> Iterator[Finding]:
    """No parameter is seen above the noise, or the model cannot be evaluated."""
    assert context.evidence is not None
    if context.evidence.blind:
        yield refuse(Code.RANK_ZERO)
    elif not np.isfinite(context.evidence.after).all():
        yield refuse(Code.NOT_FINITE)


@check("mean-rival", When.UNSEEN, order=60, given=Given.NOTHING, needs=("evidence",))
def mean_rival(context: Decision[Model]) -> Iterator[Finding]:
    """The model is no better than predicting the mean of the measurements."""
    assert context.evidence is not None
    there, constant = context.evidence.there, context.evidence.constant
    if constant is None or not len(constant) or not len(there):
        return
    if there.mean() >= MEAN_RIVAL * constant.mean():
        after, mean = Quantity(float(there.mean())), Quantity(float(constant.mean()))
        yield refuse(Code.NO_BETTER_THAN_MEAN, after=after, constant=mean)


@check("unexplained", When.UNSEEN, order=70, given=Given.NOTHING, needs=("evidence",))
def residual_finding(context: Decision[Model]) -> Iterator[Finding]:
    """The model leaves so much that it does not describe this robot."""
    yield from left_over(context, UNEXPLAINED_MOST)


def left_over(context: Decision[Model], most: float) -> Iterator[Finding]:
    """What is left beyond the stated noise, where it is more than a share of the variance."""
    assert context.evidence is not None
    part, left = context.evidence.residual_share
    if part > most and context.evidence.exceeds_noise:
        noise = Quantity(context.evidence.stated) if context.evidence.stated else None
        yield refuse(Code.UNEXPLAINED, explained=1 - part, rms=Quantity(left), stated=noise)

"""What a gain on unseen measurements is worth: whether every fit ended, whether it is the robot that was identified, and whether the
model that is returned is the one that was proven."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Finding, Given, Level, When, check, note, of_remarks, qualify, refuse
from robocal.diagnose.implausible import implausible, out_of_tolerance
from robocal.diagnose.limits import (
    ANGLES_LEFT,
    ANGLES_SIGMA,
    BENT_LEAVES,
    KEPT_GAIN,
    PROOF_PLACES,
    ROUNDING_MARGIN,
    UNEXPLAINED_SHARE,
)
from robocal.fit.baseline import frame_names
from robocal.fit.estimators import estimator
from robocal.fit.misfit import errors
from robocal.measure.machine import Model
from robocal.prove.bands import find_identified
from robocal.prove.decision import Decision, rms
from robocal.prove.unseen import left_over
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__: list[str] = []


@check("convergence", When.PROOF, order=10, given=Given.NOTHING, needs=("evidence",))
def convergence(context: Decision[Model]) -> Iterator[Finding]:
    """The fit that was judged did not converge."""
    assert context.evidence is not None
    if not context.evidence.converged:
        yield qualify(Code.NOT_CONVERGED)


@check("few-unseen", When.PROOF, order=20, given=Given.NOTHING, needs=("evidence",))
def few_unseen(context: Decision[Model]) -> Iterator[Finding]:
    """Too few unseen places for a bootstrap to doubt."""
    assert context.evidence is not None
    if len(np.unique(context.evidence.configurations)) < PROOF_PLACES:
        yield qualify(Code.FEW_UNSEEN, least=PROOF_PLACES)


@check("unexplained-without-gain", When.PROOF, order=30, given=Given.NOTHING, needs=("evidence",))
def residual_without_gain(context: Decision[Model]) -> Iterator[Finding]:
    """Much is left and no gain is proven: nobody should hear that the nominal model may be as good as can be."""
    if not context.improvement:
        yield from left_over(context, UNEXPLAINED_SHARE)


@check("unfinished", When.PROOF, order=40, given=Given.GAIN, needs=("proven",))
def fits_without_convergence(context: Decision[Model]) -> Iterator[Finding]:
    """One of the fits behind the verdict did not converge."""
    assert context.proof is not None
    ended = {
        "the baseline": context.need_baseline.converged and context.proof.before.converged,
        "the fit to everything": context.need_fit.solution.reasons[0].converged
        or estimator(context.chosen.method).finite,
        "a round": context.proof.after.converged,
    }
    for what in [what for what, done in ended.items() if not done][:1]:
        yield qualify(Code.NOT_CONVERGED, what=what)


@check("robot-identified", When.PROOF, order=50, given=Given.GAIN, needs=("proven",))
def robot_identified(context: Decision[Model]) -> Iterator[Finding]:
    """Nothing of the robot itself was fitted, or nothing of it is known by itself."""
    part = context.need_proofs.part
    if not set(part.problem.free) - set(frame_names(context.model, context.need_proofs.base)):
        yield qualify(Code.NOTHING_OF_ROBOT)
    elif not find_identified(part, part.total) & set(context.model.table.names):
        yield qualify(Code.NOTHING_IDENTIFIED)


@check("numbers-of-a-round", When.PROOF, order=60, given=Given.GAIN, needs=("proven",))
def numbers_of_a_round(context: Decision[Model]) -> Iterator[Finding]:
    """A round leaves too little to fit: that would be met exactly, and what was left out by what was known of it before."""
    assert context.proof is not None
    problem, split = context.need_proofs.part.problem, context.proof.split
    left, sought = int((split.fit @ problem.numbers).min()), problem.n - int(problem.has_prior.sum())
    if len(split) > 1 and left <= sought:
        noun = "configuration" if split.how == "leave-one-out" else "fold"
        yield qualify(Code.FEW_NUMBERS, noun=noun, left=left, sought=sought)


@check("bent", When.PROOF, order=70, given=Given.GAIN, needs=("proven",))
def bent(context: Decision[Model]) -> Iterator[Finding]:
    """The model was bent to data that it still does not explain, or to what no making leaves."""
    part = context.need_proofs.part
    changes = implausible(context.model, part)
    left = max((g.rms for g in part.groups if g.unit == "m"), default=0.0)
    if changes and left > BENT_LEAVES:
        yield refuse(Code.BENT, left=Quantity(left))
        yield from of_remarks(changes, Level.REFUSE)
    else:
        yield from of_remarks(out_of_tolerance(context.model, context.need_proofs.base, part), Level.REFUSE)


@check("angles", When.PROOF, order=80, given=Given.GAIN, needs=("proven",))
def angles(context: Decision[Model]) -> Iterator[Finding]:
    """Angles that were measured and are not explained."""
    for g in context.need_proofs.part.groups:
        if g.unit == "rad" and g.rms > max(ANGLES_LEFT, ANGLES_SIGMA * (g.stated or 0.0)):
            yield refuse(Code.ANGLES_UNEXPLAINED, group=g.name, left=Quantity(g.rms, "rad"))
            return


@check("same-model", When.PROOF, order=90, given=Given.GAIN, needs=("proven",))
def same_model(context: Decision[Model]) -> Iterator[Finding]:
    """What was proven of one fit holds for another only if both ended in the same place: the fit to everything has seen what the other
    one predicted, and must keep a good part of the gain."""
    before, after, counted = context.errors
    left = errors(context.residuals, context.unit)[0][counted].mean()
    if left > (1 - KEPT_GAIN) * before[counted].mean() + KEPT_GAIN * after[counted].mean():
        amounts = {"left": float(left), "after": float(after[counted].mean())}
        yield qualify(Code.ENDED_ELSEWHERE, **{k: Quantity(v, context.unit) for k, v in amounts.items()})


@check("exact", When.PROOF, order=100, given=Given.GAIN, needs=("proven",))
def exact(context: Decision[Model]) -> Iterator[Finding]:
    """The identified model leaves nothing but rounding."""
    _, after, counted = context.errors
    if context.digits is not None and (left := rms(after[counted])) <= ROUNDING_MARGIN * context.digits:
        yield note(Code.EXACT, left=Quantity(left), digits=Quantity(context.digits))


@check("proofs-not-made", When.FIT, order=250, needs=("proven",))
def missing_proofs(context: Decision[Model]) -> Iterator[Finding]:
    """A proof that was asked for and not made."""
    yield from of_remarks(context.need_proofs.left_out, Level.NOTE)

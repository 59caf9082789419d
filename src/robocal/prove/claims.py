"""Whether unseen measurements can be judged at all (the first of these findings ends it, and no gain is computed), and what a gain on
them is worth: whether every fit ended, whether it is the robot that was identified, and whether the model that is returned is the
one that was proven.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose import limits
from robocal.diagnose.check_registry import Finding, Given, Level, When, check, doubt, note, of_remarks, qualify, refuse
from robocal.diagnose.gross import share
from robocal.diagnose.zeros import UNKNOWN, cable_zeros
from robocal.fit.baseline import frame_names
from robocal.fit.estimators import estimator
from robocal.fit.misfit import errors
from robocal.measure.machine import Model
from robocal.prove.bands import find_identified
from robocal.prove.decision import Decision
from robocal.prove.statistics import rms
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["BASELINES"]

BASELINES = declare(
    "baselines-apart",
    "the nominal robot misses the same unseen rows by {together:.3g} where they were held out together, and by {single:.3g} one by one",
    "Too few rows are left to place instruments and zeros. Measure more poses, or judge by --folds 5, which fits more of them.",
)


@check("convergence", When.PROOF, order=10, given=Given.NOTHING, needs=("evidence",))
def convergence(context: Decision[Model]) -> Iterator[Finding]:
    """The fit that was judged did not converge."""
    assert context.evidence is not None
    if not context.evidence.converged:
        yield qualify(Code.NOT_CONVERGED)


@check("few-places", When.PROOF, order=15, given=Given.NOTHING, needs=("evidence", "proven"))
def few_places(context: Decision[Model]) -> Iterator[Finding]:
    """Too few places, of which more visits would be no more of them."""
    assert context.evidence is not None
    yield from _too_few(context, len(np.unique(context.evidence.configurations)))


def _too_few(context: Decision[Model], unseen: int) -> Iterator[Finding]:
    """Of places that were visited again, more rows would not help; of others, few `unseen` ones are told as such."""
    places = len(np.unique(context.places))
    if places < limits.PLACES_LEAST and (unseen >= limits.PROOF_PLACES or places < len(context.places)):
        yield qualify(Code.FEW_PLACES, least=limits.PLACES_LEAST, instrument=None)


@check("few-unseen", When.PROOF, order=20, given=Given.NOTHING, needs=("evidence",))
def few_unseen(context: Decision[Model]) -> Iterator[Finding]:
    """Too few unseen places for a bootstrap to doubt."""
    assert context.evidence is not None
    if len(np.unique(context.evidence.configurations)) < limits.PROOF_PLACES:
        yield qualify(Code.FEW_UNSEEN, least=limits.PROOF_PLACES)


@check("unfinished", When.PROOF, order=40, given=Given.GAIN, needs=("proven",))
def fits_without_convergence(context: Decision[Model]) -> Iterator[Finding]:
    """One of the fits behind the verdict did not converge."""
    assert context.proof is not None
    began = context.need_baseline.converged and context.proof.before.converged
    whole = context.need_fit.solution.reasons[0].converged or estimator(context.chosen.method).finite
    ended = {"the baseline": began, "the fit to everything": whole, "a round": context.proof.after.converged}
    for what in [what for what, done in ended.items() if not done][:1]:
        # Poses of a nominal robot with lost zeros are anywhere: whoever names the zeros helps its fit, more steps do not.
        if not began and (off := cable_zeros(context)):
            yield qualify(UNKNOWN, count=len(off), most=Quantity(max(off)))
        else:
            yield qualify(Code.NOT_CONVERGED, what=what)


@check("robot-identified", When.PROOF, order=50, given=Given.GAIN, needs=("proven",))
def robot_identified(context: Decision[Model]) -> Iterator[Finding]:
    """Nothing of the robot itself was fitted though it was to be found, or nothing of it is known by itself."""
    if context.frames_alone:
        return
    part = context.proven.part
    if not set(part.problem.free) - set(frame_names(context.model, context.proven.base.problem)):
        yield qualify(Code.NOTHING_OF_ROBOT)
    elif not find_identified(part) & set(context.model.table.names):
        yield qualify(Code.NOTHING_IDENTIFIED)


@check("numbers-of-a-round", When.PROOF, order=60, given=Given.GAIN, needs=("proven",))
def numbers_of_a_round(context: Decision[Model]) -> Iterator[Finding]:
    """A round leaves too little to fit: that would be met exactly, and what was left out by what was known of it before."""
    assert context.proof is not None
    part, split = context.proven.part, context.proof.split
    problem = part.problem
    left, sought = int((split.fit @ part.spare).min()), problem.n - int(problem.has_prior.sum())
    if len(split) > 1 and left <= sought:
        noun = "configuration" if split.how == "leave-one-out" else "fold"
        yield qualify(Code.FEW_NUMBERS, noun=noun, left=left, sought=sought)


@check("same-model", When.PROOF, order=90, given=Given.GAIN, needs=("proven",))
def same_model(context: Decision[Model]) -> Iterator[Finding]:
    """What was proven of one fit holds for another only if both ended in the same place: the fit to everything has seen what the other
    one predicted, and must keep a good part of the gain. Of frames alone there is none to keep, and it may leave half as much again."""
    before, after, counted = context.errors
    before = 2 * after if context.frames_alone else before
    left = errors(context.residuals, context.unit)[0][counted].mean()
    if left > (1 - limits.KEPT_GAIN) * before[counted].mean() + limits.KEPT_GAIN * after[counted].mean():
        amounts = {"left": float(left), "after": float(after[counted].mean())}
        yield qualify(Code.ENDED_ELSEWHERE, **{k: Quantity(v, context.unit) for k, v in amounts.items()})


@check("exact", When.PROOF, order=100, given=Given.GAIN, needs=("proven",))
def exact(context: Decision[Model]) -> Iterator[Finding]:
    """The identified model leaves nothing but rounding."""
    _, after, counted = context.errors
    if context.digits is not None and (left := rms(after[counted])) <= limits.ROUNDING_MARGIN * context.digits:
        yield note(Code.EXACT, left=Quantity(left), digits=Quantity(context.digits))


@check("proofs-not-made", When.FIT, order=250, needs=("proven",))
def missing_proofs(context: Decision[Model]) -> Iterator[Finding]:
    """A proof that was asked for and not made."""
    yield from of_remarks(context.proven.left_out, Level.NOTE)


@check("baselines", When.FIT, order=255, needs=("proven",))
def compare_baselines(context: Decision[Model]) -> Iterator[Finding]:
    """The nominal robot misses the same rows otherwise where they were held out together and where one by one: with the better of two
    baselines in both, that is for want of data."""
    proofs = context.proven.proofs
    if not {"held_out", "leave_one_out"} <= set(proofs):
        return
    (held, _, some), (single, _, every) = (proofs[n]().errors(context.unit) for n in ("held_out", "leave_one_out"))
    both = some & every
    if not both.any():
        return
    one, other = float(held[both].mean()), float(single[both].mean())
    if max(one, other) > limits.BASELINES_APART * min(one, other):
        yield doubt(BASELINES, together=Quantity(one, context.unit), single=Quantity(other, context.unit))


@check("one-place", When.UNSEEN, order=10, given=Given.NOTHING, needs=("proven",))
def one_place(context: Decision[Model]) -> Iterator[Finding]:
    """All measurements were taken at one place."""
    if len(np.unique(context.places)) < 2:
        yield refuse(Code.ONE_PLACE)


@check("excluded-share", When.UNSEEN, order=20, given=Given.NOTHING, needs=("proven",))
def share_of_excluded(context: Decision[Model]) -> Iterator[Finding]:
    """So many rows are excluded that they are no outliers. A fit that did not see all rows may see more clearly which are gross."""
    excluded = max(share(context.need_data), context.proven.part.problem.aside)
    if excluded > limits.GROSS_SHARE:
        yield refuse(Code.TOO_MANY_ASIDE, share=excluded, most=limits.GROSS_SHARE)


@check("nothing-unseen", When.UNSEEN, order=30, given=Given.NOTHING, needs=("proven",))
def nothing_unseen(context: Decision[Model]) -> Iterator[Finding]:
    """Nothing was held out, or nothing that was held out proves anything."""
    if context.proof is None:
        yield qualify(Code.NOTHING_HELD_OUT)
    elif not context.errors[2].any() and len(np.unique(context.places)) < limits.PROOF_PLACES:
        again = list(_too_few(context, 0))
        yield from again or [qualify(Code.FEW_UNSEEN, least=limits.PROOF_PLACES)]
    elif not context.errors[2].any():
        yield qualify(Code.NOTHING_MEASURED_THERE)


@check("exact-nominal", When.UNSEEN, order=40, given=Given.NOTHING, needs=("proven",))
def exact_nominal(context: Decision[Model]) -> Iterator[Finding]:
    """The nominal model leaves nothing but rounding."""
    before, _, counted = context.errors
    if (
        not context.frames_alone
        and context.digits is not None
        and (left := rms(before[counted])) <= limits.ROUNDING_MARGIN * context.digits
    ):
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
    if there.mean() >= limits.MEAN_RIVAL * constant.mean():
        after, mean = Quantity(float(there.mean())), Quantity(float(constant.mean()))
        yield refuse(Code.NO_BETTER_THAN_MEAN, after=after, constant=mean)

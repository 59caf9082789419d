"""The joint offsets alone: what a controller that takes nothing else would gain.

    free: the joints' zeros, and the frames and the tool of the baseline; everything else of the robot stays nominal

Not the zeros of the identified model: there they share the work with twists and lengths that the controller will not
know of. The rows, their noise, the loss and the unseen places are those of a proof of the whole model, leave-one-out where
it was made, so the three means (baseline, offsets alone, whole model) are of the same measurements; what is seen is
decided at the noise that offsets alone leave.
Source of the idea: Elatta et al., An overview of robot calibration (2004), level 1 against level 2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.limits import PROOF_PLACES
from robocal.estimate.elimination import Squares, squares
from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import Total, quantile, total, uncertainty, uneven
from robocal.fit.baseline import frame_names
from robocal.fit.fit import Fit
from robocal.fit.misfit import by_unit
from robocal.fit.repeats import places
from robocal.geometry.path.program import Zero, offset_matrix
from robocal.measure.machine import Model, joints_of
from robocal.prove.decision import Decision
from robocal.prove.evidence import bootstrap_gain
from robocal.prove.folds import local_names, unseen
from robocal.prove.judge import Proof, drawn, units_of
from robocal.prove.statistics import Statistic
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["JointOffset", "OffsetsAlone", "offsets_alone"]

ROUNDS = 3  # of noise and selection


@record
class JointOffset:
    """What to add to a joint's value (rad or m) before the nominal model, its standard deviation and 95 % interval; a
    joint whose offset is not seen has 0, and the note says what looks like it."""

    joint: str
    unit: str
    offset: float
    sigma: float | None = None
    interval: tuple[float, float] | None = None
    status: str = "dropped"  # identified | dropped | fixed
    remarks: tuple[Remark, ...] = ()

    @property
    def note(self) -> str:
        """The remarks in one line."""
        return "; ".join(map(str, self.remarks))


@record
class OffsetsAlone:
    """The offsets of all joints, fitted alone, with mean errors on unseen measurements (m, rad or px): baseline, offsets
    alone, whole model; `gain` is the mean reduction against the baseline with its 95 % interval."""

    parameters: tuple[JointOffset, ...]
    proven: bool
    reason: Remark
    unit: str
    before: Statistic | None = None
    after: Statistic | None = None
    whole: Statistic | None = None
    gain: tuple[float, float, float] | None = None
    how: str = ""

    @property
    def status(self) -> str:
        """improved, or not_improved."""
        return "improved" if self.proven else "not_improved"

    @property
    def n(self) -> int:
        """How many unseen measurements the means are of."""
        return self.before.n if self.before else 0


@record
class _Found:
    problem: Problem  # with the columns that were fitted
    x: Array
    converged: bool
    notes: dict[str, Remark]  # why a zero was not fitted
    total: Callable[[], Total]  # worked out of one that is told, not of one that is only held against unseen rows


def offsets_alone(context: Decision[Model]) -> OffsetsAlone | None:
    """Fits and proves the joint offsets alone. None where no joint's zero may move."""
    model, base_x, whole, proven = context.model, context.need_baseline.x, context.need_fit, context.proven
    zeros = () if model.mechanism is None else model.mechanism.open_zeros
    if not zeros:
        return None
    found = _fit_zeros(model, whole, base_x, zeros)
    offsets = _offsets(model, found, zeros)
    # Of the proofs that were made, the one with the most places: a mean of ten errors says little of the next thousand.
    one_by_one = proven.proofs.get("leave_one_out")
    main = proven.best if one_by_one is None else one_by_one()
    if main is None:
        return OffsetsAlone(offsets, False, Remark.of(Code.NOTHING_HELD_OUT), context.unit)
    part, home = found, base_x
    if one_by_one is None and "held_out" in proven.proofs:
        part, home = _fit_zeros(model, proven.part, proven.base.x, zeros), proven.base.x
    local = [n for n in local_names(model, found.problem) if n in found.problem.free]
    alone = _unseen(part, base_x, home, local, main)
    converged = part.converged and found.converged and alone.after.converged and alone.before.converged
    return _assess_gain(context, main, alone, offsets, converged)


def _fit_zeros(model: Model, fit: Fit, x: Array, zeros: Sequence[Zero]) -> _Found:
    """The zeros fitted from a baseline x (1, P), with the rows, the noise and the loss of a fit."""
    names = [*frame_names(model, fit.problem), *(z.parameter for z in zeros)]
    every = fit.problem.with_free(names)
    start, noise = x, 1.0
    kept: tuple[str, ...] | None = None
    known: Squares | None = None
    for _ in range(ROUNDS):
        seen = analyse(every, start, noise=noise, known=known)
        if seen.basis == kept:
            break
        kept = seen.basis
        chosen = every.with_free(kept)
        # A loss that forgets large residuals would forget all of them at a start that is millimetres away.
        near = least_squares(chosen.with_loss("huber"), x).x if chosen.loss == "tukey" else x
        solution = least_squares(chosen, near)
        start = solution.x
        lin = every.linearize(start)
        known = squares(every, start, lin)
        u = uncertainty(chosen, start, known=known)
        noise = u.factor

    def off() -> Total:
        visits = places(fit.data.configurations)
        more = float(np.sqrt(uneven(chosen, start, visits, lin, known, every.column_of[chosen.index])))
        return total(every, chosen.free, start, factor=u.factor * more, dof=max(float(u.dof), 1.0), known=known)

    # Why a zero stays: what it looks like, or that it is too small beside what offsets cannot explain.
    notes = {c.name: c.remark if c.partners else Remark.of(Code.BELOW_THE_REST) for c in seen.combinations}
    converged = solution.reasons[0].converged and bool(np.isfinite(solution.cost[0]))
    return _Found(chosen, start, converged, notes, off)


def _offsets(model: Model, found: _Found, zeros: Sequence[Zero]) -> tuple[JointOffset, ...]:
    """The offset of every joint, in SI; joints whose zero may not move have none."""
    table, off = found.problem.table, found.total()
    at, reach = {n: i for i, n in enumerate(off.names)}, quantile(off.dof)
    known = {z.joint: i for i, z in enumerate(zeros)}
    seen = [i for i, z in enumerate(zeros) if z.parameter in found.problem.free]
    moved = np.array(
        [float(found.x[0, table.index[zeros[i].parameter]]) - model.table[zeros[i].parameter].value for i in seen]
    )
    # Where joints count with each other, the offset of one undoes what that of another moves.
    inverse = np.linalg.inv(offset_matrix(zeros))[:, seen]
    own = [at[zeros[i].parameter] for i in seen]
    values, sigma = (
        inverse @ moved,
        np.sqrt(np.einsum("ij,jk,ik->i", inverse, off.covariance[np.ix_(own, own)], inverse)),
    )
    out = []
    for joint in joints_of(model):
        unit = "m" if joint.type == "prismatic" else "rad"
        i = known.get(joint.name)
        if i is None:
            out.append(JointOffset(joint.name, unit, 0.0, status="fixed"))
        elif not inverse[i].any():
            notes = tuple(r for n, r in found.notes.items() if n == zeros[i].parameter)
            out.append(JointOffset(joint.name, unit, 0.0, remarks=notes))
        else:
            value, bar = float(values[i]), float(sigma[i])
            ends = (value - reach * bar, value + reach * bar)
            out.append(JointOffset(joint.name, unit, value, bar, ends, "identified"))
    return tuple(out)


def _unseen(part: _Found, base_x: Array, home: Array, local: Sequence[str], main: Proof) -> Proof:
    """What the offsets miss where the main proof held out; all rounds in one batch."""
    x = np.array(part.x)
    # Frames that only held-out rows can see are looked for where all rows believe them to stand.
    for at in (part.problem.table.index[n] for n in local if n not in part.problem.free):
        x[:, at] = base_x[:, at]
    begins = np.repeat(home, len(main.split), axis=0) if main.before.x is None else main.before.x
    return replace(main, after=unseen(part.problem, x, main.split, units_of(part.problem), local, begins))


def _assess_gain(
    context: Decision[Model], main: Proof, alone: Proof, offsets: tuple[JointOffset, ...], converged: bool
) -> OffsetsAlone:
    """The gain of offsets alone and whether it is proven, by the rule of the main verdict."""
    terms, unit = context.need_fit.problem.terms, context.unit
    before, after, told = alone.errors(unit)
    _, best, other = main.errors(unit)
    told &= other
    if not told.any():
        return OffsetsAlone(offsets, False, Remark.of(Code.NOTHING_MEASURED_THERE), unit, how=main.split.how)
    at = by_unit(terms, [t.configuration for t in terms], unit)[told]
    together = drawn(main.split, context.places, at)
    finite = bool(np.isfinite(after[told]).all())
    gain = bootstrap_gain(before[told], after[told], together, context.chosen.seed) if finite else None
    seen = any(o.status == "identified" for o in offsets)
    enough = len(np.unique(together)) >= PROOF_PLACES
    proven = gain is not None and converged and seen and enough and gain[1] > 0
    first, mine, best_of = (Statistic.of(v[told]) for v in (before, after, best))
    shown = {name: Quantity(s.mean, unit) for name, s in (("before", first), ("after", mine), ("whole", best_of)) if s}
    low, high = (None, None) if gain is None else (Quantity(gain[1], unit), Quantity(gain[2], unit))
    if proven:
        reason = Remark.of(Code.OFFSETS_PROVEN, **shown, low=low, high=high, how=main.split.how)
    elif not converged or not finite:
        reason = Remark.of(Code.NOT_CONVERGED)
    elif not seen:
        reason = Remark.of(Code.OFFSETS_UNSEEN)
    elif not enough:
        reason = Remark.of(Code.FEW_UNSEEN, least=PROOF_PLACES)
    else:
        reason = Remark.of(Code.OFFSETS_NOT_PROVEN, **shown, low=low, high=high, how=main.split.how)
    return OffsetsAlone(offsets, proven, reason, unit, first, mine, best_of, gain, main.split.how)

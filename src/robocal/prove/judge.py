"""What the errors of unseen measurements prove: the stages of every quantity, and the verdict.

A proof is a split with the errors of baseline and identified model on what it held out. The verdict takes the first
that there is: a hold-out, a k-fold, leave-one-out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.diagnose.digits import carried
from robocal.diagnose.gross import share
from robocal.diagnose.limits import (
    ANGLES_LEFT,
    ANGLES_SIGMA,
    BENT_LEAVES,
    FINEST_ERROR,
    GROSS_SHARE,
    KEPT_GAIN,
    PROOF_PLACES,
    ROUNDING_MARGIN,
)
from robocal.diagnose.verdict import Verdict
from robocal.estimate.problem import Problem
from robocal.fit.baseline import frame_names
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.fit.misfit import by_unit, errors
from robocal.fit.noise import owners
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine
from robocal.prove.bands import claimed, total_of
from robocal.prove.evidence import constant_errors, judge
from robocal.prove.folds import Unseen
from robocal.prove.split import Split, leave_one_out_rounds
from robocal.prove.statistics import Fold, Stages, Statistic
from robocal.prove.warn import ABSOLUTE, implausible, unmade
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["Proof", "best", "drawn", "stages", "units_of", "unseen_of", "verdict"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
UNITS = ("m", "rad", "px")  # in which errors are told; the verdict takes the first that was measured


@dataclass(frozen=True)
class Proof:
    """What a split held out, and what baseline and identified model missed there."""

    split: Split
    before: Unseen
    after: Unseen
    aside: Mapping[str, NDArray[np.bool_]]  # by unit, (N,): gross rows, which prove nothing

    def errors(self, unit: str, everything: bool = False) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Errors (N,) of both models in one unit, and which rows prove something; `everything`: gross rows too."""
        before, after = self.before.value[unit], self.after.value[unit]
        told = ~(np.isnan(before) | np.isnan(after))
        return before, after, told if everything else told & ~self.aside[unit]

    @property
    def starved(self) -> bool:
        """Whether enough rows were unseen, but too many of them are gross."""
        some = [[int(self.errors(u, everything)[2].sum()) for everything in (False, True)] for u in self.aside]
        return bool(some) and some[0][0] < PROOF_PLACES <= some[0][1]


def units_of(problem: Problem) -> tuple[str, ...]:
    """The SI units in which a problem's errors are told."""
    return tuple(u for u in UNITS if any(u == v for t in problem.terms for _, _, v in t.parts))


def stages(
    data: DataSet, base: Problem, base_x: Array, part: Fit, fitted: Ints, proofs: Mapping[str, Proof], unit: str
) -> Stages:
    """Every stage in one unit; `proofs` by name: held_out, k_fold, leave_one_out. Where rows were set aside, the same once
    more with all of them."""
    known = (data, base, base_x, part, fitted, proofs, unit)
    unused = any((~t.used).any() for t in part.problem.terms)
    found = _stages(*known, everything=False)
    return replace(found, all_rows=_stages(*known, everything=True)) if unused or _left_out(proofs) else found


def _left_out(proofs: Mapping[str, Proof]) -> bool:
    return any(a.any() for p in proofs.values() for a in p.aside.values())


def _stages(
    data: DataSet,
    base: Problem,
    base_x: Array,
    part: Fit,
    fitted: Ints,
    proofs: Mapping[str, Proof],
    unit: str,
    *,
    everything: bool,
) -> Stages:
    before, at = errors(base.residuals(base_x), unit)
    after, _ = errors(part.problem.residuals(part.solution.x), unit)
    inside = np.isin(at, fitted)
    if not everything:
        inside &= by_unit(part.problem.terms, [t.used for t in part.problem.terms], unit)
    seen: dict[str, Any] = {}
    for name in ("held_out", "k_fold", "leave_one_out"):
        proof = proofs.get(name)
        seen[f"{name}_before"], seen[name] = (None, None) if proof is None else unseen_of(proof, unit, everything)
    # Where a configuration's own pose is fitted to its rows, predicting the mean of them is no rival.
    constant = _constant(data, base, best(proofs), everything) if unit == "m" and not base.blocks else None
    return Stages(
        unit=unit,
        before=Statistic.of(before[inside]),
        after=Statistic.of(after[inside]),
        # A target that only held-out rows show has no mean to predict.
        constant=Statistic.of(constant[np.isfinite(constant)]) if constant is not None else None,
        folds=_folds(proofs["k_fold"], unit, at, everything) if "k_fold" in proofs else (),
        **seen,
    )


def unseen_of(proof: Proof, unit: str, everything: bool = False) -> tuple[Statistic | None, Statistic | None]:
    """The errors of what a proof held out, before and after, in one unit; `everything`: those of gross rows too."""
    first, second, told = proof.errors(unit, everything)
    turned = bool(proof.after.profiled.any())
    return Statistic.of(first[told], turned), Statistic.of(second[told], turned)


def _folds(proof: Proof, unit: str, at: Ints, everything: bool) -> tuple[Fold, ...]:
    first, second, told = proof.errors(unit, everything)
    mine = proof.split.round_of[at]
    rows = [np.flatnonzero(told & (mine == k)) for k in range(len(proof.split))]
    return tuple(
        Fold(
            proof.split.names[k], len(r), float(first[r].mean()), float(second[r].mean()), bool(proof.after.profiled[k])
        )
        for k, r in enumerate(rows)
        if len(r)
    )


def best(proofs: Mapping[str, Proof]) -> Proof | None:
    """The proof that the verdict takes: the first that there is, unless gross rows left it too little to prove anything."""
    known = [n for n in ("held_out", "k_fold", "leave_one_out") if n in proofs]
    return next((proofs[n] for n in known if not proofs[n].starved), proofs[known[0]] if known else None)


def _located(data: DataSet) -> list[int]:
    """The observations that have a mean to predict: positions in the coordinates of an instrument."""
    return [i for i, o in enumerate(data.observations) if o.kind in ABSOLUTE and o.value.ndim == 2]


def _constant(data: DataSet, base: Problem, proof: Proof | None, everything: bool = False) -> Array | None:
    """What predicting the mean would miss of the rows that prove something, of each target by each instrument that measured
    positions; None where none did."""
    found = _located(data)
    split = proof.split if proof is not None else leave_one_out_rounds(data)
    if not found or (len(split) < 2 and proof is None):
        return None
    owned = list(owners(data, base))
    owner = by_unit(base.terms, [np.full(len(t.index), i) for i, t in owned], "m")
    row = by_unit(base.terms, [t.index for _, t in owned], "m")
    out = []
    for i in found:
        obs = data.observations[i]
        told = np.ones(len(obs), dtype=bool)
        if proof is not None and not everything:
            told[row[owner == i]] = ~proof.aside["m"][owner == i]
        target = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
        used = None if everything else obs.used
        for one in np.unique(target):
            mine = target == one
            missed = constant_errors(
                obs.value[mine, :3], obs.configuration[mine], split, None if used is None else used[mine]
            )
            out.append(missed[told[mine]])
    missed = np.concatenate(out)
    return np.asarray(missed[~np.isnan(missed)])


def verdict(
    model: Machine,
    data: DataSet,
    base: Problem,
    part: Fit,
    whole: Fit,
    proofs: Mapping[str, Proof],
    options: Options,
    started: bool = True,
) -> Verdict:
    """Whether the model improved, with the reasons; `part` is what was judged, `whole` what is handed back, `data` has the gross
    rows marked, and `started` says whether the baseline converged. See docs/architecture.md."""
    label = places(data.configurations)
    if len(np.unique(label)) < 2:
        return Verdict("refused", (Remark.of(Code.ONE_PLACE),))
    # A fit that did not see all rows may see more clearly which are gross.
    if (aside := max(share(data), part.problem.aside)) > GROSS_SHARE:
        return Verdict("refused", (Remark.of(Code.TOO_MANY_ASIDE, share=aside, most=GROSS_SHARE),))
    proof = best(proofs)
    if proof is None:
        return Verdict("not_improved", (Remark.of(Code.NOTHING_HELD_OUT),))
    unit = units_of(base)[0]
    before, after, told = proof.errors(unit)
    if not told.any() and len(np.unique(label)) < PROOF_PLACES:
        return Verdict("not_improved", (Remark.of(Code.FEW_UNSEEN, least=PROOF_PLACES),))
    if not told.any():
        return Verdict("not_improved", (Remark.of(Code.NOTHING_MEASURED_THERE),))
    digits = _digits(model, data, part, before, after, told) if unit == "m" else None
    if digits is not None and (left := _rms(before[told])) <= ROUNDING_MARGIN * digits:
        return Verdict("not_improved", (Remark.of(Code.NOMINAL_EXACT, left=Quantity(left), digits=Quantity(digits)),))
    constant = _constant(data, base, proof) if unit == "m" else None
    owner = by_unit(base.terms, [np.full(len(t.index), i) for i, t in owners(data, base)], unit)
    at = np.concatenate([r.configuration for r in base.residuals(base.start) for *_, u in r.parts if u == unit])
    stated = [g.stated for g in part.groups if g.unit == "m" and g.stated is not None]
    found = judge(
        before[told],
        after[told],
        constant,
        drawn(proof.split, label, at[told]),
        blind=part.identifiability.blind,
        # Some methods end after as many steps as were asked for.
        converged=part.solution.reasons[0].converged or estimator(options.method).finite,
        seed=options.seed,
        kind=proof.split.how,
        stated=float(np.sqrt(3) * stated[0]) if stated else None,
        unit=unit,
        everything=proof.errors(unit, everything=True) if proof.aside[unit].any() else None,
        located=after[told & np.isin(owner, _located(data))],
    )
    if found.status == "improved" and (what := _unfinished(whole, proof, options, started)):
        found = found.instead("not_improved", Remark.of(Code.NOT_CONVERGED, what=what))
    if found.status == "improved":
        found = _second_thoughts(model, base, part, proof, found)
    if found.status == "improved":
        found = _same_model(whole, proof, unit, found)
    if found.status == "improved" and digits is not None and (left := _rms(after[told])) <= ROUNDING_MARGIN * digits:
        exact = Remark.of(Code.EXACT, left=Quantity(left), digits=Quantity(digits))
        found = Verdict(found.status, (*found.reasons, exact))
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _digits(
    model: Machine, data: DataSet, part: Fit, before: Array, after: Array, told: NDArray[np.bool_]
) -> float | None:
    """What rounding leaves (m), where one of the two models is so good that it matters; see `digits`."""
    matters = min(_rms(before[told]), _rms(after[told])) < FINEST_ERROR
    return carried(model, data, part, told) if matters else None


def _unfinished(whole: Fit, proof: Proof, options: Options, started: bool) -> str | None:
    """Which of the fits behind a verdict did not converge; None when all did."""
    ended = {
        "the baseline": started and proof.before.converged,
        "the fit to everything": whole.solution.reasons[0].converged or estimator(options.method).finite,
        "a round": proof.after.converged,
    }
    return next((what for what, done in ended.items() if not done), None)


def drawn(split: Split, label: Ints, at: Ints) -> Ints:
    """What the bootstrap draws as a whole: blocks or groups, where enough of them were held out to prove something, else
    places."""
    if split.together is not None and len(np.unique(split.together[at])) >= PROOF_PLACES:
        return split.together[at]
    return label[at]


def _second_thoughts(model: Machine, base: Problem, part: Fit, proof: Proof, found: Verdict) -> Verdict:
    """An improvement that cannot be one: nothing of the robot was fitted, or a round leaves too little to fit."""
    problem = part.problem
    if not set(problem.free) - set(frame_names(model, base)):
        return found.instead("not_improved", Remark.of(Code.NOTHING_OF_ROBOT))
    if not claimed(part, total_of(part)) & set(model.table.names):
        return found.instead("not_improved", Remark.of(Code.NOTHING_IDENTIFIED))
    rows = problem.numbers
    left, sought = int((proof.split.fit @ rows).min()), problem.n - int(problem.stated.sum())
    # What is left would be met exactly, and the left-out configuration by what was known of it before.
    if len(proof.split) > 1 and left <= sought:
        few = Remark.of(Code.FEW_NUMBERS, noun=_noun(proof), left=left, sought=sought)
        return found.instead("not_improved", few)
    bent = implausible(model, part)
    left_over = max((g.rms for g in part.groups if g.unit == "m"), default=0.0)
    if bent and left_over > BENT_LEAVES:
        return found.refused(Remark.of(Code.BENT, left=Quantity(left_over)), *bent)
    if wrong := unmade(model, base, part):
        return found.refused(*wrong)
    for g in part.groups:
        if g.unit == "rad" and g.rms > max(ANGLES_LEFT, ANGLES_SIGMA * (g.stated or 0.0)):
            told = Remark.of(Code.ANGLES_UNEXPLAINED, group=g.name, left=Quantity(g.rms, "rad"))
            return found.refused(told)
    return found


def _same_model(whole: Fit, proof: Proof, unit: str, found: Verdict) -> Verdict:
    """What was proven of one fit holds for another only if both ended in the same place: the fit to everything has seen
    what the other one predicted, and must keep at least half of the gain."""
    before, after, told = proof.errors(unit)
    left = errors(whole.problem.residuals(whole.solution.x), unit)[0][told].mean()
    if left <= (1 - KEPT_GAIN) * before[told].mean() + KEPT_GAIN * after[told].mean():
        return found
    elsewhere = Remark.of(
        Code.ENDED_ELSEWHERE, left=Quantity(float(left), unit), after=Quantity(float(after[told].mean()), unit)
    )
    return found.instead("not_improved", elsewhere)


def _noun(proof: Proof) -> str:
    return "configuration" if proof.split.how == "leave-one-out" else "fold"

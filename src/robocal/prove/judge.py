"""What the errors of unseen measurements are: proofs, and the stages of every quantity.

A proof is a split with the errors of baseline and identified model on what it held out. The verdict takes the first
that there is: a hold-out, a k-fold, leave-one-out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.limits import PROOF_PLACES
from robocal.diagnose.motions import ABSOLUTE
from robocal.estimate.problem import Problem
from robocal.fit.baseline import Baseline
from robocal.fit.fit import Fit
from robocal.fit.misfit import by_unit, errors
from robocal.fit.noise import owners
from robocal.measure.data import DataSet
from robocal.prove.evidence import constant_errors
from robocal.prove.folds import Unseen
from robocal.prove.split import Split, leave_one_out_rounds
from robocal.prove.statistics import Fold, Stages, Statistic
from robocal.remarks.remark import Remark

__all__ = ["Proof", "Proven", "absolute_observations", "constant_of", "drawn", "stages", "units_of", "unseen_of"]

UNITS = ("m", "rad", "px", "N m", "A")  # in which errors are told; the verdict takes the first that was measured
PROOFS = ("held_out", "k_fold", "leave_one_out")  # the verdict takes the first that there is


@record
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
    def short_of_rows(self) -> bool:
        """Whether enough rows were unseen, but too many of them are gross."""
        some = [[int(self.errors(u, everything)[2].sum()) for everything in (False, True)] for u in self.aside]
        return bool(some) and some[0][0] < PROOF_PLACES <= some[0][1]


@record
class Proven:
    """Who makes each proof, by name, once it is asked for, with the baseline and the fit that had not seen what was held out."""

    proofs: Mapping[str, Callable[[], Proof]]
    base: Baseline
    part: Fit
    fitted: Ints
    held_out: Ints
    embargoed: Ints  # neither fitted nor held out
    left_out: tuple[Remark, ...]  # a proof that was not made

    @property
    def best(self) -> Proof | None:
        """The proof that the verdict takes: the first that there is, unless gross rows left it too little to prove anything."""
        known = [self.proofs[name] for name in PROOFS if name in self.proofs]
        return next((make() for make in known if not make().short_of_rows), known[0]() if known else None)


def units_of(problem: Problem) -> tuple[str, ...]:
    """The SI units in which a problem's errors are told."""
    return tuple(u for u in UNITS if any(u == v for t in problem.terms for _, _, v in t.parts))


def stages(data: DataSet, proven: Proven, unit: str) -> Stages:
    """Every stage in one unit. Where rows were set aside, the same once more with all of them."""
    found = _stages(data, proven, unit, everything=False)
    unused = any((~t.used).any() for t in proven.part.problem.terms)
    if unused or any(aside.any() for make in proven.proofs.values() for aside in make().aside.values()):
        return replace(found, all_rows=_stages(data, proven, unit, everything=True))
    return found


def _stages(data: DataSet, proven: Proven, unit: str, *, everything: bool) -> Stages:
    base, part = proven.base.problem, proven.part
    before, at = errors(base.residuals(proven.base.x), unit)
    after, _ = errors(part.problem.residuals(part.solution.x), unit)
    inside = np.isin(at, proven.fitted)
    if not everything:
        inside &= by_unit(part.problem.terms, [t.used for t in part.problem.terms], unit)
    proofs = {name: make() for name, make in proven.proofs.items()}
    seen: dict[str, Any] = {}
    for name, proof in proofs.items():
        seen[f"{name}_before"], seen[name] = unseen_of(proof, unit, everything)
    # Where a configuration's own pose is fitted to its rows, predicting the mean of them is no rival.
    constant = constant_of(data, base, proven.best, everything) if unit == "m" and not base.blocks else None
    # A target that only held-out rows show has no mean to predict.
    mean = Statistic.of(constant[np.isfinite(constant)]) if constant is not None else None
    rounds = _folds(proofs["k_fold"], unit, at, everything) if "k_fold" in proofs else ()
    first, last = Statistic.of(before[inside]), Statistic.of(after[inside])
    return Stages(unit=unit, before=first, after=last, constant=mean, folds=rounds, **seen)


def unseen_of(proof: Proof, unit: str, everything: bool = False) -> tuple[Statistic | None, Statistic | None]:
    """The errors of what a proof held out, before and after, in one unit; `everything`: those of gross rows too."""
    first, second, told = proof.errors(unit, everything)
    turned = bool(proof.after.profiled.any())
    return Statistic.of(first[told], turned), Statistic.of(second[told], turned)


def _folds(proof: Proof, unit: str, at: Ints, everything: bool) -> tuple[Fold, ...]:
    first, second, told = proof.errors(unit, everything)
    mine = proof.split.round_of[at]
    out = []
    for k, (name, profiled) in enumerate(zip(proof.split.names, proof.after.profiled.tolist(), strict=True)):
        if (own := told & (mine == k)).any():
            out.append(Fold(name, int(own.sum()), float(first[own].mean()), float(second[own].mean()), profiled))
    return tuple(out)


def absolute_observations(data: DataSet) -> list[int]:
    """The observations that have a mean to predict: positions in the coordinates of an instrument."""
    return [i for i, o in enumerate(data.observations) if o.kind in ABSOLUTE and o.value.ndim == 2]


def constant_of(data: DataSet, base: Problem, proof: Proof | None, everything: bool = False) -> Array | None:
    """What predicting the mean would miss of the rows that prove something, of each target by each instrument that measured
    positions; None where none did."""
    found = absolute_observations(data)
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


def drawn(split: Split, label: Ints, at: Ints) -> Ints:
    """What the bootstrap draws as a whole: blocks or groups, where enough of them were held out to prove something, else
    places."""
    if split.together is not None and len(np.unique(split.together[at])) >= PROOF_PLACES:
        return split.together[at]
    return label[at]

"""What a machine that stands where its lengths say is off by: its poses from lengths alone, beside what an instrument reads.

Poses of unseen configurations are found from all their rows, those of the instrument too; then the instrument is compared with itself.
Here every one is found once more from its lengths alone, with the baseline and with the identified model.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.diagnose.check_registry import once
from robocal.diagnose.growth import at_end, error_growth
from robocal.diagnose.motions import ABSOLUTE
from robocal.estimate.elimination import block_ranks
from robocal.estimate.problem import Problem
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import by_unit
from robocal.measure.machine import Model
from robocal.prove import folds
from robocal.prove.decision import Decision
from robocal.prove.lengths_alone import LENGTHS, kinds_of, rows_of_kinds
from robocal.prove.split import Split
from robocal.prove.statistics import Stages, Statistic

__all__ = ["PoseFromLengths", "pose_from_lengths"]


@record
class PoseFromLengths:
    """Errors on unseen configurations: position from lengths, orientation where an instrument read it, and lengths beside them; `end`
    is the mean error of positions (m) at the end of a file along which something drifts, None without."""

    position: Stages
    orientation: Stages | None
    lengths: Stages
    end: float | None = None


@once
def pose_from_lengths(context: Decision[Model]) -> PoseFromLengths | None:
    """These errors in the proof that the verdict takes; None without lengths, without an instrument that reads positions, and where
    lengths tell no pose."""
    proof, base, part = context.proof, context.proven.base, context.proven.part
    if proof is None or not base.problem.families:
        return None
    kinds = kinds_of(base.problem)
    if LENGTHS not in kinds or not set(ABSOLUTE) & set(kinds):
        return None
    ends = [base.x, part.solution.x] if proof.after.x is None else [proof.before.x, proof.after.x]
    known = [x for x in ends if x is not None and len(x) == len(proof.split)]
    if len(known) < 2:
        return None  # every round was done from the beginning, and nobody kept where it ended
    seen = [_misses(p, x, proof.split, kinds) for p, x in zip((base.problem, part.problem), known, strict=True)]
    name = next(n for n, make in context.proven.proofs.items() if make() is proof)

    def stages(unit: str, before: Array, after: Array, counted: Bools) -> Stages | None:
        told = counted & np.isfinite(before) & np.isfinite(after)
        if not told.any():
            return None
        means = {f"{name}_before": Statistic.of(before[told]), name: Statistic.of(after[told])}
        return Stages(unit=unit, **means)  # type: ignore[arg-type]

    absolute = [k in ABSOLUTE for k in kinds]
    position, orientation = (
        stages(u, seen[0][u], seen[1][u], ~proof.aside[u][_rows_of(base.problem, absolute, u)])
        if u in seen[0]
        else None
        for u in ("m", "rad")
    )
    before, after, counted = proof.errors("m")
    mine = _rows_of(base.problem, [k == LENGTHS for k in kinds], "m")
    lengths = stages("m", before, after, counted & mine)
    if position is None or lengths is None:
        return None
    whole = context.need_fit.problem
    more = error_growth(context, rows_of_kinds(whole, kinds, (LENGTHS,)), rows_of_kinds(whole, kinds, ABSOLUTE))
    told = (
        ~proof.aside["m"][_rows_of(base.problem, absolute, "m")] & np.isfinite(seen[0]["m"]) & np.isfinite(seen[1]["m"])
    )
    end = float(at_end(seen[1]["m"], more, "m")[told].mean()) if more else None
    return PoseFromLengths(position, orientation, lengths, end)


def _rows_of(problem: Problem, some: list[bool], unit: str) -> Bools:
    """Which errors in one unit are those of some terms."""
    rows = [np.full(len(t.configuration), s) for t, s in zip(problem.terms, some, strict=True)]
    return by_unit(problem.terms, rows, unit)


def _misses(problem: Problem, x: Array, split: Split, kinds: list[str]) -> dict[str, Array]:
    """By unit, how far from what instruments read unseen poses are that lengths alone give, (N,), x (K, P) being the ends of the rounds;
    NaN where they give none."""
    own, seen = (rows_of_kinds(problem, kinds, some) for some in ((LENGTHS,), ABSOLUTE))
    placed = own_poses(own, x, split.held_out)[0]
    rank = block_ranks(own.with_free(()).with_weights(None).linearize(placed[:1]), own.families[0].count)
    told = np.where(rank == len(own.families[0].axes), 1.0, np.nan)
    units = [u for u in ("m", "rad") if any(u == v for t in seen.terms for _, _, v in t.parts)]
    out = folds.empty(seen, placed[:1], units)
    factor = np.ones((len(split), len(seen.terms)))
    folds.collect(out, seen, placed, factor, split, np.arange(len(split)), np.tile(told, (len(split), 1)))
    return out

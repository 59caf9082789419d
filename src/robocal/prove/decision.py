"""What is decided of a machine from its measurements: the model that is handed back, what was proven of it, and the verdict.

1 split    fit and held-out configurations, in one round or several
2 gross    rows that belong to no others are set aside (see `gross`)
3 start    closed form for frames and targets, refined together: the baseline
4 fit      what is seen above the noise, on the fit configurations (see `fit`)
5 judge    paired comparison with the baseline on configurations that were not used
6 refit    once more on everything, for the model that is handed back

Whatever can change the status of the verdict is here. What is told beside it (see `identify`) is not: a study of thousands of
identifications asks for the status and for the errors of what was not used.

A joint that lost its zero may be off by any angle, a length by what making leaves. What looks alike is kept by the effect of its
expected error, often the length; once that has moved by more than ZERO_CHANGE times its own, the zero is the likelier cause, and the
one that a controller takes: it is expected to be off by ZERO_LOST, and the fit is made again. Where conventions hold zeros, or an
angle is too large for a fit to find, a search over all joints says where the fit begins (`hypotheses/zero_search`).
"""

from __future__ import annotations

from functools import cached_property
from typing import TypeVar

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Bools
from robocal.diagnose.check_registry import Context, M_co
from robocal.diagnose.hypotheses.zero_search import search_zeros
from robocal.diagnose.limits import BENT_LEAVES, FINEST_ERROR, FOLDS, HOLD_OUT_SHARE, ZERO_CHANGE, ZERO_LOST, ZERO_SIGMA
from robocal.diagnose.rounding import rounding_rms
from robocal.errors import ModelError
from robocal.estimate.uncertainty import Uncertainty
from robocal.fit.baseline import check_baseline
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.fit.frames_alike import FixedFrame, fix_frames, frames_alone, frames_of
from robocal.fit.misfit import by_unit
from robocal.fit.noise import owners
from robocal.fit.options import Options
from robocal.fit.starts.own import place_configurations
from robocal.fit.starts.unknown_zeros import begin_zeros
from robocal.geometry.path.program import offset_matrix
from robocal.measure.data import DataSet, Frame
from robocal.measure.machine import Model, freedom_of
from robocal.progress import Watch
from robocal.prove.default_folds import likely_lost
from robocal.prove.evidence import Evidence, Gain
from robocal.prove.frames_alone import RobotShare, judge_frames, robot_share
from robocal.prove.judge import Proof, Proven, absolute_observations, constant_of, drawn, units_of, unseen_of
from robocal.prove.prove import fit_beside_baseline, prove
from robocal.prove.split import default_hold_out, make_split
from robocal.prove.statistics import Statistic, rms

__all__ = ["REGION", "Decision", "decide"]

REGION = "region"  # the names of checks
MOVED = "moved"
SCALES = ("instrument-scale", "wrong-instrument-scale")


@record
class Decision(Context[M_co]):
    """A fit to all measurements but gross rows, which `data` marks, from `start` (1, P), the baseline beside it, and what was
    proven; the options are those that were used."""

    start: Array = field(kw_only=True)
    proven: Proven = field(kw_only=True)
    fixed_frames: tuple[FixedFrame, ...] = field(
        default=(), kw_only=True
    )  # frames of the robot's file that look like free ones

    @property
    def proof(self) -> Proof | None:
        """The proof that the verdict takes."""
        return self.proven.best

    @property
    def uncertainty(self) -> Uncertainty:
        """Of the fitted columns, with the covariance of the method where that has one of its own."""
        known = self.need_fit.uncertainty
        return known if self.need_fit.covariance is None else replace(known, covariance=self.need_fit.covariance)

    @property
    def unit(self) -> str:
        """The SI unit in which the verdict is found: the first that was measured."""
        return units_of(self.proven.base.problem)[0]

    @cached_property
    def errors(self) -> tuple[Array, Array, Bools]:
        """Unseen errors (N,) of baseline and identified model, and which rows prove something."""
        assert self.proof is not None
        return self.proof.errors(self.unit)

    @cached_property
    def digits(self) -> float | None:
        """What rounding leaves (m), where one of the two models is so good that it matters; see `digits`."""
        before, after, counted = self.errors
        if self.unit != "m" or min(rms(before[counted]), rms(after[counted])) >= FINEST_ERROR:
            return None
        return rounding_rms(self.model, self.need_data, self.proven.part, counted)

    @cached_property
    def evidence(self) -> Evidence | None:
        """What unseen measurements say; None where nothing was measured there."""
        proof, unit, part, base = self.proof, self.unit, self.proven.part, self.proven.base.problem
        if proof is None or not self.errors[2].any():
            return None
        before, after, counted = self.errors
        owner = by_unit(base.terms, [np.full(len(t.index), i) for i, t in owners(self.need_data, base)], unit)
        at = by_unit(base.terms, [t.configuration for t in base.terms], unit)
        stated = [g.stated for g in part.groups if g.unit == "m" and g.stated is not None]
        # Some methods end after as many steps as were asked for.
        ended = part.solution.reasons[0].converged or estimator(self.chosen.method).finite
        # A motor has readings, and no pose.
        what = "readings" if freedom_of(self.model) or self.model.mechanism is None else None
        return Evidence(
            before[counted], after[counted], constant_of(self.need_data, base, proof) if unit == "m" else None,
            drawn(proof.split, self.places, at[counted]), blind=part.identifiability.blind, converged=ended, seed=self.chosen.seed,
            kind=proof.split.how, stated=float(np.sqrt(3) * stated[0]) if stated else None, unit=unit,
            everything=proof.errors(unit, everything=True) if proof.aside[unit].any() else None,
            located=after[counted & np.isin(owner, absolute_observations(self.need_data))],
            what=what, mixed=len({t.kind for t in base.terms}) > 1,
        )  # fmt: skip

    @cached_property
    def frames_alone(self) -> bool:
        """Whether nothing but frames was to be found."""
        return frames_alone(self.model, self.proven.base.problem.table.free, self.need_data)

    @cached_property
    def frames(self) -> dict[str, Frame]:
        """The frames of the data by name."""
        return frames_of(self.need_data)

    @cached_property
    def share(self) -> RobotShare:
        """What the robot's own errors do to frames that were fitted alone."""
        return robot_share(self.model, self.need_fit)

    @property
    def silent(self) -> tuple[str, ...]:
        """Checks that mean nothing here: of frames alone nothing is corrected anywhere, and where the robot's own errors explain what is
        left, they change how long things seem too. Poses that are given and each off by something look like steps from row to row."""
        if not self.frames_alone:
            return ()
        if self.share.covariance is None:
            return (REGION,)
        given = freedom_of(self.model) == () and len(self.need_data.configurations) < len(
            self.need_data.observations[0]
        )
        return (REGION, *SCALES, *((MOVED,) if given else ()))

    @property
    def spread(self) -> tuple[tuple[str, ...], Array]:
        """What the parameters may be off by, with their names; of frames alone what the robot's own errors do to them included."""
        off = self.need_fit.total
        if self.frames_alone and self.share.covariance is not None:
            return self.need_fit.problem.free, self.share.covariance
        return off.names, off.covariance

    @cached_property
    def gain(self) -> Gain | None:
        """The gain on unseen measurements; of frames alone, whether they hold there."""
        if self.evidence is None:
            return None
        if not self.frames_alone:
            return self.evidence.gain
        own = dict.fromkeys(n.rpartition(".")[0] for n in self.need_fit.problem.free)
        unseen = self.evidence.after
        if "leave_one_out" in self.proven.proofs:
            _, after, counted = self.proven.proofs["leave_one_out"]().errors(self.unit)
            unseen = after[counted] if counted.any() else unseen
        return judge_frames(self.share, self.need_fit, self.evidence, unseen, tuple(own))

    @property
    def improvement(self) -> bool:
        """Whether it is proven."""
        return self.gain is not None and self.gain.proven

    @cached_property
    def corrected(self) -> M_co:
        """The model with what was found."""
        return self.model.with_values({n: v for n, v in self.values.items() if n in self.model.table})

    def unseen(self, unit: str) -> tuple[Statistic, Statistic] | None:
        """The errors, before and after, of what was held out, or else left out one by one; None where nothing was."""
        proofs = self.proven.proofs
        for name in ("held_out", "leave_one_out"):
            before, after = unseen_of(proofs[name](), unit) if name in proofs else (None, None)
            if before is not None and after is not None:
                return before, after
        return None


def with_zeros(model: M, fit: Fit) -> M | None:
    """The model with those zeros expected to be lost that look like what moved too far; None where there are none."""
    table, x = fit.problem.table, fit.solution.x[0]
    own = set(fit.problem.free) & (set(model.geometric) - model.anywhere)
    change = {n: abs(float(x[table.index[n]]) - model.table[n].value) for n in own}
    far = {n for n in own if change[n] > ZERO_CHANGE * model.table[n].scale}
    moving = model.mechanism
    if not far or moving is None:
        return None
    # A zero with a stated prior is where its owner says.
    zeros = {z.parameter: model.table[z.parameter] for z in moving.open_zeros}
    lost = {
        n: ZERO_LOST[z.unit]
        for n, z in zeros.items()
        if z.prior is None and z.unit in ZERO_LOST and z.scale < ZERO_LOST[z.unit]
    }
    alike = {c.name: far & {n for n, _ in c.partners} for c in fit.identifiability.combinations if c.name in lost}
    if not any(alike.values()):
        return None
    sigma = dict(zip(fit.total.names, fit.total.sigma, strict=True))
    likely = {name: lost[name] for name, like in alike.items() if any(change[n] > ZERO_SIGMA * sigma[n] for n in like)}
    return model.with_table(model.table.with_expected(likely)) if likely else None


def find_zeros(model: M, data: DataSet, fit: Fit) -> tuple[M, dict[str, float]] | None:
    """The model with those zeros free that are lost by so much that no fit from the nominal ones is sure to find them, and where
    these parameters begin; None where nothing asks for it, none is lost, or somebody vouches for one."""
    moving = model.mechanism
    if moving is None or not moving.joints or not _asks_for_zeros(model, fit):
        return None
    open_zeros = {z.joint: z for z in moving.open_zeros}
    lost = search_zeros(moving, data) if open_zeros else {}
    table = model.table
    if not lost or any(j not in open_zeros or table[open_zeros[j].parameter].prior is not None for j in lost):
        return None
    zeros = tuple(open_zeros.values())
    found = offset_matrix(zeros) @ np.array([lost.get(z.joint, 0.0) for z in zeros])
    moved = {z.parameter: float(v) for z, v in zip(zeros, found, strict=True) if v}
    expected = {n: max(ZERO_LOST["rad"], abs(v)) for n, v in moved.items()}
    freed = table.with_free({*table.free, *moved}).with_expected(expected)
    return model.with_table(freed), {n: table[n].value + v for n, v in moved.items()}


def _asks_for_zeros(model: Model, fit: Fit) -> bool:
    """Whether geometry moved as no making leaves it, or millimetres are left."""
    x, at = fit.solution.x[0], fit.problem.table.index
    moved = (
        abs(float(x[at[n]]) - model.table[n].value) / model.table[n].scale
        for n in fit.problem.free
        if n in model.geometric
    )
    return any(m > ZERO_CHANGE for m in moved) or any(g.unit == "m" and g.rms > BENT_LEAVES for g in fit.groups)


M = TypeVar("M", bound=Model)


def decide(model: M, data: DataSet, options: Options, watch: Watch | None = None) -> Decision[M]:
    """Fits a model to data and proves it; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    if not data.observations or not len(data.configurations):
        raise ModelError("the data set holds no measurement")
    _numbers(data)
    data = place_configurations(model, data)
    model, fixed = fix_frames(model, data)
    if not options.begin and (zeros := begin_zeros(model, data)):
        options = replace(options, begin=zeros)
    return replace(_decide(model, data, options, watch), fixed_frames=fixed)


def _decide(model: M, data: DataSet, options: Options, watch: Watch | None) -> Decision[M]:
    usual = options.hold_out is None and options.folds is None
    if options.hold_out is None:
        held, folds = default_hold_out(data, options.folds)
        options = replace(options, hold_out=held, folds=folds)
    assert options.hold_out is not None
    split = make_split(data, options.hold_out, folds=options.folds, blocks=options.blocks, seed=options.seed)
    everyone = np.arange(len(data.configurations))
    clean, start, whole, base = fit_beside_baseline(model, data, everyone, options, watch)
    if not options.begin and (found := find_zeros(model, data, whole)) is not None:
        return _decide(found[0], data, replace(options, begin=found[1]), watch)
    if (likelier := with_zeros(model, whole)) is not None:
        return _decide(likelier, data, options, watch)
    gains = usual and options.hold_out == HOLD_OUT_SHARE and not frames_alone(model, base.problem.table.free, data)
    if gains and likely_lost(clean, base, whole, options):
        options = replace(options, folds=FOLDS, hold_out=0.0)
        split = make_split(data, 0.0, folds=FOLDS, blocks=options.blocks, seed=options.seed)
    judged = Context(model, clean, base, whole, options, watch)
    proven = prove(judged, data, split)
    better = base if proven.base is base else check_baseline(model, base, proven.base.x)
    if better is not base:
        judged = Context(model, clean, better, whole, options, watch)
        proven = prove(judged, data, split)
    return Decision(model, clean, better, whole, options, watch, start=start, proven=proven, memo=judged.memo)


def _numbers(data: DataSet) -> None:
    for obs in data.observations:
        for what, bad in (
            ("a measurement is not a finite number", ~np.isfinite(obs.value).all(axis=-1)),
            ("a sigma must be above zero", np.zeros(len(obs)) if obs.sigma is None else ~(obs.sigma > 0).all(axis=-1)),
        ):
            if bad.any():
                first = obs.configuration[np.flatnonzero(bad)[0]]
                raise ModelError(what, key=obs.label, found=f"configuration {data.configurations.ids[first]}")

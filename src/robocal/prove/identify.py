"""Identify a machine from its measurements, and judge the result.

1 decide   split, gross rows, baseline, fit, proof and verdict (see `decide`)
2 tell     the model that is handed back with covariance and prediction band, and what is worth knowing of it
3 offsets  the joints' zeros alone, proven on the same configurations, for controllers that take nothing else
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Generic, TypeVar

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.check_registry import DIAGNOSE, PROVE, Finding, M_co, When, run
from robocal.diagnose.outliers import Outlier
from robocal.diagnose.scale import Scale, common_scale
from robocal.diagnose.scatter import WhitenedRows, whiten_fit
from robocal.errors import ModelError
from robocal.estimate.identifiability import Identifiability
from robocal.estimate.solution import Reason
from robocal.estimate.uncertainty import Total
from robocal.fit.baseline import baseline, frame_names
from robocal.fit.estimators import can_batch
from robocal.fit.noise import NoiseGroup
from robocal.fit.options import Options
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.parameters import ParameterTable
from robocal.progress import Watch
from robocal.prove.agreement import GroupAgreement, agreement_of
from robocal.prove.bands import mean_conditions, range_of_joints
from robocal.prove.bootstrap import Resampled, bootstrap_of
from robocal.prove.course import Passes, filter_passes, passes_of
from robocal.prove.decision import Decision, decide
from robocal.prove.fit_findings import Linearity, linearity_of, outliers, unseen_coverage
from robocal.prove.frame_poses import LocatedFrame, locate_frames
from robocal.prove.judge import stages, units_of
from robocal.prove.offsets import OffsetsAlone, offsets_alone
from robocal.prove.opened_groups import OpenedGroup, open_groups
from robocal.prove.pose_from_lengths import PoseFromLengths, pose_from_lengths
from robocal.prove.region import Holds, range_of
from robocal.prove.results import Band, ParameterResult, RowTable, parameter_results, prediction_of, row_table
from robocal.prove.shape import RobotShape, shape_of
from robocal.prove.statistics import Coverage, Stages
from robocal.prove.verdict import Verdict, verdict_of
from robocal.remarks.remark import Remark

__all__ = ["Identification", "baseline", "frame_names", "identify"]

M = TypeVar("M", bound=Model)


def _stages(made: Decision[Model], unit: str) -> Stages:
    """Errors at every stage in one unit; of frames alone nothing was before: the nominal robot with frames fitted is what was found."""
    found = stages(made.need_data, made.proven, unit)
    return found.without_before if made.frames_alone else found


@record
class Identification(Generic[M_co]):
    """Nominal and corrected model, per-parameter results, identifiability, errors, noise groups, verdict and recipe."""

    nominal: M_co
    corrected: M_co
    table: ParameterTable  # of the whole problem, at the solution
    options: Options
    parameters: tuple[ParameterResult, ...]
    identifiability: Identifiability
    stages: tuple[Stages, ...]
    groups: tuple[NoiseGroup, ...]
    verdict: Verdict
    rows: RowTable
    fit_ids: tuple[str, ...]
    held_out_ids: tuple[str, ...]
    iterations: int
    reason: Reason
    history: tuple[float, ...]
    chi2: float
    dof: int
    correlation_names: tuple[str, ...]
    correlation: Array
    covariance: Array  # as fitted, of correlation_names
    band: Band | None
    findings: tuple[Finding, ...]  # doubts and notes beside the verdict
    embargoed_ids: tuple[str, ...]  # neither fitted nor held out: tied to what is held out
    how: str  # in words, how the unseen measurements were chosen
    total: Total  # what the parameters may be off by, hidden partners included
    baseline: ParameterTable  # the nominal model with frames and tool fitted
    coverage: tuple[Coverage, ...]  # of the bands, on what was held out
    joints: Array | None  # (n, 2) the range in which each joint was measured
    linearity: Linearity | None  # what one linear step would have done
    outliers: tuple[Outlier, ...]
    conditions: Mapping[str, float]  # mean of every other recorded column
    resampled: Resampled | None  # the bootstrap, where it was asked for
    offsets: OffsetsAlone | None  # the joint offsets alone; None where no joint's zero may move
    holds: Holds | None  # over the working range
    pose_from_lengths: PoseFromLengths | None  # on unseen configurations
    scale: Scale | None  # of the fitted lengths, all together
    frames: tuple[LocatedFrame, ...]  # where frames of the data were found
    shape: RobotShape | None  # for pictures
    passes: Passes | None  # how the fit came about
    filter: Passes | None  # the same of a filter, over the measurements
    whitened_rows: WhitenedRows | None  # the rows at the solution, for a comparison with another run
    agreement: tuple[GroupAgreement, ...]  # what each group of sensors says of the others
    opened: tuple[OpenedGroup, ...]  # which groups of numbers the data tell, where a camera is among the sensors

    @property
    def warnings(self) -> tuple[Remark, ...]:
        """The doubts and notes for people."""
        return tuple(f.remark for f in self.findings)


def identify(model: M, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Identification[M]:
    """Identifies a model from data; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if options.bootstrap is not None and not can_batch(options):
        words = "the bootstrap takes a method that minimises the cost"
        method = options.method if options.tolerance is None else f"{options.method}, which stops at a tolerance"
        raise ModelError(words, key="method", found=method, expected="lm")
    made = decide(model, data, options, watch)
    data, fit, proven, u = made.need_data, made.need_fit, made.proven, made.uncertainty
    base, nominal = proven.base.problem, proven.base.problem.table
    fit_ids, held_out_ids, embargoed_ids = (
        tuple(data.configurations.ids[i] for i in some) for some in (proven.fitted, proven.held_out, proven.embargoed)
    )
    parameters = parameter_results(made)
    findings = tuple(f for when in (When.DATA, When.FIT) for f in run(when, made, DIAGNOSE, PROVE, skip=made.silent))
    return Identification(
        nominal=made.model, corrected=made.corrected, table=fit.problem.table.with_values(made.values), options=made.chosen,
        parameters=parameters, identifiability=fit.identifiability,
        stages=tuple(_stages(made, unit) for unit in units_of(base)), groups=fit.groups, verdict=verdict_of(made),
        rows=row_table(made), fit_ids=fit_ids, held_out_ids=held_out_ids, embargoed_ids=embargoed_ids,
        how=proven.best.split.how if proven.best else "", iterations=int(fit.solution.iterations[0]), reason=fit.solution.reasons[0],
        history=tuple(fit.solution.history[:, 0].tolist()), chi2=u.chi2, dof=u.dof, correlation_names=fit.problem.free,
        correlation=u.correlation, covariance=u.covariance * u.factor**2, band=prediction_of(made), findings=findings,
        total=made.need_fit.total,
        baseline=nominal.with_values(proven.base.x[0, : len(nominal)]), coverage=unseen_coverage(made),
        joints=range_of_joints(data.configurations), linearity=linearity_of(made), outliers=outliers(made),
        conditions=mean_conditions(data.configurations), resampled=bootstrap_of(made), holds=range_of(made), scale=common_scale(made),
        whitened_rows=whiten_fit(made), offsets=offsets_alone(made), frames=tuple(locate_frames(made)),
        pose_from_lengths=pose_from_lengths(made), passes=passes_of(made), filter=filter_passes(made), shape=shape_of(made),
        agreement=agreement_of(made), opened=open_groups(made),
    )  # fmt: skip

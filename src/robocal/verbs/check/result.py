"""What robot and data files say and what they can tell, before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from robocal._record import record, replace
from robocal.diagnose.camera_views import wrong_views
from robocal.diagnose.check_registry import Context, When, run
from robocal.diagnose.exchanged_views import exchanged_views
from robocal.diagnose.fit_checks import findings_of_segments
from robocal.diagnose.gross import sift
from robocal.diagnose.motions import describe_motions, open_motions
from robocal.diagnose.outliers import Outlier, name_outliers
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.files import evidence_parts
from robocal.files.display import outlier, to_display
from robocal.files.parts import Document, InputHash, hashes
from robocal.fit.baseline import Baseline
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, joints_of
from robocal.prove.identify import baseline
from robocal.quantities import Amount, DisplayUnit, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, remark_fields
from robocal.session.inputs import open_machine, read_inputs
from robocal.session.opened import Inputs, Opened
from robocal.session.verb_base import VerbResult
from robocal.session.watching import Watch, computable

if TYPE_CHECKING:
    from robocal.session.cable.summary import CableFacts

__all__ = ["Checked", "check_inputs"]


@record
class JointPart:
    """A joint with its limits."""

    name: str
    type: str
    unit: str
    lower: float | None
    upper: float | None


@record
class RobotPart:
    """The robot; of a cable robot its cables, and what is known of them."""

    name: str
    convention: str
    joints: tuple[JointPart, ...]
    source: str
    cables: tuple[str, ...] | None
    cable_robot: CableFacts | None


@record(kw_only=True)
class InstrumentPart:
    """An instrument, how much it measured, and one sigma as stated, of every unit that it reads in."""

    name: str
    kind: str
    source: str
    rows: int
    configurations: int
    sigma_source: str
    sigma: tuple[UnitValue, ...]
    frame: str
    targets: list[str]
    places: list[str]


@record(kw_only=True)
class IdentifiabilityPart:
    """What the data can tell at the nominal model."""

    rank: int
    n_free: int
    structural_rank: int | None
    condition: float
    kept: tuple[str, ...]
    dropped: tuple[str, ...]
    combinations: list[str]
    observability: Mapping[str, float]
    sigma_assumed: bool


@record
class BaselineError:
    """The mean error of the nominal model with fitted frames, without and with gross rows."""

    unit: DisplayUnit
    mean: Amount
    mean_of_all_rows: Amount | None


@record(kw_only=True)
class CheckDocument(Document):
    """What --json prints."""

    robot: RobotPart
    instruments: tuple[InstrumentPart, ...]
    configurations: int | None
    free: tuple[str, ...]
    identifiability: IdentifiabilityPart | None
    baseline_error: BaselineError | None
    outliers: list[evidence_parts.OutlierRow]
    inputs: list[InputHash]


@record(kw_only=True, eq=False)
class Checked(VerbResult):
    """What was found: the robot, the instruments, what the data can tell at the nominal model; little of it without data."""

    robot: Opened[Any]
    free: tuple[str, ...]
    data: DataSet | None = None
    instruments: tuple[InstrumentPart, ...] = ()
    identifiability: Identifiability | None = None
    misfit: float | None = None  # mean error of the nominal model with fitted frames (m), gross rows not counted
    assumed: bool = False  # whether some noise had to be assumed
    outliers: tuple[Outlier, ...] = ()  # rows that do not belong to the others
    misfit_of_all: float | None = None  # the mean error with gross rows
    motions: Remark | None = None  # of the machine, which no measurement shows, where they are all that cannot be seen

    @property
    def line_to_write(self) -> str:
        """The line of the robot's file that frees something, where nothing of the robot is free."""
        table = self.robot.machine.table
        return self.robot.line_to_free if table.rows and not table.free else ""

    @property
    def document(self) -> CheckDocument:
        """The same for machines."""
        machine, file, seen, facts = self.robot.machine, self.robot.file, self.identifiability, self.robot.facts
        joints = tuple(
            JointPart(j.name, j.type, "m" if j.type == "prismatic" else "rad", j.lower, j.upper)
            for j in joints_of(machine)
        )
        return CheckDocument(
            robot=RobotPart(machine.name, file.convention, joints, file.source, facts.get("cables"), facts.get("cable_robot")),
            instruments=self.instruments,
            configurations=None if self.data is None else len(self.data.configurations),
            free=self.free,
            identifiability=None if seen is None else IdentifiabilityPart(
                rank=seen.rank, n_free=len(seen.names), structural_rank=seen.structural_rank, condition=seen.condition, kept=seen.basis,
                dropped=seen.dropped, combinations=[c.remark.sentence for c in seen.combinations], observability=seen.indices,
                sigma_assumed=self.assumed,
            ),
            baseline_error=None if self.misfit is None else to_display(BaselineError, ("m", self.misfit, self.misfit_of_all)),
            **remark_fields(self.warnings),
            outliers=[outlier(o) for o in self.outliers],
            inputs=hashes(self.inputs),
        )  # fmt: skip


def check_inputs(o: Any, watch: Watch | None = None) -> Checked:
    """A robot, and with data what they can tell, by the options of the verb. Raises InputError for whatever is wrong with them."""
    if not o.data:
        return check_machine(open_machine(o.robot, base=o.base, tip=o.tip))
    inputs = read_inputs(o.robot, o.data, base=o.base, tip=o.tip, exclude=o.exclude, watch=watch)
    with computable(o.robot, *o.data):
        return check_data(inputs, watch)


def check_machine(opened: Opened[Any]) -> Checked:
    """A machine alone: what its file says, and what its geometry shows."""
    machine: Model = opened.machine
    # A cable robot's file need not say what is free.
    findings = (f for f in run(When.DATA, Context(machine)) if opened.arm or f.code != Code.NOTHING_FREE)
    remarks = (*opened.warnings, *(f.remark for f in findings))
    return Checked(robot=opened, free=machine.table.free, warnings=remarks, inputs=opened.inputs)


def check_data(inputs: Inputs, watch: Watch | None = None) -> Checked:
    """A machine with data: what they can tell at the nominal model, rows that do not belong, and remarks."""
    opened, measured = inputs.opened, inputs.data
    machine: Model = opened.machine
    everyone = np.arange(len(measured.configurations))
    sifted = sift(machine, measured, everyone, watch)
    problem, x = baseline(machine, sifted.data, everyone, watch)
    free = problem.table.free
    seen = analyse(problem.with_free(free), x) if free else None
    motions = None if seen is None else tuple(open_motions(machine, seen))
    whole_motions = (
        describe_motions(machine, seen, motions) if seen and motions and len(motions) == len(seen.dropped) else None
    )
    context = Context(machine, measured, Baseline(problem, x), watch=watch, soft=Baseline(sifted.problem, sifted.x))
    # A view that was set aside by itself is no step.
    aside = replace(context, data=sifted.data, memo={})
    findings = [*run(When.DATA, context), *findings_of_segments.run(aside), *wrong_views.run(context)]
    strange = name_outliers(machine, sifted.data, sifted.problem, sifted.x, sifted.away)
    findings += exchanged_views(sifted.data, strange)
    parts = [(r, a, b) for r in problem.residuals(x) for a, b, unit in r.parts if unit == "m"]
    lengths = [(np.linalg.norm(r.value[:, a:b], axis=1), r.used) for r, a, b in parts]
    misfit = float(np.concatenate([v[used] for v, used in lengths]).mean()) if lengths else None
    whole = float(np.concatenate([v for v, _ in lengths]).mean()) if lengths else None
    assumed = any(o.sigma is None for o in measured.observations)
    warnings = tuple(dict.fromkeys((*inputs.warnings, *(f.remark for f in findings))))
    return Checked(
        robot=opened, free=free, data=measured, instruments=_instruments(measured), identifiability=seen, misfit=misfit,
        assumed=assumed, outliers=strange, misfit_of_all=whole, motions=whole_motions, warnings=warnings, inputs=inputs.files,
    )  # fmt: skip


def _instruments(data: DataSet) -> tuple[InstrumentPart, ...]:
    out = []
    for obs in data.observations:
        sigma = () if obs.sigma is None else tuple(
            UnitValue(float(np.sqrt(np.mean(obs.sigma[:, a:b] ** 2))), unit) for a, b, unit in kind_of(obs).parts
        )  # fmt: skip
        free = None if obs.frame is None else obs.frame.free
        out.append(
            InstrumentPart(
                name=obs.label,
                kind=obs.kind,
                source=obs.source,
                rows=len(obs),
                configurations=len(np.unique(obs.configuration)),
                sigma_source="stated" if sigma else "estimated from the residuals",
                sigma=sigma,
                frame="none" if free is None else "free" if all(free) else "partly free" if any(free) else "known",
                targets=[t.name for t in obs.targets],
                places=[f.name for f in kind_of(obs).frames(obs)],
            )
        )
    return tuple(out)

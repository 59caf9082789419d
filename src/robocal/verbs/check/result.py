"""What robot and data files say and what they can tell, before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robocal.diagnose.gross import sift
from robocal.diagnose.outliers import Outlier, named
from robocal.diagnose.segments.find import find_segments, segment_remarks
from robocal.estimate.identifiability import Identifiability, analyse
from robocal.files import evidence
from robocal.files.headers import cables_of
from robocal.files.opened import Opened, cable_file
from robocal.files.parts import Document, InputHash, hashes
from robocal.files.shown import shown
from robocal.files.text import InputFile
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine
from robocal.prove.identify import baseline
from robocal.prove.warn import few_numbers, input_remarks
from robocal.quantities import Amount, ShownUnit, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, told
from robocal.session.cable.identify import read_measured
from robocal.session.cable.load import robot_inputs
from robocal.session.inputs import open_arm, read_inputs, robot_files
from robocal.session.strange import outlier
from robocal.session.watching import Watch, computable

if TYPE_CHECKING:
    from robocal.session.cable.summed import CableFacts

__all__ = ["Checked", "checked"]


@dataclass(frozen=True)
class JointPart:
    """A joint with its limits."""

    name: str
    type: str
    unit: str
    lower: float | None
    upper: float | None


@dataclass(frozen=True)
class RobotPart:
    """The robot; of a cable robot its cables, and what is known of them."""

    name: str
    convention: str
    joints: tuple[JointPart, ...]
    source: str
    cables: tuple[str, ...] | None
    cable_robot: CableFacts | None


@dataclass(frozen=True, kw_only=True)
class Instrument:
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


@dataclass(frozen=True, kw_only=True)
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


@dataclass(frozen=True)
class BaselineError:
    """The mean error of the nominal model with fitted frames, without and with gross rows."""

    unit: ShownUnit
    mean: Amount
    mean_of_all_rows: Amount | None


@dataclass(frozen=True, kw_only=True)
class CheckDocument(Document):
    """What --json prints."""

    robot: RobotPart
    instruments: tuple[Instrument, ...]
    configurations: int | None
    free: tuple[str, ...]
    identifiability: IdentifiabilityPart | None
    baseline_error: BaselineError | None
    outliers: list[evidence.Outlier]
    inputs: list[InputHash]


@dataclass(frozen=True)
class Checked:
    """What was found: the robot, the instruments, what the data can tell at the nominal model, and
    warnings."""

    robot: Opened
    data: DataSet | None
    instruments: tuple[Instrument, ...]
    free: tuple[str, ...]
    seen: Identifiability | None
    misfit: float | None  # mean error of the nominal model with fitted frames (m), gross rows not counted
    assumed: bool  # whether some noise had to be assumed
    warnings: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    strange: tuple[Outlier, ...] = ()  # rows that do not belong to the others
    misfit_of_all: float | None = None  # the mean error with gross rows

    @property
    def cables(self) -> tuple[str, ...]:
        """The cables of a cable robot; none of an arm."""
        return tuple(cables_of(self.robot.machine))

    @property
    def document(self) -> CheckDocument:
        """The same for machines."""
        machine, seen = self.robot.machine, self.seen
        joints = tuple(
            JointPart(j.name, j.type, "m" if j.type == "prismatic" else "rad", j.lower, j.upper) for j in machine.joints
        )
        return CheckDocument(
            robot=RobotPart(machine.name, self.robot.convention, joints, self.robot.source, *self._cables()),
            instruments=self.instruments,
            configurations=None if self.data is None else len(self.data.configurations),
            free=self.free,
            identifiability=None if seen is None else IdentifiabilityPart(
                rank=seen.rank, n_free=len(seen.names), structural_rank=seen.structural_rank, condition=seen.condition, kept=seen.kept,
                dropped=seen.dropped, combinations=[c.remark.sentence for c in seen.combinations], observability=seen.indices,
                sigma_assumed=self.assumed,
            ),
            baseline_error=None if self.misfit is None else shown(BaselineError, ("m", self.misfit, self.misfit_of_all)),
            **told(self.warnings),
            outliers=[outlier(o) for o in self.strange],
            inputs=hashes(self.inputs),
        )  # fmt: skip

    def _cables(self) -> tuple[Any, ...]:
        """What a cable robot has beside."""
        if not self.cables:
            return (None, None)
        from robocal.session.cable.summed import facts

        return (self.cables, facts(self.robot.machine))


def checked(o: Any, watch: Watch | None = None) -> Checked:
    """A robot, and with data what they can tell, by the options of the verb. Raises InputError for whatever is wrong with them."""
    cable = cable_file(o.robot)
    if o.data and cable is not None:
        seen = read_measured(cable, o.robot, o.data, o.exclude, watch)
        return _checked(cable, o, seen.data, seen.warnings, seen.files, watch)
    if o.data:
        inputs = read_inputs(o.robot, o.data, base=o.base, tip=o.tip, exclude=o.exclude, watch=watch)
        return _checked(inputs.robot, o, inputs.data, inputs.warnings, inputs.files, watch)
    if cable is not None:
        files = robot_inputs(cable, o.robot)
        return Checked(cable, None, (), cable.machine.table.free, None, None, False, cable.warnings, files)
    arm = open_arm(o.robot, base=o.base, tip=o.tip)
    said = (*arm.warnings, *input_remarks(arm.machine), *_free(arm.machine))
    return Checked(arm, None, (), arm.machine.table.free, None, None, False, said, robot_files(arm, o.robot))


def _checked(
    opened: Opened,
    o: Any,
    measured: DataSet,
    said_before: tuple[Remark, ...],
    files: tuple[InputFile, ...],
    watch: Watch | None,
) -> Checked:
    """A robot with data: what they can tell at the nominal model, rows that do not belong, and remarks."""
    machine = opened.machine
    with computable(o.robot, *o.data):
        everyone = np.arange(len(measured.configurations))
        sifted = sift(machine, measured, everyone, watch)
        problem, x = baseline(machine, sifted.data, everyone, watch)
        free = problem.table.free
        seen = analyse(problem.with_free(free), x) if free else None
        moved = find_segments(machine, measured, dict(zip(problem.table.names, map(float, x[0]), strict=False)))
    strange = named(machine, sifted.data, sifted.problem, sifted.x, sifted.away)
    lengths = [
        (np.linalg.norm(r.value[:, a:b], axis=1), r.used)
        for r in problem.residuals(x)
        for a, b, u in r.parts
        if u == "m"
    ]
    misfit = float(np.concatenate([v[used] for v, used in lengths]).mean()) if lengths else None
    whole = float(np.concatenate([v for v, _ in lengths]).mean()) if lengths else None
    assumed = any(o.sigma is None for o in measured.observations)
    rows = sum(o.value.size for o in measured.observations)
    said = (*input_remarks(machine, measured), *few_numbers(rows, len(free)), *_free(machine), *segment_remarks(moved))
    warnings = tuple(dict.fromkeys((*said_before, *said)))
    seen_by = _instruments(measured)
    return Checked(opened, measured, seen_by, free, seen, misfit, assumed, warnings, files, strange, whole)


def _free(chain: Machine) -> tuple[Remark, ...]:
    return () if chain.table.free else (Remark.of(Code.NOTHING_FREE),)


def _instruments(data: DataSet) -> tuple[Instrument, ...]:
    out = []
    for obs in data.observations:
        sigma = () if obs.sigma is None else tuple(
            UnitValue(float(np.sqrt(np.mean(obs.sigma[:, a:b] ** 2))), unit) for a, b, unit in kind_of(obs).parts
        )  # fmt: skip
        free = None if obs.frame is None else obs.frame.free
        out.append(
            Instrument(
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

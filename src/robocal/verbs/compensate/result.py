"""Corrected joint values and Cartesian commands for a controller that keeps its nominal model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.apply.compensate import STATUS, Compensation
from robocal.apply.compensate import compensate as solve
from robocal.arms.chain import Chain
from robocal.diagnose.limits import LEAP, SINGULAR_BELOW
from robocal.estimate.uncertainty import LEVEL, radius
from robocal.files.covariance import COVARIANCE
from robocal.files.display import listing_text
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text, plain
from robocal.files.robot import Robot
from robocal.files.runfolder import LAYER
from robocal.files.targets import TargetFile, compensation_listing, read_targets
from robocal.files.units import numbers_of
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.place_bands import predict
from robocal.prove.statistics import Statistic
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.inputs import open_machine, robot_files
from robocal.session.pose_prediction import shape_motion
from robocal.session.reference import nominal_chain, run_result
from robocal.session.runs import knowledge_of
from robocal.session.verb_base import VerbResult
from robocal.session.watching import Watch, computable

__all__ = ["Compensated", "compensate_targets"]

INSTEAD = "an arm; of a cable robot the corrected lengths are those of: robocal cable inverse RUN/calibrated.yaml POSES"
# No calibration moves an arm by more (m, median): the two models are of two robots.
ELSEWHERE = 0.05
SHOWN = 5  # targets that are named
TOOLS = ("calibrated", "nominal", "own")


@record
class SimulatedErrors:
    """Without compensation, with corrected joint values, with corrected Cartesian commands."""

    unit: str
    before: Statistic | None
    after: Statistic | None
    after_by_tcp: Statistic | None


@record(kw_only=True)
class CompensationDocument(Document):
    """compensation.json."""

    robot: str
    tool: str
    verdict_of_the_calibration: str | None
    simulated: str = "errors of the calibrated model driven with what is commanded"
    targets: int
    status: dict[str, int]
    errors: SimulatedErrors
    expected_of_the_real_robot: dict[str, Any] | None
    rows: Listing
    provenance: Origin


@record(kw_only=True, eq=False)
class Compensated(VerbResult):
    """What a compensation came to: numbers in SI, a note per target, the table, and what a person should know."""

    robot: Robot
    compensation: Compensation
    file: TargetFile
    notes: tuple[Remark | None, ...]  # of every target
    listing: Listing  # one row per target: compensated.csv
    tool: str
    verdict: str | None
    within: Array | None  # m: what the run knows of the real robot at the corrected joint values, 95 %

    lists_files = "never"

    @property
    def trusted(self) -> bool:
        """Whether the calibration is one that proved its gain (a file without a run is taken at its word), and any
        target is reached."""
        return self.verdict in (None, "improved") and bool(self.compensation.reachable.any())

    @cached_property
    def printed(self) -> tuple[str, Listing]:
        """One row per target."""
        return listing_text(self.listing), self.listing

    @property
    def head(self) -> dict[str, Any]:
        """The robot and what the page is of."""
        return {"title": f"{self.robot.name}: corrected targets", "kind": "Compensation"}

    def texts(self) -> Mapping[str, str | bytes]:
        """The list, and the document."""
        return {"compensated.csv": self.printed[0], "compensation.json": json_text(self.document)}

    @property
    def counts(self) -> dict[str, int]:
        """Targets by status."""
        return {word: int((self.compensation.status == i).sum()) for i, word in enumerate(STATUS)}

    @property
    def errors(self) -> SimulatedErrors:
        """Simulated errors (mm) of the targets that have a correction."""
        m = self.compensation
        there = (m.before[m.reachable & np.isfinite(m.before)], m.after[m.reachable], m.by_command[m.reachable])
        return SimulatedErrors("mm", *(Statistic.of(1e3 * errors) for errors in there))

    @property
    def expected(self) -> Statistic | None:
        """How near its targets the real robot is expected, 95 % (mm); None where no run says."""
        return None if self.within is None else Statistic.of(1e3 * self.within[np.isfinite(self.within)])

    @property
    def document(self) -> CompensationDocument:
        """What compensation.json holds."""
        known = self.expected
        codes = Column("code", "", [note.code if note else None for note in self.notes])
        return self.document_of(
            CompensationDocument,
            robot=self.robot.name,
            tool=self.tool,
            verdict_of_the_calibration=self.verdict,
            targets=len(self.compensation.status),
            status=self.counts,
            errors=self.errors,
            expected_of_the_real_robot=None if known is None else {"unit": "mm", "level": LEVEL} | plain(known),
            rows=Listing((*self.listing.columns, codes)),
        )


def compensate_targets(o: Any, command: str = "", watch: Watch | None = None) -> Compensated:
    """Compensates targets, by the options of the verb. Both models carry the tool that was found (calibrated) or the nominal
    one, each its own, or one of six numbers in the robot's units. Raises InputError."""
    arm = open_machine(o.robot, base=o.base, tip=o.tip).need_arm(INSTEAD)
    what = "compensation needs the model that the controller keeps"
    reference = nominal_chain(o.robot, arm, o.nominal, base=o.base, tip=o.tip, what=what)
    file = read_targets(o.targets, arm.chain)
    before, after = _tools(reference, arm, o.tool)
    if watch:
        watch({"stage": "compensating"})
    with computable(o.robot, o.targets):
        made = solve(before, after, file.targets)
    known = run_result(o.robot)
    verdict = None if known is None else known.verdict.status
    notes = tuple(_note(made, i, after, file) for i in range(len(file.ids)))
    within = _within(Path(o.robot), arm, after, made, file)
    warnings = [*_warnings(made, file, verdict, reference, arm)]
    if (Path(o.robot) / LAYER).is_file():
        warnings.append(Remark.of(Code.LAYER_LEFT_OUT, what="corrections"))
    return Compensated(
        robot=arm, compensation=made, file=file, notes=notes, tool=o.tool, verdict=verdict, within=within,
        listing=compensation_listing(made, file, after, [str(n or "") for n in notes], within),
        warnings=(*arm.warnings, *(r for f in file.files for r in f.remarks), *warnings),
        inputs=(*robot_files(arm, o.robot), *file.files), command=command,
    )  # fmt: skip


def _tools(nominal: Chain, arm: Robot, tool: str) -> tuple[Chain, Chain]:
    """Both models with the tool that they are to carry. Raises ModelError."""
    names = [f"tool.{s}" for s in FRAME_SYMBOLS]
    calibrated = arm.chain
    if tool == "own" or not all(n in c.table for n in names for c in (nominal, calibrated)):
        return nominal, calibrated
    if tool in TOOLS:
        source = calibrated if tool == "calibrated" else nominal
        values = {n: source.table[n].value for n in names}
    else:
        expected = f"x,y,z,rx,ry,rz in {arm.units.length.name} and {arm.units.angle.name}; {'; '.join(TOOLS)}"
        numbers = numbers_of(tool, expected, key="--tool")
        values = {n: arm.units.of(calibrated.table[n].unit).to_si(v) for n, v in zip(names, numbers, strict=True)}
    return nominal.with_values(values), calibrated.with_values(values)


def _within(folder: Path, arm: Robot, chain: Chain, made: Compensation, file: TargetFile) -> Array | None:
    """The radius (m,) in m in which the real robot is expected with 95 %: what the calibration does not know of the
    model, and what the model does not say of the robot. None where no run says."""
    some = np.flatnonzero(made.reachable)
    if not (folder / COVARIANCE).is_file() or not len(some):
        return None
    known = knowledge_of(folder, arm.chain.table)
    motion = None if known.placed else shape_motion(replace(arm, chain=chain), known)[0]
    extra = {k: v[some] for k, v in file.targets.extra.items()}
    found = predict(chain, made.joints[some], known.total, {**known.conditions, **extra}, motion, turn=False)
    out = np.full(len(made.status), np.nan)
    out[some] = radius(found.position + known.noise.get("m", 0.0) ** 2 * np.eye(3), known.total.dof)
    return out


def _note(made: Compensation, i: int, chain: Chain, file: TargetFile) -> Remark | None:
    """What a person should know of one target, if anything."""

    def joint(k: int, value: float) -> str:
        unit = file.units.length if chain.joints[k].type == "prismatic" else file.units.angle
        return f"{chain.joints[k].name} by {unit.from_si(float(value)):.3g} {unit.name}"

    words = STATUS[made.status[i]]
    if words == "outside limits":
        parts = tuple(joint(k, b) for k, b in enumerate(made.limit_excess[i].tolist()) if b)
        return Remark.of(Code.NEEDS_JOINTS, joints=parts) if parts else Remark.of(Code.BY_WAY_OF_LIMITS)
    if words == "unreachable":
        angle = Quantity(float(made.after_angle[i]), "rad") if made.oriented else None
        return Remark.of(Code.NEAREST_REACHED, gap=Quantity(float(made.after[i])), angle=angle)
    if words == "near singular":
        step = np.abs(made.joints[i] - made.nominal[i])
        if np.isfinite(step).all() and step.max(initial=0.0) > LEAP:
            worst = int(np.argmax(step))
            return Remark.of(Code.CORRECTION_LEAPS, joint=joint(worst, step[worst]))
        return Remark.of(Code.LOW_DEXTERITY, dexterity=float(made.dexterity[i]), least=SINGULAR_BELOW)
    if words == "orientation relaxed":
        return Remark.of(Code.ORIENTATION_RELAXED, angle=Quantity(float(made.after_angle[i]), "rad"))
    return None


def _warnings(
    made: Compensation, file: TargetFile, verdict: str | None, nominal: Chain, arm: Robot
) -> Iterator[Remark]:
    if verdict not in (None, "improved"):
        yield Remark.of(Code.CALIBRATION_UNPROVEN, verdict=verdict)
    lost = [name for name, fine in zip(file.ids, made.reachable, strict=True) if not fine]
    if lost:
        shown, others = tuple(lost[:SHOWN]), len(lost) - SHOWN
        more = others if others > 0 else None
        total = len(made.status)
        yield Remark.of(Code.TARGETS_UNREACHED, count=len(lost), total=total, targets=shown, others=more)
    gap = np.nanmedian(made.before) if np.isfinite(made.before).any() else 0.0
    if gap > ELSEWHERE:
        yield Remark.of(Code.MODELS_APART, gap=Quantity(float(gap)))
    if file.targets.joints is None:
        yield Remark.of(Code.BRANCH_UNKNOWN)
    changed = {n for n in arm.chain.table.names if n.startswith("tool.") and n in nominal.table
               and abs(arm.chain.table[n].value - nominal.table[n].value) > 1e-12}  # fmt: skip
    if changed:
        yield Remark.of(Code.TOOL_CHANGED)

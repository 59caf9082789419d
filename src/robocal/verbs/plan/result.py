"""Which poses to measure, written as a joint program with the data file to be filled in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.datawrite import data_text, table_text
from robocal.files.listing import listing_text
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.pose_table import joint_program, read_poses
from robocal.files.robot import Robot
from robocal.measure.data import DataSet
from robocal.planning.candidates import Region, Template, observe
from robocal.planning.pose_selection import Plan, PlanOptions, plan
from robocal.planning.route import length, travel
from robocal.quantities import Column, Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.inputs import need_arm, read_inputs, robot_files
from robocal.session.instrument_template import template, template_from_data
from robocal.session.verb_base import VerbResult
from robocal.session.watching import Watch, computable

__all__ = ["Planned", "make_plan", "points"]

INSTEAD = "an arm; of a cable robot: robocal cable poses ROBOT --choose N, which plans poses that its cables can hold"


@dataclass(frozen=True, kw_only=True)
class ForecastPart:
    """The error that is foretold after all poses, after as many at random, and what was asked for."""

    unit: str
    mean: float
    p95: float
    random: float
    asked: float | None


@dataclass(frozen=True, kw_only=True)
class Selection:
    """The criterion: of the greedy choice, after exchanges, and what no choice exceeds."""

    greedy: float
    value: float
    exchanges: int
    limit: float | None


@dataclass(frozen=True, kw_only=True)
class Travel:
    """How far the joints go, in the order of the ranks and in that of the program."""

    unit: str
    by_rank: float
    path: float


@dataclass(frozen=True, kw_only=True)
class PlanDocument(Document):
    """plan.json."""

    robot: str
    kind: str
    instruments: list[str]
    criterion: str
    poses: int
    measured_before: int
    candidates: int
    tests: int
    parameters: Sequence[str]
    accuracy: ForecastPart
    enough: int | None
    forecast: Listing
    perturbed_models: UnitValue
    selection: Selection
    travel: Travel
    program: Listing
    provenance: Origin


@dataclass(frozen=True, kw_only=True, eq=False)
class Planned(VerbResult):
    """A plan, with the robot and files that it was made from; `files` are those to be filled in."""

    robot: Robot
    opened: str  # what the robot was opened by
    plan: Plan
    options: PlanOptions
    template: Template  # with the sigma that is stated
    files: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the poses, in the order of travel."""
        n = len(self.plan.q)
        return tuple(f"p{i + 1:0{len(str(n))}d}" for i in range(n))

    @property
    def program(self) -> Listing:
        """The poses in the order of travel, SI."""
        p = self.plan
        return joint_program(self.robot.chain, self.names, p.q[p.path], [int(k) + 1 for k in p.path])

    @property
    def head(self) -> dict[str, Any]:
        """The robot, and the plan in a few words."""
        p = self.plan
        facts = (
            ("Poses", str(len(p.q))), ("Measured before", str(p.measured)), ("Kind", p.template[0].kind), ("Criterion", p.criterion),
            ("Chosen from", f"{len(p.candidates)} candidates"),
        )  # fmt: skip
        return {"title": self.robot.name, "kind": "Plan of poses", "facts": facts}

    def texts(self) -> Mapping[str, str | bytes]:
        """The files to be filled in, and the document."""
        return {**self.files, "plan.json": json_text(self.document)}

    @cached_property
    def document(self) -> PlanDocument:
        """plan.json: lengths in mm, joint values in SI."""
        p, f = self.plan, self.plan.forecast
        distance, n = travel(self.robot.chain, p.q), len(p.q)
        candidate = Column("candidate", "", [p.names[k] for k in p.path])
        mean, p95, random = (1e3 * np.asarray(v, float) for v in (f.mean, f.p95, f.random))
        return self.document_of(
            PlanDocument,
            robot=self.robot.chain.name,
            kind=p.template[0].kind,
            instruments=[o.label for o in p.template],
            criterion=p.criterion,
            poses=n,
            measured_before=p.measured,
            candidates=len(p.candidates),
            tests=len(p.tests),
            parameters=p.parameters,
            accuracy=ForecastPart(
                unit="mm", mean=mean[n], p95=p95[n], random=random[n],
                asked=None if self.options.accuracy is None else self.options.accuracy * 1e3,
            ),
            enough=p.enough,
            forecast=Listing((
                Column("poses", "", np.asarray(f.count)),
                Column("mean", "mm", mean, label="mean"),
                Column("p95", "mm", p95, label="95 %"),
                Column("random", "mm", random, label="random"),
                Column("gain", "mm", [None, *(mean[:-1] - mean[1:])], label="last pose"),
            )),
            perturbed_models=UnitValue(p.uncertainty * 1e3, "mm"),
            selection=Selection(greedy=p.design.start_value, value=p.design.value, exchanges=p.design.exchanges, limit=p.limit),
            travel=Travel(unit="rad", by_rank=length(distance, np.arange(n)), path=length(distance, p.path)),
            program=Listing((*self.program.columns, candidate)),
        )  # fmt: skip


def make_plan(o: Any, watch: Watch | None = None, command: str = "") -> Planned:
    """A plan by the options of the verb, with the files to be filled in where they are to be written. Raises InputError."""
    arm = need_arm(o.robot, INSTEAD, base=o.base, tip=o.tip)
    si = o.si(arm.units)
    if o.noise == 0:
        raise ModelError("out of range", key="--noise", found=o.noise, expected="a finite number above 0")
    warnings, files = arm.warnings, robot_files(arm, o.robot)
    links: dict[str, Any] = {"base": o.base, "tip": o.tip, "watch": watch}
    done = read_inputs(o.robot, o.after, **links) if o.after else None
    given = read_inputs(o.robot, [o.data], **links) if o.data else None
    for more in (done, given):
        if more is not None:
            warnings = tuple(dict.fromkeys((*warnings, *more.warnings)))
            files = tuple(dict.fromkeys((*files, *more.files)))
    region = _region(o, si)
    with computable(o.robot, *o.after):
        stated = template(arm, done, given, o.kind, si.noise, o.frame)
        at_work, measured, values = template_from_data(arm, stated, done, given, watch)
    if region.needs_instrument and done is None and given is None and o.frame == "auto":
        raise ModelError(
            "the place of the instrument is not specified", key="--frame", found=o.frame,
            expected="x,y,z,rx,ry,rz of the base in its frame, or measurements",
        )  # fmt: skip
    choices, there = None, None
    if o.listed is not None:
        names, q, read = read_poses(o.listed, arm.chain)
        choices, files = (names, q), (*files, *read)
    if o.tests is not None:
        _, there, read = read_poses(o.tests, arm.chain)
        files = (*files, *read)
    warnings = (*warnings, *(remark for file in files for remark in file.remarks))
    options = PlanOptions(
        o.count, o.criterion, o.candidates, accuracy=si.accuracy, seed=o.seed, region=region,
        task=None if o.task is None else replace(region, box=_box("--task", o.task, si.task)),
    )  # fmt: skip
    known: dict[str, Any] = {"listed": choices, "tests": there, "measured": measured, "values": values}
    with computable(o.robot, *o.after):
        made = plan(arm.chain, at_work, options, **known, watch=watch)
    warnings = (*warnings, *_doubts(made, si.accuracy, at_work))
    found = Planned(
        robot=arm,
        opened=o.robot,
        plan=made,
        options=options,
        template=stated,
        files={},
        warnings=warnings,
        inputs=files,
        command=command,
    )
    return found if o.output is None else _with_files(found)


def _region(said: Any, si: Any) -> Region:
    """Where may be measured, from the options of the verb as they were said and in SI. Raises ModelError."""
    if si.pedestal is not None and si.pedestal[0] <= 0:
        raise ModelError("out of range", key="--pedestal", found=said.pedestal, expected="R,H with R above 0")
    if si.distance is not None and not 0 <= si.distance[0] < si.distance[1]:
        raise ModelError("out of range", key="--range", found=said.distance, expected="MIN,MAX with 0 <= MIN < MAX")
    return Region(_box("--box", said.box, si.box), si.floor, si.pedestal, si.distance, si.cone, si.facing)


def _box(
    option: str, said: str | None, ends: Array | None
) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    """A box from its ends x0,y0,z0,x1,y1,z1 (6,) in m. Raises ModelError for an empty one."""
    if ends is None:
        return None
    a, b, c, d, e, f = ends.tolist()
    if not (a < d and b < e and c < f):
        expected = "x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1"
        raise ModelError("an empty box", key=option, found=said, expected=expected)
    return (a, b, c), (d, e, f)


def _doubts(made: Plan, wanted: float | None, at_work: Template) -> Iterator[Remark]:
    """What to know of the forecast."""
    if wanted is not None and made.enough is None:
        best, after = Quantity(float(made.forecast.mean[-1])), int(made.forecast.count[-1])
        yield Remark.of(Code.ACCURACY_NOT_REACHED, best=best, poses=after)
    if any(o.sigma is None for o in at_work):
        yield Remark.of(Code.SIGMA_ASSUMED)


def _with_files(made: Planned) -> Planned:
    """With the joint program, and the data file with its table to be filled in; with a warning where a kind has no table."""
    p, chain, units = made.plan, made.robot.chain, made.robot.units
    program = listing_text(made.program, units)
    blank = observe(made.template, p.q[p.path], made.names, {})
    unknown = []
    for obs in blank.observations:
        frame = obs.frame
        if frame is not None and all(frame.free):
            frame = replace(frame, value=(0.0,) * 6)
        unknown.append(replace(obs, value=np.full_like(obs.value, np.nan), frame=frame))
    try:
        data = DataSet(blank.configurations, tuple(unknown))
        table, said = table_text(data, chain, units), data_text(data, chain, "data.csv", units)
    except ModelError as error:
        left = Remark.of(Code.NO_DATA_FILE, reason=f"{error.message} ({error.found})")
        return replace(made, files={"poses.csv": program}, warnings=(*made.warnings, left))
    empty = "\n".join(",".join("" if c == ".nan" else c for c in r.split(",")) for r in table.split("\n"))
    return replace(made, files={"poses.csv": program, "data.csv": empty, "data.yaml": said})


def points(made: Planned) -> dict[str, list[list[float]]]:
    """Tool positions (m) of candidates, chosen and test poses, for the picture."""
    chain, p = made.robot.chain, made.plan
    chosen = {"candidates": p.candidates[:1000], "tests": p.tests, "chosen": p.q[p.path]}
    if set(chain.program.columns) - set(chain.joint_names):  # it takes more than joint values to say where the tool is
        return {name: [] for name in chosen}
    return {name: chain.pose(q, {})[:, :3, 3].tolist() for name, q in chosen.items()}

"""Which poses to measure, written as a joint program with the data file to be filled in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import ModelError, nearest
from robocal.files.datawrite import data_text, table_text
from robocal.files.display import listing_text
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.pose_table import joint_program, read_poses
from robocal.files.robot import Robot
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.planning.candidates import Region, Template, observe
from robocal.planning.pose_selection import Plan, PlanOptions, plan
from robocal.planning.route import length, travel
from robocal.prove.identify import baseline
from robocal.quantities import Column, Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.inputs import Inputs, open_machine, read_inputs, robot_files
from robocal.session.simulated_robot import sample_joints
from robocal.session.simulator import parse_frame
from robocal.session.verb_base import VerbResult
from robocal.session.watching import Watch, computable
from robocal.simulation.rigs import CONTACTS, RIGS, Instrument, measure

__all__ = ["Planned", "make_plan", "points"]

SAMPLE = 40  # poses that say where an instrument may stand that only its kind describes
INSTEAD = "an arm; of a cable robot: robocal cable poses ROBOT --choose N, which plans poses that its cables can hold"


@record(kw_only=True)
class ForecastPart:
    """The error that is foretold after all poses, after as many at random, and what was asked for."""

    unit: str
    mean: float
    p95: float
    random: float
    asked: float | None


@record(kw_only=True)
class Selection:
    """The criterion: of the greedy choice, after exchanges, and what no choice exceeds."""

    greedy: float
    value: float
    exchanges: int
    limit: float | None


@record(kw_only=True)
class Travel:
    """How far the joints go, in the order of the ranks and in that of the program."""

    unit: str
    by_rank: float
    path: float


@record(kw_only=True)
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


@record(kw_only=True, eq=False)
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
    arm = open_machine(o.robot, base=o.base, tip=o.tip).need_arm(INSTEAD)
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
    source = given or done
    warnings = (*warnings, *_doubts(made, si.accuracy, at_work, None if source is None else source.data))
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


def _doubts(made: Plan, wanted: float | None, at_work: Template, data: DataSet | None) -> Iterator[Remark]:
    """What to know of the forecast."""
    if wanted is not None and made.enough is None:
        best, after = Quantity(float(made.forecast.mean[-1])), int(made.forecast.count[-1])
        yield Remark.of(Code.ACCURACY_NOT_REACHED, best=best, poses=after)
    if any(o.sigma is None for o in at_work):
        yield Remark.of(Code.SIGMA_ASSUMED)
    touched = next((o.label for o in at_work if kind_of(o).contact), "")
    others = dict.fromkeys(o.label for o in data.observations if kind_of(o).contact) if data is not None else {}
    if touched and len(others) > 1:
        yield Remark.of(Code.ONE_PLACE_PLANNED, place=touched, others=tuple(n for n in others if n != touched))


def _with_files(made: Planned) -> Planned:
    """With the joint program, and the data file with its table to be filled in."""
    p, chain, units = made.plan, made.robot.chain, made.robot.units
    program = listing_text(made.program, units)
    blank = observe(made.template, p.q[p.path], made.names, {})
    unknown = []
    for obs in blank.observations:
        frame = obs.frame
        if frame is not None and all(frame.free):
            frame = replace(frame, value=(0.0,) * 6)
        unknown.append(replace(obs, value=np.full_like(obs.value, np.nan), frame=frame))
    data = DataSet(blank.configurations, tuple(unknown))
    table, said = table_text(data, chain, units), data_text(data, chain, "data.csv", units)
    empty = "\n".join(",".join("" if c == ".nan" else c for c in r.split(",")) for r in table.split("\n"))
    return replace(made, files={"poses.csv": program, "data.csv": empty, "data.yaml": said})


def points(made: Planned) -> dict[str, list[list[float]]]:
    """Tool positions (m) of candidates, chosen and test poses, for the picture."""
    chain, p = made.robot.chain, made.plan
    chosen = {"candidates": p.candidates[:1000], "tests": p.tests, "chosen": p.q[p.path]}
    if set(chain.program.columns) - set(chain.joint_names):  # it takes more than joint values to say where the tool is
        return {name: [] for name in chosen}
    return {name: chain.pose(q, {})[:, :3, 3].tolist() for name, q in chosen.items()}


# --- what an instrument shows at one configuration ---------------------------------------------------------------------


def template(
    arm: Robot, done: Inputs | None, given: Inputs | None, kind: str, noise: float | None, frame: str
) -> Template:
    """What one configuration shows: of the data file, else of what was measured before, else by its kind."""
    source = given or done
    if source is not None:
        return _typical(source.data, noise)
    fitting = [k for k in RIGS if k not in CONTACTS]
    if kind not in fitting:
        message, expected = "this kind needs a data file that describes it", f"{', '.join(fitting)}, or DATA"
        raise ModelError(message, key="--kind", found=kind, expected=expected, suggestion=nearest(kind, fitting))
    plainly = Instrument(kind, frame=parse_frame(frame, arm.units))
    plainly = plainly if noise is None else replace(plainly, noise=noise)
    rng = np.random.default_rng(0)
    return _typical(measure(arm.chain, sample_joints(arm.chain, SAMPLE, rng), plainly, rng), None)


def _typical(data: DataSet, noise: float | None) -> Template:
    """The rows of the configuration that shows most, with the sigma that is typical of each instrument."""
    if pairs := [o.kind for o in data.observations if o.second is not None]:
        message = "this kind compares two configurations, and poses are planned one by one"
        raise ModelError(message, found=pairs[0], expected="a plan for positions: the same poses serve")
    total = len(data.configurations)
    counts = np.sum([np.bincount(o.configuration, minlength=total) for o in data.observations], axis=0)
    found = data.take(np.flatnonzero(counts == counts.max())[:1])
    out = []
    for obs in found.observations:
        same = (o for o in data.observations if o.label == obs.label and o.kind == obs.kind)
        whole = [o.sigma for o in same if o.sigma is not None]
        usual = np.median(np.concatenate(whole), axis=0) if whole else None
        if noise is not None:
            usual = np.full(obs.value.shape[-1], 1e-4) if usual is None else np.array(usual)
            for start, stop, unit in kind_of(obs).parts:
                usual[start:stop] = noise if unit == "m" else usual[start:stop]
        out.append(replace(obs, sigma=None if usual is None else np.tile(usual, (len(obs), 1))))
    return tuple(out)


def template_from_data(
    arm: Robot, shown: Template, done: Inputs | None, given: Inputs | None, watch: Watch | None
) -> tuple[Template, DataSet | None, dict[str, float] | None]:
    """What was measured with the noise that it showed, and the values of parameters and frames that were fitted to it."""
    source = done or given
    if source is None:
        return shown, None, None
    everyone = np.arange(len(source.data.configurations))
    problem, x = baseline(arm.chain, source.data, everyone, watch)
    if done is None:
        # The file only says what the instrument is and where it stands.
        own = {n: float(v) for n, v in zip(problem.table.names, x[0], strict=False) if n not in arm.chain.table}
        return shown, None, own
    fitted = fit(arm.chain, done.data, everyone, Options(), x, watch)
    values = {n: float(v) for n, v in zip(fitted.problem.table.names, fitted.solution.x[0], strict=False)}
    used = {(o.kind, o.label): o for o in fitted.data.observations}
    out = []
    for obs in shown:
        same = used.get((obs.kind, obs.label))
        if same is not None and same.sigma is not None:
            # Of one instrument the noise is what the fit left, not what the file states.
            obs = replace(obs, frame=same.frame, sigma=np.tile(np.median(same.sigma, axis=0), (len(obs), 1)))
        out.append(obs)
    return tuple(out), fitted.data, values

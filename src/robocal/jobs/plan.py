"""The verb `plan`: which poses to measure, written as a joint program with the data file to be filled in."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.errors import ModelError
from robocal.files.dataset import InputFile
from robocal.files.datawrite import data_text, table_text
from robocal.files.poses import poses_text, read_poses
from robocal.files.robot import Robot
from robocal.files.writing import write_files
from robocal.jobs.inputs import Watch, computable, open_arm, read_inputs, robot_files
from robocal.jobs.instruments import known, template
from robocal.jobs.plain import plain
from robocal.jobs.simulate import refuse_existing
from robocal.measure.data import DataSet
from robocal.plan.candidates import Region, Template, observed
from robocal.plan.poses import Plan, PlanOptions, plan
from robocal.plan.route import length, travel
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, told
from robocal.report.plan import plan_page

__all__ = ["Planned", "plan_poses"]

Array = NDArray[np.float64]
FILES = ("poses.csv", "data.yaml", "data.csv", "plan.json", "plan.html")


@dataclass(frozen=True)
class Planned:
    """A plan, the robot and files that it was made from, and what was written."""

    robot: Robot
    plan: Plan
    options: PlanOptions
    template: Template  # with the sigma that is stated
    inputs: tuple[InputFile, ...]
    warnings: tuple[Remark, ...]
    written: tuple[Path, ...] = ()

    @property
    def document(self) -> dict[str, Any]:
        """plan.json: lengths in mm, joint values in SI."""
        p, f = self.plan, self.plan.forecast
        distance = travel(self.robot.chain, p.q)
        n = len(p.q)
        found: dict[str, Any] = plain(
            {
                "robot": self.robot.chain.name,
                "kind": p.template[0].kind,
                "instruments": [o.label for o in p.template],
                "criterion": p.criterion,
                "poses": n,
                "measured_before": p.measured,
                "candidates": len(p.candidates),
                "tests": len(p.tests),
                "parameters": list(p.parameters),
                "accuracy": {"mean_mm": f.mean[n] * 1e3, "p95_mm": f.p95[n] * 1e3, "random_mm": f.random[n] * 1e3},
                "enough": p.enough,
                "asked_accuracy_mm": None if self.options.accuracy is None else self.options.accuracy * 1e3,
                "forecast": [
                    {
                        "poses": int(k), "mean_mm": a * 1e3, "p95_mm": b * 1e3, "random_mm": r * 1e3,
                        "gain_mm": (f.mean[i - 1] - a) * 1e3 if i else None,
                    }
                    for i, (k, a, b, r) in enumerate(zip(f.count, f.mean, f.p95, f.random, strict=True))
                ],
                "perturbed_models_mm": (p.doubts * 1e3).tolist(),
                "selection": {
                    "greedy": p.design.start_value, "value": p.design.value, "exchanges": p.design.exchanges, "limit": p.limit,
                },
                "travel_rad": {"by_rank": length(distance, np.arange(n)), "path": length(distance, p.path)},
                "program": [
                    {"id": f"p{i + 1:0{len(str(n))}d}", "rank": int(k) + 1, "candidate": p.names[k], "joints_si": p.q[k]}
                    for i, k in enumerate(p.path)
                ],
                **told(self.warnings),
                "inputs": [{"file": str(i.file), "sha256": i.sha256} for i in self.inputs],
            }
        )  # fmt: skip
        return found


def plan_poses(
    robot: str,
    data: str | None = None,
    output: Path | None = None,
    *,
    count: int | None = None,
    kind: str = "position",
    noise: float | None = None,
    frame: str = "auto",
    after: Sequence[str] = (),
    criterion: str = "I",
    accuracy: float | None = None,
    candidates: int = 5000,
    listed: str | None = None,
    tests: str | None = None,
    box: str | None = None,
    task: str | None = None,
    floor: float | None = None,
    pedestal: str | None = None,
    distance: str | None = None,
    cone: float | None = None,
    facing: float | None = None,
    seed: int = 0,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: Watch | None = None,
) -> Planned:
    """Plans and, given a folder, writes; lengths and angles are in the robot file's units. Raises InputError."""
    arm = open_arm(robot, base=base, tip=tip)
    size, turn = arm.units.length, arm.units.angle
    if noise is not None:
        noise = size.to_si(_positive("--noise", noise))
    chain, warnings, files = arm.chain, arm.warnings, robot_files(arm, robot)
    if output is not None:
        refuse_existing(output, FILES, force)
    done = read_inputs(robot, after, base=base, tip=tip, watch=watch) if after else None
    given = read_inputs(robot, [data], base=base, tip=tip, watch=watch) if data else None
    for more in (done, given):
        if more is not None:
            warnings, files = (
                tuple(dict.fromkeys((*warnings, *more.warnings))),
                tuple(dict.fromkeys((*files, *more.files))),
            )
    region = Region(
        _box("--box", box, size.to_si),
        None if floor is None else size.to_si(_finite("--floor", floor)),
        _pair("--pedestal", pedestal, size.to_si, lambda r, _: r > 0, "R,H with R above 0"),
        _pair("--range", distance, size.to_si, lambda a, b: 0 <= a < b, "MIN,MAX with 0 <= MIN < MAX"),
        None if cone is None else turn.to_si(_positive("--cone", cone)),
        None if facing is None else turn.to_si(_positive("--facing", facing)),
    )
    with computable(robot, *after):
        stated = template(arm, done, given, kind, noise, frame)
        at_work, measured, values = known(arm, stated, done, given, watch)
    if region.needs_instrument and done is None and given is None and frame == "auto":
        raise ModelError(
            "it is not known where the instrument stands", key="--frame", found=frame,
            expected="x,y,z,rx,ry,rz of the base seen from it, or measurements",
        )  # fmt: skip
    choices, there = None, None
    if listed is not None:
        names, q, read = read_poses(listed, chain)
        choices, files = (names, q), (*files, *read)
    if tests is not None:
        _, there, read = read_poses(tests, chain)
        files = (*files, *read)
    warnings = (*warnings, *(remark for file in files for remark in file.remarks))
    wanted = None if accuracy is None else size.to_si(_positive("--accuracy", accuracy))
    options = PlanOptions(
        count, criterion, candidates, accuracy=wanted, seed=seed, region=region,
        task=None if task is None else replace(region, box=_box("--task", task, size.to_si)),
    )  # fmt: skip
    with computable(robot, *after):
        found = plan(
            chain, at_work, options, listed=choices, tests=there, measured=measured, values=values, watch=watch
        )
    if wanted is not None and found.enough is None:
        best, after_ = Quantity(float(found.forecast.mean[-1])), int(found.forecast.count[-1])
        warnings = (*warnings, Remark.of(Code.ACCURACY_NOT_REACHED, best=best, poses=after_))
    if any(o.sigma is None for o in at_work):
        warnings = (*warnings, Remark.of(Code.SIGMA_ASSUMED))
    made = Planned(arm, found, options, stated, files, warnings)
    if output is None:
        return made
    texts, said = _texts(made)
    made = replace(made, warnings=(*warnings, *said))
    texts["plan.json"] = json.dumps(made.document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    texts["plan.html"] = plan_page(made.document, {k: v.tolist() for k, v in _points(made).items()})
    return replace(made, written=write_files(output, texts))


def _texts(made: Planned) -> tuple[dict[str, str], tuple[Remark, ...]]:
    """The joint program, and the data file with its table to be filled in; and a warning where a kind has no table."""
    p, chain, units = made.plan, made.robot.chain, made.robot.units
    n = len(p.q)
    names = tuple(f"p{i + 1:0{len(str(n))}d}" for i in range(n))
    q = p.q[p.path]
    program = poses_text(chain, names, q, [int(k) + 1 for k in p.path], units)
    blank = observed(made.template, q, names, {})
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
        return {"poses.csv": program}, (left,)
    empty = "\n".join(",".join("" if c == ".nan" else c for c in r.split(",")) for r in table.split("\n"))
    return {"poses.csv": program, "data.csv": empty, "data.yaml": said}, ()


def _points(made: Planned) -> dict[str, Array]:
    """Tool positions (m) of candidates, chosen and test poses, for the picture."""
    chain, p = made.robot.chain, made.plan
    some = p.candidates[:1000]
    return {
        name: chain.pose(q, {})[:, :3, 3] if not _columns(made) else np.zeros((0, 3))
        for name, q in (("candidates", some), ("tests", p.tests), ("chosen", p.q[p.path]))
    }


def _columns(made: Planned) -> bool:
    """Whether the model needs more than joint values to say where the tool is."""
    return bool(set(made.robot.chain.program.columns) - set(made.robot.chain.joint_names))


def _finite(option: str, value: float) -> float:
    if not math.isfinite(value):
        raise ModelError("not a number", key=option, found=value, expected="a finite number")
    return value


def _positive(option: str, value: float) -> float:
    if not 0 < value < math.inf:
        raise ModelError("out of range", key=option, found=value, expected="a finite number above 0")
    return value


def _numbers(option: str, text: str, count: int, form: str) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count or not all(math.isfinite(v) for v in found):
        raise ModelError("not understood", key=option, found=text, expected=form)
    return found


def _pair(
    option: str, text: str | None, to_si: Any, good: Callable[[float, float], bool], expected: str
) -> tuple[float, float] | None:
    if text is None:
        return None
    a, b = _numbers(option, text, 2, "two numbers such as 200,500")
    if not good(a, b):
        raise ModelError("out of range", key=option, found=text, expected=expected)
    return float(to_si(a)), float(to_si(b))


def _box(
    option: str, text: str | None, to_si: Any
) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    if text is None:
        return None
    v = [float(to_si(x)) for x in _numbers(option, text, 6, "x0,y0,z0,x1,y1,z1")]
    low, high = (v[0], v[1], v[2]), (v[3], v[4], v[5])
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise ModelError(
            "an empty box", key=option, found=text, expected="x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1"
        )
    return low, high

"""Two calibrations of one robot, some time apart; has it changed, and by how much?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal._version import __version__
from robocal.apply.drift import Drift, ParameterChange, Single, compare
from robocal.apply.model_difference import ModelDifference
from robocal.errors import ModelError
from robocal.files.covariance import Knowledge
from robocal.files.display import to_display
from robocal.files.plain import plain
from robocal.files.result import Result
from robocal.files.robot import Robot
from robocal.files.runfolder import open_run
from robocal.prove.place_bands import sample_joints
from robocal.remarks.code import Code
from robocal.remarks.remark import Number, Quantity, Remark, remark_fields
from robocal.session.inputs import open_arm
from robocal.session.pose_prediction import knowledge_of
from robocal.session.runs import shared_files, verdict_remarks
from robocal.session.watching import Watch

__all__ = ["DriftResult", "colleague_remarks", "compare_runs", "reasons", "void"]

SAMPLES = 2000
SAME = 1e-9  # of a nominal value, in m or rad


@dataclass(frozen=True)
class DriftResult:
    """Two runs compared: the drift, its verdict (unchanged, possible, drifted) with its reasons, and remarks. `void` are
    reasons for which nothing can be concluded."""

    robot: Robot
    drift: Drift
    region: str
    reasons: tuple[Remark, ...]
    void: tuple[Remark, ...]
    warnings: tuple[Remark, ...]
    runs: tuple[str, str]
    command: str = ""
    written: tuple[Path, ...] = ()

    @property
    def status(self) -> str:
        """unchanged, possible or drifted; where nothing can be concluded, a change stays possible."""
        return "possible" if self.void else self.drift.status

    @property
    def why(self) -> tuple[Remark, ...]:
        """The reasons of that."""
        return self.void or self.reasons

    @property
    def difference(self) -> ModelDifference:
        """How far it has changed, in mm."""
        return to_display(ModelDifference, self.drift.difference)

    @property
    def changes(self) -> tuple[ParameterChange, ...]:
        """Of the parameters, in the units of the robot file."""
        return tuple(to_display(ParameterChange, c, self.robot.units) for c in self.drift.changes)

    @property
    def document(self) -> dict[str, Any]:
        """drift.json: lengths in mm, angles in deg, parameters in the units of the robot file."""
        apart, seen = self.difference, self.drift.scatter
        mm = {k: getattr(apart, k) for k in ("rms", "largest", "expected", "limit")}
        size = {k: getattr(apart, k) for k in ("change", "low", "high")}
        place = {"place": apart.place, "joints": np.degrees(apart.joints)}
        return {
            "robocal": 1,
            "version": __version__,
            "robot": self.robot.name,
            "runs": list(self.runs),
            "verdict": {
                "status": self.status, **remark_fields(self.why, "reasons"),
            },
            "change": {
                "unit": "mm", **size, "matters": 1e3 * self.drift.matters, "p_value": apart.p_value, "region": self.region,
                "n": apart.n,
            },
            "workspace": {
                "unit": "mm", "region": self.region, "n": apart.n, **mm, "p_value": apart.p_value, "worst": place,
            },
            "scatter": None if seen is None else {
                "factor": seen.factor, "by": seen.by, "same_poses": seen.same, "dof": seen.dof,
            },
            "joint_test": {
                "statistic": self.drift.statistic, "rank": self.drift.rank, "dof": self.drift.dof,
                "p_value": self.drift.p_value,
            },
            "changes": [plain(c) for c in self.changes],
            "single_causes": [plain(to_display(Single, c, self.robot.units)) for c in self.drift.singles],
            **remark_fields(self.warnings),
            "command": self.command,
        }  # fmt: skip


def compare_runs(
    first: Path, second: Path, new_tool: bool, matters: float, command: str = "", watch: Watch | None = None
) -> DriftResult:
    """Compares two run folders of one robot; `matters` (m) is the change worth an alarm. Raises InputError when they cannot
    be compared."""
    if watch:
        watch({"stage": "read"})
    runs = (first, second)
    results = (open_run(first).result, open_run(second).result)
    robots = (open_arm(first), open_arm(second))
    known = (knowledge_of(first, robots[0]), knowledge_of(second, robots[1]))
    _comparable(runs, robots, known)
    joints, region = _shared(robots[0], known)
    found = compare(
        robots[0].chain,
        robots[1].chain,
        (known[0].total, known[1].total),
        joints,
        known[0].conditions,
        new_tool=new_tool,
        rows=(known[0].rows, known[1].rows),
        matters=matters,
    )
    warnings = tuple(
        dict.fromkeys((*robots[0].warnings, *robots[1].warnings, *colleague_remarks(runs, results, known)))
    )
    why = reasons(robots[0], found, known, region)
    names = (str(first), str(second))
    return DriftResult(robots[1], found, region, why, void(runs, results), warnings, names, command)


def _shared(robot: Robot, known: tuple[Knowledge, Knowledge]) -> tuple[Array, str]:
    """Joint values at which the two are compared: where they were measured; drawn from the range that both measured where a
    run does not keep its places, or within the limits where the two never met."""
    rows = [k.rows.joints for k in known if k.rows is not None]
    if len(rows) == 2 and min(len(r) for r in rows):
        return np.concatenate(rows), "poses measured in either run"
    ranges = [k.joints for k in known if k.joints is not None]
    if len(ranges) == 2:
        low, high = np.maximum(ranges[0][:, 0], ranges[1][:, 0]), np.minimum(ranges[0][:, 1], ranges[1][:, 1])
        if (low < high).all():
            drawn = np.random.default_rng(0).uniform(low, high, (SAMPLES, len(low)))
            return drawn, "range of the joints in which both runs measured"
    return sample_joints(robot.chain, ranges[0] if ranges else None, SAMPLES)


def _comparable(runs: tuple[Path, Path], robots: tuple[Robot, Robot], known: tuple[Knowledge, Knowledge]) -> None:
    a, b = (r.chain for r in robots)
    if a.table.names != b.table.names or a.convention != b.convention:
        raise ModelError(
            "these are runs of different robots", key=str(runs[1]), found=f"{b.name} ({b.convention})",
            expected=f"{a.name} ({a.convention}), as in {runs[0]}",
        )  # fmt: skip
    for name in known[0].total.names:
        if name in known[1].total.names and name in a.table:
            one, two = known[0].nominal[name], known[1].nominal[name]
            if abs(one - two) > SAME:
                raise ModelError(
                    "the two runs started from different nominal models: identify both from the same robot file",
                    key=name, found=two, expected=one,
                )  # fmt: skip


CHANCE = 0.05
FEW = 6
CAUSES = 3
BLOCKS = {"place": "the place", "time": "the time of measuring", "joints": "the part of joint space"}
VERDICT = {"unchanged": Code.CHANGE_BELOW, "drifted": Code.CHANGE_ABOVE, "possible": Code.CHANGE_OPEN}
WORTH_SAYING = 1.2  # times the variance as fitted
FIGURES = 2


def reasons(robot: Robot, found: Drift, known: tuple[Knowledge, Knowledge], region: str) -> tuple[Remark, ...]:
    """The verdict in words: the change in mm first, then what chance would show, then the parameters."""
    apart, size = found.difference, _size(found)
    out = [Remark.of(VERDICT[found.status], region=region, **size)]
    counts = [None if k.rows is None else round(len(k.rows.joints) * k.rows.thinned) for k in known]
    if found.status == "possible" and apart.more is not None and None not in counts:
        poses = _round_up(apart.more * max(c for c in counts if c is not None))
        out.append(Remark.of(Code.CHANGE_SETTLED_BY, poses=poses, first=counts[0], second=counts[1]))
    shown = {k: Quantity(getattr(apart, k)) for k in ("rms", "largest", "expected", "limit")}
    out.append(Remark.of(Code.PREDICTIONS_APART, chance=apart.p_value, **shown))
    seen = found.scatter
    if seen is not None and seen.factor > WORTH_SAYING:
        out.append(Remark.of(Code.ERRORS_SHARED, by=BLOCKS[seen.by], factor=seen.factor))
    elif seen is not None and seen.factor < 1:
        out.append(Remark.of(Code.ERRORS_CANCEL, same=seen.same, factor=seen.factor))
    out.append(Remark.of(Code.PARAMETERS_DIFFER, chance=found.p_value, rank=found.rank))
    return (*out, *(_parameters(robot, found, known) if found.p_value < CHANCE else ()))


def _size(found: Drift) -> dict[str, Number]:
    apart = found.difference
    return {
        "change": Quantity(apart.change), "low": Quantity(apart.low), "high": Quantity(apart.high),
        "matters": Quantity(found.matters),
    }  # fmt: skip


def _round_up(value: float) -> int:
    """Two figures, upwards."""
    step = int(10 ** max(math.floor(math.log10(value)) - FIGURES + 1, 0))
    return math.ceil(value / step) * step


def _parameters(robot: Robot, found: Drift, known: tuple[Knowledge, Knowledge]) -> list[Remark]:
    """Which parameters show it, and which one alone would explain it."""
    sure = [c.name for c in sorted(found.changes, key=lambda c: c.p_value) if c.p_of_all < CHANCE]
    names = (*sure[:FEW], *(["..."] if len(sure) > FEW else []))
    out = [Remark.of(Code.SHOWS_IN, names=names) if sure else Remark.of(Code.SHOWS_IN_SUMS)]
    told = []
    for c in [c for c in found.singles if c.p_rest > CHANCE][:CAUSES]:
        unit = robot.units.of(c.unit)
        told.append(f"{c.name} by {c.change / unit.factor:+.3g} ± {1.96 * c.sigma / unit.factor:.2g} {unit.name}")
    if told:
        out.append(Remark.of(Code.ONE_CAUSE, causes=" or ".join(told)))
    left = max((k.noise.get("m", 0.0) for k in known), default=0.0)
    if found.difference.rms < left:
        out.append(Remark.of(Code.BELOW_SCATTER, left=Quantity(left)))
    return out


def void(runs: tuple[Path, Path], results: tuple[Result, Result]) -> tuple[Remark, ...]:
    """Why nothing can be concluded from these two."""
    out = []
    if both := shared_files(*results):
        out.append(Remark.of(Code.SAME_MEASUREMENTS, files=both[:FEW]))
    for run, result in zip(runs, results, strict=True):
        out += [r for r in verdict_remarks(result, str(run)) if r.code == Code.RUN_REFUSED]
    return tuple(out)


def colleague_remarks(
    runs: tuple[Path, Path], results: tuple[Result, Result], known: tuple[Knowledge, Knowledge]
) -> list[Remark]:
    """What a careful colleague would add."""
    out = []
    for run, result, k in zip(runs, results, known, strict=True):
        out += [r for r in verdict_remarks(result, str(run)) if r.code == Code.RUN_NOT_IMPROVED]
        if k.rows is None:
            out.append(Remark.of(Code.ROWS_NOT_KEPT, run=str(run)))
    names = [{n for n in k.total.names if n in known[0].nominal and n in known[1].nominal} for k in known]
    only = sorted((set(known[0].total.names) ^ set(known[1].total.names)) - names[0] - names[1])
    only = [n for n in only if n.rpartition(".")[0].startswith("j")]
    if only:
        out.append(Remark.of(Code.FREE_IN_ONE, names=(*only[:8],)))
    return out

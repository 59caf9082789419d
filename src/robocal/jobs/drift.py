"""Two calibrations of one robot, some time apart; has it changed, and by how much?"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal._version import __version__
from robocal.apply.apart import Apart
from robocal.apply.drift import Change, Drift, Single, compare
from robocal.calibrate.workspace import sample_joints
from robocal.errors import ModelError
from robocal.files.covariance import Knowledge
from robocal.files.plain import plain
from robocal.files.robot import Robot
from robocal.files.runfolder import open_run
from robocal.files.shown import shown
from robocal.jobs.drifting import doubts, reasons, void
from robocal.jobs.inputs import open_arm
from robocal.jobs.predict import known_of
from robocal.jobs.watching import Watch
from robocal.remarks.remark import Remark, told

__all__ = ["Comparison", "drifted"]

Array = NDArray[np.float64]
SAMPLES = 2000
SAME = 1e-9  # of a nominal value, in m or rad


@dataclass(frozen=True)
class Comparison:
    """Two runs compared: the drift, its verdict (unchanged, possible, drifted) with its reasons, and remarks. `void` are
    reasons for which nothing can be concluded."""

    robot: Robot
    found: Drift
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
        return "possible" if self.void else self.found.status

    @property
    def why(self) -> tuple[Remark, ...]:
        """The reasons of that."""
        return self.void or self.reasons

    @property
    def apart(self) -> Apart:
        """How far it has changed, in mm."""
        return shown(Apart, self.found.apart)

    @property
    def changes(self) -> tuple[Change, ...]:
        """Of the parameters, in the units of the robot file."""
        return tuple(shown(Change, c, self.robot.units) for c in self.found.changes)

    @property
    def document(self) -> dict[str, Any]:
        """drift.json: lengths in mm, angles in deg, parameters in the units of the robot file."""
        apart, seen = self.apart, self.found.scatter
        mm = {k: getattr(apart, k) for k in ("rms", "largest", "expected", "limit")}
        size = {k: getattr(apart, k) for k in ("change", "low", "high")}
        place = {"place": apart.place, "joints": np.degrees(apart.joints)}
        return {
            "robocal": 1,
            "version": __version__,
            "robot": self.robot.name,
            "runs": list(self.runs),
            "verdict": {
                "status": self.status, **told(self.why, "reasons"),
            },
            "change": {
                "unit": "mm", **size, "matters": 1e3 * self.found.matters, "p_value": apart.p_value, "region": self.region,
                "n": apart.n,
            },
            "workspace": {
                "unit": "mm", "region": self.region, "n": apart.n, **mm, "p_value": apart.p_value, "worst": place,
            },
            "scatter": None if seen is None else {
                "factor": seen.factor, "by": seen.by, "same_poses": seen.same, "dof": seen.dof,
            },
            "joint_test": {
                "statistic": self.found.statistic, "rank": self.found.rank, "dof": self.found.dof,
                "p_value": self.found.p_value,
            },
            "changes": [plain(c) for c in self.changes],
            "single_causes": [plain(shown(Single, c, self.robot.units)) for c in self.found.singles],
            **told(self.warnings),
            "command": self.command,
        }  # fmt: skip


def drifted(
    first: Path, second: Path, new_tool: bool, matters: float, command: str = "", watch: Watch | None = None
) -> Comparison:
    """Compares two run folders of one robot; `matters` (m) is the change worth an alarm. Raises InputError when they cannot
    be compared."""
    if watch:
        watch({"stage": "read"})
    runs = (first, second)
    results = (open_run(first).result, open_run(second).result)
    robots = (open_arm(first), open_arm(second))
    known = (known_of(first, robots[0]), known_of(second, robots[1]))
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
    warnings = tuple(dict.fromkeys((*robots[0].warnings, *robots[1].warnings, *doubts(runs, results, known))))
    why = reasons(robots[0], found, known, region)
    names = (str(first), str(second))
    return Comparison(robots[1], found, region, why, void(runs, results), warnings, names, command)


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

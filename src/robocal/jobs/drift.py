"""The verb `drift`: two calibrations of one robot, some time apart; has it changed, and by how much?"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal import __version__
from robocal.calibrate.drift import Change, Drift, Single, compare
from robocal.calibrate.workspace import sample_joints
from robocal.errors import ModelError
from robocal.files.covariance import Knowledge
from robocal.files.result import Result, read_result
from robocal.files.robot import Robot
from robocal.files.text import write_files
from robocal.jobs.inputs import Watch, open_arm
from robocal.jobs.plain import json_text
from robocal.jobs.predict import known_of

__all__ = ["Comparison", "drift"]

Array = NDArray[np.float64]
SAMPLES = 2000
SAME = 1e-9  # of a nominal value, in m or rad


@dataclass(frozen=True)
class Comparison:
    """Two runs compared: the drift with its verdict in words."""

    robot: Robot
    found: Drift
    region: str
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    runs: tuple[str, str]
    command: str = ""
    written: tuple[Path, ...] = ()

    @property
    def document(self) -> dict[str, Any]:
        """drift.json: lengths in mm, angles in deg, parameters in the units of the robot file."""
        apart = self.found.apart
        mm = {k: 1e3 * getattr(apart, k) for k in ("rms", "largest", "expected", "limit", "drift")}
        place = {"place": [1e3 * v for v in apart.place], "joints": [float(v) for v in np.degrees(apart.joints)]}
        return {
            "robocal": 1,
            "version": __version__,
            "robot": self.robot.name,
            "runs": list(self.runs),
            "verdict": {"status": "drifted" if self.found.drifted else "no_significant_drift", "reasons": list(self.reasons)},
            "joint_test": {
                "statistic": self.found.statistic, "rank": self.found.rank,
                "dof": self.found.dof if math.isfinite(self.found.dof) else None, "p_value": self.found.p_value,
            },
            "workspace": {
                "unit": "mm", "region": self.region, "n": apart.n, **mm, "p_value": apart.p_value, "worst": place,
            },
            "changes": [self._change(c) for c in self.found.changes],
            "single_causes": [self._single(c) for c in self.found.singles],
            "warnings": list(self.warnings),
            "command": self.command,
        }  # fmt: skip

    def _single(self, c: Single) -> dict[str, Any]:
        unit = self.robot.units.of(c.unit)
        sizes = {k: getattr(c, k) / unit.factor for k in ("change", "sigma")}
        return {"name": c.name, "unit": unit.name, **sizes, "p_rest": c.p_rest}

    def _change(self, c: Change) -> dict[str, Any]:
        unit = self.robot.units.of(c.unit)
        size = {k: getattr(c, k) / unit.factor for k in ("change", "sigma")}
        values = {k: unit.from_si(getattr(c, k)) for k in ("first", "second")}
        chances = {k: v for k, v in asdict(c).items() if k.startswith("p_")}
        return {"name": c.name, "unit": unit.name, **values, **size, **chances}


def drift(
    first: Path,
    second: Path,
    *,
    new_tool: bool = False,
    output: Path | None = None,
    command: str = "",
    watch: Watch | None = None,
) -> Comparison:
    """Compares two run folders of one robot; `output` gets drift.json. Raises InputError when they cannot be compared."""
    if watch:
        watch({"stage": "read"})
    runs = (first, second)
    known = (known_of(first), known_of(second))
    results = (read_result(first / "result.json"), read_result(second / "result.json"))
    robots = (open_arm(first), open_arm(second))
    _comparable(runs, robots, known)
    joints, region = _shared(robots[0], known)
    found = compare(
        robots[0].chain,
        robots[1].chain,
        (known[0].total, known[1].total),
        joints,
        known[0].conditions,
        new_tool=new_tool,
    )
    warnings = tuple(
        dict.fromkeys([*map(str, robots[0].warnings), *map(str, robots[1].warnings), *_doubts(runs, results, known)])
    )
    made = Comparison(
        robots[1],
        found,
        region,
        tuple(_words(robots[0], found, known, region)),
        warnings,
        (str(first), str(second)),
        command,
    )
    if output is None:
        return made
    text = json_text(made.document)
    return replace(made, written=write_files(output, {"drift.json": text}))


def _shared(robot: Robot, known: tuple[Knowledge, Knowledge]) -> tuple[Array, str]:
    """Joint values drawn where both runs measured; within the limits where a run does not say, or the two never met."""
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


def _doubts(runs: tuple[Path, Path], results: tuple[Result, Result], known: tuple[Knowledge, Knowledge]) -> list[str]:
    out = []
    used = [{i.sha256 for i in r.provenance.inputs if i.file.lower().endswith(".csv")} for r in results]
    if used[0] & used[1]:
        out.append("both runs were fitted to the same measurements: that shows no drift, whatever happened")
    for run, result in zip(runs, results, strict=True):
        if result.verdict.status != "improved":
            out.append(f"{run}: the verdict of this run was {result.verdict.status.replace('_', ' ')}")
        if any("model error" in g.sigma_source for g in result.fit.groups):
            out.append(
                f"{run}: the model leaves more than the stated noise; what it cannot describe differs from place to place, so compare "
                "runs measured at like configurations"
            )
    names = [{n for n in k.total.names if n in known[0].nominal and n in known[1].nominal} for k in known]
    only = sorted((set(known[0].total.names) ^ set(known[1].total.names)) - names[0] - names[1])
    only = [n for n in only if n.rpartition(".")[0].startswith("j")]
    if only:
        out.append(f"free in one run only: {', '.join(only[:8])}; held at its nominal value in the other")
    return out


def _words(robot: Robot, found: Drift, known: tuple[Knowledge, Knowledge], region: str) -> list[str]:
    """The verdict in words: the joint test, the distance in mm, the parameters that show it."""
    apart = found.apart
    chance = "less than 1e-6" if found.p_value < 1e-6 else f"{found.p_value:.2g}"
    out = [
        f"without a change, parameters would differ as much with a chance of {chance} ({found.rank} combinations that both runs saw)"
    ]
    size = f"predictions differ by {1e3 * apart.rms:.3g} mm rms over the {region}, at most {1e3 * apart.largest:.3g} mm"
    limit = f"without a change they would by {1e3 * apart.expected:.3g} mm, rarely more than {1e3 * apart.limit:.3g} mm"
    out.append(f"{size}; {limit}")
    sure = [c for c in sorted(found.changes, key=lambda c: c.p_value) if c.p_of_all < 0.05]
    if found.drifted and sure:
        out.append("the change shows in " + ", ".join(c.name for c in sure[:6]) + (", ..." if len(sure) > 6 else ""))
    elif found.drifted:
        out.append("no parameter by itself changed significantly, only combinations of them")
    alone = [c for c in found.singles if c.p_rest > 0.05][:3] if found.drifted else []
    if alone:
        told = []
        for c in alone:
            unit = robot.units.of(c.unit)
            told.append(f"{c.name} by {c.change / unit.factor:+.3g} ± {1.96 * c.sigma / unit.factor:.2g} {unit.name}")
        out.append("a change of one parameter alone would explain it: " + ", or ".join(told))
    left = max((k.noise.get("m", 0.0) for k in known), default=0.0)
    if found.drifted and apart.rms < left:
        out.append(f"that is less than the {1e3 * left:.3g} mm per axis by which single measurements scatter")
    return out

"""Two calibrations of one robot, some time apart; has it changed, and by how much?"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal._version import __version__
from robocal.apply.drift import Drift, ParameterChange, ParameterDrift, Single, compare, compare_models
from robocal.apply.model_difference import ModelDifference
from robocal.errors import ModelError
from robocal.files.display import to_display
from robocal.files.plain import json_text, plain
from robocal.files.runfolder import Run
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.prove.place_bands import sample_joints
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, remark_fields
from robocal.session.inputs import Calibration
from robocal.session.opened import Opened
from robocal.session.runs import shared_files, verdict_remarks
from robocal.session.verb_base import VerdictResult

__all__ = ["DriftResult", "compare_runs", "has_places"]

Pair = tuple[Calibration, Calibration]
SAMPLES = 2000
SAME = 1e-9  # of a nominal value, in m or rad


@record(kw_only=True, eq=False)
class DriftResult(VerdictResult):
    """Two runs compared: the drift, its verdict (unchanged, possible, drifted) with its reasons, and remarks. `void` are
    reasons for which nothing can be concluded. Of a machine without places (`has_places`) the parameters alone are compared."""

    robot: Opened[Any]
    drift: ParameterDrift
    region: str
    void: tuple[Remark, ...]
    pair: tuple[Run, Run]

    lists_files = "never"

    @property
    def runs(self) -> tuple[Run, Run]:
        """Both of them."""
        return self.pair

    @property
    def trusted(self) -> bool:
        """Whether anything can be concluded."""
        return not self.void

    def texts(self) -> Mapping[str, str | bytes]:
        """The document."""
        return {"drift.json": json_text(self.document)}

    @property
    def status(self) -> str:
        """unchanged, possible or drifted; where nothing can be concluded, a change stays possible."""
        return "possible" if self.void else self.drift.status

    @property
    def why(self) -> tuple[Remark, ...]:
        """The reasons of that."""
        return self.void or self.reasons

    @property
    def difference(self) -> ModelDifference | None:
        """How far it has changed, in mm; None where it has no places."""
        return to_display(ModelDifference, self.drift.difference) if isinstance(self.drift, Drift) else None

    @property
    def changes(self) -> tuple[ParameterChange, ...]:
        """Of the parameters, in the units of the robot file."""
        return tuple(to_display(ParameterChange, c, self.robot.units) for c in self.drift.changes)

    @property
    def document(self) -> dict[str, Any]:
        """drift.json: lengths in mm, angles in deg, parameters in the units of the robot file."""
        return {
            "robocal": 1,
            "version": __version__,
            "robot": self.robot.name,
            "runs": [str(run.folder) for run in self.runs],
            "verdict": {
                "status": self.status, **remark_fields(self.why, "reasons"),
            },
            **self._places,
            "joint_test": {
                "statistic": self.drift.statistic, "rank": self.drift.rank, "dof": self.drift.dof,
                "p_value": self.drift.p_value,
            },
            "changes": [plain(c) for c in self.changes],
            "single_causes": [plain(to_display(Single, c, self.robot.units)) for c in self.drift.singles],
            **remark_fields(self.warnings),
            "command": self.command,
        }  # fmt: skip

    @property
    def _places(self) -> dict[str, Any]:
        """What the document says in millimetres; None for each where the machine has no places."""
        apart, found = self.difference, self.drift
        if apart is None or not isinstance(found, Drift):
            return dict.fromkeys(("change", "workspace", "scatter"))
        seen = found.scatter
        mm = {k: getattr(apart, k) for k in ("rms", "largest", "expected", "limit")}
        size = {k: getattr(apart, k) for k in ("change", "low", "high")}
        place = {"place": apart.place, "joints": np.degrees(apart.joints)}
        return {
            "change": {
                "unit": "mm", **size, "matters": 1e3 * found.matters, "p_value": apart.p_value, "region": self.region,
                "n": apart.n,
            },
            "workspace": {
                "unit": "mm", "region": self.region, "n": apart.n, **mm, "p_value": apart.p_value, "worst": place,
            },
            "scatter": None if seen is None else {
                "factor": seen.factor, "by": seen.by, "same_poses": seen.same, "dof": seen.dof,
            },
        }  # fmt: skip


def has_places(machine: Model) -> bool:
    """Whether joint values alone say where the machine is, so that a change has a size in millimetres."""
    return bool(joints_of(machine)) and freedom_of(machine) is None


def compare_runs(pair: Pair, new_tool: bool, matters: float, command: str = "") -> DriftResult:
    """Compares two calibrations of one machine; `matters` (m) is the change worth an alarm. Raises InputError when they cannot
    be compared."""
    _comparable(pair)
    first, second = pair
    one, two = first.opened.machine, second.opened.machine
    totals, region = (first.known.total, second.known.total), ""
    found: ParameterDrift
    if has_places(one):
        joints, region = _shared(pair)
        rows = (first.known.rows, second.known.rows)
        found = compare(one, two, totals, joints, first.known.conditions, new_tool=new_tool, rows=rows, matters=matters)
    else:
        found = compare_models(one, two, totals)
    warnings = dict.fromkeys((*first.opened.warnings, *second.opened.warnings, *_colleague_remarks(pair)))
    return DriftResult(
        robot=second.opened, drift=found, region=region, pair=(first.run, second.run), reasons=_reasons(pair, found, region),
        void=_void(pair), warnings=tuple(warnings), command=command,
    )  # fmt: skip


def _shared(pair: Pair) -> tuple[Array, str]:
    """Joint values at which the two are compared: where they were measured; drawn from the range that both measured where a
    run does not keep its places, or within the limits where the two never met."""
    rows = [c.known.rows.joints for c in pair if c.known.rows is not None]
    if len(rows) == 2 and min(len(r) for r in rows):
        return np.concatenate(rows), "poses measured in either run"
    ranges = [c.known.joints for c in pair if c.known.joints is not None]
    if len(ranges) == 2:
        low, high = np.maximum(ranges[0][:, 0], ranges[1][:, 0]), np.minimum(ranges[0][:, 1], ranges[1][:, 1])
        if (low < high).all():
            drawn = np.random.default_rng(0).uniform(low, high, (SAMPLES, len(low)))
            return drawn, "range of the joints in which both runs measured"
    return sample_joints(pair[0].opened.machine, ranges[0] if ranges else None, SAMPLES)


def _comparable(pair: Pair) -> None:
    (a, b), (first, second) = (c.opened for c in pair), (c.known for c in pair)
    table = a.machine.table
    if table.names != b.machine.table.names or a.file.convention != b.file.convention:
        raise ModelError(
            "these are runs of different robots", key=str(pair[1].run.folder), found=f"{b.name} ({b.file.convention})",
            expected=f"{a.name} ({a.file.convention}), as in {pair[0].run.folder}",
        )  # fmt: skip
    for name in first.total.names:
        if name in second.total.names and name in table:
            one, two = first.nominal[name], second.nominal[name]
            if abs(one - two) > SAME:
                message = "the two runs started from different nominal models: identify both from the same robot file"
                raise ModelError(message, key=name, found=two, expected=one)


CHANCE = 0.05
FEW = 6
CAUSES = 3
BLOCKS = {"place": "the place", "time": "the time of measuring", "joints": "the part of joint space"}
VERDICT = {"unchanged": Code.CHANGE_BELOW, "drifted": Code.CHANGE_ABOVE, "possible": Code.CHANGE_OPEN}
WORTH_SAYING = 1.2  # times the variance as fitted
FIGURES = 2


def _reasons(pair: Pair, found: ParameterDrift, region: str) -> tuple[Remark, ...]:
    """The verdict in words: the change in mm first, where there are places, then what chance would show, then the parameters."""
    differ = Remark.of(Code.PARAMETERS_DIFFER, chance=found.p_value, rank=found.rank)
    if isinstance(found, Drift):
        first = _size_reasons(found, pair, region)
    else:
        first = [Remark.of(Code.NO_CHANGE_FOUND)] if found.p_value >= CHANCE else []
    return (*first, differ, *(_parameters(found, pair) if found.p_value < CHANCE else ()))


def _size_reasons(found: Drift, pair: Pair, region: str) -> list[Remark]:
    apart = found.difference
    size = {k: Quantity(getattr(apart, k)) for k in ("change", "low", "high")}
    out = [Remark.of(VERDICT[found.status], region=region, **size, matters=Quantity(found.matters))]
    counts = [round(len(rows.joints) * rows.thinned) for c in pair if (rows := c.known.rows) is not None]
    if found.status == "possible" and apart.more is not None and len(counts) == len(pair):
        poses = _round_up(apart.more * max(counts))
        out.append(Remark.of(Code.CHANGE_SETTLED_BY, poses=poses, first=counts[0], second=counts[1]))
    shown = {k: Quantity(getattr(apart, k)) for k in ("rms", "largest", "expected", "limit")}
    out.append(Remark.of(Code.PREDICTIONS_APART, chance=apart.p_value, **shown))
    seen = found.scatter
    if seen is not None and seen.factor > WORTH_SAYING:
        out.append(Remark.of(Code.ERRORS_SHARED, by=BLOCKS[seen.by], factor=seen.factor))
    elif seen is not None and seen.factor < 1:
        out.append(Remark.of(Code.ERRORS_CANCEL, same=seen.same, factor=seen.factor))
    return out


def _round_up(value: float) -> int:
    """Two figures, upwards."""
    step = int(10 ** max(math.floor(math.log10(value)) - FIGURES + 1, 0))
    return math.ceil(value / step) * step


def _parameters(found: ParameterDrift, pair: Pair) -> list[Remark]:
    """Which parameters show it, and which one alone would explain it."""
    sure = [c.name for c in sorted(found.changes, key=lambda c: c.p_value) if c.p_of_all < CHANCE]
    names = (*sure[:FEW], *(["..."] if len(sure) > FEW else []))
    out = [Remark.of(Code.SHOWS_IN, names=names) if sure else Remark.of(Code.SHOWS_IN_SUMS)]
    told = []
    for c in [c for c in found.singles if c.p_rest > CHANCE][:CAUSES]:
        unit = pair[0].opened.units.of(c.unit)
        told.append(f"{c.name} by {c.change / unit.factor:+.3g} ± {1.96 * c.sigma / unit.factor:.2g} {unit.name}")
    if told:
        out.append(Remark.of(Code.ONE_CAUSE, causes=" or ".join(told)))
    left = max(c.known.noise.get("m", 0.0) for c in pair)
    if isinstance(found, Drift) and found.difference.rms < left:
        out.append(Remark.of(Code.BELOW_SCATTER, left=Quantity(left)))
    return out


def _void(pair: Pair) -> tuple[Remark, ...]:
    """Why nothing can be concluded from these two."""
    both = shared_files(*(c.run.result for c in pair))
    out = [Remark.of(Code.SAME_MEASUREMENTS, files=both[:FEW])] if both else []
    for c in pair:
        out += [r for r in verdict_remarks(c.run.result, str(c.run.folder)) if r.code == Code.RUN_REFUSED]
    return tuple(out)


def _colleague_remarks(pair: Pair) -> Iterator[Remark]:
    """What a careful colleague would add."""
    robot, (first, second) = pair[0].opened, (c.known for c in pair)
    for c in pair:
        run = str(c.run.folder)
        yield from (r for r in verdict_remarks(c.run.result, run) if r.code == Code.RUN_NOT_IMPROVED)
        if c.known.rows is None and has_places(robot.machine):
            yield Remark.of(Code.ROWS_NOT_KEPT, run=run)
    only = [n for n in {*first.total.names} ^ {*second.total.names} if not (n in first.nominal and n in second.nominal)]
    # Of an arm only what belongs to a joint: base and tool are placed anew.
    arm, table = robot.arm is not None, robot.machine.table
    only = [n for n in sorted(only) if (n.rpartition(".")[0].startswith("j") if arm else n in table)]
    if only:
        yield Remark.of(Code.FREE_IN_ONE, names=(*only[:8],))

"""What is said of two runs that were compared: reasons of the verdict, reasons for which there is none, and doubts."""

from __future__ import annotations

import math
from pathlib import Path

from robocal.apply.drift import Drift
from robocal.files.covariance import Knowledge
from robocal.files.result import Result
from robocal.files.robot import Robot
from robocal.remarks.code import Code
from robocal.remarks.remark import Number, Quantity, Remark

__all__ = ["doubts", "reasons", "void"]

CHANCE = 0.05
FEW = 6
CAUSES = 3
BLOCKS = {"place": "the place", "time": "the time of measuring", "joints": "the part of joint space"}
VERDICT = {"unchanged": Code.CHANGE_BELOW, "drifted": Code.CHANGE_ABOVE, "possible": Code.CHANGE_OPEN}
WORTH_SAYING = 1.2  # times the variance as fitted
FIGURES = 2


def reasons(robot: Robot, found: Drift, known: tuple[Knowledge, Knowledge], region: str) -> tuple[Remark, ...]:
    """The verdict in words: the change in mm first, then what chance would show, then the parameters."""
    apart, size = found.apart, _size(found)
    out = [Remark.of(VERDICT[found.status], region=region, **size)]
    counts = [None if k.rows is None else round(len(k.rows.joints) * k.rows.thinned) for k in known]
    if found.status == "possible" and apart.more is not None and None not in counts:
        poses = _rounded(apart.more * max(c for c in counts if c is not None))
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
    apart = found.apart
    return {
        "change": Quantity(apart.change), "low": Quantity(apart.low), "high": Quantity(apart.high),
        "matters": Quantity(found.matters),
    }  # fmt: skip


def _rounded(value: float) -> int:
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
    if found.apart.rms < left:
        out.append(Remark.of(Code.BELOW_SCATTER, left=Quantity(left)))
    return out


def void(runs: tuple[Path, Path], results: tuple[Result, Result]) -> tuple[Remark, ...]:
    """Why nothing can be concluded from these two."""
    out = []
    used = [{i.sha256: i.file for i in r.provenance.inputs if i.file.lower().endswith(".csv")} for r in results]
    both = tuple(Path(used[1][k]).name for k in used[1] if k in used[0])
    if both:
        out.append(Remark.of(Code.SAME_MEASUREMENTS, files=both[:FEW]))
    for run, result in zip(runs, results, strict=True):
        if result.verdict.status == "refused":
            out.append(Remark.of(Code.RUN_REFUSED, run=str(run)))
    return tuple(out)


def doubts(runs: tuple[Path, Path], results: tuple[Result, Result], known: tuple[Knowledge, Knowledge]) -> list[Remark]:
    """What a careful colleague would add."""
    out = []
    for run, result, k in zip(runs, results, known, strict=True):
        if result.verdict.status == "not_improved":
            out.append(Remark.of(Code.RUN_NOT_IMPROVED, run=str(run)))
        if k.rows is None:
            out.append(Remark.of(Code.ROWS_NOT_KEPT, run=str(run)))
    names = [{n for n in k.total.names if n in known[0].nominal and n in known[1].nominal} for k in known]
    only = sorted((set(known[0].total.names) ^ set(known[1].total.names)) - names[0] - names[1])
    only = [n for n in only if n.rpartition(".")[0].startswith("j")]
    if only:
        out.append(Remark.of(Code.FREE_IN_ONE, names=(*only[:8],)))
    return out

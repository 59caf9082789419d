"""The verdict of a motor with what its logs cannot tell, and what is worth knowing beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robocal._record import replace
from robocal._types import Bools
from robocal.drives.drive_sweep import Sweep
from robocal.files.drive_log import DriveLog
from robocal.prove.verdict import Verdict, verdict_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.drive.drive_checks import (
    check_better_reading,
    check_coverage,
    check_electrical,
    check_gaps,
    check_lag,
    check_motor,
    check_reading,
    check_share,
    check_sign,
    check_weight,
)
from robocal.session.drive.drive_fit import MotorFit
from robocal.session.drive.drive_listings import log_names
from robocal.session.drive.table_share import Explained

__all__ = ["escape_width", "judge_logs"]

# What is said of readings on poses, in words of efforts and arcs.
OWN_WORDS = {Code.GAIN_PROVEN: Code.DRIVE_GAIN_PROVEN, Code.GAIN_NOT_PROVEN: Code.DRIVE_GAIN_NOT_PROVEN}

GRID = 10  # grid: cells per degree, in which escapes are measured


def escape_width(sweep: Sweep, escaped: Bools) -> float:
    """How wide the arcs are where the rotor escaped, deg."""
    cells = np.floor(np.degrees(np.mod(sweep.angle, 2 * np.pi)) * GRID)
    return len(np.unique(cells[escaped])) / GRID


def judge_logs(
    logs: Sequence[DriveLog], sweeps: Sequence[Sweep], used: Sequence[Bools], escaped: Sequence[Bools], taken: MotorFit,
    other_logs: Mapping[int, Explained], contradictions: Sequence[Remark], made: tuple[int | None, int | None],
    noise_share: float, lag: float, other_way: float,
) -> tuple[Verdict, tuple[Remark, ...]]:  # fmt: skip
    """The verdict with what the logs cannot tell, and what is worth knowing beside it; `contradictions` are
    between the fitted logs, `noise_share` is the noise's of the variance, `lag` that of one curve for both directions,
    `other_way` the share of one direction that the harmonics of the other explain."""
    known_free = any(log.load == "detached" for log in logs)
    verdict = verdict_of(taken.decision, over_range=False)
    warnings = [r for log in logs for r in log.remarks]
    for remark, lacking in check_coverage(sweeps, used, made):
        if lacking:
            verdict = _doubt(verdict, remark)
        else:
            warnings.append(remark)
    for remark in contradictions:
        verdict = _doubt(verdict, remark)
    whole = all(r.code != Code.DRIVE_UNDER_TURN for r in verdict.reasons)
    share = taken.share if np.isfinite(taken.share) else 0.0
    why = check_share(logs[0], sweeps[0], share)
    if why is not None:
        other = check_reading(sweeps[0], share)
        verdict = verdict.instead("refused", other or why)
    elif (other := check_sign(sweeps[0]) or check_better_reading(sweeps[0], share, noise_share, whole)) is not None:
        verdict = verdict.instead("refused", other)
    else:
        c = taken.motor.cogging
        warnings += check_motor(c.orders, c.amplitudes, *made)
        if (far := check_lag(logs[0], lag, share, other_way, c.by_direction)) is not None:
            verdict = _doubt(verdict, far)
        for remark in check_gaps(sweeps, used, c.orders, c.amplitudes) if whole else ():
            verdict = _doubt(verdict, remark)
        for remark, doubted in (
            *check_weight(c, sweeps, known_free),
            *check_electrical(sweeps[0], share, noise_share, c, made),
        ):
            if doubted:
                verdict = _doubt(verdict, remark)
            else:
                warnings.append(remark)
    for sweep, rows in zip(sweeps, escaped, strict=True):
        if rows.any():
            warnings.append(_escape(sweep, rows))
    names = log_names(logs)
    for i, found in other_logs.items():
        log = logs[i]
        speed = float(log.in_angle_unit(found.speed))
        warnings.append(
            Remark.of(Code.DRIVE_HELD_BACK, log=names[i], speed=speed, unit=log.speed_unit, alone=found.alone)
        )
    return replace(verdict, reasons=tuple(_own_words(verdict))), tuple(warnings)


def _doubt(verdict: Verdict, why: Remark) -> Verdict:
    """The verdict with a reason why nobody should use the table; not improved, where it was."""
    if verdict.status == "improved":
        return verdict.instead("not_improved", why)
    return replace(verdict, reasons=(why, *verdict.reasons))


def _own_words(verdict: Verdict) -> Iterator[Remark]:
    """The reasons; beside those of the log a gain that was proven says nothing more, nor does what a few arcs make odd."""
    own = any(r.code.startswith("drive-") for r in verdict.reasons)
    for r in verdict.reasons:
        if r.code != Code.GAIN_ANYWAY and not (own and r.code in (Code.FEW_UNSEEN, Code.NUMBER_WRONG)):
            yield replace(r, code=OWN_WORDS.get(r.code, r.code))


def _escape(sweep: Sweep, rows: Bools) -> Remark:
    """How wide the escapes are, and how much of it the other direction has."""
    cells = np.floor(np.degrees(np.mod(sweep.angle, 2 * np.pi)) * GRID).astype(np.int64)
    read = {d: set(cells[sweep.used & ~rows & (sweep.direction == d)].tolist()) for d in (1, -1)}
    gone = {d: set(cells[rows & (sweep.direction == d)].tolist()) - read[d] for d in (1, -1)}
    repaired = sum(len(gone[d] & read[-d]) for d in (1, -1)) / GRID
    lost = sum(len(gone[d] - read[-d]) for d in (1, -1)) / GRID
    count = int(np.sum(np.diff(np.concatenate([[False], rows]).astype(np.int8)) == 1))
    return Remark.of(
        Code.DRIVE_ESCAPED, width=escape_width(sweep, rows), count=count, repaired=repaired or None, lost=lost or None
    )

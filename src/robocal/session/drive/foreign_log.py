"""Why a log is not of the motor of a table: units, columns, signs, zeros and gains that differ, or another motor.

The readings are tried in the order in which people make such mistakes: another unit or exchanged columns, another zero or sign, another
gain of the effort; what none of them explains is another motor.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._types import Bools
from robocal.diagnose.drive_limits import OTHER_GAIN, READING_EXPLAINS, SHIFT_BETTER, SHIFT_LEAST, TABLE_EXPLAINS
from robocal.drives.motor import Motor
from robocal.files.drive_log import DriveLog
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.drive.drive_checks import other_readings
from robocal.session.drive.table_share import Explained, Shift, best_shift, explain, share_alone

__all__ = ["contradiction"]


def contradiction(
    motor: Motor, coulomb: float, log: DriveLog, used: Bools, parts: Mapping[bool, Explained]
) -> Remark | None:
    """Why the log cannot be of this motor, by the parts of it (compensated or not); None where it may be."""
    name = log.path.name
    whole = explain(motor, log.sweep, used) if len(parts) > 1 else next(iter(parts.values()))
    foreign = all(e.gain < OTHER_GAIN for e in parts.values())
    unlike = foreign or all(e.gain > 1 / OTHER_GAIN for e in parts.values())
    if whole.alone < TABLE_EXPLAINS and unlike:
        words, share = _reading(motor, log)
        if share > READING_EXPLAINS:
            return Remark.of(Code.DRIVE_OTHER_READING, change=words, other=share, share=max(whole.alone, 0.0))
    missing = max(log.sweep.take(used).missing.values()) if len(np.unique(log.sweep.direction[used])) > 1 else 0
    if not missing:
        shift = best_shift(motor, log.sweep, used, coulomb)
        moved = abs(shift.angle) > SHIFT_LEAST
        fits = shift.share > TABLE_EXPLAINS and shift.share > SHIFT_BETTER * whole.best
        if fits and whole.alone < SHIFT_BETTER * shift.share and (shift.mirrored or shift.negative or moved or foreign):
            return _other_zero(shift, log, max(whole.alone, 0.0), moved)
    if foreign and whole.fitted < READING_EXPLAINS:
        return Remark.of(Code.DRIVE_OTHER_MOTOR, log=name, gain=max(whole.gain, 0.0), best=max(whole.best, 0.0))
    return Remark.of(Code.DRIVE_OTHER_GAIN, log=name, gain=whole.gain) if unlike else None


def _reading(motor: Motor, log: DriveLog) -> tuple[str, float]:
    """The other reading of which the table explains most, and that share."""
    best = ("", 0.0)
    for words, other in other_readings(log.sweep):
        if other.used.any():
            best = max(best, (words, share_alone(motor, other, other.used)), key=lambda b: b[1])
    return best


def _other_zero(shift: Shift, log: DriveLog, alone: float, moved: bool) -> Remark:
    by = float(log.in_angle_unit(shift.angle))
    told: dict[str, str | float] = {"share": shift.share, "log": log.path.name, "unit": log.angle_unit, "alone": alone}
    if shift.negative and not shift.mirrored:
        return Remark.of(Code.DRIVE_OTHER_SIGN, shift=by if moved else None, **told)
    turned, effort = "reversed" if shift.mirrored else None, "reversed" if shift.negative else None
    return Remark.of(Code.DRIVE_OTHER_ZERO, shift=by, reversed=turned, negative=effort, **told)

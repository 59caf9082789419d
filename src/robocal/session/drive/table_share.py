"""What the table of a motor explains of another log: alone; with a lag, a gain, friction and inertia of its own; and what harmonics of
the same orders could explain at best.

Whether a drive compensated is told by the turns of the log: where more than half of the variance of a turn's effort is what the table
says, it was added there. Where the motor runs rough, the inertia of the rotor carries it through its cogging, and no table of positions
explains the effort.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.diagnose.drive_limits import TABLE_EXPLAINS
from robocal.drives.drive_sweep import Sweep, arc_of
from robocal.drives.moments import moments_of
from robocal.drives.motor import GAIN, LAG, Motor
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem
from robocal.session.drive.drive_data import NUMBERS, drive_data, friction_free

__all__ = ["Explained", "Shift", "best_shift", "compensated_turns", "explain", "halves", "share_alone"]

SHIFTS = 14400  # grid: of a turn; a fortieth of a degree is 2 deg of order 72
NEARLY = 0.02  # grid: of the variance; readings that explain the same differ by less, in the noise of their fits
ALIKE = 2e-3  # grid: of the variance; places of one curve that comes again differ by less, in the noise of its parts
LEAST = 50  # grid: rows of a turn, below which its share is not asked


@record
class Explained:
    """Shares of the variance of the effort without friction: of the table alone, with what the log has of its own, and at best; the
    lag (rad), gain and inertia that go with them, and the speed with its standard deviation (rad/s)."""

    rows: int
    alone: float
    fitted: float
    best: float
    lag: float
    gain: float
    inertia: float
    viscous: float
    speed: float
    scatter: float
    noise: float = float("nan")


@record
class Shift:
    """By how much (rad) the angle of a log has to be moved, whether it and its effort are reversed, and the share that is explained
    then."""

    angle: float
    mirrored: bool
    negative: bool
    share: float


def _table(motor: Motor, sweep: Sweep) -> Array:
    return motor.cogging.at(sweep.angle, sweep.direction)


def _share(effort: Array, left: Array) -> float:
    total = float(np.sum((effort - effort.mean()) ** 2))
    return 1 - float(np.sum((left - left.mean()) ** 2)) / total if total > 0 else float("nan")


def share_alone(motor: Motor, sweep: Sweep, rows: Bools) -> float:
    """The share that the motor's table explains of some rows of a log, as it is."""
    effort = friction_free(sweep, rows)
    return _share(effort, effort - _table(motor, sweep.take(rows)))


def explain(motor: Motor, sweep: Sweep, rows: Bools) -> Explained:
    """What the motor's table explains of some rows of a log."""
    effort = friction_free(sweep, rows)
    some = sweep.take(rows)
    alone = share_alone(motor, sweep, rows)
    data = drive_data([sweep], [rows], NUMBERS)
    loose = motor.with_table(motor.table.with_free({LAG, GAIN}))
    made = problem(loose, data)
    ended = least_squares(made, made.start)
    values = dict(zip(made.table.names, ended.x[0].tolist(), strict=False))
    left = made.residuals(ended.x)[0].value[:, 0]
    total = float(effort @ effort)
    moments = moments_of(
        some.angle,
        effort,
        some.direction,
        np.zeros(len(effort), dtype=np.int64) + arc_of(some.angle),
        max(motor.orders, default=1),
    )
    _, best = moments.fit(motor.orders, motor.table[LAG].value)
    speed = some.speed * some.direction
    gap = np.median(np.abs(np.diff(left))) / (0.6745 * np.sqrt(2.0))
    return Explained(
        len(effort), alone, 1 - float(left @ left) / total, 1 - best / total, values[LAG], values[GAIN], values["log1.inertia"],
        values["log1.viscous"], float(np.mean(speed)), float(np.std(speed)), float(gap),
    )  # fmt: skip


def compensated_turns(motor: Motor, sweep: Sweep) -> Bools:
    """For each row, whether its turn was compensated, (m,)."""
    turn = np.floor(sweep.angle / (2 * np.pi)).astype(np.int64)
    effort, table = np.array(sweep.effort), _table(motor, sweep)
    out = np.zeros(len(sweep), dtype=bool)
    known = False
    for t in np.unique(turn):
        mine = (turn == t) & sweep.used
        if mine.sum() >= LEAST:
            known = _share(effort[mine], effort[mine] - table[mine]) > TABLE_EXPLAINS
        out[turn == t] = known
    return out


def halves(motor: Motor, sweep: Sweep) -> dict[bool, Bools]:
    """The rows that were compensated, and the others."""
    on = compensated_turns(motor, sweep)
    return {word: sweep.used & (on == word) for word in (True, False) if (sweep.used & (on == word)).any()}


def best_shift(motor: Motor, sweep: Sweep, rows: Bools, friction: float = 0.0) -> Shift:
    """How the angle and the effort of a log have to be read so that the table explains most. Where the motor's Coulomb friction is known,
    and the log has both directions, a reading with the other sign of friction is none."""
    effort, some = friction_free(sweep, rows), sweep.take(rows)
    c = motor.cogging
    table, n = np.array(c.cosine) - 1j * np.array(c.sine), np.array(c.orders)
    shifts = np.arange(SHIFTS) * 2 * np.pi / SHIFTS
    turned = table * np.exp(1j * np.outer(shifts, n))
    mean = [float(np.mean(sweep.effort[rows][some.direction == d])) for d in (1, -1) if (some.direction == d).any()]
    own = (mean[0] - mean[1]) / 2 if len(mean) == 2 else 0.0
    total, found = float(np.mean(effort**2)), list[Shift]()
    for mirrored in (False, True):
        angle, direction = (-some.angle, -some.direction) if mirrored else (some.angle, some.direction)
        moments = moments_of(angle, effort, direction, arc_of(angle), max(c.orders, default=1))
        x, _ = moments.fit(c.orders, c.lag)
        parts = x[2 : 2 + len(n)] - 1j * x[2 + len(n) : 2 + 2 * len(n)]
        for negative in (False, True):
            if friction * own * (-1 if mirrored != negative else 1) < 0:
                continue
            # Half the squares of what is left of the harmonics, by the shift of the angle.
            left = np.sum(np.abs((-parts if negative else parts) - turned) ** 2, axis=1) / 2
            # Of a curve that comes again within a turn the nearest place, for it is as good as the others.
            low = (left <= np.roll(left, 1)) & (left <= np.roll(left, -1)) & (left <= left.min() + ALIKE * total)
            at = int(min(np.flatnonzero(low), key=lambda i: min(i, SHIFTS - i)))
            share = 1 - (total - float(np.sum(np.abs(parts) ** 2)) / 2 + float(left[at])) / total
            found.append(Shift(float((shifts[at] + np.pi) % (2 * np.pi) - np.pi), mirrored, negative, share))
    most = max(s.share for s in found)
    # The simplest of those that are nearly as good: one order alone looks the same by several readings.
    return next(s for s in found if s.share >= most - NEARLY)

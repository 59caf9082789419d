"""What a log of a drive cannot tell, and what is wrong with it: arcs and directions that are missing, orders that its rows are too few
for, a speed that hides the torque, columns or units that were mistaken, slots, poles and gears that do not fit the orders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import lcm

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.drive_limits import (
    AT_LIMIT,
    ELECTRICAL_LEAVES,
    LEAST_PACE,
    MOST_PACE,
    NOISE_TIMES,
    QUICK_RIPPLE,
    READING_EXPLAINS,
    SHIFT_LEAST,
    SLOTS_NAME,
    SWEEP_EFFORT,
    TABLE_EXPLAINS,
    WEIGHT_MOST,
    WEIGHT_SEEN,
)
from robocal.drives.cogging import Cogging
from robocal.drives.drive_sweep import Sweep, sweep_of
from robocal.drives.order_names import guess_motor, named_share
from robocal.files.drive_log import DriveLog
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.drive.drive_fit import HIGHEST, choose, highest_order, moments_of_sweeps

__all__ = [
    "check_better_reading",
    "check_coverage",
    "check_electrical",
    "check_gaps",
    "check_lag",
    "check_motor",
    "check_reading",
    "check_share",
    "check_sign",
    "check_speed",
    "check_weight",
    "other_readings",
]

FEW = 6  # grid: orders, by which another reading is tried
SIGNED = "the effort with the sign of its direction"
WEAK = 0.01  # grid: of the variance; of weaker orders some are noise, and share no divisor
LEVELS = 20  # grid: a coarser effort has its largest value often by itself
CROWD = 5  # grid: times the rows at the next value; of a round top that is told in steps it is 2.4
LEAST_TURN = 0.9  # grid: of a turn, which another reading of the angle has to cover
MOST_PAIRS = 24  # grid: pole pairs; motors of robots have fewer
TURNS = 5000  # grid: of a reading that no log has


def check_coverage(
    sweeps: Sequence[Sweep], used: Sequence[Bools], made: tuple[int | None, int | None] = (None, None)
) -> Iterator[tuple[Remark, bool]]:
    """What is missing, each with whether the table must not be trusted for it; `made` are slots and poles, where they are known.

    An order above half the angles of a turn appears as a lower one, and every arc that was held out agrees.
    """
    parts = [s.take(rows) for s, rows in zip(sweeps, used, strict=True)]
    ways = {d: [p.missing[d] for p in parts if (p.direction == d).any()] for d in (1, -1)}
    missing = max(min(m) for m in ways.values() if m)
    if missing:
        yield Remark.of(Code.DRIVE_UNDER_TURN, missing=missing), True
    if not all(ways.values()):
        yield Remark.of(Code.DRIVE_ONE_DIRECTION, log=parts[0].name), True
    for part in parts:
        yield from check_speed(part)
        size = _effort_size(part)
        if size is not None:
            yield size, True
        cut = _cut_off(part)
        if cut is not None:
            yield cut, True
    highest, places = highest_order(sweeps, used)
    if highest < HIGHEST:
        slots, poles = made
        own = HIGHEST // 4 if slots is None or poles is None else lcm(slots, poles)
        yield Remark.of(Code.DRIVE_ORDERS_UNSEEN, places=places, highest=highest), highest < own


def check_gaps(
    sweeps: Sequence[Sweep], used: Sequence[Bools], orders: Sequence[int], amplitudes: Array
) -> Iterator[Remark]:
    """What neither direction has read, where the strongest order may rise from zero to its peak unseen.

    Orders with a common divisor say the same in every part of a turn: what one part lacks others have.
    """
    if not len(orders):
        return
    each, power = np.array(orders), np.asarray(amplitudes) ** 2
    parts, strongest = int(np.gcd.reduce(each[power > WEAK * power.sum()])), int(each[np.argmax(power)])
    period = 2 * np.pi / parts
    angle = np.unique(np.mod(np.concatenate([s.angle[rows] for s, rows in zip(sweeps, used, strict=True)]), period))
    widest = float(np.diff(angle, append=angle[0] + period).max())
    if widest > np.pi / 2 / strongest * (
        1 + 1e-6
    ):  # tolerance: of rounding, where an encoder has four steps in a period
        said = float(np.degrees(period)) if parts > 1 else None
        yield Remark.of(Code.DRIVE_ARC_UNREAD, width=float(np.degrees(widest)), period=said, order=strongest)


def check_speed(sweep: Sweep) -> Iterator[tuple[Remark, bool]]:
    """A pace that no sweep has, as another unit of time makes it."""
    pace = sweep.median_speed
    if not LEAST_PACE <= pace <= MOST_PACE:
        word = "slowly" if pace < LEAST_PACE else "fast"
        yield Remark.of(Code.DRIVE_PACE, log=sweep.name, speed=float(np.degrees(pace)), word=word), True


def _effort_size(sweep: Sweep) -> Remark | None:
    """An effort that no free motor asks for, by the tenth of its rows that is farthest from their middle; None where it may be one."""
    value = (
        float(np.quantile(np.abs(sweep.effort - np.median(sweep.effort)), 0.9)) if len(sweep) else 0.0
    )  # grid: of the rows
    unit = sweep.unit
    if value > SWEEP_EFFORT[f"{unit} most"] and not sweep.loaded:
        return Remark.of(Code.DRIVE_EFFORT_SIZE, log=sweep.name, value=value, unit=unit, word="much", option="--loaded")
    if 0 < value < SWEEP_EFFORT[f"{unit} least"]:
        return Remark.of(Code.DRIVE_EFFORT_SIZE, log=sweep.name, value=value, unit=unit, word="little", option=None)
    return None


def _cut_off(sweep: Sweep) -> Remark | None:
    """The effort at which many rows stand, largest of all of one sign; None where there is none."""
    values, counts = np.unique(sweep.effort, return_counts=True)
    if len(values) < LEVELS:
        return None
    for end, next_to in ((-1, -2), (0, 1)):
        if counts[end] > AT_LIMIT * len(sweep) and counts[end] > CROWD * counts[next_to]:
            share = float(counts[end] / len(sweep))
            return Remark.of(
                Code.DRIVE_AT_LIMIT, share=share, log=sweep.name, value=float(values[end]), unit=sweep.unit
            )
    return None


def other_readings(sweep: Sweep) -> Iterator[tuple[str, Sweep]]:
    """The log as other units or exchanged columns would make it, with what to change."""
    factors = {
        "the angle in deg": np.pi / 180, "the angle in rad": 180 / np.pi, "the angle in turn": 2 * np.pi, "the angle in mrad": 1e-3,
    }  # fmt: skip
    for words, factor in factors.items():
        yield words, _again(sweep, sweep.angle * factor, sweep.effort)
    yield "angle and effort exchanged", _again(sweep, sweep.effort, sweep.angle)
    if _is_unsigned(sweep):
        yield SIGNED, _again(sweep, sweep.angle, sweep.effort * sweep.direction)


def _is_unsigned(sweep: Sweep) -> bool:
    """Whether efforts of both directions have one sign, as the size of a current has."""
    effort = sweep.effort[sweep.used]
    return len(np.unique(sweep.direction[sweep.used])) > 1 and bool((effort >= 0).all() or (effort <= 0).all())


def check_sign(sweep: Sweep) -> Remark | None:
    """That efforts have lost their sign: with that of their direction, the curves of both directions are one. Under a weight that is larger
    than friction they are one as they are."""
    if not _is_unsigned(sweep):
        return None
    share, other = _explained(sweep), _explained(dict(other_readings(sweep))[SIGNED])
    if other <= max(share, TABLE_EXPLAINS):
        return None
    return Remark.of(Code.DRIVE_OTHER_READING, change=SIGNED, other=other, share=max(share, 0.0))


def check_lag(log: DriveLog, lag: float, share: float, other: float, by_direction: bool) -> Remark | None:
    """That the curves of both directions lie farther apart than friction makes them, or, with phases of their own, that one says nothing of
    the `other`: so it is where effort and angle are of different moments."""
    far = 2 * abs(lag) > SHIFT_LEAST
    if not far and not (by_direction and other < TABLE_EXPLAINS * share):
        return None
    apart = float(log.in_angle_unit(2 * abs(lag))) if far else None
    delay = abs(lag) / max(log.sweep.median_speed, 1e-12) if far else None
    name, unit = log.path.name, log.angle_unit
    return Remark.of(Code.DRIVE_LAG_FAR, log=name, other=max(other, 0.0), apart=apart, unit=unit, delay=delay)


def _again(sweep: Sweep, angle: Array, effort: Array) -> Sweep:
    return sweep_of(sweep.name, sweep.unit, sweep.time, angle, effort, sweep.flag, sweep.lines)


def _explained(sweep: Sweep) -> float:
    """The share that a few orders explain on unseen arcs; 0 where it is no sweep."""
    if not sweep.used.any() or np.ptp(sweep.angle) > TURNS * 2 * np.pi or np.ptp(sweep.angle) < 2 * np.pi * LEAST_TURN:
        return 0.0
    highest, _ = highest_order([sweep], [sweep.used])
    moments = moments_of_sweeps([sweep], [sweep.used], highest)
    if len(np.unique(moments.arc)) < 2 or not moments.q.sum():
        return 0.0
    found = choose(moments, FEW, eccentric=False)
    return found.shares[-1] if found.shares else 0.0


def check_reading(sweep: Sweep, share: float) -> Remark | None:
    """The other reading that explains what this one does not; None where there is none."""
    words, best = _best_reading(sweep)
    return (
        Remark.of(Code.DRIVE_OTHER_READING, change=words, other=best, share=max(share, 0.0))
        if best > READING_EXPLAINS
        else None
    )


def _best_reading(sweep: Sweep) -> tuple[str, float]:
    """What to change for the reading that a few orders explain best, and the share that they do."""
    return max(((words, _explained(other)) for words, other in other_readings(sweep)), key=lambda t: t[1])


def check_better_reading(sweep: Sweep, share: float, noise_share: float, whole: bool) -> Remark | None:
    """The other reading that halves what this one leaves: low orders of a wrong turn explain much of a curve that its own orders explain.
    Where noise is most of what is left, none is asked. Of a part of a turn (not `whole`) any curve is explained: another reading needs no
    more than to explain it too."""
    if not whole:
        return check_reading(sweep, share)
    if 1 - share <= NOISE_TIMES * noise_share:
        return None
    words, best = _best_reading(sweep)
    if best <= READING_EXPLAINS or 1 - best >= ELECTRICAL_LEAVES * (1 - share):
        return None
    return Remark.of(Code.DRIVE_OTHER_READING, change=words, other=best, share=share)


def check_share(log: DriveLog, sweep: Sweep, share: float) -> Remark | None:
    """Why a table must not be used that explains too little."""
    if not share < TABLE_EXPLAINS:
        return None
    share = max(share, 0.0)
    quick = float(np.std(sweep.speed[sweep.used] * sweep.direction[sweep.used]))
    if quick > QUICK_RIPPLE:
        speed = float(log.in_angle_unit(sweep.median_speed))
        return Remark.of(Code.DRIVE_SPEED_HIDES, share=share, speed=speed, unit=log.speed_unit)
    return Remark.of(Code.DRIVE_EXPLAINS_LITTLE, share=share)


def check_weight(c: Cogging, sweeps: Sequence[Sweep], known_free: bool) -> Iterator[tuple[Remark, bool]]:
    """What comes once per turn and may be a load's weight; with whether it is most of the curve, so that nobody should call it cogging."""
    if 1 not in c.orders or known_free or any(s.loaded for s in sweeps):
        return
    power = c.amplitudes**2
    share = float(power[c.orders.index(1)] / power.sum())
    if share > WEIGHT_SEEN:
        yield Remark.of(Code.DRIVE_WEIGHT, share=share), share > WEIGHT_MOST


def check_electrical(
    sweep: Sweep, share: float, noise_share: float, c: Cogging, made: tuple[int | None, int | None]
) -> Iterator[tuple[Remark, bool]]:
    """Whether the effort comes again after several turns of the angle only. Where noise is most of what is left, no angle is asked."""
    slots, poles = made
    turns = float(np.ptp(sweep.angle)) / (2 * np.pi)
    if 1 - share > NOISE_TIMES * noise_share:
        for pairs in range(2, min(MOST_PAIRS, int(turns / LEAST_TURN)) + 1):
            other = _explained(_again(sweep, sweep.angle / pairs, sweep.effort))
            if 1 - other < ELECTRICAL_LEAVES * (1 - share):
                yield Remark.of(Code.DRIVE_ELECTRICAL, pairs=pairs), True
                return
    if slots is None or poles is None or not c.orders:
        return
    strongest, pairs, whole = int(c.orders[int(np.argmax(c.amplitudes))]), poles // 2, lcm(slots, poles)
    own = strongest % slots == 0 or strongest % poles == 0 or strongest == pairs
    if pairs > 1 and not own and strongest * pairs % whole == 0:
        yield Remark.of(Code.DRIVE_ELECTRICAL, pairs=pairs), True


def check_motor(orders: Sequence[int], amplitudes: Array, slots: int | None, poles: int | None) -> Iterator[Remark]:
    """Whether slots and poles fit the orders; without them, which would."""
    known = slots is not None and poles is not None
    guess = guess_motor(tuple(orders), amplitudes, (None, None) if known else (slots, poles))
    if slots is None or poles is None:
        if guess is not None:
            yield Remark.of(Code.DRIVE_WINDING, slots=guess[0], poles=guess[1])
            yield _design(*guess)
        elif slots is not None or poles is not None:
            said = f"{slots} slots" if slots is not None else f"{poles} poles"
            free = guess_motor(tuple(orders), amplitudes)
            if free is not None:
                yield Remark.of(Code.DRIVE_ONE_UNLIKE, said=said, slots=free[0], poles=free[1])
        return
    yield _design(slots, poles)
    if not len(orders):
        return
    strongest = int(np.array(orders)[np.argmax(amplitudes)])
    share = named_share(orders, amplitudes, slots, poles)
    times = _gear(orders, amplitudes, slots, poles)
    if times > 1:
        yield Remark.of(Code.DRIVE_GEAR, times=times, slots=slots, poles=poles)
    elif share < SLOTS_NAME or (strongest % slots and strongest % poles and strongest != poles // 2):
        others = None if guess is None else f"{guess[0]} slots and {guess[1]} poles"
        yield Remark.of(Code.DRIVE_SLOTS_UNLIKE, slots=slots, poles=poles, share=share, others=others)
    own = [n for n in (poles // 2, poles) if n in orders]
    if own and times <= 1:
        yield Remark.of(Code.DRIVE_SENSOR_ORDERS, orders=" and ".join(map(str, own)))


def _design(slots: int, poles: int) -> Remark:
    """What an ideal motor of this winding cogs, and what would remove it."""
    whole = lcm(slots, poles)
    ratio = None if slots % poles else slots // poles
    return Remark.of(Code.DRIVE_IDEAL, slots=slots, poles=poles, order=whole, skew=360 / whole, ratio=ratio)


def _gear(orders: Sequence[int], amplitudes: Array, slots: int, poles: int) -> int:
    """By what whole number all that is strong exceeds the orders of the motor; 1 where it does not."""
    power = np.asarray(amplitudes, float) ** 2
    each = np.array(orders)
    strongest, whole = int(each[np.argmax(power)]), lcm(slots, poles)
    for own in (whole, slots, poles):
        times, left = divmod(strongest, own)
        if left or times < 2 or strongest == whole:
            continue
        # Orders of a gear's output are multiples of its ratio; those of the motor itself are not.
        strong = power[each % times == 0].sum() / power.sum()
        lower = [n for n in (slots, poles, whole, poles // 2) if n % times]
        # An order of the output may fall on the common multiple itself: then an own order that lacks has to say so.
        said = whole not in orders or (own == whole and lower)
        if strong > READING_EXPLAINS and not any(n in orders for n in lower) and said:
            return times
    return 1

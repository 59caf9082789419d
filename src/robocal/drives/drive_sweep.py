"""A log of a drive: what it asked of its motor at every angle, and which way that moved.

The direction is that in which the rotor is led: it turns where the angle comes back by degrees, for a rotor that slips and sticks, and an
encoder that shows a step back and forth, are led on. Rows after a turn do not count until the rotor has left it by the hysteresis of
its friction. Speed is the way from some rows before to some rows after by its time. An escape is where the rotor, pulled by its magnets,
runs ahead of its setpoint: it crosses an arc many times as fast as it is led, and stands beyond it until the setpoint has come. Effort
there says nothing of the arc. Source: seed document, 1.4.2 and figure 1.7.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints

__all__ = ["ARC", "Sweep", "arc_of", "escaped_rows", "led_directions", "lone_rows", "sweep_of", "turns_of"]

ARC = np.pi / 6  # what is held out together: 30 degrees, in both directions
STEPS = 6.0  # grid: of the encoder, over which a speed is asked
BACK = np.radians(3.0)  # grid: so far no led rotor slips back
HYSTERESIS = np.radians(1.5)  # grid: friction of bearings turns within a degree; a sweep has 360 of them
# grid: a shorter way is a slip of friction: the effort falls by what breakaway is above sliding, a tenth, and no more
ESCAPE_LEAST = np.radians(1.5)
ESCAPE_SPEED = (
    8.0  # grid: times the speed at which it is led; a rotor that follows its cogging is up to three times as fast
)
ESCAPE_STEPS = 4.0  # grid: of the encoder, over which a jump is asked
AROUND = 7  # grid: rows, by whose median one is judged
ALONE = 0.1  # grid: of the middle size of efforts; from row to row a curve changes by less
PAUSE = np.radians(30.0)  # grid: a rotor that escapes may stand while it is led by twenty degrees
STAND = np.radians(0.1)  # grid: so little is noise of an angle
PAUSE_STEPS = 20.0  # grid: of a coarse encoder, in place of these degrees
GAP = 50.0  # grid: times the middle step of time; where nobody logged for so long, nothing tells how the rotor was led
LANDING = np.radians(0.3)  # grid: so far friction gives way before the rotor turns again


@record(eq=False)
class Sweep:
    """Rows (m,) of one log in SI: `time`, `angle` (rad, unwrapped), `effort` (N m or A, as `unit` says), `direction` (1, -1, 0 where it
    stands), `speed` (rad/s) and `acceleration`, both smoothed; `flag` is what the log itself says of a compensation, `used` which rows
    count; `step` is one step of the encoder (rad, 0: none is seen), and `loaded` whether something hangs on the shaft."""

    name: str
    unit: str
    time: Array
    angle: Array
    effort: Array
    direction: Array
    speed: Array
    acceleration: Array
    used: Bools
    step: float = 0.0
    flag: Array | None = None
    lines: Ints | None = None
    loaded: bool = False

    def __len__(self) -> int:
        return len(self.angle)

    def take(self, rows: Bools | Ints) -> Sweep:
        """Some of the rows."""
        own = ("time", "angle", "effort", "direction", "speed", "acceleration", "used", "flag", "lines")
        return replace(self, **{n: v[rows] for n in own if (v := getattr(self, n)) is not None})

    @property
    def median_speed(self) -> float:
        """The median speed of the rows that move, rad/s."""
        moving = self.used & (self.direction != 0)
        return float(np.median(np.abs(self.speed[moving]))) if moving.any() else 0.0

    @property
    def ripple(self) -> float:
        """The standard deviation of the speed, as a share of its median."""
        moving = self.used & (self.direction != 0)
        if not moving.any() or not self.median_speed:
            return 0.0
        return float(np.std(np.abs(self.speed[moving])) / self.median_speed)

    @property
    def missing(self) -> dict[int, int]:
        """How many of the twelve arcs each direction (1, -1) lacks."""
        return {d: 12 - len(np.unique(arc_of(self.angle[self.used & (self.direction == d)]))) for d in (1, -1)}


def arc_of(angle: Array) -> Ints:
    """The arc of 30 degrees, 0 to 11, of angles (m,)."""
    return np.floor(np.mod(angle, 2 * np.pi) / ARC).astype(np.int64) % 12


def turns_of(angle: Array) -> float:
    """How many turns angles cover, without gaps: from the least to the greatest."""
    return float(np.ptp(angle)) / (2 * np.pi)


def _window(angle: Array) -> tuple[int, float]:
    """Over how many rows, to each side, a speed is asked; and one step of the encoder (rad)."""
    moved = np.abs(np.diff(angle))
    moved = moved[moved > 1e-9]  # tolerance: rad, of rounding
    step = float(np.quantile(moved, 0.05)) if len(moved) else 0.0
    wide = 1
    while wide < max(1, len(angle) // 40):
        if np.median(np.abs(angle[2 * wide :] - angle[: -2 * wide])) >= STEPS * step:
            break
        wide = max(wide + 1, wide * 5 // 4)
    return wide, step


def led_directions(angle: Array, back: float) -> tuple[Array, Ints]:
    """The direction (m,) in which each row is led, 1 or -1, 0 of an angle that goes nowhere; and the rows at which it turns, by a way
    back of so much (rad)."""
    out, turns = np.zeros(len(angle)), list[int]()
    high, low = np.maximum.accumulate(angle), np.minimum.accumulate(angle)
    begun = np.flatnonzero((angle >= low + back) | (angle <= high - back))
    if not len(begun):
        return out, np.zeros(0, dtype=np.int64)
    first, d, last = int(begun[0]), 1.0 if angle[begun[0]] >= low[begun[0]] + back else -1.0, 0
    while True:
        # The farthest place so far, and where the angle first comes back from it by so much.
        way = d * angle[first:]
        farthest = np.maximum.accumulate(way)
        ended = np.flatnonzero(way <= farthest - back)
        if not len(ended):
            out[last:] = d
            return out, np.array(turns, dtype=np.int64)
        stop = first + int(np.argmax(way[: int(ended[0])]))
        out[last:stop] = d
        turns.append(stop)
        last, first, d = stop, stop, -d


def sweep_of(
    name: str,
    unit: str,
    time: Array,
    angle: Array,
    effort: Array,
    flag: Array | None = None,
    lines: Ints | None = None,
    aside: Bools | None = None,
) -> Sweep:
    """A log from its columns in SI; the angle may begin anew at every turn. Rows that are `aside` tell nothing."""
    angle = np.unwrap(angle) if np.ptp(angle) <= 2 * np.pi * (1 + 1e-9) else angle  # tolerance: of rounding
    wide, step = _window(angle)
    direction, turns = led_directions(angle, min(BACK, float(np.ptp(angle)) / 4))
    used = direction != 0
    for i, turn in enumerate(turns):
        # Where it turned it is not led yet, and its friction has not turned.
        stop = turns[i + 1] if i + 1 < len(turns) else len(angle)
        left = np.flatnonzero(np.abs(angle[turn:stop] - angle[turn]) > HYSTERESIS)
        used[turn : turn + int(left[0]) if len(left) else stop] = False
    at = np.arange(len(angle))
    ahead, behind = np.minimum(at + wide, len(angle) - 1), np.maximum(at - wide, 0)
    took = time[ahead] - time[behind]
    speed = np.divide(angle[ahead] - angle[behind], took, out=np.zeros(len(angle)), where=took > 0)
    slope = np.divide(speed[ahead] - speed[behind], took, out=np.zeros(len(angle)), where=took > 0)
    made = Sweep(name, unit, time, angle, effort, direction, speed, slope, used, step, flag, lines)
    return replace(made, used=used & ~_pauses(made) & (True if aside is None else ~aside))


def _pauses(sweep: Sweep) -> Bools:
    """Rows (m,) in which nobody leads the rotor: before it first moves, after it last moved, and where it stands for as long as thirty
    degrees take elsewhere. Friction has no direction there."""
    still = max(STAND, 2 * sweep.step)
    out = np.zeros(len(sweep), dtype=bool)
    out[: int(np.argmax(np.abs(sweep.angle - sweep.angle[0]) > still))] = True
    out[len(out) - int(np.argmax(np.abs(sweep.angle - sweep.angle[-1])[::-1] > still)) :] = True
    pace = _led_pace(sweep)
    if not pace:
        return out
    until = np.searchsorted(sweep.time, sweep.time + max(PAUSE, PAUSE_STEPS * sweep.step) / pace)
    begin = np.flatnonzero(until < len(sweep))
    end = until[begin]
    stands = np.abs(sweep.angle[end] - sweep.angle[begin]) <= still
    stands &= sweep.direction[end] == sweep.direction[begin]
    edges = np.zeros(len(sweep) + 1, dtype=np.int64)
    np.add.at(edges, begin[stands], 1)
    np.add.at(edges, end[stands] + 1, -1)
    return np.asarray(out | (np.cumsum(edges[:-1]) > 0))


def lone_rows(sweep: Sweep, times: float) -> Bools:
    """Rows (m,) whose effort stands alone: farther than so many robust sigma from the median of the rows around it."""
    y = sweep.effort
    if len(y) < AROUND:
        return np.zeros(len(y), dtype=bool)
    half = AROUND // 2
    around = np.lib.stride_tricks.sliding_window_view(np.pad(y, half, mode="edge"), AROUND)
    off = np.abs(y - np.median(around, axis=1))
    # Half of what is off is the median of noise; a log without noise has none that is off by chance.
    sigma = float(np.median(off)) / 0.6745
    return np.asarray(off > times * max(sigma, ALONE * float(np.median(np.abs(y - np.median(y))))))


def _led_pace(sweep: Sweep) -> float:
    """The speed at which the rotor is led (rad/s): the way of each direction by its time, without gaps of the log. An escape changes it
    little, while a rotor that stands and jumps has a median speed near zero."""
    tick = np.diff(sweep.time)
    turned = np.flatnonzero((np.diff(sweep.direction) != 0) | (tick > GAP * np.median(tick) if len(tick) else False))
    edges = [0, *(turned + 1).tolist(), len(sweep)]
    runs = [(a, b - 1) for a, b in pairwise(edges) if sweep.direction[a] and b - a > 1]
    way = sum(abs(float(sweep.angle[b] - sweep.angle[a])) for a, b in runs)
    took = sum(float(sweep.time[b] - sweep.time[a]) for a, b in runs)
    return way / took if took > 0 else 0.0


def escaped_rows(sweep: Sweep) -> Bools:
    """Rows (m,) of a sweep that belong to an escape: from where the rotor runs until it has been led beyond where it landed.

    A jump is asked over as few rows as the encoder allows: over more, the rows before it would be lost too. Slips of friction are shorter.
    """
    out = np.zeros(len(sweep), dtype=bool)
    pace = _led_pace(sweep)
    tick = float(np.median(np.diff(sweep.time))) if len(sweep) > 1 else 0.0
    if not pace or not tick:
        return out
    wide = max(1, int(np.ceil(ESCAPE_STEPS * sweep.step / (ESCAPE_SPEED * pace * tick))))
    if wide >= len(sweep):
        return out
    way = np.abs(sweep.angle[wide:] - sweep.angle[:-wide])
    run = (way > ESCAPE_SPEED * pace * (sweep.time[wide:] - sweep.time[:-wide])) & (
        sweep.direction[wide:] == sweep.direction[:-wide]
    )
    fast = np.zeros(len(sweep), dtype=bool)
    for k in range(wide + 1):
        fast[k : len(sweep) - wide + k] |= run
    fast &= sweep.used
    reach = max(LANDING, 4 * sweep.step)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], fast, [False]]).astype(np.int8)))
    for first, last in zip(ends[::2], ends[1::2], strict=True):
        d = sweep.direction[first]
        landed = float(np.max(sweep.angle[first:last] * d))
        if landed - sweep.angle[first] * d < ESCAPE_LEAST:
            continue
        # It stands, and the effort climbs at one angle, until it is led on.
        beyond = np.flatnonzero(sweep.angle[last:] * d > landed + reach)
        stop = last + int(beyond[0]) if len(beyond) else len(sweep)
        out[first:stop] = True
    return out

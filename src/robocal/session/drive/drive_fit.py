"""A motor in its logs: orders by held-out arcs, then the fit and the proof of every identification, with one lag for both directions and
with phases per direction; what held-out arcs prefer is taken.

    share = 1 - sum e^2 / sum e0^2    e of the motor over held-out arcs, e0 less the mean of each direction of each log
    noise = sqrt(mean (e_(i+1) - e_i)^2 / 2)    of rows that follow one another: what no curve explains

Intervals of the orders know that what is left is not white: where the orders around one leave more than the noise would, it is this
floor that its parts may be off by.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._record import record
from robocal._scipy import special
from robocal._types import Array, Bools
from robocal.diagnose.drive_limits import FLOOR_CHANCE, PREFER_SIDE
from robocal.drives.drive_sweep import Sweep, arc_of
from robocal.drives.moments import Moments, moments_of
from robocal.drives.motor import Motor, motor_of, order_names
from robocal.drives.order_choice import ChosenOrders, choose_orders
from robocal.fit.options import Options
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.session.drive.drive_data import drive_data, friction_free

__all__ = [
    "MotorFit",
    "choose",
    "fit_motor",
    "highest_order",
    "moments_of_sweeps",
    "noise_of",
    "other_direction",
    "prefer_directions",
]

HIGHEST = 300  # grid: four times the highest order that motors of robots are built with
REACH = np.radians(1.5)  # grid: the document's motor has less than three degrees between its directions, twice the lag
AROUND = 20  # grid: orders to each side, among which the floor is asked


@record(eq=False)
class MotorFit:
    """One form of a motor: its decision, the held-out share, the squares of errors that each arc leaves, and the floor: how many times
    the noise's own amplitude orders around each of its orders leave."""

    decision: Decision[Motor]
    share: float
    arcs: Array
    noise_ratio: Array

    @property
    def motor(self) -> Motor:
        """The motor as it was found."""
        return self.decision.corrected

    def sigma(self, name: str) -> float:
        """What a parameter may be off by, one standard deviation; NaN of one that was not fitted."""
        names, covariance = self.decision.spread
        if name not in names:
            return float("nan")
        own = float(np.sqrt(covariance[names.index(name), names.index(name)]))
        factor = {
            p: f
            for n, f in zip(self.motor.orders, self.noise_ratio, strict=True)
            for c in (False, True)
            for p in order_names(n, c)
        }
        return own * float(factor.get(name, 1.0))


def highest_order(sweeps: Sequence[Sweep], used: Sequence[Bools]) -> tuple[int, float]:
    """The highest order that is asked: below half the places per turn that were read; and how many these are."""
    places = []
    for sweep, rows in zip(sweeps, used, strict=True):
        for d in (1, -1):
            angle = sweep.angle[rows & (sweep.direction == d)]
            if len(angle):
                places.append(len(np.unique(np.round(angle, 9))) / max(np.ptp(angle) / (2 * np.pi), 1e-9))
    per_turn = float(min(places, default=0.0))
    return max(1, min(HIGHEST, int(per_turn / 2) - 1)), per_turn


def moments_of_sweeps(sweeps: Sequence[Sweep], used: Sequence[Bools], highest: int) -> Moments:
    """Moments of the rows that are used, without the friction of each log."""
    effort = [friction_free(s, rows) for s, rows in zip(sweeps, used, strict=True)]
    angle, direction = (
        np.concatenate([getattr(s, n)[rows] for s, rows in zip(sweeps, used, strict=True)])
        for n in ("angle", "direction")
    )
    return moments_of(angle, np.concatenate(effort), direction, arc_of(angle), highest)


def noise_of(made: Decision[Motor]) -> float:
    """The noise of rows that follow one another, in the unit of the effort."""
    squares, count = 0.0, 0
    for rows in made.residuals:
        # Rows of one arc and direction follow one another, but where the turn ends.
        same = np.diff(rows.configuration) == 0
        step = np.diff(rows.value[:, 0])[same]
        squares, count = squares + float(step @ step), count + len(step)
    return float(np.sqrt(squares / max(count, 1) / 2))


def other_direction(moments: Moments, orders: Sequence[int], lag: float) -> float:
    """The share of one direction that the harmonics of the other explain, with a lag between them; the lesser of the two."""
    shares = []
    for d in (1.0, -1.0):
        one, two = moments.of(d), moments.of(-d)
        if not len(one.n) or not len(two.n):
            return float("nan")
        x, _ = one.fit(orders, lag)
        x[:2] = 0.0
        a, b = (v.sum(axis=0) for v in two.normal(orders, lag))
        many, total = two.n.sum(), two.q.sum() - b[0] ** 2 / two.n.sum()
        left = two.q.sum() - 2 * x @ b + x @ a @ x - (b[0] - a[0] @ x) ** 2 / many
        shares.append(1 - left / total)
    return float(min(shares))


def choose(moments: Moments, most: int, eccentric: bool, loaded: bool = False) -> ChosenOrders:
    """Orders of a motor; of an eccentric encoder two numbers say what sidebands would, and what comes once per turn is a load's."""
    arcs = len(np.unique(moments.arc))
    quantile = float(special.stdtrit(max(arcs - 1, 1), PREFER_SIDE))

    def allowed(order: int, others: tuple[int, ...]) -> bool:
        return not (loaded and order == 1) and (not eccentric or not any(abs(order - n) == 1 for n in others))

    return choose_orders(moments, most, quantile, REACH, allowed)


def fit_motor(
    sweeps: Sequence[Sweep],
    used: Sequence[Bools],
    moments: Moments,
    orders: Sequence[int],
    *,
    by_direction: bool,
    eccentric: bool,
    name: str,
    slots: int | None,
    poles: int | None,
    watch: Watch | None,
) -> MotorFit:
    """One form of a motor, fitted to logs and proven on held-out arcs."""
    data = drive_data(sweeps, used)
    size = float(np.sqrt(moments.q.sum() / moments.n.sum()))
    both = len(np.unique(moments.direction)) > 1
    motor = motor_of(
        name, orders, sweeps[0].unit, size, by_direction=by_direction and both, eccentric=eccentric, lag=both, slots=slots, poles=poles
    )  # fmt: skip
    arcs = len(set(data.configurations.groups or ()))
    options = (
        Options(hold_out="group", folds=arcs, leave_one_out=False)
        if arcs > 1
        else Options(hold_out=0.0, leave_one_out=False)
    )
    made = decide(motor, data, options, watch)
    if made.proof is None:
        return MotorFit(made, float("nan"), np.zeros(0), np.ones(len(orders)))
    _, after, _ = made.errors
    # Friction that was held out with its arc would be off by what the low orders leave of the others: no variance of the effort.
    share = 1 - float(after @ after) / float(moments.q.sum())
    label = np.array(data.configurations.groups)[np.concatenate([o.configuration for o in data.observations])]
    every = np.array([float(np.sum(after[label == a] ** 2)) for a in np.unique(label)])
    return MotorFit(made, share, every, _floor(made, moments, orders))


def _floor(made: Decision[Motor], moments: Moments, orders: Sequence[int]) -> Array:
    """How many times the amplitude that white noise leaves at an order its neighbours have, (n,); 1 where chance explains it."""
    residual = list(made.residuals)
    data = made.need_data
    angle, direction = (
        np.concatenate([np.asarray(o.extra[n]) for o in data.observations]) for n in ("angle", "direction")
    )
    effort = np.concatenate([r.value[:, 0] for r in residual])
    left = moments_of(angle, effort, direction, np.zeros(len(angle), dtype=np.int64), moments.highest)
    amplitude = 2 * np.abs(left.y.sum(axis=0)) / len(effort)
    white = 4 * float(effort @ effort) / len(effort) ** 2  # the mean square of an amplitude under white noise
    out = np.ones(len(orders))
    free = np.setdiff1d(np.arange(1, moments.highest + 1), np.array(orders, dtype=np.int64))
    for i, n in enumerate(orders):
        near = free[np.abs(free - n) <= AROUND]
        if not len(near) or white <= 0:
            continue
        ratio = float(np.mean(amplitude[near] ** 2)) / white
        if ratio > special.chdtri(2 * len(near), FLOOR_CHANCE) / (2 * len(near)):
            out[i] = np.sqrt(ratio)
    return out


def prefer_directions(tried: Mapping[str, MotorFit]) -> MotorFit:
    """Of one lag and of phases per direction what held-out arcs prefer: the phases, where these leave surely less arc by arc."""
    if len(tried) < 2:
        return next(iter(tried.values()))
    one, other = tried["lag"], tried["directions"]
    gain = one.arcs - other.arcs
    if len(gain) < 2:
        return one
    quantile = float(special.stdtrit(len(gain) - 1, PREFER_SIDE))
    return other if gain.mean() > quantile * gain.std(ddof=1) / np.sqrt(len(gain)) else one

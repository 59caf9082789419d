"""What a drive asks of its motor: torque (N m) or current (A) at an angle that it moves through.

    r = offset + coulomb d + viscous w + inertia a + p cos(theta) + q sin(theta) + gain c(theta, d) - y,    c: as in `drives.cogging`

value (k, 1) and sigma (k, 1) in N m or A; extra["angle"] (k,) rad, extra["direction"] (k,) 1 or -1, extra["speed"] (k,) rad/s,
extra["acceleration"] (k,) rad/s^2. options["log"] names the log, whose numbers are the sensor's zero `log.offset`, friction
(`log.coulomb`, `log.viscous`), `log.inertia`, and the weight of a load, `log.weight_cos` p and `log.weight_sin` q: loaded and
detached, one motor has others.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.drives.motor import ECCENTRIC, GAIN, LAG, Motor, order_names
from robocal.errors import ModelError
from robocal.estimate.losses import Loss
from robocal.estimate.terms import Normal
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Number, Rows, number_names

__all__ = ["EffortRows", "effort_kind"]

LOG = 6  # numbers of a log
SINGLE = LOG + 4  # numbers before those of the orders: the log's, lag, gain, and the encoder's two
EXPECTED = 10.0  # of numbers of a log, in SI: nothing is known of them


class EffortRows(Rows):
    """The rows of one log; columns are those of the log's numbers, of the lag, the gain and the encoder, then of every order."""

    reading = True

    def __init__(self, builder: Builder, obs: Observations) -> None:
        motor = builder.machine.part(Motor)
        if motor is None:
            message = "readings of a drive are of a motor"
            raise ModelError(message, key=obs.label, found=builder.machine.name, expected="kind: motor")
        self.orders = np.array(motor.orders, dtype=float)
        self.changes = motor.by_direction
        names = [*number_names(obs), LAG, GAIN, *ECCENTRIC]
        for changes in (False, True) if self.changes else (False,):
            for part in (0, 1):
                names += [order_names(n, changes)[part] for n in motor.orders]
        super().__init__((), obs, np.arange(len(obs)), builder.rows(names))
        self.angle, self.direction = obs.extra["angle"], np.ascontiguousarray(obs.extra["direction"], dtype=float)
        fixed = (np.ones(len(obs)), self.direction, obs.extra["speed"], obs.extra["acceleration"])
        self.fixed = np.stack([*fixed, np.cos(self.angle), np.sin(self.angle)])
        # What was worked out of these rows once: the same whatever noise and free columns copies of them have.
        self._memory: dict[bool, tuple[Array, Array]] = {}

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        r, j = np.empty((len(x), rows, 1)), np.empty((len(x), rows, 1, len(self.own)))
        for b, values in enumerate(x[:, self.numbers]):
            r[b, :, 0], columns = self._one(values, first, rows)
            j[b, :, 0] = columns.T
        r -= self.values_at(which, first, rows)
        return r, j, np.empty((len(x), rows, 1, 0))

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        if loss.kind:
            return False
        square, at = self.scale[:, 0] ** 2, np.ix_(self.columns, self.columns)
        for b, values in enumerate(x[:, self.numbers]):
            w = weight[b if len(weight) > 1 else 0][self.configuration] * square
            r, j = self._one(values, 0, len(self.angle))
            r -= self.value[which[b] if len(self.value) > 1 else 0, :, 0]
            pull, heavy = w * r, w * j
            out.cost[b] += 0.5 * (r @ pull)
            out.g[b, self.columns] += j @ pull
            whole = np.zeros_like(out.a[b])
            whole[at] = heavy @ j.T
            out.a[b] += np.tril(whole)
        return True

    def _one(self, values: Array, first: int, rows: int) -> tuple[Array, Array]:
        """What one problem predicts (m,), and its Jacobian (k, m)."""
        at, n, count = slice(first, first + rows), self.orders, len(self.orders)
        d, fixed, (lag, gain, e_c, e_s) = self.direction[at], self.fixed[:, at], values[LOG:SINGLE]
        part = values[SINGLE:].reshape(-1, count) if count else np.zeros((4, 0))
        theta, moved = self.angle[at], bool(e_c or e_s)
        if moved:
            cos, sin = waves(theta + e_c * np.cos(theta) + e_s * np.sin(theta), n)
        else:
            if moved not in self._memory:
                self._memory[moved] = waves(self.angle, n)
            cos, sin = (wave[:, at] for wave in self._memory[moved])
        if lag:  # cos(v - d n L) = cos v cos(n L) + d sin v sin(n L), for d is 1, -1 or 0
            turn, back = np.where(d == 0, 1.0, np.cos(n * lag)[:, None]), np.outer(np.sin(n * lag), d)
            cos, sin = turn * cos + back * sin, turn * sin - back * cos
        a, b = part[0], part[1]
        curve = a @ cos + b @ sin
        if self.changes:
            curve += d * (part[2] @ cos + part[3] @ sin)
        predicted = values[:LOG] @ fixed + gain * curve
        out = np.empty((len(self.own), rows))
        if not len(self.own):
            return predicted, out
        slope = np.zeros(rows)
        if set(self.own.tolist()) & {LOG, LOG + 2, LOG + 3}:
            slope = (n * b) @ cos - (n * a) @ sin
            if self.changes:
                slope += d * ((n * part[3]) @ cos - (n * part[2]) @ sin)
        single = [*fixed, -gain * d * slope, curve, gain * slope * np.cos(theta), gain * slope * np.sin(theta)]
        for row, own in enumerate(self.own.tolist()):
            if own < SINGLE:
                out[row] = single[own]
            else:
                which, i = divmod(own - SINGLE, count)
                np.multiply((cos, sin)[which % 2][i], gain if which < 2 else gain * d, out=out[row])
        return predicted, out


def waves(angle: Array, orders: Array) -> tuple[Array, Array]:
    """cos(n angle) and sin(n angle), (n, m) each."""
    turns = np.multiply.outer(orders, angle)
    return np.cos(turns), np.sin(turns)


def effort_kind(name: str, unit: str) -> Kind:
    """A kind of such readings, by its unit."""
    speed, acceleration = (unit.replace(" ", "") + " " + per for per in ("s/rad", "s s/rad"))
    own = tuple(
        Number("log", symbol, of, expected=EXPECTED)
        for symbol, of in (
            ("offset", unit),
            ("coulomb", unit),
            ("viscous", speed),
            ("inertia", acceleration),
            ("weight_cos", unit),
            ("weight_sin", unit),
        )
    )

    def terms(builder: Builder, obs: Observations) -> list[Rows]:
        return [EffortRows(builder, obs)] if len(obs) else []

    return Kind(name, 1, terms, parts=((0, 1, unit),), numbers=own, unstated=1e-2, owner="log")

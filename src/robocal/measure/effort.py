"""What a drive asks of its motor: torque (N m) or current (A) at an angle that it moves through.

    r = offset + coulomb d + viscous w + inertia a + gain c(theta, d) - y,    c: the cogging of `drives.cogging`

value (k, 1) and sigma (k, 1) in N m or A; extra["angle"] (k,) rad, extra["direction"] (k,) 1 or -1, extra["speed"] (k,) rad/s,
extra["acceleration"] (k,) rad/s^2. options["log"] names the log, whose numbers are the sensor's zero `log.offset`, friction
(`log.coulomb`, `log.viscous`) and `log.inertia`: loaded and detached, one motor has others.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.drives.motor import ECCENTRIC, GAIN, LAG, Motor, order_names
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Number, Rows, number_names

__all__ = ["EffortRows", "effort_kind"]

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
        self.angle, self.direction = obs.extra["angle"], obs.extra["direction"]
        ones = np.ones(len(obs))
        # Columns of the log's own numbers, which nothing changes.
        self.fixed = np.column_stack([ones, self.direction, obs.extra["speed"], obs.extra["acceleration"]])
        self._waves: tuple[bytes, int, Array, Array] | None = None

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        out = np.empty((len(x), rows, 1)), np.empty((len(x), rows, 1, len(self.own)))
        for b, values in enumerate(x[:, self.numbers]):
            out[0][b, :, 0], out[1][b, :, 0] = self._one(values, first, rows)
        out[0][...] -= self.values_at(which, first, rows)
        return *out, np.empty((len(x), rows, 1, 0))

    def _one(self, values: Array, first: int, rows: int) -> tuple[Array, Array]:
        """What one problem predicts (m,), and its Jacobian (m, k)."""
        at, n = slice(first, first + rows), self.orders
        count = len(n)
        d, fixed = self.direction[at], self.fixed[at]
        theta = self.angle[at]
        lag, gain, e_c, e_s = values[4:8]
        part = values[8:].reshape(-1, count) if count else np.zeros((4, 0))
        u = theta + e_c * np.cos(theta) + e_s * np.sin(theta) - d * lag
        cos, sin = self._of_orders(u)
        a, b = part[0], part[1]
        curve = cos @ a + sin @ b
        slope = cos @ (n * b) - sin @ (n * a)
        if self.changes:
            curve += d * (cos @ part[2] + sin @ part[3])
            slope += d * (cos @ (n * part[3]) - sin @ (n * part[2]))
        whole = np.empty((rows, len(values)))
        whole[:, :4] = fixed
        whole[:, 4], whole[:, 5] = -gain * d * slope, curve
        whole[:, 6], whole[:, 7] = gain * slope * np.cos(theta), gain * slope * np.sin(theta)
        whole[:, 8 : 8 + count], whole[:, 8 + count : 8 + 2 * count] = gain * cos, gain * sin
        if self.changes:
            whole[:, 8 + 2 * count :] = d[:, None] * whole[:, 8 : 8 + 2 * count]
        return fixed @ values[:4] + gain * curve, whole[:, self.own]

    def _of_orders(self, u: Array) -> tuple[Array, Array]:
        """cos(n u) and sin(n u), (m, n)."""
        turns = np.multiply.outer(u, self.orders)
        return np.cos(turns), np.sin(turns)


def effort_kind(name: str, unit: str) -> Kind:
    """A kind of such readings, by its unit."""
    speed, acceleration = (unit.replace(" ", "") + " " + per for per in ("s/rad", "s s/rad"))
    own = tuple(
        Number("log", symbol, of, expected=EXPECTED)
        for symbol, of in (("offset", unit), ("coulomb", unit), ("viscous", speed), ("inertia", acceleration))
    )

    def terms(builder: Builder, obs: Observations) -> list[Rows]:
        return [EffortRows(builder, obs)] if len(obs) else []

    return Kind(name, 1, terms, parts=((0, 1, unit),), numbers=own, unstated=1e-2, owner="log")

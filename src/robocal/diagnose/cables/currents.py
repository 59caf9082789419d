"""Currents of winches that were read, beside the platform that they hold: whether any winches hold it so, and which column or row is wrong.

    W_j t_j + w_j = 0,    t = (n / R) (k i + c sgn(v) + b n v / R)      linear in k and in what friction is free

With the geometry as stated, a few centimetres off, a tension pulls a hundredth off its direction: only what is far beyond that counts.
All that is told of k, of n and of R is the tension of an ampere, n k / R.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Given, When, check, refuse
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.cable.winch_tensions import FRICTION, KT, friction_columns
from robocal.measure.data import DataSet, Observations
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["ALIKE", "GAIN", "ROW", "SWAPPED", "TURNED", "UNBALANCED", "UNLIKE", "currents"]

LEFT = ": they leave {left:.3g} of force, with that {after:.3g}"
SWAPPED = declare(
    "currents-exchanged",
    "the currents of {one} and {other} are exchanged" + LEFT,
    "Name their columns in the order of {one}, {other}.",
)
TURNED = declare(
    "current-turned",
    "the current of {cable} counts the other way" + LEFT,
    "Write it times -1, so that it is above zero where the motor pulls.",
)
UNLIKE = declare(
    "current-unlike",
    "the current of {cable} is none of the tension of this cable" + LEFT,
    "Check whether this column changes with the pose, and has the unit, the motor and the drum of the others.",
)
ALIKE = declare(
    "currents-shifted", "the currents stand {rows} rows too {where}" + LEFT, "Write each beside the id of its pose."
)
ROW = declare(
    "current-row",
    "the current of {cable} in row {row} is {value:.4g}, {times:.0f} times what is usual" + LEFT,
    "Correct or remove this row.",
)
UNBALANCED = declare(
    "currents-unbalanced",
    "no winches with these currents hold the platform: they leave {left:.3g} of force, its weight is {weight:.3g}",
    "Check the order of the columns, their unit and sign, and the platform's mass.",
)
GAIN = declare(
    "winch-gain",
    "an ampere pulls {times:.4g} times what is stated: these currents need {name} of {found:.4g}, and {stated:.4g} is stated[: {near}]",
    "Check the gear, the radius of the drum, the unit of the currents, the torque constant, and the platform's mass.",
)
# What an ampere pulls too much, and the mistake that makes it so.
FACTORS = {
    1e3: "a unit is a thousand times off",
    1e-3: "a unit is a thousand times off",
    2.0: "a diameter for a radius",
}
SHIFTS = (-3, -2, -1, 1, 2, 3)


@check("currents", When.READ, order=45, given=Given.ACCEPTED, needs=("data",))
def currents(context: Context[CableRobot]) -> Iterator[Finding]:
    """The currents of every file, at the poses that were measured, or from which a fit starts."""
    robot, data = context.model, context.need_data
    for obs in data.observations:
        if obs.kind == "winches" and "current" in obs.extra and "axis" in obs.extra:
            finding = _judge(robot, obs, WrenchBalance.of(robot, data, obs))
            if finding is not None:
                yield finding
                return


@record(eq=False)
class WrenchBalance:
    """Wrenches that tensions make, W (k, d, m), and that of the platform, w (k, d), of configurations `at` (k,) with currents (k, m) in A
    and speeds (k, m) in m/s; `body` (k, d, n) is what free numbers of the platform do."""

    obs: Observations
    at: Ints
    structure: Array
    wrench: Array
    body: Array
    current: Array
    speed: Array

    @classmethod
    def of(cls, robot: CableRobot, data: DataSet, obs: Observations) -> WrenchBalance:
        """Those of one file."""
        at, first = np.unique(obs.configuration, return_index=True)
        t, rows = _poses(robot, data)[at], list(robot.axes)
        still = gravity_wrench(t, float(robot.need("mass")), robot.com)[:, rows]
        free = obs.options.get("free")
        loose = [i for i, s in enumerate(("cx", "cy", "cz")) if isinstance(free, tuple) and s in free]
        more = [
            gravity_wrench(t, 1.0, np.eye(3)[i])[:, rows] - gravity_wrench(t, 1.0, np.zeros(3))[:, rows] for i in loose
        ]
        body = np.stack(more, axis=-1) if more else np.empty((*still.shape, 0))
        return cls(obs, at, structure_of(robot, t), still, body, obs.extra["current"][first], obs.extra["speed"][first])

    @property
    def free(self) -> tuple[str, ...]:
        """The symbols that somebody set free."""
        found = self.obs.options.get("free")
        return tuple(map(str, found)) if isinstance(found, tuple) else ()

    def tried(
        self, current: Array, kept: Array | None = None, without: int | None = None
    ) -> tuple[float, float, float]:
        """The force that is left (rms N), the tensions (rms N) and k, of the best numbers for such currents; of `kept` (k,) rows alone,
        or of whatever tension the cable `without` has."""
        columns = friction_columns(self.obs, current, self.speed)
        values = self.obs.options["values"]
        known = (
            {s: float(values.get(s, 0.0)) for s in FRICTION}
            if isinstance(values, dict)
            else dict.fromkeys(FRICTION, 0.0)
        )
        m, fixed = current.shape[1], np.zeros_like(current)
        parts = [columns[0][:, :, None] * np.ones(1)]
        for symbol, column in zip(FRICTION, columns[1:], strict=True):
            if symbol in self.free:
                parts.append(column[:, :, None] * np.eye(m))
            else:
                fixed = fixed + known[symbol] * column
        every = np.concatenate(parts, axis=2)  # (k, m, n): tensions by numbers
        w, load, body = self.structure, self.wrench + np.einsum("kdm,km->kd", self.structure, fixed), self.body
        if kept is not None:
            every, w, load, body, fixed = every[kept], w[kept], load[kept], body[kept], fixed[kept]
        a, y = np.concatenate([w @ every, body], axis=2), -load
        if without is not None:
            u = w[:, :, without] / np.linalg.norm(w[:, :, without], axis=1, keepdims=True)
            a = a - u[:, :, None] * np.einsum("kd,kdn->kn", u, a)[:, None]
            y = y - u * np.einsum("kd,kd->k", u, y)[:, None]
        x = np.linalg.lstsq(a.reshape(-1, a.shape[2]), y.ravel(), rcond=1e-12)[0]
        left = (a @ x - y)[:, : 3 if y.shape[1] == 6 else min(2, y.shape[1])]
        pull = fixed + every @ x[: every.shape[2]]
        return _rms(left), _rms(pull), float(x[0])


def _rms(rows: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))


def _poses(robot: CableRobot, data: DataSet) -> Array:
    """Poses (U, 4, 4) of the platform: as they were measured in the base's axes, else those from which a fit starts."""
    start = place_configurations(robot, data).configurations.start
    assert start is not None
    t = se3.from_vector(start)
    for obs in data.observations:
        frame = obs.frame
        if obs.kind != "pose" or (frame is not None and (any(frame.free) or frame.mount != "base")):
            continue
        of = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
        mounted = se3.from_vector([g.value for g in obs.targets] or [(0.0,) * 6])
        loose = np.array([any(g.free) or g.mount != "tool" for g in obs.targets] or [False])
        seen = se3.from_vector(obs.value) @ se3.inverse(mounted[of])
        if frame is not None:
            seen = se3.inverse(se3.from_vector([frame.value])) @ seen
        good = np.isfinite(seen).all(axis=(1, 2)) & ~loose[of]
        t[obs.configuration[good]] = seen[good]
    return t


def _judge(robot: CableRobot, obs: Observations, found: WrenchBalance) -> Finding | None:
    """What is wrong with these currents, if anything is."""
    weight = _rms(found.wrench[:, :3])
    if len(found.at) < limits.TENSION_POSES or not weight > 0 or not np.isfinite(found.structure).all():
        return None
    i = found.current
    left, pull, k = found.tried(i)
    if left > limits.TENSION_DIRECTIONS * pull:
        return _cause(robot, obs, found, left) or refuse(
            UNBALANCED, source=obs.source, left=Quantity(left, "N"), weight=Quantity(weight, "N")
        )
    return _gain(obs, found, k)


def _cause(robot: CableRobot, obs: Observations, found: WrenchBalance, left: float) -> Finding | None:
    """The one mistake with which the same currents hold the platform."""
    i, enough = found.current, limits.TENSION_CLEARLY * left
    m, names = i.shape[1], robot.cables

    def said(code: str, after: float, **numbers: str | int | float | Quantity) -> Finding:
        force = {"left": Quantity(left, "N"), "after": Quantity(after, "N")}
        return refuse(code, source=obs.source, **force, **numbers)

    usual = np.median(np.abs(i), axis=0)
    size = np.abs(i) / np.where(usual > 0, usual, 1.0)
    row, cable = (int(v) for v in np.unravel_index(int(size.argmax()), size.shape))
    after = found.tried(i, kept=np.delete(np.arange(len(i)), row))[0] if len(i) > limits.TENSION_POSES else left
    if after < enough:
        told = int(obs.rows[np.flatnonzero(obs.configuration == found.at[row])[0]]) if obs.rows is not None else row
        value, times = Quantity(float(i[row, cable]), "A"), float(size[row, cable])
        return said(ROW, after, cable=names[cable], row=told, value=value, times=times)
    turned = {c: found.tried(i * np.where(np.arange(m) == c, -1.0, 1.0))[0] for c in range(m)}
    if turned[c := min(turned, key=turned.__getitem__)] < enough:
        return said(TURNED, turned[c], cable=names[c])
    pairs = {pair: found.tried(_exchange(i, *pair))[0] for pair in combinations(range(m), 2)}
    if pairs[pair := min(pairs, key=pairs.__getitem__)] < enough:
        return said(SWAPPED, pairs[pair], one=names[pair[0]], other=names[pair[1]])
    late = {by: found.tried(np.roll(i, by, axis=0))[0] for by in SHIFTS if len(i) > 2 * abs(by)}
    if late and late[by := min(late, key=late.__getitem__)] < enough:
        return said(ALIKE, late[by], rows=abs(by), where="high" if by > 0 else "low")
    alone = {c: found.tried(i, without=c)[0] for c in range(m)} if m > found.wrench.shape[1] else {}
    if alone and alone[c := min(alone, key=alone.__getitem__)] < enough:
        return said(UNLIKE, alone[c], cable=names[c])
    return None


def _exchange(current: Array, one: int, other: int) -> Array:
    out = current.copy()
    out[:, [one, other]] = current[:, [other, one]]
    return out


def _gain(obs: Observations, found: WrenchBalance, k: float) -> Finding | None:
    """That an ampere pulls far more or less than is stated, where a prior or nobody lets it."""
    values, priors = obs.options["values"], obs.options.get("priors")
    assert isinstance(values, dict)
    stated = float(values[KT])
    prior = float(priors.get(KT, np.inf)) if isinstance(priors, dict) and KT in found.free else np.inf
    prior = prior if KT in found.free else 0.0
    if "mass" in found.free or k <= 0 or abs(k - stated) <= limits.PRIOR_SIGMA * prior:
        return None
    times = k / stated
    if 1 / limits.WINCH_GAIN < times < limits.WINCH_GAIN:
        return None
    near = next((w for f, w in FACTORS.items() if abs(times / f - 1) < limits.CELL_UNIT_NEAR), None)
    numbers = {"found": Quantity(k, "N m/A"), "stated": Quantity(stated, "N m/A")}
    return refuse(GAIN, source=obs.source, times=times, name=f"{obs.options['winches']}.{KT}", near=near, **numbers)

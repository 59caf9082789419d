"""Swivel angles: r = wrap(atan2(e2 . d, e1 . d) - s0_i - y), d = p + R b_i - a_i, one row per cable and configuration.

value (k, 1) and sigma (k, 1) in rad; extra["cable"] (k,) is the cable's number from 0; options["cables"] names the cables. A cable
leaves the frame in the plane of its pulley, which swivels about the pulley's axis: from e1 (the base's x across that axis) towards
e2 = axis x e1. Where the encoder of cable c counts from, s0, is the parameter `c.swivel`. The wheel's radius does not matter: axis and
cable lie in one plane. Do not bring a platform anchor below its frame anchor: the angle has no meaning there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.geometry import WHEEL, CableRobot
from robocal.errors import ModelError
from robocal.measure.bearing import wrap
from robocal.measure.builder import Builder
from robocal.measure.cable.cable_names import cable_names
from robocal.measure.cable.platform_rows import ENDS, PlatformRows, cable_robot_of, material_parameters
from robocal.measure.data import Observations
from robocal.measure.machine import Model
from robocal.measure.rows import Kind, Number, Rows, numbers, register
from robocal.parameters import Parameter

__all__ = ["SWIVEL", "across", "swivels", "zeros_at"]

SYMBOL = "swivel"
ANYWHERE = 1.0  # rad, of a zero that nobody has said
TINY = 1e-300
WHAT = "swivel angles"


def across(axis: Array) -> tuple[Array, Array]:
    """e1 and e2 (..., 3) of swivel axes (..., 3): unit vectors across each, e1 nearest to the base's x, of an axis along x to its y."""
    n = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
    one = _toward(n) - np.sum(_toward(n) * n, axis=-1, keepdims=True) * n
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return one, np.cross(n, one)


def _toward(n: Array) -> Array:
    return np.where(np.abs(n[..., :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])


def by_axis(d: Array, axis: Array, one: Array, two: Array) -> Array:
    """Derivatives (..., 3) of the angles of vectors d (..., 3) by the three numbers of swivel axes (..., 3), whose e1 turns with them.

    Where n moves by alpha e1 + beta e2 the angle moves by h (alpha Y - beta X) / (X^2 + Y^2) + beta (t . n) / (t . e1), with d = X e1 +
    Y e2 + h n and t the axis of the base to which e1 is nearest.
    """
    size = np.linalg.norm(axis, axis=-1, keepdims=True)
    n = axis / size
    x, y, h = (np.sum(d * e, axis=-1, keepdims=True) for e in (one, two, n))
    toward = _toward(n)
    tilt = np.sum(toward * n, axis=-1, keepdims=True) / np.sum(toward * one, axis=-1, keepdims=True)
    flat = np.maximum(x * x + y * y, TINY)
    return np.asarray((h * y / flat * one + (tilt - h * x / flat) * two) / size)


class Axes:
    """The swivel axes of a robot's pulleys as parameters: upright where a cable has no pulley."""

    def __init__(self, robot: CableRobot) -> None:
        self.names, *self._which = material_parameters(robot, WHEEL[1:])
        self.cables = len(robot.cables)
        owner, symbol = np.divmod(np.arange(7 * self.cables), 7)
        # Of every number of the rows: whose it is, and which of a cable's ten.
        self.of = np.concatenate([owner, self._which[0]]), np.concatenate([symbol, 7 + self._which[1]])

    def at(self, values: Array) -> Array:
        """Axes (B, cables, 3) from the numbers (B, n)."""
        out = np.tile([0.0, 0.0, 1.0], (len(values), self.cables, 1))
        out[:, self._which[0], self._which[1]] = values
        return out


def swivels(d: Array, one: Array, two: Array) -> tuple[Array, Array]:
    """Angles (...) of vectors d (..., 3) from e1 towards e2, and their gradient by d (..., 3)."""
    x, y = np.sum(d * one, axis=-1), np.sum(d * two, axis=-1)
    flat = np.maximum(x * x + y * y, TINY)[..., None]
    return np.arctan2(y, x), (x[..., None] * two - y[..., None] * one) / flat


class SwivelRows(PlatformRows):
    """The rows of all cables; columns are the carrier's, then the free numbers of every cable: its ends and its zero."""

    def __init__(self, builder: Builder, obs: Observations, cables: Sequence[str]) -> None:
        self.axes = Axes(cable_robot_of(builder.machine, WHAT))
        own = builder.rows([*(f"{c}.{s}" for c in cables for s in (*ENDS, SYMBOL)), *self.axes.names])
        super().__init__(builder, obs, np.arange(len(obs)), own)
        self.cable = obs.extra["cable"].astype(np.int64)

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        cable = self.cable[first : first + rows]
        seen, sight, _ = self.look(x, first, rows)
        t, j, jl = (a[:, sight] for a in seen)
        seven = 7 * self.axes.cables
        number = x[:, self.numbers[:seven]].reshape(len(x), -1, 7)[:, cable]
        n = self.axes.at(x[:, self.numbers[seven:]])[:, cable]
        one, two = across(n)
        turn = t[..., :3, :3]
        lever = np.einsum("bmij,bmj->bmi", turn, number[..., 3:6])
        d = t[..., :3, 3] + lever - number[..., :3]
        angle, slope = swivels(d, one, two)
        r = wrap(angle - number[..., 6] - self.values_at(which, first, rows)[..., 0])[..., None]
        by_pose = np.concatenate([slope, np.cross(lever, slope)], axis=-1)[:, :, None]
        by_number = np.concatenate(
            [-slope, np.einsum("bmij,bmi->bmj", turn, slope), -np.ones((*slope.shape[:2], 1)), by_axis(d, n, one, two)], axis=-1
        )  # fmt: skip
        owner, symbol = (v[self.own] for v in self.axes.of)
        mine = (owner == cable[:, None]) * by_number[..., symbol]
        return r, np.concatenate([by_pose @ j, mine[:, :, None]], axis=3), by_pose @ jl


def zeros_at(machine: Model, obs: Observations, index: Ints, pose: Array) -> dict[str, float]:
    """The zero of every cable's encoder by name, where the platform stood at poses (k, 4, 4) when rows `index` (k,) were read: the
    mean direction of what is shown beyond the angle of the robot's ends."""
    names = cable_names(obs, WHAT)
    cable = obs.extra["cable"][index].astype(np.int64)
    robot = cable_robot_of(machine, WHAT)
    end = robot.numbers[cable, :6]
    wheels = robot.pulleys
    axis = np.tile([0.0, 0.0, 1.0], (len(names), 1)) if wheels is None else np.asarray(wheels.axis, float)
    one, two = (e[cable] for e in across(axis))
    d = pose[:, :3, 3] + np.einsum("kij,kj->ki", pose[:, :3, :3], end[:, 3:]) - end[:, :3]
    beyond = np.exp(1j * (swivels(d, one, two)[0] - obs.value[index, 0]))
    return {
        f"{c}.{SYMBOL}": float(np.angle(beyond[cable == i].sum())) for i, c in enumerate(names) if (cable == i).any()
    }


def parameters(obs: Observations) -> list[Parameter]:
    """The zero of every cable's encoder; all start from the one value that is stated, or are free from 0."""
    zero = [Number("zero", SYMBOL, "rad", expected=ANYWHERE)]
    own = (replace(obs, options={**obs.options, "zero": c}, group=obs.label) for c in cable_names(obs, WHAT))
    return [p for of_cable in own for p in numbers(of_cable, zero)]


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all cables."""
    cables, names = builder.machine.parts.get("cable", ()), cable_names(obs, WHAT)
    if names != cables:
        expected = ", ".join(cables) or "cables"
        raise ModelError("swivel angles are of the cables of a cable robot", found=", ".join(names), expected=expected)
    cable_robot_of(builder.machine, WHAT).need_straight(fixed=True)
    return [SwivelRows(builder, obs, names)] if len(obs) else []


SWIVEL = register(Kind("swivel", 1, terms, parameters, ((0, 1, "rad"),), unstated=2e-3))

"""What the rows of all cables of a platform share: the robot that they are of, the poses that they look at, and its pulleys and
elasticities as parameters of the lengths that are read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.geometry import STRETCH, WHEEL, CableRobot
from robocal.cables.pulley import Pulleys, by_wheel, run
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.machine import Model
from robocal.measure.rows import SightRows

__all__ = ["ENDS", "Material", "PlatformRows", "cable_names", "cable_robot_of", "material_parameters"]

EVERY = slice(None)
ENDS = ("ax", "ay", "az", "bx", "by", "bz")


def cable_robot_of(model: Model, what: str) -> CableRobot:
    """The cable robot of a machine. Raises ModelError where it has none; `what` was measured."""
    robot = model.part(CableRobot)
    if robot is None:
        raise ModelError(f"{what} need a cable robot", found=model.name, expected="kind: cable")
    return robot


def cable_names(obs: Observations, what: str) -> tuple[str, ...]:
    """The names of the cables that some observations state. Raises ModelError where they state none; `what` needs them."""
    names = obs.options.get("cables")
    if not isinstance(names, tuple) or not names:
        raise ModelError(f"{what} need the names of the cables", key=obs.label, expected="options['cables']")
    return names


class PlatformRows(SightRows):
    """Rows of many cables at each configuration, which all look at the platform's one pose there."""

    def __init__(self, builder: Builder, obs: Observations, index: Ints, numbers: Ints) -> None:
        configurations, sight = np.unique(obs.configuration[index], return_inverse=True)
        super().__init__(builder.tool(configurations), obs, index, numbers, np.ascontiguousarray(sight.ravel()))


def material_parameters(robot: CableRobot, symbols: Sequence[str]) -> tuple[list[str], Ints, Ints]:
    """The parameters that stand for such numbers of the cables, where a cable has one: names, whose each is (n,), and which of the
    symbols (n,)."""
    every = [(i, s) for i, _ in enumerate(robot.cables) for s, _ in enumerate(symbols)]
    some = [(i, s) for i, s in every if robot.row(f"{robot.cables[i]}.{symbols[s]}") in robot.table]
    owner, symbol = np.array(some, dtype=np.int64).reshape(-1, 2).T
    return [robot.row(f"{robot.cables[i]}.{symbols[s]}") for i, s in some], owner, symbol


class Material:
    """Which rows of a robot's table say how its pulleys are and how its cables stretch, and what lengths owe to them.

    `names` are a name for every such number, cable by cable; two cables that have one in common name it twice. Where no tension
    (m,) was read beside the lengths, cables do not stretch.
    """

    def __init__(self, robot: CableRobot, tension: Array | None, cable: Ints) -> None:
        symbols = WHEEL if tension is None else (*WHEEL, STRETCH)
        self.names, self.owner, self.symbol = material_parameters(robot, symbols)
        self.stated = np.array([robot.table[n].value for n in self.names])
        self.cables, self.cable = len(robot.cables), cable
        self.tension = np.zeros(len(cable)) if tension is None else tension

    def _every(self, values: Array) -> Array:
        """Numbers (cables, 5) in the order of WHEEL and STRETCH; eyelets and stiff cables where there are none."""
        out = np.tile([0.0, 0.0, 0.0, 1.0, 0.0], (self.cables, 1))
        out[self.owner, self.symbol] = values
        return out

    def at(self, values: Array, part: slice = EVERY, tension: Array | None = None) -> tuple[Array, Array, Array]:
        """Radii (cables,), axes of length 1 (cables, 3), and what stretch leaves of the length in some rows, (m,), under their tensions
        (m,) where others than those that were read are told."""
        every = self._every(values)
        size = np.linalg.norm(every[:, 1:4], axis=1, keepdims=True)
        pull = self.tension[part] if tension is None else tension
        return every[:, 0], every[:, 1:4] / size, 1.0 / (1.0 + every[self.cable[part], 4] * pull)

    def slopes(self, values: Array, pose: Array, numbers: Array, part: slice, tension: Array) -> tuple[Array, Array]:
        """Derivatives (m, n) of the lengths without stretch by the numbers, and of what stretch leaves of them, over the share that
        it leaves; and by the tension (m,). pose (m, 4, 4) and tension (m,) of every row, numbers (cables, 7)."""
        every, cable = self._every(values), self.cable[part]
        own = numbers[cable]
        d = pose[:, :3, 3] + np.einsum("mij,mj->mi", pose[:, :3, :3], own[:, 3:6]) - own[:, :3]
        size = np.linalg.norm(every[:, 1:4], axis=1)
        wheel = Pulleys(every[cable, 0], every[cable, 1:4] / size[cable, None])
        slope = np.empty((len(cable), 5))
        slope[:, :4] = by_wheel(d, wheel)
        slope[:, 1:4] /= size[cable, None]
        less = -run(d, wheel)[0] / (1.0 + every[cable, 4] * tension)
        slope[:, 4] = less * tension
        return np.where(self.owner == cable[:, None], slope[:, self.symbol], 0.0), less * every[cable, 4]

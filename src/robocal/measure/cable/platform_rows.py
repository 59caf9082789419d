"""What the rows of all cables of a platform share: the robot that they are of, the poses that they look at, and its pulleys and
elasticities as parameters of the lengths that are read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.cables.geometry import RAIL, STRETCH, WHEEL, CableRobot
from robocal.cables.pulley import Pulleys, by_wheel, run
from robocal.cables.rail import by_rail, offset
from robocal.errors import ModelError
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.machine import Model
from robocal.measure.rows import SightRows

__all__ = ["ENDS", "Material", "PlatformRows", "cable_robot_of", "material_parameters"]

EVERY = slice(None)
ENDS = ("ax", "ay", "az", "bx", "by", "bz")


def cable_robot_of(model: Model, what: str) -> CableRobot:
    """The cable robot of a machine. Raises ModelError where it has none; `what` was measured."""
    robot = model.part(CableRobot)
    if robot is None:
        raise ModelError(f"{what} need a cable robot", found=model.name, expected="kind: cable")
    return robot


class PlatformRows(SightRows):
    """Rows of many cables at each configuration, which all look at the platform's one pose there."""

    def __init__(self, builder: Builder, obs: Observations, index: Ints, numbers: Ints) -> None:
        configurations, sight = np.unique(obs.configuration[index], return_inverse=True)
        super().__init__(builder.tool(configurations), obs, index, numbers, np.ascontiguousarray(sight.ravel()))


def material_parameters(robot: CableRobot, symbols: Sequence[str]) -> tuple[list[str], Ints, Ints]:
    """The parameters that stand for such numbers of the segments, where one has it: names, whose each is (n,), and which of the
    symbols (n,)."""
    ways = robot.segments
    every = {
        (i, s): robot.row(f"{robot.cables[cable] if symbol == STRETCH else segment}.{symbol}")
        for i, (segment, cable) in enumerate(zip(ways.names, ways.cable, strict=True))
        for s, symbol in enumerate(symbols)
    }
    some = {at: name for at, name in every.items() if name in robot.table}
    owner, symbol = np.array(list(some), dtype=np.int64).reshape(-1, 2).T
    return list(some.values()), owner, symbol


class Material:
    """Which rows of a robot's table say how pulleys and rails are and how its cables stretch, and what lengths owe to them.

    Its rows are those of segments, segment (m,). `names` are a name for every such number, segment by segment; two that have one in
    common name it twice. Where no tension (m,) was read beside the lengths, cables do not stretch. carriage (m,) in m is what was read of
    the carriage on a rail, not a number where it stands as the robot says.
    """

    def __init__(self, robot: CableRobot, tension: Array | None, segment: Ints, carriage: Array | None = None) -> None:
        symbols = (*WHEEL, *RAIL) if tension is None else (*WHEEL, *RAIL, STRETCH)
        self.names, self.owner, self.symbol = material_parameters(robot, symbols)
        self.stated = np.array([robot.table[n].value for n in self.names])
        self.segment, self.times = segment, robot.segments.times
        self.railed = robot.rails is not None
        self.tension = np.zeros(len(segment)) if tension is None else tension
        self.carriage = np.full(len(segment), np.nan) if carriage is None else carriage

    def _every(self, values: Array) -> Array:
        """Numbers (segments, 10) in the order of WHEEL, RAIL and STRETCH; eyelets, points and stiff cables where there are none."""
        out = np.tile([0.0, 0.0, 0.0, 1.0, *(0.0,) * 6], (len(self.times), 1))
        out[self.owner, self.symbol] = values
        return out

    def at(self, values: Array, part: slice = EVERY, tension: Array | None = None) -> tuple[Array, Array, Array]:
        """Radii (segments,), axes of length 1 (segments, 3), and by what some rows are multiplied, (m,): how often a cable runs along the
        segment, times what stretch leaves under tensions (m,), where others than those that were read are told."""
        every, own = self._every(values), self.segment[part]
        size = np.linalg.norm(every[:, 1:4], axis=1, keepdims=True)
        pull = self.tension[part] if tension is None else tension
        return every[:, 0], every[:, 1:4] / size, self.times[own] / (1.0 + every[own, 9] * pull)

    def carry(self, values: Array, part: slice) -> Array:
        """How far the anchors of some rows are from the origins of their rails, (m, 3)."""
        rails = self._every(values)[self.segment[part], 4:9]
        return offset(rails, self._readings(rails, part))

    def _readings(self, rails: Array, part: slice) -> Array:
        read = self.carriage[part]
        return np.where(np.isnan(read), rails[:, 0], read)

    def slopes(self, values: Array, pose: Array, ends: Array, part: slice, tension: Array) -> tuple[Array, Array]:
        """Derivatives (m, n) of the lengths without stretch by the numbers, and of what stretch leaves of them, over the share that
        it leaves; and by the tension (m,). pose (m, 4, 4), ends (m, 7) and tension (m,) of every row."""
        every, own = self._every(values), self.segment[part]
        d = pose[:, :3, 3] + np.einsum("mij,mj->mi", pose[:, :3, :3], ends[:, 3:6]) - ends[:, :3]
        size = np.linalg.norm(every[own, 1:4], axis=1)
        wheel = Pulleys(every[own, 0], every[own, 1:4] / size[:, None])
        slope = np.zeros((len(own), 10))
        slope[:, :4] = by_wheel(d, wheel)
        slope[:, 1:4] /= size[:, None]
        full, u = run(d, wheel)
        if self.railed:
            rails = every[own, 4:9]
            slope[:, 4:9] = by_rail(rails, -u, self._readings(rails, part))
            slope[:, 4] = np.where(np.isnan(self.carriage[part]), by_rail(rails, -u)[:, 0], 0.0)
        less = -full / (1.0 + every[own, 9] * tension)
        slope[:, 9] = less * tension
        return np.where(self.owner == own[:, None], slope[:, self.symbol], 0.0), less * every[own, 9]

"""How the lengths of a robot's cables follow its pose and its parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.geometry import SYMBOLS, WHEEL, CableRobot, lengths
from robocal.cables.pulley import by_wheel

__all__ = ["by_parameters"]


def by_parameters(robot: CableRobot, poses: ArrayLike, names: Sequence[str]) -> tuple[Array, Array]:
    """Gradients of the lengths without stretch at poses (k, 4, 4): L (k, m, 6) by the twist (v, w), and (k, m, n) by the parameters
    `names`, of anchors, zeros and pulleys."""
    t = np.asarray(poses, float)
    at = {n: i for i, n in enumerate(names)}
    by_pose, out = np.empty((len(t), len(robot.cables), 6)), np.zeros((len(t), len(robot.cables), len(names)))
    for i, cable in enumerate(robot.cables):
        _, one, own = lengths(t[None], robot.numbers[i][None], robot.pulley(i))
        by_pose[:, i] = one[0]
        columns = list(zip(SYMBOLS, own[0].T, strict=True))
        wheel = robot.pulley(i)
        if wheel is not None and wheel.radius != 0.0:
            a, b = robot.numbers[i, :3], robot.numbers[i, 3:6]
            columns += zip(WHEEL, by_wheel(t[:, :3, 3] + t[:, :3, :3] @ b - a, wheel).T, strict=True)
        for symbol, column in columns:
            if (where := at.get(robot.row(f"{cable}.{symbol}"))) is not None:
                out[:, i, where] += column
    return by_pose, out

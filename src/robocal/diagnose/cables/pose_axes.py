"""Poses of a list that were written in other axes than the lengths: mirrored, exchanged, or their orientations inverted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.geometry import CableRobot
from robocal.diagnose.limits import COLUMN_CLEARLY, COLUMN_LEAVES, COLUMN_POSES
from robocal.errors import ModelError

__all__ = ["Turned", "find_pose_axes"]

Kind = Literal["position", "pose", "orientation"]
REFLECTIONS = {
    "x has the wrong sign": (0, 1, 2, -1, 1, 1), "y has the wrong sign": (0, 1, 2, 1, -1, 1), "z has the wrong sign": (0, 1, 2, 1, 1, -1),
    "x and y are exchanged": (1, 0, 2, 1, 1, 1), "x and z are exchanged": (2, 1, 0, 1, 1, 1), "y and z are exchanged": (0, 2, 1, 1, 1, 1),
}  # fmt: skip


@dataclass(frozen=True)
class Turned:
    """What explains the lengths: of positions alone, of whole poses (a left-handed frame), or of orientations; what anchors of every
    cable by itself leave as stated and with that, rms m."""

    kind: Kind
    what: str
    stated: float
    left: float


def find_pose_axes(robot: CableRobot, poses: ArrayLike, readings: ArrayLike) -> Turned | None:
    """The other axes in which poses (n, 4, 4) explain readings (n, m), NaN where there is none; None where they do as they are, or where
    nothing does."""
    t, y = np.asarray(poses, float), np.asarray(readings, float)
    if len(robot.axes) < 6 or len(y) < COLUMN_POSES or np.isfinite(y).sum(axis=0).min() < COLUMN_POSES:
        return None
    spread = float(np.linalg.norm(np.std(t[:, :3, 3], axis=0)))
    stated = _left(robot, t, y)
    if stated is None or stated <= COLUMN_LEAVES * spread / COLUMN_CLEARLY:
        return None
    tried = [(left, kind, what) for kind, what, moved in _others(t) if (left := _left(robot, moved, y)) is not None]
    if not tried:
        return None
    left, kind, what = min(tried, key=lambda v: v[0])
    return (
        Turned(kind, what, stated, left) if COLUMN_CLEARLY * left <= stated and left <= COLUMN_LEAVES * spread else None
    )


def _left(robot: CableRobot, poses: Array, readings: Array) -> float | None:
    try:
        return float(np.sqrt(np.mean(per_cable(robot, poses, readings).left[0] ** 2)))
    except ModelError:
        return None


def _others(t: Array) -> Iterator[tuple[Kind, str, Array]]:
    for what, numbers in REFLECTIONS.items():
        s = np.zeros((3, 3))
        s[range(3), numbers[:3]] = numbers[3:]
        moved = t.copy()
        moved[:, :3, 3] = t[:, :3, 3] @ s.T
        yield "position", what, moved
        both = moved.copy()
        both[:, :3, :3] = s @ t[:, :3, :3] @ s.T
        yield "pose", what, both
    inverted = t.copy()
    inverted[:, :3, :3] = t[:, :3, :3].swapaxes(1, 2)
    yield "orientation", "inverted", inverted

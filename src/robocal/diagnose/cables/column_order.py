"""Whether lengths stand in each other's columns: each column is fitted by each platform anchor, and the best pairing is looked at.

A cable whose frame anchor and zero are free fits lengths of its own platform anchor down to their noise, and those of another one
only as far as the platform does not turn. Nothing is taken from the robot but its platform anchors, so it stands whatever is wrong
with frame anchors and zeros, and wherever the instrument is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.geometry import CableRobot
from robocal.diagnose.limits import COLUMN_CLEARLY, COLUMN_LEAVES, COLUMN_POSES
from robocal.errors import ModelError

__all__ = ["Exchange", "find_exchange"]


@dataclass(frozen=True)
class Exchange:
    """Column j holds what belongs to cable `of` [j]; what the cables concerned leave as stated and with that (m, rms), and whether
    frame anchors say that it is the platform anchors in the robot file that are exchanged, not the columns."""

    of: tuple[int, ...]
    stated: float
    left: float
    anchors: bool

    @property
    def wrong_columns(self) -> tuple[int, ...]:
        """The columns that hold another cable."""
        return tuple(j for j, i in enumerate(self.of) if i != j)


def find_exchange(robot: CableRobot, poses: ArrayLike, readings: ArrayLike) -> Exchange | None:
    """The exchange that explains poses (n, 4, 4), in anybody's coordinates, and readings (n, m) in m, NaN where there is none; None
    where as stated is as good, and where the list cannot tell."""
    from scipy.optimize import linear_sum_assignment

    y, m = np.asarray(readings, float), len(robot.cables)
    if len(y) < COLUMN_POSES or np.isfinite(y).sum(axis=0).min() < COLUMN_POSES:
        return None
    left, found = np.empty((m, m)), np.empty((m, m, 3))
    for i in range(m):  # every column by platform anchor i
        same = {robot.row(f"{c}.b{s}"): float(v) for c in robot.cables for s, v in zip("xyz", robot.b[i], strict=True)}
        try:
            fit = per_cable(replace(robot, table=robot.table.with_values(same)), poses, y)
        except ModelError:
            return None
        left[i], found[i] = fit.left[0], fit.anchors[0]
    if not np.isfinite(left).all():
        return None
    # The product of what is left: a cable that fits badly anyhow does not outweigh those that fit.
    rows, columns = linear_sum_assignment(np.log(np.maximum(left, 1e-12)))
    of = tuple(int(i) for i in rows[np.argsort(columns)])
    moved = [j for j, i in enumerate(of) if i != j]
    if not moved:
        return None
    stated, new = (float(np.sqrt(np.mean([left[i, j] ** 2 for i, j in pairs]))) for pairs in (
        [(j, j) for j in moved], [(of[j], j) for j in moved],
    ))  # fmt: skip
    spread = float(np.linalg.norm(np.std(np.asarray(poses, float)[:, :3, 3], axis=0)))
    if not (COLUMN_CLEARLY * new <= stated and new <= COLUMN_LEAVES * spread):
        return None
    here = np.array([found[of[j], j] for j in range(m)])
    as_columns, as_cables = (_unlike(here, robot.a[list(order)]) for order in (range(m), of))
    return Exchange(of, stated, new, as_columns < as_cables)


def _unlike(a: Array, b: Array) -> float:
    """How far the distances among points (m, 3) differ from those among others."""
    one, two = (np.linalg.norm(p[:, None] - p[None], axis=2) for p in (a, b))
    return float(np.abs(one - two).sum())

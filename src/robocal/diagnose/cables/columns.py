"""Lengths that stand in each other's columns, or poses in other axes, by poses that were measured.

Columns: each is fitted by each platform anchor, and the best pairing is looked at. A cable whose frame anchor and zero are free fits
lengths of its own platform anchor down to their noise, and those of another one only as far as the platform does not turn. Nothing
is taken from the robot but its platform anchors, so it stands whatever is wrong with frame anchors and zeros, and wherever the
instrument is. Axes: poses may be mirrored, exchanged, or their orientations inverted.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.geometry import CableRobot
from robocal.diagnose.check_registry import Context, Finding, Given, When, check, once, refuse
from robocal.diagnose.limits import AXES_SIMPLER, COLUMN_CLEARLY, COLUMN_LEAVES, COLUMN_POSES
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.measure.data import Observations
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = [
    "ANCHORS",
    "AXES",
    "LENGTHS",
    "Exchange",
    "Turned",
    "beside_poses",
    "columns",
    "find_exchange",
    "find_pose_axes",
]

GAIN = ": with that, what they leave falls from {stated:.3g} to {left:.3g}"
RIGHT = "Give poses in right-handed axes, T_base_platform."
AXES = {
    "position": declare("position-axes", "in the positions {what}" + GAIN, RIGHT),
    "orientation": declare("orientations-inverted", "the orientations are inverted" + GAIN, RIGHT),
    "pose": declare("left-handed-poses", "the poses are of a left-handed frame ({what})" + GAIN, RIGHT),
}
ANCHORS = declare(
    "anchors-exchanged",
    "the platform anchors of {names} are exchanged" + GAIN,
    "Write the platform anchors in the order of {right}.",
)
LENGTHS = declare("lengths-exchanged", "the lengths of {names} are exchanged" + GAIN, "Write {line}.")


@check("columns", When.READ, order=30, given=Given.ACCEPTED, needs=("data",))
def columns(context: Context[CableRobot]) -> Iterator[Finding]:
    """Wrong axes are one mistake, exchanged cables are several: the former may leave somewhat more."""
    robot, seen = context.model, beside_poses(context)
    if seen is None:
        return
    read, pose, t, y = seen
    order, axes = find_exchange(robot, t, y), find_pose_axes(robot, t, y)
    if axes is not None and (order is None or axes.left <= AXES_SIMPLER * order.left):
        amounts = {"stated": Quantity(axes.stated), "left": Quantity(axes.left)}
        yield refuse(AXES[axes.kind], source=pose.source, what=axes.what, **amounts)
    elif order is not None:
        names = " and ".join(robot.cables[j] for j in order.wrong_columns)
        right = ", ".join(robot.cables[i] for i in order.of)
        amounts = {"stated": Quantity(order.stated), "left": Quantity(order.left)}
        line = _line(robot, read.options.get("columns"), order)
        yield refuse(
            ANCHORS if order.anchors else LENGTHS, source=read.source, names=names, right=right, line=line, **amounts
        )


def _line(robot: CableRobot, columns: object, order: Exchange) -> str:
    """What to write: columns that are called as cables are read by their names, wherever the data file lists them."""
    told = [str(c) for c in columns] if isinstance(columns, tuple) else []
    if sorted(told) == sorted(robot.cables) or not told:
        own = {c: robot.cables[order.of[robot.cables.index(c)]] for c in told or robot.cables}
        return f"the titles {', '.join(own.values())} where the table has {', '.join(own)}"
    return f"columns: [{', '.join(told[j] for j in np.argsort(order.of))}]"


@once
def beside_poses(context: Context[CableRobot]) -> tuple[Observations, Observations, Array, Array] | None:
    """The lengths, the poses beside them, and both where the platform was seen, (n, 4, 4) and (n, m), NaN where no length is; None where
    there is not one file of each."""
    robot, data = context.model, context.need_data
    lengths = [o for o in data.observations if o.kind == "lengths"]
    poses = [o for o in data.observations if o.kind == "pose" and not (o.frame is not None and o.frame.mount == "tool")]
    if len(lengths) != 1 or len(poses) != 1 or not robot.segments.is_plain or "carriage" in lengths[0].extra:
        return None
    (read,), (pose,) = lengths, poses
    mounted = se3.from_vector([t.value for t in pose.targets] or [(0.0,) * 6])
    which = np.zeros(len(pose), dtype=np.int64) if pose.target is None else pose.target
    t = np.full((len(data.configurations), 4, 4), np.nan)
    t[pose.configuration] = se3.from_vector(pose.value) @ se3.inverse(mounted[which])
    y = np.full((len(data.configurations), len(robot.cables)), np.nan)
    y[read.configuration, read.extra["cable"].astype(np.int64)] = read.value[:, 0]
    known = np.isfinite(t).all(axis=(1, 2))
    return read, pose, t[known], y[known]


@record
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
    stated, new = (float(np.sqrt(np.mean(left[rows, moved] ** 2))) for rows in (moved, [of[j] for j in moved]))
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


Kind = Literal["position", "pose", "orientation"]
REFLECTIONS = {
    "x has the wrong sign": (0, 1, 2, -1, 1, 1), "y has the wrong sign": (0, 1, 2, 1, -1, 1), "z has the wrong sign": (0, 1, 2, 1, 1, -1),
    "x and y are exchanged": (1, 0, 2, 1, 1, 1), "x and z are exchanged": (2, 1, 0, 1, 1, 1), "y and z are exchanged": (0, 2, 1, 1, 1, 1),
}  # fmt: skip


@record
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
    explained = COLUMN_CLEARLY * left <= stated and left <= COLUMN_LEAVES * spread
    return Turned(kind, what, stated, left) if explained else None


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

"""Lengths that stand in each other's columns, or poses in other axes, by poses that were measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.diagnose.cables.column_order import find_exchange
from robocal.diagnose.cables.pose_axes import find_pose_axes
from robocal.diagnose.check_registry import Context, Finding, Given, When, check, refuse
from robocal.diagnose.limits import AXES_SIMPLER
from robocal.geometry import se3
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["ANCHORS", "AXES", "LENGTHS", "columns"]

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
LENGTHS = declare(
    "lengths-exchanged", "the lengths of {names} are exchanged" + GAIN, "Name columns that hold {right} in this order."
)


@check("columns", When.READ, order=30, given=Given.ACCEPTED, needs=("data",))
def columns(context: Context[CableRobot]) -> Iterator[Finding]:
    """Wrong axes are one mistake, exchanged cables are several: the former may leave somewhat more."""
    robot, data = context.model, context.need_data
    lengths = [o for o in data.observations if o.kind == "lengths"]
    poses = [o for o in data.observations if o.kind == "pose" and not (o.frame is not None and o.frame.mount == "tool")]
    if len(lengths) != 1 or len(poses) != 1:
        return
    (read,), (pose,) = lengths, poses
    mounted = (
        np.eye(4)[None] if not pose.targets else np.stack([se3.from_vector(np.array(t.value)) for t in pose.targets])
    )
    which = np.zeros(len(pose), dtype=np.int64) if pose.target is None else pose.target
    t = np.full((len(data.configurations), 4, 4), np.nan)
    t[pose.configuration] = se3.from_vector(pose.value) @ se3.inverse(mounted[which])
    y = np.full((len(data.configurations), len(robot.cables)), np.nan)
    y[read.configuration, read.extra["cable"].astype(np.int64)] = read.value[:, 0]
    known = np.isfinite(t).all(axis=(1, 2))
    order, axes = find_exchange(robot, t[known], y[known]), find_pose_axes(robot, t[known], y[known])
    if axes is not None and (order is None or axes.left <= AXES_SIMPLER * order.left):
        amounts = {"stated": Quantity(axes.stated), "left": Quantity(axes.left)}
        yield refuse(AXES[axes.kind], source=pose.source, what=axes.what, **amounts)
    elif order is not None:
        yield refuse(
            ANCHORS if order.anchors else LENGTHS,
            source=read.source,
            names=" and ".join(robot.cables[j] for j in order.wrong_columns),
            right=", ".join(robot.cables[i] for i in order.of),
            stated=Quantity(order.stated),
            left=Quantity(order.left),
        )

"""A URDF for an arm that did not come from one: the same kinematics, joint by joint, with nothing but the joint axes
and the tool.

With the arm at zero every link frame is parallel to the base and lies on its joint's axis, at the foot of the
perpendicular from the frame before it. So every origin has xyz only, the axis carries the direction, and no angle is
rounded but the tool's.
"""

from __future__ import annotations

import math
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.arms.denavit import axes_at_zero
from robocal.errors import ModelError
from robocal.files.orientation import to_rpy
from robocal.files.units import number
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["urdf_text"]

Array = NDArray[np.float64]


def urdf_text(chain: Chain) -> tuple[str, tuple[Remark, ...]]:
    """The URDF of an arm and notes on it. Raises ModelError when a joint's gain is not 1, which a URDF cannot say."""
    axes, points, gains, tool = axes_at_zero(chain)
    for joint, gain in zip(chain.joints, gains, strict=True):
        if abs(gain - 1.0) > 1e-12:
            # A gain of -1 is an axis that points the other way; anything else has no place.
            raise ModelError(
                "a URDF cannot hold a joint's gain",
                key=f"{joint.name}.gain",
                found=float(gain),
                expected="--format yaml",
            )
    lines = ['<?xml version="1.0"?>', "<!-- Written by robocal. Joint values are those of the model; lengths in m. -->"]
    lines += [f"<robot name={quoteattr(chain.name)}>", '  <link name="base_link"/>']
    at, parent = np.zeros(3), "base_link"
    for i, joint in enumerate(chain.joints):
        turning = joint.type == "revolute"
        axis = axes[i]
        # Any point of the axis will do; the nearest is the plainest, and no common normal of near-parallel axes is
        # sought, which could lie anywhere.
        point = points[i] + axis * (axis @ (at - points[i])) if turning else at
        child = f"{joint.name}_link"
        lines += _joint(
            joint.name,
            "revolute" if turning else "prismatic",
            parent,
            child,
            point - at,
            axis,
            (joint.lower, joint.upper),
        )
        at, parent = point, child
    lines += [
        '  <link name="tool"/>',
        '  <joint name="tool_fixed" type="fixed">',
        f"    <parent link={quoteattr(parent)}/>",
        '    <child link="tool"/>',
        f'    <origin xyz="{_three(tool[:3, 3] - at)}" rpy="{_three(to_rpy(tool[:3, :3]))}"/>',
        "  </joint>",
        "</robot>",
    ]
    notes = (Remark.of(Code.URDF_PLACEHOLDERS),)
    return "\n".join(lines) + "\n", notes if any(
        math.isfinite(j.upper) or j.type == "prismatic" for j in chain.joints
    ) else ()


def _joint(
    name: str, kind: str, parent: str, child: str, xyz: Array, axis: Array, limits: tuple[float, float]
) -> list[str]:
    bounded = all(math.isfinite(v) for v in limits)
    if kind == "revolute" and not bounded:
        kind = "continuous"
    low, high = limits if bounded else (-1e3, 1e3)
    limit = (
        []
        if kind == "continuous"
        else [f'    <limit lower="{number(low)}" upper="{number(high)}" effort="0" velocity="0"/>']
    )
    return [
        f"  <link name={quoteattr(child)}/>",
        f"  <joint name={quoteattr(name)} type={quoteattr(kind)}>",
        f"    <parent link={quoteattr(parent)}/>",
        f"    <child link={quoteattr(child)}/>",
        f'    <origin xyz="{_three(xyz)}" rpy="0 0 0"/>',
        f'    <axis xyz="{_three(axis)}"/>',
        *limit,
        "  </joint>",
    ]


def _three(v: Array) -> str:
    return " ".join(number(round(float(x), 15)) for x in v)

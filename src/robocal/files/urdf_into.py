"""A calibrated model written into the URDF that a robot already has: meshes, limits, comments and every other byte stay,
and the origins of the joints say what was found.

Each joint frame of the URDF is moved by as little as puts its axis on the calibrated one: the smallest turn, and the
shift to the nearest point. Near-parallel axes need no special care, for no common normal is sought. What the last axis
leaves goes into the last fixed joint before the tip.

An arm that did not come from a URDF gets one of its own (`urdf_text`): the same kinematics, joint by joint, with nothing but the joint
axes and the tool.

With the arm at zero every link frame is parallel to the base and lies on its joint's axis, at the foot of the
perpendicular from the frame before it. So every origin has xyz only, the axis carries the direction, and no angle is
rounded but the tool's.
"""

from __future__ import annotations

import math
from xml.sax.saxutils import quoteattr

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.arms.denavit import axes_at_zero
from robocal.errors import ModelError
from robocal.files.robot import Robot, open_robot
from robocal.files.units import number
from robocal.files.urdf import edit_urdf
from robocal.geometry import se3, so3
from robocal.geometry.path.program import Joint
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["urdf_into", "urdf_text"]

# Further apart than this and the URDF is of another robot, or counts its joints from elsewhere.
OTHER = (0.05, 0.1)  # m, rad
LOST = (1e-9, 1e-9)


def urdf_into(
    chain: Chain, into: str, *, base: str | None = None, tip: str | None = None
) -> tuple[str, tuple[Remark, ...]]:
    """The text of a URDF with the calibrated origins, and notes. Raises InputError for a URDF of another robot."""
    urdf = open_robot(into, base=base, tip=tip)
    if urdf.format != "urdf":
        raise ModelError("this is not a URDF", key="--into", found=into)
    axes, points, tool, own = _comparable(chain, urdf)
    order = [str(row["name"]) for row in urdf.chain.meta["rows"]]  # type: ignore[attr-defined]
    table = urdf.chain.table
    origins = {n: se3.from_vector(np.array([table[f"{n}.{s}"].value for s in FRAME_SYMBOLS])) for n in order}
    moving = {j.name: i for i, j in enumerate(urdf.chain.joints)}
    last_fixed = order[-1] if order[-1] not in moving else None
    was, now = np.eye(4), np.eye(4)
    changed: dict[str, float] = {}
    for name in order:
        was = was @ origins[name]
        if name in moving:
            i = moving[name]
            wanted = _align_axis(was, own[i], axes[i], points[i])
            if name == order[-1]:
                wanted = _orient_to_tool(wanted, axes[i], tool)
        elif name == last_fixed:
            wanted = tool
        else:
            wanted = now @ origins[name]
        made = np.linalg.inv(now) @ wanted
        if np.abs(made - origins[name]).max() > 1e-15:
            changed |= {f"{name}.{s}": float(v) for s, v in zip(FRAME_SYMBOLS, se3.to_vector(made), strict=True)}
        now = wanted
    text, _ = edit_urdf(urdf.text, urdf.chain, changed)
    gap = float(np.linalg.norm(now[:3, 3] - tool[:3, 3]))
    turn = float(np.linalg.norm(so3.log(now[:3, :3] @ tool[:3, :3].T)))
    if gap <= LOST[0] and turn <= LOST[1]:
        return text, ()
    return text, (Remark.of(Code.URDF_TOOL_OFF, file=into, gap=Quantity(gap), angle=Quantity(turn, "rad")),)


def _comparable(chain: Chain, urdf: Robot) -> tuple[Array, Array, Array, Array]:
    """Axes, points and tool of the model, and the axes of the URDF, when the URDF is of this robot. Raises ModelError."""
    if [j.type for j in chain.joints] != [j.type for j in urdf.chain.joints]:
        expected, found = (", ".join(f"{j.name} ({j.type})" for j in arm.joints) for arm in (chain, urdf.chain))
        raise ModelError("the URDF has other joints than the model", key="--into", found=found, expected=expected)
    axes, points, gain, tool = axes_at_zero(chain)
    if np.abs(gain - 1).max() > 1e-12:
        worst = chain.joints[int(np.argmax(np.abs(gain - 1)))].name
        raise ModelError("a URDF cannot hold a joint's gain", key=f"{worst}.gain", expected="--format yaml")
    axes2, points2, _, _ = axes_at_zero(urdf.chain)
    for i, joint in enumerate(chain.joints):
        angle = float(np.arctan2(np.linalg.norm(np.cross(axes[i], axes2[i])), axes[i] @ axes2[i]))
        away = points[i] - points2[i] if joint.type == "revolute" else np.zeros(3)
        gap = float(np.linalg.norm(away - axes2[i] * (axes2[i] @ away)))
        if gap > OTHER[0] or angle > OTHER[1]:
            message = "this axis lies elsewhere in the URDF: another robot, another base, or joints with another zero"
            found = f"{1e3 * gap:.3g} mm and {np.degrees(angle):.3g} deg apart"
            expected = f"at most {1e3 * OTHER[0]:g} mm and {np.degrees(OTHER[1]):.2g} deg"
            raise ModelError(message, key=joint.name, found=found, expected=expected)
    return axes, points, tool, axes2


def _align_axis(frame: Array, own: Array, axis: Array, point: Array) -> Array:
    """A joint frame whose axis was `own`, turned and shifted by as little as puts it on the calibrated axis."""
    cross = np.cross(own, axis)
    sine = float(np.linalg.norm(cross))
    turn = so3.exp(cross / sine * np.arctan2(sine, own @ axis)) if sine > 1e-15 else np.eye(3)
    out = frame.copy()
    out[:3, :3] = turn @ frame[:3, :3]
    if np.isfinite(point).all():
        out[:3, 3] = point + axis * (axis @ (frame[:3, 3] - point))
    return out


def _orient_to_tool(frame: Array, axis: Array, tool: Array) -> Array:
    """A joint frame that ends the arm, turned about its axis and shifted along it until it is nearest to the tool."""
    m = tool[:3, :3] @ frame[:3, :3].T
    twice = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    out = frame.copy()
    out[:3, :3] = so3.exp(axis * np.arctan2(axis @ twice, np.trace(m) - axis @ m @ axis)) @ frame[:3, :3]
    out[:3, 3] += axis * (axis @ (tool[:3, 3] - frame[:3, 3]))
    return out


def urdf_text(chain: Chain) -> tuple[str, tuple[Remark, ...]]:
    """The URDF of an arm and notes on it. Raises ModelError when a joint's gain is not 1, which a URDF cannot say."""
    axes, points, gains, tool = axes_at_zero(chain)
    for joint, gain in zip(chain.joints, gains, strict=True):
        if abs(gain - 1.0) > 1e-12:
            # A gain of -1 is an axis that points the other way; anything else has no place.
            key = f"{joint.name}.gain"
            raise ModelError("a URDF cannot hold a joint's gain", key=key, found=float(gain), expected="--format yaml")
    lines = ['<?xml version="1.0"?>', "<!-- Written by robocal. Joint values are those of the model; lengths in m. -->"]
    lines += [f"<robot name={quoteattr(chain.name)}>", '  <link name="base_link"/>']
    at, parent = np.zeros(3), "base_link"
    for joint, axis, of in zip(chain.joints, axes, points, strict=True):
        # Any point of the axis will do; the nearest is the plainest, and no common normal of near-parallel axes is
        # sought, which could lie anywhere.
        point = of + axis * (axis @ (at - of)) if joint.type == "revolute" else at
        child = f"{joint.name}_link"
        lines += _joint(joint, parent, child, point - at, axis)
        at, parent = point, child
    lines += [
        *_link("tool_fixed", "fixed", parent, "tool", tool[:3, 3] - at, so3.roll_pitch_yaw(tool[:3, :3])),
        "</robot>",
    ]
    limited = any(math.isfinite(j.upper) or j.type == "prismatic" for j in chain.joints)
    return "\n".join(lines) + "\n", (Remark.of(Code.URDF_PLACEHOLDERS),) if limited else ()


def _joint(joint: Joint, parent: str, child: str, xyz: Array, axis: Array) -> list[str]:
    """The lines of a link and of the joint that moves it about or along an axis."""
    bounded = math.isfinite(joint.lower) and math.isfinite(joint.upper)
    kind = "continuous" if joint.type == "revolute" and not bounded else joint.type
    low, high = (joint.lower, joint.upper) if bounded else (-1e3, 1e3)
    more = [f'    <axis xyz="{_three(axis)}"/>']
    if kind != "continuous":
        more.append(f'    <limit lower="{number(low)}" upper="{number(high)}" effort="0" velocity="0"/>')
    return _link(joint.name, kind, parent, child, xyz, np.zeros(3), *more)


def _link(name: str, kind: str, parent: str, child: str, xyz: Array, rpy: Array, *more: str) -> list[str]:
    """The lines of a link and of the joint above it."""
    return [
        f"  <link name={quoteattr(child)}/>",
        f"  <joint name={quoteattr(name)} type={quoteattr(kind)}>",
        f"    <parent link={quoteattr(parent)}/>",
        f"    <child link={quoteattr(child)}/>",
        f'    <origin xyz="{_three(xyz)}" rpy="{_three(rpy)}"/>',
        *more,
        "  </joint>",
    ]


def _three(v: Array) -> str:
    return " ".join(number(round(float(x), 15)) for x in v)

"""What the joints of a URDF's chain say that nobody reads, say twice, or leave out where all others state it.

A URDF may leave out an origin or an axis, and then means zero, or x: so a misspelt word moves a joint without a complaint of
any parser.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from robocal.arms.conventions import CONVENTIONS
from robocal.files.unread import named, near_miss
from robocal.files.unstated import unstated_remarks
from robocal.files.urdftree import MOVING, UrdfJoint
from robocal.files.yamlio import Document, Path_
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["joint_remarks"]

# Elements of a joint and their attributes, as the format has them (wiki.ros.org/urdf/XML/joint).
WORDS: dict[str, tuple[str, ...]] = {
    "origin": ("xyz", "rpy"),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "mimic": ("joint", "multiplier", "offset"),
    "calibration": ("rising", "falling", "reference_position"),
    "dynamics": ("damping", "friction"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
}


def joint_remarks(joints: Sequence[UrdfJoint], path: Path) -> tuple[Remark, ...]:
    """Remarks on the joints of a chain. Raises FormatError for an element that a joint has twice."""
    found: dict[str, str | None] = {}
    for joint in joints:
        _refuse_twice(joint)
        found.update(_unknown(joint))
    unread = (named(Code.ELEMENTS_UNREAD, path, found),) if found else ()
    return (*unread, *_absent(joints, path))


def _refuse_twice(joint: UrdfJoint) -> None:
    seen: dict[str, int] = {}
    for node in joint.node.children:
        if node.tag in seen and node.tag in WORDS:
            both = f"rows {seen[node.tag]} and {node.row}"
            node.fail(f"a joint has more than one <{node.tag}>", key=f"joint {joint.name}", found=both, expected="one")
        seen[node.tag] = node.row


def _unknown(joint: UrdfJoint) -> Iterator[tuple[str, str | None]]:
    """Elements and attributes that the format does not have, each with the known one that it looks like."""
    there = {node.tag for node in joint.node.children}
    for node in joint.node.children:
        if node.tag not in WORDS:
            yield f"<{node.tag}>", near_miss(node.tag, [w for w in WORDS if w not in there])
            continue
        for name in node.attributes:
            if name not in WORDS[node.tag]:
                near = near_miss(name, [w for w in WORDS[node.tag] if w not in node.attributes])
                yield f"{node.tag} {name}", near


def _absent(joints: Sequence[UrdfJoint], path: Path) -> Iterator[Remark]:
    rows: list[dict[str, object]] = []
    lines: dict[Path_, int] = {}
    for i, joint in enumerate(joints):
        lines["joints", i] = joint.node.row
        origin, axis, limit = (joint.node.child(word) for word in ("origin", "axis", "limit"))
        row: dict[str, object] = {"name": joint.name, "type": MOVING.get(joint.type, "fixed")}
        for key in ("xyz", "rpy"):
            row[key] = None if origin is None else origin.attributes.get(key)
        # A fixed joint has no axis to state, a continuous one no limits.
        row["axis"] = (None if axis is None else axis.attributes.get("xyz")) if joint.type in MOVING else "none"
        row["limits"] = limit if joint.type in ("revolute", "prismatic") else "none"
        rows.append(row)
        if limit is not None and joint.type in ("revolute", "prismatic"):
            keys = tuple(word for word in ("lower", "upper") if word not in limit.attributes)
            if keys:
                values = tuple(f"{key}: 0" for key in keys)
                where, name = (str(path), limit.row), f"joint {joint.name}"
                yield Remark.of(Code.KEYS_UNSTATED, file=where[0], row=where[1], joint=name, keys=keys, values=values)
    yield from unstated_remarks(rows, CONVENTIONS["urdf"], Document(path, "", "", {}, lines))

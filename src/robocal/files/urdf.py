"""URDF in and out: a path of links becomes a chain; on the way back only the changed origins are touched, every other
byte survives.

A URDF may leave out an origin or an axis, and then means zero, or x: so a misspelt word moves a joint without a complaint of
any parser. What the joints of a chain say that nobody reads, say twice, or leave out where all others state it, is named.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, chain, rows
from robocal.errors import FormatError, ModelError, nearest
from robocal.files.orientation import quaternion, rpy, to_form
from robocal.files.robot_rows import MOST_REACH, MOST_TURN, MOST_TURNS, NO_LIMIT, missing_key_remarks
from robocal.files.text import Source
from robocal.files.units import number, same
from robocal.files.unread import near_miss, remark_unknown_names
from robocal.files.urdftree import (
    MOVING,
    RESERVED,
    Node,
    UrdfJoint,
    check_xacro,
    joints_of,
    links_of,
    longest,
    owner_of,
    refuse_cut,
    root_of,
)
from robocal.files.yamlio import Path_, YamlDocument
from robocal.geometry import se3, so3
from robocal.parameters import FRAME_SYMBOLS
from robocal.quantities import LARGEST
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["UrdfArm", "edit_urdf", "read_urdf"]

# Elements of a joint and their attributes, as the format has them (wiki.ros.org/urdf/XML/joint).
WORDS: dict[str, tuple[str, ...]] = {
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "mimic": ("joint", "multiplier", "offset"),
    "calibration": ("rising", "falling", "reference_position"),
    "dynamics": ("damping", "friction"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
}


def joint_remarks(joints: Sequence[UrdfJoint], made: Sequence[dict[str, Any]], path: Path) -> tuple[Remark, ...]:
    """Remarks on the joints of a chain and the rows made of them. Raises FormatError for an element that a joint has twice."""
    found: dict[str, str | None] = {}
    for joint in joints:
        _refuse_twice(joint)
        found.update(_unknown(joint))
    unread = (remark_unknown_names(Code.ELEMENTS_UNREAD, path, found),) if found else ()
    return (*unread, *_absent(joints, path), *_other_units(joints, made, path))


def _other_units(joints: Sequence[UrdfJoint], made: Sequence[dict[str, Any]], path: Path) -> Iterator[Remark]:
    """Lengths that add up to more than any arm measures, and angles of more than a turn: a URDF is in m and rad."""
    reach = sum(math.hypot(*_floats(j.node.child("origin"), "xyz", (0.0,) * 3, j)) for j in joints)
    if reach > MOST_REACH:
        yield Remark.of(Code.URDF_SIZE, file=str(path), reach=reach)
    angles = [(max(map(abs, _floats(j.node.child("origin"), "rpy", (0.0,) * 3, j))), j.name) for j in joints]
    value, joint = max(angles, default=(0.0, ""))
    if value > MOST_TURN:
        yield Remark.of(Code.URDF_TURN, file=str(path), joint=joint, value=value)
    for row in made:
        low, high = row.get("limits", (0.0, 0.0)) if row["type"] == "revolute" else (0.0, 0.0)
        if high - low > MOST_TURNS and max(-low, high) < NO_LIMIT:
            yield Remark.of(Code.URDF_LIMITS, file=str(path), joint=row["name"], low=low, high=high)
            return


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
        for name in (n for n in node.attributes if n not in WORDS[node.tag]):
            yield f"{node.tag} {name}", near_miss(name, [w for w in WORDS[node.tag] if w not in node.attributes])


def _absent(joints: Sequence[UrdfJoint], path: Path) -> Iterator[Remark]:
    rows: list[dict[str, object]] = []
    lines: dict[Path_, int] = {}
    for i, joint in enumerate(joints):
        lines["joints", i] = joint.node.row
        origin, axis, limit = (joint.node.child(word) for word in ("origin", "axis", "limit"))
        row: dict[str, object] = {"name": joint.name, "type": MOVING.get(joint.type, "fixed")}
        words = {} if origin is None else origin.attributes
        row |= {"xyz": words.get("xyz"), "rpy": words.get("rpy", words.get(QUATERNION))}
        # A fixed joint has no axis to state, a continuous one no limits.
        row["axis"] = (None if axis is None else axis.attributes.get("xyz")) if joint.type in MOVING else "none"
        row["limits"] = limit if joint.type in ("revolute", "prismatic") else "none"
        rows.append(row)
        if limit is not None and joint.type in ("revolute", "prismatic"):
            keys = tuple(word for word in ("lower", "upper") if word not in limit.attributes)
            if keys:
                name, values = f"joint {joint.name}", tuple(f"{key}: 0" for key in keys)
                yield Remark.of(Code.KEYS_UNSTATED, file=str(path), row=limit.row, joint=name, keys=keys, values=values)
    yield from missing_key_remarks(rows, CONVENTIONS["urdf"], YamlDocument(path, "", "", {}, lines))


QUATERNION = "quat_xyzw"
UNIT = 1e-3  # tolerance: of the length of a quaternion; four digits leave less
_ATTRIBUTE = re.compile(rb"([^\s=/>\"']+)\s*=\s*(\"[^\"]*\"|'[^']*')")


@record
class UrdfArm:
    """The chain between two links of a URDF."""

    chain: Chain
    root: str
    tip: str
    warnings: tuple[Remark, ...] = ()


def read_urdf(source: Source, *, base: str | None = None, tip: str | None = None) -> UrdfArm:
    """The chain from link `base` (default the root) to link `tip` (default the end of the longest chain). Raises
    FormatError."""
    root = Node.parse(source.text, source.path)
    check_xacro(root, source)
    if root.tag != "robot":
        root.fail("this is not a URDF", found=f"<{root.tag}>", expected="<robot>")
    links = links_of(root)
    joints = joints_of(root, links)
    start = root_of(links, joints)
    into = {j.child: j for j in joints}
    notes: tuple[Remark, ...] = ()
    if tip is None:
        tip, tie = longest(base or start, joints)
        refuse_cut(base or start, tip, joints)
        if tie:
            notes = (Remark.of(Code.TIP_CHOSEN, file=str(source.path), tip=tip),)
    for word, name in (("base", base), ("tip", tip)):
        if name is not None and name not in links:
            near = nearest(name, links)
            raise FormatError("there is no such link", file=source.path, key=word, found=name, suggestion=near)
    path: list[UrdfJoint] = []
    at = tip
    while at != (base or start):
        if at not in into:
            message, expected = "the tip is not connected to the base", f"a link above {tip}"
            raise FormatError(message, file=source.path, key="base", found=base, expected=expected)
        path.insert(0, into[at])
        at = into[at].parent
    made = [_row(j) for j in path]
    notes = (*notes, *joint_remarks(path, made, source.path))
    if not any(row["type"] != "fixed" for row in made):
        raise FormatError("no joint moves between base and tip", file=source.path, found=f"{base or start} to {tip}")
    try:
        name = root.attributes.get("name") or source.path.stem
        arm = chain(name, "urdf", made, source=str(source.path.name), meta={"file": str(source.path)})
    except ModelError as error:
        raise error.of_file(source.path) from None
    still = {owner_of(j.node) for j in path if j.type == "fixed"}
    free = [n for n in arm.usual if n.rpartition(".")[0] not in still]
    return UrdfArm(replace(arm, table=arm.table.with_free(free)), base or start, tip, notes)


def edit_urdf(text: str, arm: Chain, changed: Mapping[str, float]) -> tuple[str, tuple[str, ...]]:
    """The URDF with the origins of an arm that other values have moved, and the names that a URDF cannot hold."""
    data, changed = text.encode("utf-8"), _turn_origins(arm, changed)
    owners = {n.rpartition(".")[0] for n in arm.table.names} - set(RESERVED)
    origin = {f"{o}.{s}" for o in owners for s in FRAME_SYMBOLS}
    left_out = tuple(n for n in changed if n not in origin)
    root = Node.parse(text, None)
    nodes = {owner_of(n): n for n in root.children if n.tag == "joint"}
    splices: list[tuple[int, int, bytes]] = []
    for row in rows(arm.with_values({n: v for n, v in changed.items() if n in origin})):
        owner = str(row["name"])
        words = {}
        for word, symbols in (("xyz", FRAME_SYMBOLS[:3]), ("rpy", FRAME_SYMBOLS[3:])):
            names = [name for s in symbols if (name := f"{owner}.{s}") in changed]
            if not all(same(arm.table[name].value, changed[name]) for name in names):
                words[word] = " ".join(number(v) for v in row[word])  # type: ignore[attr-defined]
        at = nodes[owner].child("origin")
        if "rpy" in words and at is not None and QUATERNION in at.attributes:
            turned = to_form(rpy(row["rpy"])[None], "quaternion_xyzw")[0]  # type: ignore[arg-type]
            words[QUATERNION] = " ".join(number(float(v)) for v in turned)
            del words["rpy"]
        if words:
            splices += _origin_splices(data, nodes[owner], words)
    for start, end, new in sorted(splices, reverse=True):
        data = data[:start] + new + data[end:]
    return data.decode("utf-8"), left_out


def _turn_origins(arm: Chain, changed: Mapping[str, float]) -> dict[str, float]:
    """The same changes with the zeros of joints in the origins before them: T Q(axis, q + offset) = (T Q(axis, offset)) Q(axis, q)."""
    out = dict(changed)
    given: Any = arm.meta.get("rows", ())
    for row in given:
        names = [f"{row['name']}.{s}" for s in FRAME_SYMBOLS]
        offset = out.pop(f"{row['name']}.offset", 0.0)
        if offset:
            axis = np.asarray(row["axis"], float)
            screw = np.zeros(6)
            screw[slice(3) if row["type"] == "prismatic" else slice(3, 6)] = offset * axis / np.linalg.norm(axis)
            origin = se3.from_vector(np.array([out.get(n, arm.table[n].value) for n in names]))
            out |= dict(zip(names, se3.to_vector(origin @ se3.from_vector(screw)).tolist(), strict=True))
    return out


def _origin_splices(data: bytes, joint: Node, words: Mapping[str, str]) -> list[tuple[int, int, bytes]]:
    """Byte ranges to replace so that the joint's origin says `words`; a missing attribute or element is inserted."""
    node = joint.child("origin")
    if node is None:
        _, end = _start_tag(data, joint.start)
        space = re.match(rb"\s*", data[end:])
        attributes = "".join(f' {k}="{v}"' for k, v in words.items())
        return [(end, end, (space[0] if space else b"") + f"<origin{attributes}/>".encode())]
    spans, end = _start_tag(data, node.start)
    out, at = [], max((s[1] for s in spans.values()), default=node.start + len(b"<origin"))
    missing = ""
    for word, value in words.items():
        if word in spans:
            out.append((spans[word][0] + 1, spans[word][1] - 1, value.encode()))
        else:
            missing += f' {word}="{value}"'
    return [*out, (at, at, missing.encode())] if missing else out


def _start_tag(data: bytes, start: int) -> tuple[dict[str, tuple[int, int]], int]:
    """The byte span of every attribute value of a start tag, quotes included, and the end of the tag."""
    spans: dict[str, tuple[int, int]] = {}
    name = re.compile(rb"<[^\s/>]+").match(data, start)
    at = name.end() if name else start
    while True:
        if close := re.compile(rb"\s*/?>").match(data, at):
            return spans, close.end()
        found = _ATTRIBUTE.search(data, at)
        if found is None:
            raise AssertionError("a start tag without an end passed the parser")
        spans[found[1].decode()] = found.span(2)
        at = found.end()


def _row(joint: UrdfJoint) -> dict[str, Any]:
    """The row of a joint for the chain, in SI. Raises FormatError for what a chain cannot follow."""
    mimic = joint.node.child("mimic")
    if mimic is not None:
        found = mimic.attributes.get("joint")
        mimic.fail("a mimic joint on the chain", key=f"joint {joint.name}", found=found, expected="another tip")
    if joint.type not in (*MOVING, "fixed"):
        key, expected = f"joint {joint.name}", "revolute, continuous, prismatic, fixed"
        joint.node.fail("a chain cannot contain this joint", key=key, found=joint.type, expected=expected)
    origin, axis, limit = (joint.node.child(word) for word in ("origin", "axis", "limit"))
    row: dict[str, Any] = {"name": owner_of(joint.node), "type": MOVING.get(joint.type, "fixed")}
    row |= {"xyz": _floats(origin, "xyz", (0.0, 0.0, 0.0), joint), "rpy": _roll_pitch_yaw(origin, joint)}
    if joint.type in MOVING:
        row["axis"] = direction = _floats(axis, "xyz", (1.0, 0.0, 0.0), joint)
        if not any(direction):
            (axis or joint.node).fail("the axis has no direction", key=f"joint {joint.name} axis", found=direction)
    if limit is not None and joint.type in ("revolute", "prismatic"):
        (low,), (high,) = (_floats(limit, word, (0.0,), joint) for word in ("lower", "upper"))
        if low > high:
            key = f"joint {joint.name} limit"
            limit.fail("limits in the wrong order", key=key, found=[low, high], expected="lower, upper")
        row["limits"] = [low, high]
    return row


def _roll_pitch_yaw(origin: Node | None, joint: UrdfJoint) -> list[float]:
    """The rotation of an origin, as rpy or, since version 1.2 of the format, as a quaternion."""
    if origin is None or QUATERNION not in origin.attributes:
        return _floats(origin, "rpy", (0.0, 0.0, 0.0), joint)
    key, found = f"joint {joint.name} origin {QUATERNION}", origin.attributes[QUATERNION]
    if "rpy" in origin.attributes:
        origin.fail("an origin has two rotations", key=key, found=f"rpy and {QUATERNION}", expected="one of them")
    x, y, z, w = _floats(origin, QUATERNION, (0.0, 0.0, 0.0, 1.0), joint)
    size = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(size - 1) > UNIT:
        origin.fail("a quaternion of another length than 1", key=key, found=found, expected="x y z w of length 1")
    return list(map(float, so3.roll_pitch_yaw(quaternion(np.array([x, y, z, w]) / size))))


def _floats(node: Node | None, name: str, default: tuple[float, ...], joint: UrdfJoint) -> list[float]:
    """The numbers of an attribute, as many as its default has."""
    if node is None or name not in node.attributes:
        return list(default)
    text, count = node.attributes[name], len(default)
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    # Python alone takes 1_5 for 15.
    if len(values) != count or "_" in text or not all(math.isfinite(v) for v in values):
        expected = "a finite number" if count == 1 else f"{count} finite numbers"
        node.fail("not a valid attribute", key=f"joint {joint.name} {node.tag} {name}", found=text, expected=expected)
    if node.tag != "limit" and max(map(abs, values)) >= LARGEST:  # exporters write such limits where there are none
        key = f"joint {joint.name} {node.tag} {name}"
        node.fail("no robot has so large a number", key=key, found=text, expected=f"below {LARGEST:g}")
    return values

"""Cable robots of CASPR (github.com/darwinlau/CASPR): X_cables.xml with X_bodies.xml beside it.

Read are platforms of one rigid body, on driven cables: straight from an eyelet, or over a pulley of the base. Arms and
other chains, muscles and springs that nobody drives are other machines, and are named as what they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal.cables.check import PRINTED, check
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.pulley import Pulleys
from robocal.errors import FileError, FormatError, ModelError, nearest
from robocal.files.cable.cable_model import CableUnits
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.casprtree import CasprNode, parse_caspr, unheld, unread_elements
from robocal.files.text import ROBOT_LIMIT, InputFile, Source, discreet, read_text
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["CABLES", "Caspr", "bodies_of", "open_caspr", "read_caspr"]

CABLES = "_cables.xml"

# CASPR's joint of the one body -> degrees of freedom and plane.
JOINTS = {
    "SPATIAL": ("3R3T", "xz"),
    "SPATIAL_EULER_XYZ": ("3R3T", "xz"),
    "SPATIAL_QUATERNION": ("3R3T", "xz"),
    "PLANAR_XY": ("1R2T", "xy"),
    "PLANAR_XZ": ("1R2T", "xz"),
    "PLANAR_YZ": ("1R2T", "yz"),
    "T_XYZ": ("3T", "xz"),
    "P_XY": ("2T", "xy"),
    "P_XZ": ("2T", "xz"),
    "P_YZ": ("2T", "yz"),
}
# What a complaint of the model is about -> the element that says it.
SAID = {"tension": "properties"}
PASSIVE = "passive"  # cables that nobody drives: cable_passive_...
OFF = 1e-6  # m; a body's plane further than this from that of the frame anchors is another one


@record
class Cable:
    """Anchors (3,), pulley (radius, axis (3,)) of the frame's, tension limits, strain per newton and diameter where they
    are said."""

    a: np.ndarray
    b: np.ndarray
    pulley: tuple[float, np.ndarray]
    limits: list[float]
    elasticity: float | None
    diameter: float | None


@record
class Caspr:
    """A robot of CASPR, and what its files say beside it: which cable set it has, the names of the `others`, what CASPR calls
    its cables ("" where it does not), and remarks on what no robot.yaml can hold."""

    file: CableFile
    cable_set: str
    others: tuple[str, ...]
    names: tuple[str, ...]
    unheld: tuple[Remark, ...]


def read_caspr(source: Source) -> CableFile:
    """A robot of CASPR from `X_cables.xml`: the default cable set, or the only one. Lengths in m, forces in N, masses in
    kg. Raises FileError or FormatError."""
    return open_caspr(source).file


@discreet
def open_caspr(source: Source, cable_set: str | None = None) -> Caspr:
    """The same with what its files say beside it, of any of its cable sets by name. Raises FileError or FormatError."""
    if not source.text.lstrip("\ufeff \t\r\n").startswith("<"):
        message = "this is not XML, but a model of CASPR must be"
        raise FormatError(message, file=source.path, expected="a file X_cables.xml")
    top, cables = _open(source, "cables")
    name = source.path.name
    if not name.endswith(CABLES):
        cables.fail("the bodies of CASPR must be beside X_cables.xml", found=name, expected="a file X_cables.xml")
    beside = bodies_of(source.path)
    if not beside.exists():
        raise FileError("the file of the bodies is not beside that of the cables", file=beside, found="nothing")
    its = read_text(beside, limit=ROBOT_LIMIT)
    bodies, links = _open(its, "links")
    body = _body(links, beside.name)
    doubts, home = body.pop("doubts"), body.pop("home")
    chosen, others = _chosen(cables, cable_set)
    rows = [_cable(node, body["com"]) for node in chosen.every()]
    if not rows:
        cables.fail("no cables")
    known: dict[str, Any] = {"limits": np.array([row.limits for row in rows]), **body}
    for what in ("elasticity", "diameter"):
        said = [getattr(row, what) for row in rows]
        if None not in said:
            known[what] = np.array(said)
        elif any(v is not None for v in said):
            doubts.append(Remark.of(Code.SAID_OF_SOME, what=what))
    if any(row.pulley[0] > 0 for row in rows):
        known["pulleys"] = Pulleys(*(np.array([row.pulley[i] for row in rows]) for i in (0, 1)))
    called = chosen.optional("id") or ""
    known["sources"] = {"": f"CASPR, {name}{f' (cable set {called})' if called else ''} and {beside.name}"}
    robot = cable_robot(name.removesuffix(CABLES), [r.a for r in rows], [r.b for r in rows], **known)
    _plane(robot, home, cables)
    odd = (*(doubt.of_file(source.path) for doubt in doubts), *unread_elements(top), *unread_elements(bodies))
    warnings, read = (*odd, *_robot_remarks(robot, chosen, links)), (InputFile(beside, its.sha256),)
    file = CableFile(robot, CableUnits(), source.path, source.text, source.sha256, "caspr", warnings, beside=read)
    names = tuple(node.attributes.get("name", "") for node in chosen.children)
    return Caspr(file, called, others, names, tuple(_unheld(called, others, home, top, bodies)))


def bodies_of(cables: Path) -> Path:
    """X_bodies.xml of X_cables.xml."""
    return cables.with_name(cables.name.removesuffix(CABLES) + "_bodies.xml")


def _robot_remarks(robot: CableRobot, chosen: CasprNode, links: CasprNode) -> tuple[Remark, ...]:
    """What is odd about the robot, of the file of its cables. Raises FormatError at the element that says what no robot has."""
    try:
        return tuple(doubt.of_file(chosen.file) for doubt in check(robot))
    except ModelError as error:
        owner, _, what = str(error.key).partition(".")
        whose = chosen.children[robot.cables.index(owner)] if owner in robot.cables else chosen
        at = links.inside(owner) or whose.inside(SAID.get(what, what)) or whose
        raise error.of_file(at.file, row=at.row, key=f"<{at.tag}>") from None


def _unheld(
    called: str, others: tuple[str, ...], home: np.ndarray, top: CasprNode, bodies: CasprNode
) -> Iterator[Remark]:
    """Remarks on what a robot.yaml cannot hold: the other cable sets, where the body's coordinates are counted from, and
    whatever else is said that has no key."""
    if others:
        yield Remark.of(Code.CABLE_SETS_ASIDE, file=str(top.file), chosen=called, others=others)
    if home.any():
        x, y, z = map(float, home)  # m, as in the model and in the robot.yaml that is made of it
        yield Remark.of(Code.COUNTED_FROM_ELSEWHERE, file=str(bodies.file), x=x, y=y, z=z)
    for tree in (top, bodies):
        if names := unheld(tree):
            yield Remark.of(Code.NO_KEY_FOR, file=str(tree.file), names=names)


def _plane(robot: CableRobot, home: np.ndarray, cables: CasprNode) -> None:
    """A planar body moves in the plane of the frame anchors, or its cables would be slanted."""
    across = [i for i in range(3) if robot.planar and i not in robot.axes]
    off = (home - robot.a.mean(axis=0))[across]
    if (np.abs(off) > OFF).any():
        found = f"{float(off[0]):.4g} m beside it"
        expected = f"the {'xyz'[across[0]]} of <parent><location> at the anchors' mean"
        cables.fail("the planar body does not move in the plane of its frame anchors", found=found, expected=expected)


def _open(source: Source, expected: str) -> tuple[CasprNode, CasprNode]:
    """The whole tree, and its element of this tag. Raises FormatError."""
    top = parse_caspr(source)
    # Bodies stand in <links>, or since 2017 one level down.
    found = top.one(expected) if (top.tag, expected) == ("bodies_system", "links") else top
    if found.tag == "robot":
        found.fail("this is a URDF of an arm, and a cable robot is needed", expected="kind: cable, or CASPR's XML")
    if found.tag != expected:
        found.fail("this is not the expected file of CASPR", expected=f"<{expected}>")
    return top, found


def _chosen(cables: CasprNode, name: str | None) -> tuple[CasprNode, tuple[str, ...]]:
    """The set of this name, and the names of the others; without a name the set that is called the default, or the only one
    where none is."""
    default = cables.optional("default_cable_set")
    wanted = default if name is None else name
    sets = cables.all("cable_set")
    found = sets if wanted is None and len(sets) == 1 else [s for s in sets if s.optional("id") == wanted]
    for other in sets:
        other.aside = other not in found
    names = [s.attributes.get("id", "") for s in sets]
    if len(found) != 1:
        near = nearest(wanted, names) if wanted is not None and not found else None
        which = "default cable set" if name is None else "cable set of this name"
        expected = ", ".join(names) or "a <cable_set>"
        cables.fail(f"there is not one {which}", found=wanted, expected=expected, suggestion=near)
    return found[0], tuple(n for s, n in zip(sets, names, strict=True) if s is not found[0])


def _body(links: CasprNode, name: str) -> dict[str, Any]:
    """Degrees of freedom, mass, centre of mass, inertia about it; where the body stands at zero, and what is odd in the file `name`."""
    bodies = [b for b in links.every() if b.tag.startswith("link")]
    if len(bodies) != 1 or bodies[0].tag != "link_rigid":
        found = ", ".join(f"{len(links.all(tag))} <{tag}>" for tag in sorted({b.tag for b in bodies})) or "none"
        links.fail("a platform is one rigid body; arms and other chains of bodies are not read", found=found,
                   expected="one <link_rigid>")  # fmt: skip
    body = bodies[0]
    of_old = not body.all("joint")  # until 2017
    joint = body.one("joint_type").text.strip() if of_old else body.one("joint").optional("type") or ""
    if joint not in JOINTS:
        body.fail("this joint is not that of a cable robot's platform", found=joint, expected=", ".join(JOINTS))
    degrees, plane = JOINTS[joint]
    physical = body.one("physical")
    tensor = physical.one("inertia")
    xx, yy, zz, xy, xz, yz = (tensor.one(f"I{k}").numbers(1)[0] for k in ("xx", "yy", "zz", "xy", "xz", "yz"))
    if (tensor.optional("ref") or "com").lower() != "com":
        tensor.fail("the inertia is about another point", found=tensor.optional("ref"), expected="com")
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    doubts: list[Remark] = []
    known: dict[str, Any] = {"degrees": degrees, "plane": plane, "doubts": doubts}
    if degrees == "3R3T" or _solid(inertia):
        known["inertia"] = inertia
    else:
        # A planar model needs one moment only, and zeros are written for the others.
        doubts.append(Remark.of(Code.INERTIA_OF_NO_BODY, row=tensor.row, bodies=name))
    known["com"] = np.array(physical.one("com_location").numbers(3))
    known["mass"] = physical.one("mass").numbers(1)[0]
    return known | {"home": _stands(body.one("parent")) if body.all("parent") else np.zeros(3)}


def _stands(parent: CasprNode) -> np.ndarray:
    """Where the body stands at zero. Raises FormatError where it hangs on another body."""
    if parent.all("num") and parent.one("num").numbers(1) != [0.0]:
        parent.one("num").fail("a platform hangs on the base", found=parent.one("num").text.strip(), expected="0")
    return np.array(parent.one("location").numbers(3))


def _solid(inertia: np.ndarray) -> bool:
    """Whether a body can have it: no principal moment above the sum of the others."""
    low, middle, high = np.linalg.eigvalsh(inertia)
    return bool(low > 0 and high <= (low + middle) * (1 + PRINTED))


def _cable(node: CasprNode, com: np.ndarray) -> Cable:
    if node.tag not in ("cable_ideal", "cable_linear_spring"):
        why = "nobody drives this one" if PASSIVE in node.tag else "this kind of actuator is not read"
        node.fail(f"a cable robot pulls on cables: {why}", expected="<cable_ideal> or <cable_linear_spring>")
    ends = node.one("attachments").every()
    if len(ends) != 2 or ends[1].tag != "attachment" or ends[0].tag not in ("attachment", "base_rotating_pulley"):
        found = ", ".join(f"<{end.tag}>" for end in ends)
        expected = "an <attachment> or <base_rotating_pulley>, and an <attachment>"
        node.fail("a cable runs from the base straight to the body", found=found, expected=expected)
    links = [0 if end.tag == "base_rotating_pulley" else end.one("link").numbers(1)[0] for end in ends]
    if links != [0, 1]:
        shown = f"links [{', '.join(f'{v:g}' for v in links)}]"
        node.fail("a cable runs from the base (0) to the body (1)", found=shown, expected="links 0 and 1")
    reference = node.optional("attachment_reference")
    if reference not in ("joint", "com") and (reference or com.any()):
        node.fail("the reference point of the attachments is not specified", found=reference, expected="joint, com")
    a, pulley = _from(ends[0])
    b = np.array(ends[1].one("location").numbers(3)) + (com if reference == "com" else 0.0)
    made = node.one("properties")
    limits = [made.one(k).numbers(1)[0] for k in ("force_min", "force_max")]
    elasticity = None
    if node.tag == "cable_linear_spring":
        stiffness = made.one("K").numbers(1)[0]
        if not stiffness > 0:
            made.one("K").fail("a cable needs a stiffness", found=stiffness, expected="above 0 N")
        elasticity = 1 / stiffness  # CASPR divides K by the length: it is EA
    diameter = made.one("diameter").numbers(1)[0] if made.all("diameter") else None
    return Cable(a, b, pulley, limits, elasticity, diameter)


def _from(end: CasprNode) -> tuple[np.ndarray, tuple[float, np.ndarray]]:
    """Frame anchor and pulley; an eyelet is a pulley of no radius."""
    if end.tag == "attachment":
        return np.array(end.one("location").numbers(3)), (0.0, np.array([0.0, 0.0, 1.0]))
    entry = end.one("cable_entry_vector")
    axis = np.array(entry.numbers(3))
    if not axis.any():
        entry.fail("a direction must not be zero", found=entry.text.strip())
    radius = end.one("pulley_radius").numbers(1)[0]
    if radius < 0:
        end.one("pulley_radius").fail("a negative radius", found=radius, expected="0 m or more")
    return np.array(end.one("fixed_location").numbers(3)), (radius, axis / np.linalg.norm(axis))

"""Cable robots described elsewhere: CASPR's pair of XML files, and the YAML of published robots."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from robocal.cables.geometry import cable_robot
from robocal.errors import FileError, FormatError
from robocal.files.cable import CableFile, checked
from robocal.files.cablevalues import CableUnits, Values
from robocal.files.schema import Model, validate
from robocal.files.text import Source, read_text
from robocal.files.units import parse_unit
from robocal.files.yamlio import Document

__all__ = ["read_caspr", "read_published"]

# CASPR's joint of the one body -> degrees of freedom and plane.
JOINTS = {
    "SPATIAL_EULER_XYZ": ("3R3T", "xz"),
    "SPATIAL_QUATERNION": ("3R3T", "xz"),
    "PLANAR_XY": ("1R2T", "xy"),
    "PLANAR_XZ": ("1R2T", "xz"),
    "TRANSLATIONAL_XY": ("2T", "xy"),
    "TRANSLATIONAL_XZ": ("2T", "xz"),
}


class MaterialModel(Model):
    """cable: what it is made of."""

    diameter_m: Any = None
    elongation_per_N: Any = None
    weight_N_per_m: Any = None


class PublishedModel(Model):
    """The YAML of a published robot: units are in the keys."""

    name: str
    length_unit: str
    mass_kg: Any = None
    centre_of_mass_m: Any = None
    tension_limits_N: Any = None
    cable: MaterialModel | None = None
    camera: Any = None
    frame_anchors: list[Any]
    initial_lengths_m: list[Any] | None = None
    platform_anchors: list[Any]


def read_published(document: Document) -> CableFile:
    """A robot of ../shared/data/cable-robots: keys carry units, `# assumed` behind a key marks what was chosen, the
    comments above are the source. Raises FormatError."""
    model = validate(PublishedModel, document)
    unit = parse_unit(model.length_unit, "m", file=document.path, row=document.row(("length_unit",)), key="length_unit")
    own, si = Values(document, CableUnits(length=unit)), Values(document, CableUnits())
    a = [own.vector(raw, ("frame_anchors", i), "m") for i, raw in enumerate(model.frame_anchors)]
    b = [own.vector(raw, ("platform_anchors", i), "m") for i, raw in enumerate(model.platform_anchors)]
    zeros = [si.number(v, ("initial_lengths_m", i), "m") for i, v in enumerate(model.initial_lengths_m or [])]
    m = len(a)
    for key, other in (("platform_anchors", b), ("initial_lengths_m", zeros)):
        if len(other) != m and (other or key == "platform_anchors"):
            document.fail(
                "not as many as frame anchors", (key,), found=len(other), expected=f"{m}, one for each frame anchor"
            )
    known: dict[str, Any] = {}
    if model.mass_kg is not None:
        known["mass"] = si.number(model.mass_kg, ("mass_kg",), "kg")
    if model.centre_of_mass_m is not None:
        known["com"] = si.vector(model.centre_of_mass_m, ("centre_of_mass_m",), "m")
    if model.tension_limits_N is not None:
        known["limits"] = np.tile(si.vector(model.tension_limits_N, ("tension_limits_N",), "N", 2), (m, 1))
    for key, field_, unit_ in (
        ("diameter_m", "diameter", "m"),
        ("elongation_per_N", "elasticity", "1/N"),
        ("weight_N_per_m", "density", "N/m"),
    ):
        raw = getattr(model.cable, key, None)
        if raw is not None:
            known[field_] = np.full(m, si.number(raw, ("cable", key), unit_))
    said = _comments(document)
    robot = cable_robot(
        model.name,
        np.array(a),
        np.array(b),
        zeros or None,
        sources={"": said} if said else {},
        assumed=_assumed(document, m),
        **known,
    )
    warnings = checked(robot, document)
    units = CableUnits(length=unit)
    return CableFile(robot, units, document.path, document.text, document.sha256, "published", warnings)


def _comments(document: Document) -> str:
    """The comment lines at the top."""
    head = []
    for line in document.text.splitlines():
        if not line.startswith("#"):
            break
        head.append(line.lstrip("# ").rstrip())
    return " ".join(head)


def _assumed(document: Document, m: int) -> tuple[str, ...]:
    """Names of values behind whose key `# assumed` is written."""
    lines = document.text.splitlines()
    names = {
        "frame_anchors": tuple(f"c{i + 1}.a" for i in range(m)),
        "platform_anchors": tuple(f"c{i + 1}.b" for i in range(m)),
        "initial_lengths_m": tuple(f"c{i + 1}.zero" for i in range(m)),
        "tension_limits_N": tuple(f"c{i + 1}.tension" for i in range(m)),
        "mass_kg": ("mass",),
        "centre_of_mass_m": ("com",),
    }
    out: list[str] = []
    for key, those in names.items():
        row = document.lines.get((key,))
        if row is not None and re.search(r"#\s*assumed", lines[row - 1]):
            out.extend(those)
    return tuple(out)


# --- CASPR -----------------------------------------------------------------------------------------------------------


@dataclass
class Node:
    """An element with its text, on line `row`."""

    tag: str
    attributes: dict[str, str]
    row: int
    file: Path
    text: str = ""
    children: list[Node] = field(default_factory=list)

    def all(self, tag: str) -> list[Node]:
        """Its children of this tag."""
        return [c for c in self.children if c.tag == tag]

    def one(self, tag: str) -> Node:
        """Its child of this tag. Raises FormatError when there is none."""
        found = self.all(tag)
        if not found:
            self.fail(f"<{self.tag}> has no <{tag}>")
        return found[0]

    def numbers(self, count: int) -> list[float]:
        """Its text as numbers. Raises FormatError."""
        try:
            out = [float(w) for w in self.text.replace(",", " ").split()]
        except ValueError:
            out = []
        if len(out) != count or not np.isfinite(out).all():
            self.fail("not numbers", found=self.text.strip(), expected=f"{count} finite numbers")
        return out

    def fail(self, message: str, **facts: Any) -> NoReturn:
        """Raises FormatError at this element."""
        raise FormatError(message, file=self.file, row=self.row, key=f"<{self.tag}>", **facts)


def read_caspr(source: Source) -> CableFile:
    """A robot of CASPR from `X_cables.xml`, with the body in `X_bodies.xml` beside it: one rigid body, ideal cables,
    the default cable set. Lengths in m, forces in N, masses in kg. Raises FileError or FormatError."""
    cables = _tree(source, "cables")
    name = source.path.name
    if not name.endswith("_cables.xml"):
        cables.fail("CASPR's bodies are looked for beside X_cables.xml", found=name, expected="a file X_cables.xml")
    beside = source.path.with_name(name.removesuffix("_cables.xml") + "_bodies.xml")
    if not beside.exists():
        raise FileError("the file of the bodies is not beside that of the cables", file=beside, found="nothing")
    body = _body(_tree(read_text(beside), "links"))
    rows = [_cable(node, body["com"]) for node in _default_set(cables).children]
    limits = np.array([row[2] for row in rows])
    title = source.path.name.removesuffix("_cables.xml")
    notes = {"": f"CASPR, {name} and {beside.name}"}
    robot = (
        cable_robot(title, [r[0] for r in rows], [r[1] for r in rows], limits=limits, sources=notes, **body)
        if rows
        else cables.fail("no cables")
    )
    document = Document(source.path, source.text, source.sha256, {}, {(): 1})
    return CableFile(robot, CableUnits(), source.path, source.text, source.sha256, "caspr", checked(robot, document))


def _tree(source: Source, expected: str) -> Node:
    """The tree of elements. A document type is skipped (CASPR writes one), an entity in it refused."""
    from xml.parsers import expat

    parser = expat.ParserCreate("utf-8")
    top: list[Node] = []
    stack: list[Node] = []

    def begin(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag, attributes, parser.CurrentLineNumber, source.path)
        (stack[-1].children if stack else top).append(node)
        stack.append(node)

    def said(text: str) -> None:
        if stack:
            stack[-1].text += text

    def refuse(*_: Any) -> NoReturn:
        raise FormatError("an entity is not accepted", file=source.path, row=parser.CurrentLineNumber)

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.CharacterDataHandler = said
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(source.text.encode("utf-8"), True)
    except expat.ExpatError as error:
        raise FormatError(
            f"not valid XML: {expat.ErrorString(error.code)}", file=source.path, row=error.lineno
        ) from None
    if top[0].tag != expected:
        top[0].fail("this is not that file of CASPR", expected=f"<{expected}>")
    return top[0]


def _default_set(cables: Node) -> Node:
    wanted = cables.attributes.get("default_cable_set")
    sets = cables.all("cable_set")
    found = next((s for s in sets if s.attributes.get("id") == wanted), None)
    if found is None:
        names = ", ".join(s.attributes.get("id", "") for s in sets)
        cables.fail("the default cable set is not there", found=wanted, expected=names or "a <cable_set>")
    return found


def _body(links: Node) -> dict[str, Any]:
    """Degrees of freedom, mass, centre of mass and inertia about it."""
    bodies = links.all("link_rigid")
    if len(bodies) != 1:
        links.fail("a platform is one rigid body", found=f"{len(bodies)} <link_rigid>", expected="one")
    body = bodies[0]
    if body.all("joint"):
        joint = body.one("joint").attributes.get("type", "")
    else:
        joint = body.one("joint_type").text.strip()
    if joint not in JOINTS:
        body.fail("this joint is not that of a cable robot's platform", found=joint, expected=", ".join(JOINTS))
    degrees, plane = JOINTS[joint]
    physical = body.one("physical")
    com = physical.one("com_location").numbers(3)
    tensor = physical.one("inertia")
    xx, yy, zz, xy, xz, yz = (tensor.one(f"I{k}").numbers(1)[0] for k in ("xx", "yy", "zz", "xy", "xz", "yz"))
    if tensor.attributes.get("ref", "com").lower() != "com":
        tensor.fail("the inertia is about another point", found=tensor.attributes["ref"], expected="com")
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    mass = physical.one("mass").numbers(1)[0]
    return {"degrees": degrees, "plane": plane, "mass": mass, "com": np.array(com), "inertia": inertia}


def _cable(node: Node, com: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Frame anchor, platform anchor from the body's origin, tension limits."""
    if node.tag != "cable_ideal":
        node.fail("only ideal cables are read", expected="<cable_ideal>")
    ends: dict[int, np.ndarray] = {}
    attachments = node.one("attachments").all("attachment")
    for end in attachments:
        link = int(end.one("link").numbers(1)[0])
        ends[link] = np.array(end.one("location").numbers(3))
    if sorted(ends) != [0, 1] or len(attachments) != 2:
        node.fail("a cable runs from the base (0) to the body (1)", found=f"links {[*ends]}", expected="links 0 and 1")
    reference = node.attributes.get("attachment_reference", "joint")
    if reference not in ("joint", "com"):
        node.fail("unknown attachment reference", found=reference, expected="joint, com")
    b = ends[1] + (com if reference == "com" else 0.0)
    limits = [node.one("properties").one(k).numbers(1)[0] for k in ("force_min", "force_max")]
    return ends[0], b, limits

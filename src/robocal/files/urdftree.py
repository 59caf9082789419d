"""XML as a tree of elements, and links and joints of a URDF as a tree of links; every complaint names the line.

A URDF is read by expat with document types refused, so no entity can expand. Positions of start tags are kept as
byte offsets.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Self, TypeVar

from robocal._record import record
from robocal.errors import FormatError, nearest, one_of
from robocal.files.text import FORBIDDEN, Source, forbidden_character

__all__ = [
    "MOVING",
    "RESERVED",
    "Node",
    "UrdfJoint",
    "check_xacro",
    "joints_of",
    "links_of",
    "longest",
    "owner_of",
    "refuse_cut",
    "root_of",
    "walk",
]

MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
TYPES = (*MOVING, "fixed", "floating", "planar")
RESERVED = ("base", "tool", "home", "1")


@dataclass(eq=False)
class Node:
    """An element of `file`: its start tag begins at byte `start`, on line `row`. `REFUSED` is what no file may have, as the handler
    of expat, and what is said of it."""

    REFUSED: ClassVar[tuple[str, str]] = ("StartDoctypeDeclHandler", "a document type (<!DOCTYPE>) is not accepted")

    tag: str
    attributes: dict[str, str]
    start: int
    row: int
    file: Path | None
    children: list[Self] = field(default_factory=list)

    @classmethod
    def parse(cls, text: str, path: Path | None) -> Self:
        """The outermost element of a text. Raises FormatError for malformed XML and for what is refused."""
        from xml.parsers import expat

        parser = expat.ParserCreate("utf-8")
        stack: list[Self] = []
        top: list[Self] = []
        pieces: dict[Self, list[str]] = {}

        def begin(tag: str, attributes: dict[str, str]) -> None:
            node = cls(tag, attributes, parser.CurrentByteIndex, parser.CurrentLineNumber, path)
            for name, value in attributes.items():
                if forbidden_character(value):
                    node.fail(FORBIDDEN, key=f"<{tag} {name}>", found=value)
            (stack[-1].children if stack else top).append(node)
            stack.append(node)

        def on_text(text: str) -> None:
            if stack:
                pieces.setdefault(stack[-1], []).append(text)

        def end(_: str) -> None:
            node = stack.pop()
            node.end("".join(pieces.pop(node, ())))

        def refuse(*_: Any) -> NoReturn:
            raise FormatError(cls.REFUSED[1], file=path, row=parser.CurrentLineNumber)

        parser.StartElementHandler = begin
        parser.EndElementHandler = end
        parser.CharacterDataHandler = on_text
        setattr(parser, cls.REFUSED[0], refuse)
        try:
            parser.Parse(_without_late_declaration(text.encode("utf-8")), True)
        except expat.ExpatError as error:
            raise FormatError(f"not valid XML: {expat.ErrorString(error.code)}", file=path, row=error.lineno) from None
        return top[0]

    def end(self, text: str) -> None:
        """Takes the text between the tags; a URDF says nothing by it."""

    def child(self, tag: str) -> Self | None:
        """The first child of this tag."""
        return next((c for c in self.children if c.tag == tag), None)

    def attribute(self, name: str) -> str:
        """An attribute that has to be there. Raises FormatError."""
        value = self.attributes.get(name, "").strip()
        if not value:
            self.fail(f"<{self.tag}> has no {name}", expected=f'<{self.tag} {name}="...">')
        return value

    def fail(self, message: str, **facts: Any) -> NoReturn:
        """Raises FormatError at this element."""
        raise FormatError(message, file=self.file, row=self.row, **facts)


N = TypeVar("N", bound=Node)
_LATE = re.compile(rb"\s*(?:<!--.*?-->\s*)+(<\?xml\s[^>]*\?>)|\s+(<\?xml\s[^>]*\?>)", re.DOTALL)


def _without_late_declaration(data: bytes) -> bytes:
    """The same with blanks for an XML declaration that a comment or blank lines precede: tools write such, XML forbids it, and nothing
    of it matters here. Every other byte stays where it is."""
    late = _LATE.match(data)
    if late is None:
        return data
    start, end = late.span(1 if late[1] else 2)
    return data[:start] + b" " * (end - start) + data[end:]


@record
class UrdfJoint:
    """One joint: the links it connects, and where it stands in the file."""

    name: str
    type: str
    parent: str
    child: str
    node: Node


def owner_of(node: Node) -> str:
    """The owner of a joint's parameters: its name, unless that is a frame's."""
    name = node.attribute("name")
    return f"{name}_joint" if name in RESERVED else name


def walk(node: N) -> Iterator[N]:
    """An element and all inside, in the order of the file: depth is the file's, which a call in a call could not follow."""
    stack = [node]
    while stack:
        at = stack.pop()
        yield at
        stack.extend(reversed(at.children))


def check_xacro(root: Node, source: Source) -> None:
    """A xacro source must be expanded first; a leftover namespace in an expanded file is harmless."""
    for node in walk(root):
        if node.tag.startswith("xacro:") or any(re.search(r"\$[{(]", v) for v in node.attributes.values()):
            stem = source.path.name.removesuffix(".xacro").removesuffix(".urdf")
            name = f"{stem}.urdf.xacro" if source.path.name.endswith(".urdf.xacro") else f"{stem}.xacro"
            node.fail("this is a xacro source, not a URDF", expected=f"its expansion: xacro {name} > {stem}.urdf")


def links_of(root: Node) -> dict[str, Node]:
    """The links by name. Raises FormatError for a name that is missing or used twice, and where there are none."""
    links: dict[str, Node] = {}
    for node in root.children:
        if node.tag == "link":
            name = node.attribute("name")
            if name in links:
                node.fail("a link name is used twice", found=name)
            links[name] = node
    if not links:
        root.fail("the URDF has no links")
    return links


def joints_of(root: Node, links: Mapping[str, Node]) -> list[UrdfJoint]:
    """The joints in the order of the file. Raises FormatError for one that is not complete, and for a link with two parents."""
    joints: list[UrdfJoint] = []
    names: set[str] = set()
    parents: dict[str, str] = {}
    for node in root.children:
        if node.tag != "joint":
            continue
        name, kind = node.attribute("name"), node.attribute("type")
        if name in names:
            node.fail("a joint name is used twice", found=name)
        names.add(name)
        if kind not in TYPES:
            node.fail("unknown joint type", key=f"joint {name} type", found=kind, **one_of(kind, TYPES))
        ends = []
        for word in ("parent", "child"):
            end = node.child(word)
            if end is None:
                node.fail(f"the joint has no {word}", key=f"joint {name}", expected=f'<{word} link="..."/>')
            link = end.attribute("link")
            if link not in links:
                key = f"joint {name} {word}"
                end.fail("there is no such link", key=key, found=link, suggestion=nearest(link, links))
            ends.append(link)
        if ends[1] in parents:
            key, both = f"joint {name}", f"joints {parents[ends[1]]} and {name}"
            node.fail(f"link {ends[1]} has two parents: the links form a loop", key=key, found=both)
        parents[ends[1]] = name
        joints.append(UrdfJoint(name, kind, ends[0], ends[1], node))
    return joints


def root_of(links: Mapping[str, Node], joints: list[UrdfJoint]) -> str:
    """The link that is no joint's child. Raises FormatError where there is more than one, and where links form a loop."""
    children = {j.child for j in joints}
    roots = [name for name in links if name not in children]
    if len(roots) > 1:
        found = ", ".join(roots[:5])
        links[roots[1]].fail("the URDF has more than one root link", found=found, expected="one tree")
    below = _below(joints)
    seen: set[str] = set()
    stack = roots[:]
    while stack:
        seen.add(at := stack.pop())
        stack.extend(j.child for j in below.get(at, ()))
    rest = [name for name in links if name not in seen]
    if rest:
        links[rest[0]].fail("the links form a loop", found=", ".join(rest[:5]), expected="one tree")
    return roots[0]


def _below(joints: list[UrdfJoint]) -> dict[str, list[UrdfJoint]]:
    """The joints whose parent each link is."""
    below: dict[str, list[UrdfJoint]] = {}
    for j in joints:
        below.setdefault(j.parent, []).append(j)
    return below


def longest(start: str, joints: list[UrdfJoint]) -> tuple[str, bool]:
    """The link with the most moving joints above it, then the most joints; whether there are others to choose from."""
    below = _below(joints)
    best, best_key, ends = start, (0, 0), 0
    stack = [(start, 0, 0)]
    while stack:
        link, moving, count = stack.pop()
        usable = [j for j in below.get(link, []) if follows(j)]
        # A second finger that mimics the first, or something that floats, is an end to choose from as well.
        ends += (not usable) + any(not follows(j) for j in below.get(link, ()))
        if (moving, count) > best_key:
            best, best_key = link, (moving, count)
        stack.extend((j.child, moving + (j.type in MOVING), count + 1) for j in reversed(usable))
    return best, ends > 1


def follows(joint: UrdfJoint) -> bool:
    """Whether a chain may pass a joint: it is fixed, or moves along or about an axis by a value of its own."""
    return joint.type in (*MOVING, "fixed") and joint.node.child("mimic") is None


def refuse_cut(base: str, tip: str, joints: list[UrdfJoint]) -> None:
    """Raises FormatError where more moving joints lie behind or at a joint that no chain can pass than lead to the tip: the arm would
    be cut short without a word."""
    below, into = _below(joints), {j.child: j for j in joints}
    mine, at = 0, tip
    while at != base:
        mine, at = mine + (into[at].type in MOVING), into[at].parent
    stack: list[tuple[str, int, UrdfJoint | None]] = [(base, 0, None)]
    while stack:
        link, moving, cut = stack.pop()
        if cut is not None and moving > mine:
            mimic, key = cut.node.child("mimic"), f"joint {cut.name}"
            if mimic is not None:
                found = mimic.attributes.get("joint")
                ahead = next((f"; --tip {j.parent}, if both move a gripper" for j in joints if j.name == found), "")
                mimic.fail(
                    "a joint that follows another (mimic) cannot be part of an arm", key=key, found=found,
                    expected=f"--tip {cut.parent}, if the arm ends there{ahead}",
                )  # fmt: skip
            cut.node.fail(
                "the arm hangs on a joint without an axis", key=key, found=cut.type, expected=f"--base {cut.child}"
            )
        for j in below.get(link, ()):
            stack.append((j.child, moving + (j.type in MOVING), cut if cut is not None or follows(j) else j))

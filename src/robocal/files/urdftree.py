"""A URDF as a tree of elements, and its links and joints as a tree of links; every complaint names the line.

The file is read by expat with document types refused, so no entity can expand. Positions of start tags are kept as
byte offsets.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from robocal.errors import FormatError, nearest, one_of
from robocal.files.names import SAID, strange_character
from robocal.files.text import Source

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
    "parse_tree",
    "root_of",
]

MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
TYPES = (*MOVING, "fixed", "floating", "planar")
RESERVED = ("base", "tool", "home", "1")


@dataclass
class Node:
    """An element: its start tag begins at byte `start`, on line `row`."""

    tag: str
    attributes: dict[str, str]
    start: int
    row: int
    children: list[Node] = field(default_factory=list)

    def child(self, tag: str) -> Node | None:
        """The first child of this tag."""
        return next((c for c in self.children if c.tag == tag), None)


@dataclass(frozen=True)
class UrdfJoint:
    """One joint: the links it connects, and where it stands in the file."""

    name: str
    type: str
    parent: str
    child: str
    node: Node

    @property
    def owner(self) -> str:
        """The owner of its parameters: its name, unless that is a frame's."""
        return f"{self.name}_joint" if self.name in RESERVED else self.name


def owner_of(node: Node) -> str:
    name = node.attributes.get("name", "")
    return f"{name}_joint" if name in RESERVED else name


def parse_tree(text: str, path: Path | None) -> Node:
    """The tree of elements. Raises FormatError for malformed XML and for a document type."""
    from xml.parsers import expat

    parser = expat.ParserCreate("utf-8")
    stack: list[Node] = []
    top: list[Node] = []

    def begin(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag, attributes, parser.CurrentByteIndex, parser.CurrentLineNumber)
        for name, value in attributes.items():
            if strange_character(value):
                raise FormatError(SAID, file=path, row=node.row, key=f"<{tag} {name}>", found=value)
        (stack[-1].children if stack else top).append(node)
        stack.append(node)

    def refuse(*_: Any) -> NoReturn:
        raise FormatError("a document type (<!DOCTYPE>) is not accepted", file=path, row=parser.CurrentLineNumber)

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text.encode("utf-8"), True)
    except expat.ExpatError as error:
        raise FormatError(f"not valid XML: {expat.ErrorString(error.code)}", file=path, row=error.lineno) from None
    return top[0]


def _walk(node: Node) -> Iterator[Node]:
    stack = [node]
    while stack:
        at = stack.pop()
        yield at
        stack.extend(reversed(at.children))


def check_xacro(root: Node, source: Source) -> None:
    """A xacro source must be expanded first; a leftover namespace in an expanded file is harmless."""
    for node in _walk(root):
        if node.tag.startswith("xacro:") or any(re.search(r"\$[{(]", v) for v in node.attributes.values()):
            stem = source.path.name.removesuffix(".xacro").removesuffix(".urdf")
            command = (
                f"xacro {stem}.urdf.xacro > {stem}.urdf"
                if source.path.name.endswith(".urdf.xacro")
                else f"xacro {stem}.xacro > {stem}.urdf"
            )
            raise FormatError(
                "this is a xacro source, not a URDF",
                file=source.path,
                row=node.row,
                expected=f"its expansion: {command}",
            )


def links_of(root: Node, path: Path) -> dict[str, Node]:
    links: dict[str, Node] = {}
    for node in root.children:
        if node.tag == "link":
            name = _attribute(node, "name", path)
            if name in links:
                raise FormatError("a link name is used twice", file=path, row=node.row, found=name)
            links[name] = node
    if not links:
        raise FormatError("the URDF has no links", file=path, row=root.row)
    return links


def joints_of(root: Node, links: Mapping[str, Node], path: Path) -> list[UrdfJoint]:
    joints: list[UrdfJoint] = []
    names: set[str] = set()
    parents: dict[str, str] = {}
    for node in root.children:
        if node.tag != "joint":
            continue
        name, kind = _attribute(node, "name", path), _attribute(node, "type", path)
        if name in names:
            raise FormatError("a joint name is used twice", file=path, row=node.row, found=name)
        names.add(name)
        if kind not in TYPES:
            raise FormatError(
                "unknown joint type",
                file=path,
                row=node.row,
                key=f"joint {name} type",
                found=kind,
                **one_of(kind, TYPES),
            )
        ends = []
        for word in ("parent", "child"):
            end = node.child(word)
            if end is None:
                raise FormatError(
                    f"the joint has no {word}",
                    file=path,
                    row=node.row,
                    key=f"joint {name}",
                    expected=f'<{word} link="..."/>',
                )
            link = _attribute(end, "link", path)
            if link not in links:
                key = f"joint {name} {word}"
                raise FormatError(
                    "there is no such link",
                    file=path,
                    row=end.row,
                    key=key,
                    found=link,
                    suggestion=nearest(link, links),
                )
            ends.append(link)
        if ends[1] in parents:
            key, both = f"joint {name}", f"joints {parents[ends[1]]} and {name}"
            raise FormatError(
                f"link {ends[1]} has two parents: the links form a loop", file=path, row=node.row, key=key, found=both
            )
        parents[ends[1]] = name
        joints.append(UrdfJoint(name, kind, ends[0], ends[1], node))
    return joints


def root_of(links: Mapping[str, Node], joints: list[UrdfJoint], path: Path) -> str:
    children = {j.child for j in joints}
    roots = [name for name in links if name not in children]
    if len(roots) > 1:
        found = ", ".join(roots[:5])
        raise FormatError(
            "the URDF has more than one root link", file=path, row=links[roots[1]].row, found=found, expected="one tree"
        )
    below: dict[str, list[str]] = {}
    for j in joints:
        below.setdefault(j.parent, []).append(j.child)
    seen: set[str] = set()
    stack = roots[:]
    while stack:
        seen.add(at := stack.pop())
        stack.extend(below.get(at, []))
    rest = [name for name in links if name not in seen]
    if rest:
        raise FormatError(
            "the links form a loop", file=path, row=links[rest[0]].row, found=", ".join(rest[:5]), expected="one tree"
        )
    return roots[0]


def longest(start: str, joints: list[UrdfJoint]) -> tuple[str, bool]:
    """The link with the most moving joints above it, then the most joints; whether there are others to choose from."""
    below: dict[str, list[UrdfJoint]] = {}
    for j in joints:
        below.setdefault(j.parent, []).append(j)
    best, best_key, ends = start, (0, 0), 0
    stack = [(start, 0, 0)]
    while stack:
        link, moving, count = stack.pop()
        usable = [j for j in below.get(link, []) if j.type in (*MOVING, "fixed") and j.node.child("mimic") is None]
        ends += not usable
        if (moving, count) > best_key:
            best, best_key = link, (moving, count)
        stack.extend((j.child, moving + (j.type in MOVING), count + 1) for j in reversed(usable))
    return best, ends > 1


def _attribute(node: Node, name: str, path: Path) -> str:
    value = node.attributes.get(name, "").strip()
    if not value:
        raise FormatError(f"<{node.tag}> has no {name}", file=path, row=node.row, expected=f'<{node.tag} {name}="...">')
    return value

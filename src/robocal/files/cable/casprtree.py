"""The XML of CASPR as a tree whose elements know what was asked of them: one that is given twice, text where none belongs and
entities are refused, and what nobody asked for is named."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field
from typing import Any, ClassVar, NoReturn, Self

import numpy as np

from robocal._record import dataclass
from robocal.errors import FormatError
from robocal.files.text import Source, line_of
from robocal.files.unread import near_miss, remark_unknown_names
from robocal.files.urdftree import Node, walk
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["CasprNode", "parse_caspr", "unheld", "unread_elements"]

# What CASPR writes for simulations of other things; a cable robot is the same without.
SILENT = {"end_location", "num", "operational_spaces", "operational_set", "end_effectors"}
NUMBER = "num"  # of a body: the files' own way to count, and there is one body
_QUIET = re.compile(r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>", re.DOTALL)
_ENTITY = re.compile(r"&(?!(?:amp|lt|gt|quot|apos);|#)[^;\s<&]*;?")


@dataclass(eq=False)
class CasprNode(Node):
    """An element with its text; `asked` are the tags and attributes that somebody wanted of it, `aside` says that nobody wants any of
    it."""

    REFUSED: ClassVar[tuple[str, str]] = ("EntityDeclHandler", "an entity is not accepted")
    text: str = ""
    asked: set[str] = field(default_factory=set)
    aside: bool = False

    def end(self, text: str) -> None:
        """Takes the text between the tags. Raises FormatError where there are elements as well."""
        self.text = text
        if self.children and text.strip():
            self.fail("text between elements", found=text.strip(), expected="elements alone")

    def all(self, tag: str) -> list[Self]:
        """Its children of this tag."""
        self.asked.add(tag)
        return [c for c in self.children if c.tag == tag]

    def every(self) -> list[Self]:
        """All its children, in order."""
        self.asked |= {c.tag for c in self.children}
        return self.children

    def one(self, tag: str) -> Self:
        """Its child of this tag. Raises FormatError when there is none, or more than one."""
        found = self.all(tag)
        if not found:
            near = near_miss(tag, [c.tag for c in self.children])
            self.fail(f"<{self.tag}> has no <{tag}>", suggestion=near)
        if len(found) > 1:
            rows = " and ".join(str(node.row) for node in found[:2])
            found[1].fail(f"<{self.tag}> has more than one <{tag}>", found=f"rows {rows}", expected="one")
        return found[0]

    def inside(self, tag: str) -> Self | None:
        """The first element of this tag anywhere inside, None where there is none: to say where something stands."""
        return next((node for child in self.children for node in walk(child) if node.tag == tag), None)

    def optional(self, name: str) -> str | None:
        """An attribute, None where it is absent."""
        self.asked.add(f"@{name}")
        return self.attributes.get(name)

    def numbers(self, count: int) -> list[float]:
        """Its text as numbers. Raises FormatError."""
        try:
            out = [float(w) for w in self.text.replace(",", " ").split()]
        except ValueError:
            out = []
        if len(out) != count or not np.isfinite(out).all() or self.children or "_" in self.text:
            found = f"<{self.children[0].tag}> inside" if self.children else self.text.strip()
            self.fail("not numbers", found=found, expected=f"{count} finite numbers")
        return out

    def fail(self, message: str, **facts: Any) -> NoReturn:
        """Raises FormatError at this element."""
        super().fail(message, **facts | {"key": f"<{self.tag}>"})


def parse_caspr(source: Source) -> CasprNode:
    """The tree of elements. A document type is skipped (CASPR writes one), an entity is refused: where it is declared in
    another file, a parser drops it without a word. Raises FormatError."""
    top = CasprNode.parse(source.text, source.path)
    plain = _QUIET.sub(lambda part: "\n" * part[0].count("\n"), source.text)
    entity = _ENTITY.search(plain)
    if entity is not None:
        row = line_of(plain, entity.start())
        raise FormatError("an entity is not accepted", file=source.path, row=row, found=entity[0])
    return top


def unread_elements(top: CasprNode) -> tuple[Remark, ...]:
    """One remark on the elements of a file that nobody asked for, and on attributes that look like one that was wanted."""
    found: dict[str, str | None] = {}
    for node in _elements_read(top):
        there = {c.tag for c in node.children}
        wanted = [tag for tag in node.asked if not tag.startswith("@") and tag not in there]
        for tag in dict.fromkeys(c.tag for c in node.children if c.tag not in node.asked and c.tag not in SILENT):
            found[f"<{tag}>"] = found.get(f"<{tag}>") or near_miss(tag, wanted)
        missing = [a[1:] for a in node.asked if a.startswith("@") and a[1:] not in node.attributes]
        for name in node.attributes:
            near = None if f"@{name}" in node.asked else near_miss(name, missing)
            if near is not None:
                found[name] = near
    return (remark_unknown_names(Code.ELEMENTS_UNREAD, top.file, found),) if found else ()


def unheld(top: CasprNode) -> tuple[str, ...]:
    """What a file says beside a cable robot, each once: elements for simulations of other things, and attributes that nobody
    asked for (names, ranges of joints, what a window shows)."""
    found: dict[str, None] = {}
    for node in _elements_read(top):
        here = dict.fromkeys(c.tag for c in node.children if c.tag in SILENT - node.asked)
        found |= {f"<{tag}>": None for tag in here if tag != NUMBER}
        found |= {
            f"{name} of <{node.tag}>": None
            for name in node.attributes
            if f"@{name}" not in node.asked and name != NUMBER
        }
    return tuple(found)


def _elements_read(top: CasprNode) -> Iterator[CasprNode]:
    """The elements of which something was read."""
    stack = [top]
    while stack:
        node = stack.pop()
        if not node.aside:
            yield node
            stack.extend(c for c in reversed(node.children) if c.tag in node.asked)

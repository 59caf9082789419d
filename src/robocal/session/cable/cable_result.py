"""What a verb of cable robots finds: a result about one robot, its document, its files and what its page says of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from shlex import quote
from typing import Any, ClassVar, TypeVar

from robocal._record import record
from robocal.cables.geometry import CableRobot
from robocal.files.cable.cablefile import CableFile
from robocal.files.parts import CableDocument
from robocal.remarks.remark import Remark, full_text
from robocal.report.cable.length_unit import LengthUnit
from robocal.report.cable.part import part
from robocal.report.sections import Detail, Facts, Section
from robocal.session.cable.statics_options import cable_document
from robocal.session.verb_base import VerbResult

__all__ = ["CableResult"]

D = TypeVar("D", bound=CableDocument)


@record(kw_only=True, eq=False)
class CableResult(VerbResult):
    """What a verb finds of a cable robot: its file, the robot with the mass and limits that were asked for."""

    file: CableFile

    title: ClassVar[str] = ""  # of its page
    lists_files = "always"

    @property
    def robot(self) -> CableRobot:
        """The robot."""
        return self.file.robot

    @property
    def length_unit(self) -> LengthUnit:
        """The unit in which a page tells lengths: that of the robot's file."""
        return LengthUnit(self.file.units.length.name, self.file.units.length.factor)

    @property
    def head(self) -> dict[str, Any]:
        """The robot and what the page is of."""
        return {"title": f"{self.robot.name}: {self.title}", "kind": "Cable robot"}

    def document_of(self, kind: type[D], /, **parts: Any) -> D:  # type: ignore[override]
        """The document of a verb, of its own `parts`."""
        return cable_document(kind, self.robot, self.remarks, self.inputs, self.command, **parts)

    def details(self) -> Iterator[Section]:
        """What its page has room for."""
        yield from ()

    @property
    def place(self) -> str:
        """The robot's file as the next command names it."""
        return quote(str(self.inputs[0].file)) if self.inputs else "ROBOT"

    def answer(self, *told: tuple[str, str], remarks: Iterable[Remark] = ()) -> Detail:
        """What a page says first: what was asked, what came out, what is assumed, what next, the last of `told`; pairs without words
        are left out."""
        *found, after = told
        assumed = self.robot.assumed
        much = (
            f"{len(assumed)} values of the robot's file, not measured; what was found depends on them"
            if assumed
            else ""
        )
        known = " ".join(f"{full_text(r)}" for r in remarks)
        pairs = (*found, ("Assumed", much), ("Worth knowing", known), after)
        return Detail(lambda: [Facts(tuple((name, words) for name, words in pairs if words))])

    def method_part(self, words: str, remarks: Iterable[Remark] = ()) -> Section:
        """How a page says that its result was worked out, and what of the robot was assumed."""
        assumed = ", ".join(self.robot.assumed)
        assumption = f"Assumed, not measured: {assumed}. The result depends on it." if assumed else ""
        return part("How it was worked out", "\n\n".join([words, assumption, *map(full_text, remarks)]), folded=True)

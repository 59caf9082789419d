"""What a verb of cable robots finds: a result about one robot, its document, its files and what its page says of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, ClassVar, TypeVar

from robocal._record import record
from robocal.cables.geometry import CableRobot
from robocal.files.cable.cablefile import CableFile
from robocal.files.parts import CableDocument
from robocal.remarks.remark import Remark, full_text
from robocal.report.cable.length_unit import LengthUnit
from robocal.report.cable.part import part
from robocal.report.sections import Section
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

    def method_part(self, words: str, remarks: Iterable[Remark] = ()) -> Section:
        """How a page says that its result was worked out, and what of the robot was assumed."""
        assumed = ", ".join(self.robot.assumed)
        assumption = f"Assumed, not measured: {assumed}. The result depends on it." if assumed else ""
        return part("How it was worked out", "\n\n".join([words, assumption, *map(full_text, remarks)]))

"""What a verb of cable robots finds: a result about one robot, its document, its files and what its page says of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from robocal.cables.geometry import CableRobot
from robocal.files.cable.cablefile import CableFile
from robocal.files.parts import CableDocument
from robocal.files.text import InputFile
from robocal.quantities import Listing
from robocal.remarks.remark import Remark, full_text
from robocal.report.cable.length_unit import LengthUnit
from robocal.report.cable.part import part
from robocal.report.sections import Section
from robocal.session.cable.statics_options import cable_document

__all__ = ["CableResult"]

D = TypeVar("D", bound=CableDocument)


@dataclass(frozen=True, kw_only=True, eq=False)
class CableResult(ABC):
    """What a verb finds of a cable robot: its file, the robot with the mass and limits that were asked for; what is to be said of it;
    `reasons`: why it must not be trusted; the files that were read, and by which command."""

    file: CableFile
    warnings: tuple[Remark, ...]
    reasons: tuple[Remark, ...] = ()
    inputs: tuple[InputFile, ...]
    command: str = ""

    title: ClassVar[str] = ""  # of its page

    @property
    def robot(self) -> CableRobot:
        """The robot."""
        return self.file.robot

    @property
    def length_unit(self) -> LengthUnit:
        """The unit in which a page tells lengths: that of the robot's file."""
        return LengthUnit(self.file.units.length.name, self.file.units.length.factor)

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """All that is to be said."""
        return (*self.warnings, *self.reasons)

    @property
    def trusted(self) -> bool:
        """Whether the exit status is 0."""
        return not self.reasons

    @property
    def printed(self) -> tuple[str | None, Listing | None]:
        """The list that belongs on stdout, as a CSV and as it is, where there is one."""
        return None, None

    @property
    def note(self) -> str:
        """One line on the whole, beside that list."""
        return ""

    @property
    @abstractmethod
    def document(self) -> CableDocument:
        """What --json says."""

    def texts(self) -> Mapping[str, str | bytes]:
        """The files of a folder, but its page."""
        return {}

    def document_of(self, kind: type[D], **parts: Any) -> D:
        """The document of a verb, of its own `parts`."""
        return cable_document(kind, self.robot, self.remarks, self.inputs, self.command, **parts)

    def method_part(self, words: str, remarks: Iterable[Remark] = ()) -> Section:
        """How a page says that its result was worked out, and what of the robot was assumed."""
        assumed = ", ".join(self.robot.assumed)
        assumption = f"Assumed, not measured: {assumed}. The result depends on it." if assumed else ""
        return part("How it was worked out", "\n\n".join([words, assumption, *map(full_text, remarks)]))

"""What every verb finds, whatever it does: remarks, a document, the files of a folder and the head of its page."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeVar

from robocal._record import record
from robocal.files.parts import Document, provenance_of
from robocal.files.text import InputFile
from robocal.quantities import Listing
from robocal.remarks.remark import Remark, remark_fields

if TYPE_CHECKING:
    from robocal.files.runfolder import Run

__all__ = ["VerbResult", "VerdictResult"]

D = TypeVar("D", bound=Document)


@record(kw_only=True, eq=False)
class VerbResult(ABC):
    """What a verb finds: what is to be said of it; `reasons`: why it must not be trusted; the files that were read, and by which
    command."""

    warnings: tuple[Remark, ...] = ()
    reasons: tuple[Remark, ...] = ()
    inputs: tuple[InputFile, ...] = ()
    command: str = ""

    # Whether its document names the files that were written: never, where there are some, or always.
    lists_files: ClassVar[Literal["never", "some", "always"]] = "some"

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
        """The list or file that belongs on stdout, as text and, of a list, as it is, where there is one."""
        return None, None

    @property
    def note(self) -> str:
        """One line on the whole, beside that list."""
        return ""

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page, as `report.page.page` takes it."""
        return {}

    @property
    def runs(self) -> Sequence[Run]:
        """The runs that a history may record."""
        return ()

    @property
    @abstractmethod
    def document(self) -> Any:
        """What --json says."""

    def texts(self) -> Mapping[str, str | bytes]:
        """The files of a folder, but its page."""
        return {}

    def document_of(self, kind: type[D], /, **parts: Any) -> D:
        """The document of a verb, of its own `parts`, with what was remarked on and read."""
        known: dict[str, Any] = {**remark_fields(self.remarks), "provenance": provenance_of(self.command, self.inputs)}
        return kind(**known, **parts)


class VerdictResult(VerbResult):
    """A result whose reasons stand beside its verdict, not among the remarks."""

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What is to be said beside the verdict."""
        return self.warnings

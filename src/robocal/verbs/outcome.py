"""What a verb hands back, however it was called."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from robocal._record import record, replace
from robocal.progress import Watch
from robocal.remarks.remark import Message
from robocal.report.sections import Section, Text

if TYPE_CHECKING:
    from robocal.quantities import Listing
    from robocal.session.verb_base import VerbResult

__all__ = ["Outcome", "Watch", "details", "path_sections", "run_verb"]

T = TypeVar("T")
R = TypeVar("R", bound="VerbResult")


@record
class _Constant:
    """A document that was made already."""

    document: Any

    def __call__(self) -> Any:
        return self.document


@record(eq=False)
class Outcome(Generic[T]):
    """What was found (`result`), its document for machines (a dataclass of `files.parts`), whether it may be trusted (status 0,
    else 3), the remarks, and the files that were written. `text`: a list or file that belongs on stdout where nothing was written; the
    remarks go beside it, to stderr, and so does `note`, one line on the whole. Without such a text the sections hold the remarks.
    `listing`: what `text` is the CSV of, for notebooks."""

    result: T
    document: Callable[[], Any]
    trusted: bool = True
    remarks: tuple[Message, ...] = ()
    text: str | None = None
    note: str = ""
    written: tuple[Path, ...] = ()
    listing: Listing | None = None

    @staticmethod
    def of(made: R) -> Outcome[R]:
        """Of a result that says all of this by itself."""
        text, listing = made.printed
        return Outcome(made, lambda: made.document, made.trusted, made.remarks, text, made.note, listing=listing)

    def __getstate__(self) -> dict[str, Any]:
        """For pickle: the document as it is."""
        return {**self.__dict__, "document": _Constant(self.document())}

    def put(self, place: Path | None) -> Outcome[T]:
        """The same with its text in a file, which the document names, where one is wanted."""
        from robocal.files.writing import write_text

        files = () if place is None or self.text is None else (write_text(place, self.text),)
        return self._with(files, str(files[0]) if files else None)

    def with_files(self, written: tuple[Path, ...]) -> Outcome[T]:
        """The same with the files that were written, which the document lists too."""
        return self._with(written, [str(p) for p in written])

    def _with(self, files: tuple[Path, ...], named: object) -> Outcome[T]:
        from robocal.files.plain import plain

        return replace(self, written=files, document=lambda: {**plain(self.document()), "written": named})


def run_verb(
    o: Any, files: Sequence[str], find: Callable[[], R], *tell: Callable[[Outcome[R]], Iterable[Section]]
) -> Outcome[R]:
    """What is found. `output` gets the text of it; where there are `files` it is a folder that gets them, the last a page of what is
    told; `history` grows by its runs. Raises FileError where one of `files` would be replaced."""
    from robocal.files.writing import refuse_existing, write_files, write_text

    refuse_existing(o.output, files, o.force)
    made = find()
    outcome = Outcome.of(made)
    if not files:
        return outcome.put(o.output)
    if made.lists_files == "always":
        outcome = outcome.with_files(())
    history: Path | None = getattr(o, "history", None)
    grown = ""
    if history is not None:  # before anything is written: it may be no history
        from robocal.session.runs import with_history

        grown = with_history(history, made.runs)
    written: tuple[Path, ...] = ()
    if o.output is not None:
        from robocal.files.plain import plain
        from robocal.report.page import page

        texts = dict(made.texts())
        if tell:
            told = [section for sections in tell for section in sections(outcome)]
            document = outcome.document()  # of which a page says how it was made, whatever else it lists
            recipe = document.get("provenance") if isinstance(document, dict) else getattr(document, "provenance", None)
            texts[files[-1]] = page(sections=told, recipe=plain(recipe), **made.head)
        written = write_files(o.output, texts)
    if history is not None:
        written = (*written, write_text(history, grown))
    if not written:
        return outcome
    outcome = replace(outcome, note="", written=written)
    return outcome if made.lists_files == "never" else outcome.with_files(written)


def path_sections(made: Outcome[Any]) -> Iterator[Section]:
    """Where the file is, of a verb whose text stands on stdout where nothing is written."""
    yield Section.of("", *(Text.of(str(path)) for path in made.written))


def details(made: Outcome[Any]) -> Iterator[Section]:
    """What a page has room for beside the sections of its verb."""
    yield from made.result.details()

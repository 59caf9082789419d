"""What a verb hands back, however it was called."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from robocal.progress import Watch
from robocal.remarks.remark import Message

if TYPE_CHECKING:
    from robocal.quantities import Listing
    from robocal.report.sections import Section
    from robocal.session.cable.cable_result import CableResult

__all__ = ["Outcome", "Watch", "run_cable_verb"]

T = TypeVar("T")
R = TypeVar("R", bound="CableResult")


@dataclass(frozen=True)
class _Constant:
    """A document that was made already."""

    document: Any

    def __call__(self) -> Any:
        return self.document


@dataclass(frozen=True, eq=False)
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

    def __getstate__(self) -> dict[str, Any]:
        """For pickle: the document as it is."""
        return {**self.__dict__, "document": _Constant(self.document())}

    def put(self, place: Path | None) -> Outcome[T]:
        """The same with its text in a file, which the document names, where one is wanted."""
        from robocal.files.writing import write_text

        files = () if place is None or self.text is None else (write_text(place, self.text),)
        return self._with(files, str(files[0]) if files else None)

    def with_page(
        self,
        folder: Path | None,
        told: Iterable[Section],
        texts: Callable[[], Mapping[str, str | bytes]],
        page: str,
        **head: Any,
    ) -> Outcome[T]:
        """The same with `texts` and a page of what is `told` in a folder, where one is wanted; `head` as of `report.page.page`."""
        if folder is None:
            return self
        from robocal.files.plain import plain
        from robocal.files.writing import write_files
        from robocal.report import page as report

        recipe = plain(self.document()).get("provenance")
        return self.with_files(
            write_files(folder, {**texts(), page: report.page(sections=told, recipe=recipe, **head)})
        )

    def recorded(self, place: Path | None, text: str | None) -> Outcome[T]:
        """The same with a file that grows, such as a history, written anew where there is a text."""
        if place is None or text is None:
            return self
        from robocal.files.writing import write_text

        return self.with_files((*self.written, write_text(place, text)))

    def with_files(self, written: tuple[Path, ...]) -> Outcome[T]:
        """The same with the files that were written, which the document lists too."""
        return self._with(written, [str(p) for p in written])

    def _with(self, files: tuple[Path, ...], named: object) -> Outcome[T]:
        from robocal.files.plain import plain

        return replace(self, written=files, document=lambda: {**plain(self.document()), "written": named})


def run_cable_verb(
    o: Any, files: Sequence[str], find: Callable[[], R], *tell: Callable[[Outcome[R]], Iterable[Section]]
) -> Outcome[R]:
    """What is found; a folder gets its files and a page of what is told. Raises FileError where one of `files` would be replaced."""
    from robocal.files.writing import refuse_existing

    refuse_existing(o.output, files, o.force)
    made = find()
    text, listing = made.printed
    note = made.note if o.output is None else ""
    outcome = Outcome(made, lambda: made.document, made.trusted, made.remarks, text, note, listing=listing)
    outcome = outcome.with_files(())
    told = (section for sections in tell for section in sections(outcome))
    title = f"{made.robot.name}: {made.title}"
    return outcome.with_page(o.output, told, made.texts, "report.html", title=title, kind="Cable robot")

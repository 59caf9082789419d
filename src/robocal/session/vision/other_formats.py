"""What `vision export` writes: a map of markers, or a lens, in the format of another program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from robocal._record import record
from robocal.errors import ModelError, one_of
from robocal.files.lens import FORMS, lens_text, read_lens
from robocal.files.map import COVARIANCE_SUFFIX, MAP_FORMS, is_map, map_covariance_text, map_text, read_map
from robocal.files.parts import Document, Origin
from robocal.files.text import InputFile
from robocal.quantities import Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.verb_base import VerbResult

__all__ = ["ExportedText", "export_text", "files_of"]

SUFFIXES = {".ply": "ply", ".json": "json", ".yaml": "robocal"}
WITHOUT_SIGMA = ("markermapper", "ply", "opencv", "ros", "kalibr")
WITHOUT_CORRELATION = ("tagslam",)


@record(kw_only=True)
class ExportDocument(Document):
    """What --json prints: map or lens, the format, and its text where no file was written."""

    what: str
    form: str
    text: str | None
    provenance: Origin


@record(kw_only=True, eq=False)
class ExportedText(VerbResult):
    """The text of a format, and the table of a map's covariance beside it."""

    what: str
    form: str
    text: str
    table: str | None = None
    files: tuple[str, ...] = ()

    @property
    def printed(self) -> tuple[str | None, Listing | None]:
        """The text, where it is not written."""
        return (None, None) if self.files else (self.text, None)

    @property
    def document(self) -> ExportDocument:
        """What --json says."""
        return self.document_of(ExportDocument, what=self.what, form=self.form, text=None if self.files else self.text)

    def texts(self) -> Mapping[str, str | bytes]:
        """The file, and the table beside it."""
        return dict(zip(self.files, (self.text, self.table or ""), strict=False))


def files_of(o: Any) -> tuple[str, ...]:
    """The files that an export writes beside one another."""
    if o.output is None:
        return ()
    made = export_text(o)
    return (o.output.name,) if made.table is None else (o.output.name, o.output.stem + COVARIANCE_SUFFIX)


def export_text(o: Any, command: str = "", files: tuple[str, ...] = ()) -> ExportedText:
    """A map or a lens in another format. Raises InputError."""
    if not is_map(o.file):
        lens = read_lens(o.file, o.camera or "")
        form = _form(o, FORMS)
        text = lens_text(lens.lens, form, o.camera or "camera")
        return _made("lens", form, text, None, lens.file, bool(lens.lens.known), o, command, files)
    read, form = read_map(o.file), _form(o, MAP_FORMS)
    known = read.map
    whole = form == "robocal" and known.covariance is not None
    if whole and o.output is None:
        expected = "-o FILE.yaml: the covariance is a table beside it"
        raise ModelError("a map with covariance is two files", key="--output", expected=expected)
    beside = Path(o.output).stem + COVARIANCE_SUFFIX if whole else ""
    table = map_covariance_text(known) if whole else None
    text = map_text(known, form, beside)
    return _made("map", form, text, table, read.file, known.covariance is not None, o, command, files)


def _form(o: Any, forms: Mapping[str, object]) -> str:
    """The format that was named, or that the name of the output says."""
    form = o.form or (None if o.output is None else SUFFIXES.get(o.output.suffix.lower()))
    if form not in forms:
        raise ModelError("no such format", key="--form", found=form, **one_of(form or "", forms))
    return str(form)


def _made(
    what: str, form: str, text: str, table: str | None, file: InputFile, sure: bool, o: Any, command: str, files: tuple[str, ...]
) -> ExportedText:  # fmt: skip
    said = list(file.remarks)
    if sure and form in (*WITHOUT_SIGMA, *WITHOUT_CORRELATION):
        lost = "correlations" if form in WITHOUT_CORRELATION else "sigma"
        said.append(Remark.of(Code.FORMAT_LACKS, form=form, what=lost))
    return ExportedText(
        what=what, form=form, text=text, table=table, files=files, warnings=tuple(said), inputs=(file,), command=command
    )

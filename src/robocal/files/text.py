"""Reading text safely: what every format here stands on. Writing is in `writing`.

What may not stand in a name, wherever names come from: they are written into terminals, CSV, YAML for ROS, URDF and HTML, and come
back from there. Control characters move the cursor of a terminal or change its colours, line breaks end a line of YAML, embeddings of
the other writing direction show a name as another one. Raw ones are refused when a text file is read (`decode`), those that YAML, JSON
and XML spell as escapes when these are understood.

A spreadsheet runs a cell that begins with = + - or @ as a formula. CSV are written so that it takes them for text, and are read so that
a name comes back as it went.

Tables that a data file names outside its own folder are read like any other, but no error repeats what they say (`discreet`). A data
file may come from a stranger, and name any file that its reader can open. A CSV in another folder is a good reason to look there; a file
that is none must not come back line by line in messages.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

from robocal._record import field, record
from robocal.errors import CONTROL, FileError, FormatError, InputError, nearest, reason_of
from robocal.files.encoding import encoding_of
from robocal.files.writing import guard
from robocal.remarks.remark import Remark

__all__ = [
    "FORBIDDEN",
    "InputFile",
    "MemoryFile",
    "Source",
    "discreet",
    "forbidden_character",
    "forbidden_part",
    "harmless",
    "line_of",
    "meant",
    "read_bytes",
    "read_text",
]

MEGABYTE = 1 << 20
FILE_LIMIT = 64 * MEGABYTE
LINE_LIMIT = MEGABYTE
ROBOT_LIMIT = 8 * MEGABYTE  # descriptions of machines: four seconds


@record
class Source:
    """A text file as it was read: `text` without byte-order mark (which is in `mark`), `sha256` of its bytes; `western` says that it was
    no UTF-8 and was read as Windows-1252."""

    path: Path
    text: str
    sha256: str
    mark: str = ""
    western: bool = False


@record
class InputFile:
    """A file that was read, and the hash of its bytes."""

    file: Path
    sha256: str
    remarks: tuple[Remark, ...] = field(default=(), compare=False)  # what its reader says of it


class MemoryFile(type(Path())):  # type: ignore[misc]
    """The path of a file that a program holds in memory: it is read like any other, and never looked for on a disk."""

    content: bytes | None = None

    @classmethod
    def of(cls, name: str, text: str) -> MemoryFile:
        """A text under a name that messages call it by."""
        made = cls(name)
        made.content = text.encode()
        return made


def read_bytes(path: str | os.PathLike[str], *, limit: int = FILE_LIMIT) -> bytes:
    """The bytes of a file of at most `limit` bytes. Raises FileError when it is missing, a folder, unreadable, too big
    or empty."""
    place = Path(path)
    if isinstance(path, MemoryFile) and path.content is not None:
        return path.content
    try:
        if place.is_dir():
            raise FileError("this is a folder", file=place, expected="a file")
        if place.exists() and not place.is_file():
            raise FileError("this is not an ordinary file", file=place, expected="a file")
        guard(place)
        with place.open("rb") as stream:
            data = stream.read(limit + 1)
    except FileNotFoundError:
        raise FileError("there is no such file", file=place, suggestion=_neighbour(place)) from None
    except (OSError, ValueError) as error:
        raise FileError(f"cannot be read: {reason_of(error)}", file=place) from None
    if len(data) > limit:
        raise FileError("the file is too big", file=place, expected=f"at most {_megabytes(limit)}")
    if not data.strip():
        raise FormatError("the file is empty", file=place)
    return data


def read_text(path: str | os.PathLike[str], *, limit: int = FILE_LIMIT, western: bool = False) -> Source:
    """A UTF-8 text file, with or without byte-order mark; `western` files may be Windows-1252, as spreadsheets write tables. Raises
    FileError for another encoding (which byte) or a line over 1 MB."""
    data = read_bytes(path, limit=limit)
    mark = "\ufeff" if data.startswith(b"\xef\xbb\xbf") else ""
    old = western and not mark and _is_western(data)
    return Source(Path(path), decode(data, path, old), hashlib.sha256(data).hexdigest(), mark, old)


def decode(data: bytes, path: object, western: bool = False) -> str:
    """Bytes to text: UTF-8, or what an XML declaration says, or Windows-1252 where that is asked for; no line over the limit, no byte 0
    but at the end of a line (a damaged line end)."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FileError("wrong encoding", file=path, found="UTF-16", expected="UTF-8: save the file as UTF-8")
    body = data.removeprefix(b"\xef\xbb\xbf")
    if len(body) > LINE_LIMIT:
        _check_lines(body, path)
    try:
        text = body.decode("cp1252" if western else encoding_of(body))
    except UnicodeDecodeError as error:
        at = error.start + len(data) - len(body)
        guess = body[error.start : error.start + 1].decode("cp1252", "replace")
        message = f"wrong encoding: byte {at} is not UTF-8 (it would be {guess!r} in Windows-1252)"
        row, found = body.count(b"\n", 0, error.start) + 1, f"0x{body[error.start]:02x}"
        raise FileError(message, file=path, row=row, found=found, expected="UTF-8: save the file as UTF-8") from None
    if "\0" in text:
        text = "\n".join(line.rstrip("\0\r") for line in text.split("\n"))
        if "\0" in text:
            row = line_of(text, text.index("\0"))
            raise FileError("a byte 0 inside the text", file=path, row=row, expected="a text file in UTF-8")
    strange = forbidden_character(text, lines=True)
    if strange is not None:
        message, row = "a control character inside the text", line_of(text, strange.start())
        raise FormatError(message, file=path, row=row, found=strange[0], expected="plain text")
    return text


def _is_western(data: bytes) -> bool:
    """Whether bytes are Windows-1252 and no UTF-8."""
    if data.isascii():
        return False
    for encoding, found in (("utf-8", False), ("cp1252", True)):
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            continue
        return found
    return False


def line_of(text: str, index: int) -> int:
    """The 1-based line number of a character."""
    return text.count("\n", 0, index) + 1


def _check_lines(data: bytes, path: object) -> None:
    start = 0
    while len(data) - start > LINE_LIMIT:
        last = data.rfind(b"\n", start, start + LINE_LIMIT + 1)
        if last < 0:
            end, row = data.find(b"\n", start), data.count(b"\n", 0, start) + 1
            found = f"{(len(data) if end < 0 else end) - start} bytes"
            expected = f"at most {_megabytes(LINE_LIMIT)}"
            raise FileError("a line is too long", file=path, row=row, found=found, expected=expected)
        start = last + 1


def _neighbour(path: Path) -> str | None:
    try:
        return nearest(path.name, [p.name for p in path.parent.iterdir()])
    except OSError:
        return None


def _megabytes(size: int) -> str:
    return f"{size // MEGABYTE} MB"


# --- names ------------------------------------------------------------------------------------------------------------------

FORBIDDEN = "a control character or line break inside a name or text"
FREE_TEXT = ("source", "provenance")  # keys whose texts may have several lines
_BUT_LINES = re.compile(CONTROL.pattern.replace(r"\x00-\x1f", r"\x00-\x08\x0b\x0c\x0e-\x1f"))
_SUSPECT = frozenset("'=+@-")  # what a cell begins with that is worth a look
_FORMULA = re.compile("'*[=+@-]")
_MEANT = re.compile("'+[=+@-]")


def forbidden_character(text: str, *, lines: bool = False) -> re.Match[str] | None:
    """The first character that no name may have; with `lines`, line breaks and tabs may stand."""
    return (_BUT_LINES if lines else CONTROL).search(text)


def forbidden_part(data: Any) -> tuple[str, str] | None:
    """Of plain mappings, lists and texts, the key and the text in which such a character stands."""
    stack: list[tuple[str, Any, bool]] = [("", data, False)]
    while stack:
        at, value, lines = stack.pop()
        if isinstance(value, dict):
            for key, part in value.items():
                if forbidden_character(key):
                    return at, key
                stack.append((f"{at}.{key}" if at else key, part, lines or key in FREE_TEXT))
        elif isinstance(value, list):
            stack += [(f"{at}[{i}]", part, lines) for i, part in enumerate(value) if not isinstance(part, int | float)]
        elif isinstance(value, str) and forbidden_character(value, lines=lines):
            return at, value
    return None


def harmless(cell: object) -> object:
    """A cell as a spreadsheet takes it for what it is: before a text that it would run stands an apostrophe."""
    if not isinstance(cell, str) or cell[:1] not in _SUSPECT or not _FORMULA.match(cell) or _is_number(cell):
        return cell
    return f"'{cell}"


def meant(cell: str) -> str:
    """The name that `harmless` was given."""
    return cell[1:] if cell[:1] == "'" and _MEANT.match(cell) else cell


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


# --- files outside of a folder ----------------------------------------------------------------------------------------------

P = ParamSpec("P")
R = TypeVar("R")
F = TypeVar("F", bound="str | os.PathLike[str] | Source")


def discreet(read: Callable[Concatenate[F, P], R]) -> Callable[Concatenate[F, P], R]:
    """A reader whose errors about a file outside the folder of the one that it was given say where and why, not what they
    found."""

    @functools.wraps(read)
    def reading(given: F, /, *args: P.args, **options: P.kwargs) -> R:
        try:
            return read(given, *args, **options)
        except InputError as error:
            place = given.path if isinstance(given, Source) else Path(given)
            if error.file is None or error.file == str(place) or not _outside(Path(error.file), place):
                raise
            column = error.column if _names_column(error.column, place) else None
            expected = f"what {place.name} describes; what it says is not repeated, for it lies outside that folder"
            raise type(error)(error.message, file=error.file, row=error.row, column=column, expected=expected) from None

    return reading


def _outside(table: Path, described: Path) -> bool:
    try:
        return not table.resolve().is_relative_to(described.parent.resolve())
    except (OSError, ValueError, RuntimeError):  # a loop of links, a byte 0
        return True


def _names_column(column: str | int | None, described: Path) -> bool:
    """Whether the describing file itself names a column; a header of the table is what the table says."""
    try:
        return isinstance(column, int) or (column is not None and column in described.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False

"""Reading text safely: what every format here stands on. Writing is in `writing`."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from robocal.errors import FileError, FormatError, nearest, reason_of
from robocal.files.journal import guard
from robocal.files.names import forbidden_character
from robocal.remarks.remark import Remark

__all__ = ["InputFile", "MemoryFile", "Source", "line_of", "read_bytes", "read_json", "read_text"]

MEGABYTE = 1 << 20
FILE_LIMIT = 64 * MEGABYTE
LINE_LIMIT = MEGABYTE
ROBOT_LIMIT = 8 * MEGABYTE  # descriptions of machines: four seconds


@dataclass(frozen=True)
class Source:
    """A text file as it was read: `text` without byte-order mark (which is in `mark`), `sha256` of its bytes."""

    path: Path
    text: str
    sha256: str
    mark: str = ""


@dataclass(frozen=True)
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


def read_text(path: str | os.PathLike[str], *, limit: int = FILE_LIMIT) -> Source:
    """A UTF-8 text file, with or without byte-order mark. Raises FileError for another encoding (which byte) or a line
    over 1 MB."""
    data = read_bytes(path, limit=limit)
    mark = "\ufeff" if data.startswith(b"\xef\xbb\xbf") else ""
    return Source(Path(path), decode(data, path), hashlib.sha256(data).hexdigest(), mark)


def decode(data: bytes, path: object) -> str:
    """Bytes to text: UTF-8 only, no line over the limit, no byte 0 but at the end of a line (a damaged line end)."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise FileError("wrong encoding", file=path, found="UTF-16", expected="UTF-8: save the file as UTF-8")
    body = data.removeprefix(b"\xef\xbb\xbf")
    if len(body) > LINE_LIMIT:
        _check_lines(body, path)
    try:
        text = body.decode("utf-8")
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
        row = line_of(text, strange.start())
        raise FormatError(
            "a control character inside the text", file=path, row=row, found=strange[0], expected="plain text"
        )
    return text


def read_json(path: str | os.PathLike[str], otherwise: str, expected: str) -> tuple[Source, dict[str, Any]]:
    """A JSON file and its object. Raises FileError, or FormatError naming the line; `otherwise` is said of what is no object."""
    source = read_text(path)
    try:
        data = json.loads(source.text)
    except json.JSONDecodeError as error:
        raise FormatError(f"not valid JSON: {error.msg}", file=source.path, row=error.lineno) from None
    except (RecursionError, ValueError):
        raise FormatError("not valid JSON", file=source.path) from None
    if not isinstance(data, dict):
        raise FormatError(otherwise, file=source.path, found=type(data).__name__, expected=expected)
    return source, data


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

"""Reading text safely and writing files whole: what every format here stands on.

Nothing is ever half-written: bytes go to a temporary name in the same folder, reach the disk, and are renamed; when
any step of several fails, or Ctrl-C arrives, the folder is as it was.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import signal
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from robocal.errors import FileError, FormatError

__all__ = ["Source", "line_of", "read_bytes", "read_text", "write_bytes", "write_files", "write_text"]

MEGABYTE = 1 << 20
FILE_LIMIT = 64 * MEGABYTE
LINE_LIMIT = MEGABYTE


@dataclass(frozen=True)
class Source:
    """A text file as it was read: `text` without byte-order mark (which is in `mark`), `sha256` of its bytes."""

    path: Path
    text: str
    sha256: str
    mark: str = ""


def read_bytes(path: str | os.PathLike[str], *, limit: int = FILE_LIMIT) -> bytes:
    """The bytes of a file of at most `limit` bytes. Raises FileError when it is missing, a folder, unreadable, too big
    or empty."""
    place = Path(path)
    try:
        if place.is_dir():
            raise FileError("this is a folder", file=place, expected="a file")
        if place.exists() and not place.is_file():
            raise FileError("this is not an ordinary file", file=place, expected="a file")
        with place.open("rb") as stream:
            data = stream.read(limit + 1)
    except FileNotFoundError:
        raise FileError("there is no such file", file=place, suggestion=_neighbour(place)) from None
    except (OSError, ValueError) as error:
        raise FileError(f"cannot be read: {_reason(error)}", file=place) from None
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
        raise FileError(
            f"wrong encoding: byte {at} is not UTF-8 (it would be {guess!r} in Windows-1252)",
            file=path,
            row=body.count(b"\n", 0, error.start) + 1,
            found=f"0x{body[error.start]:02x}",
            expected="UTF-8: save the file as UTF-8",
        ) from None
    if "\0" in text:
        text = "\n".join(line.rstrip("\0\r") for line in text.split("\n"))
        if "\0" in text:
            row = line_of(text, text.index("\0"))
            raise FileError("a byte 0 inside the text", file=path, row=row, expected="a text file in UTF-8")
    return text


def line_of(text: str, index: int) -> int:
    """The 1-based line number of a character."""
    return text.count("\n", 0, index) + 1


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Writes a whole UTF-8 file, or nothing."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> Path:
    """Writes a whole file, or nothing; its folder is made when it is missing."""
    place = Path(path)
    return write_files(place.parent, {place.name: data})[0]


def write_files(folder: str | os.PathLike[str], files: Mapping[str, bytes | str]) -> tuple[Path, ...]:
    """Writes several files into a folder, all of them or none. Raises FileError; existing files of these names are
    replaced."""
    home = Path(folder)
    targets = tuple(home / name for name in files)
    made = _make_folder(home)
    temporary: list[Path] = []
    try:
        for target, content in zip(targets, files.values(), strict=True):
            if target.is_dir():
                raise FileError("cannot be written: there is a folder of this name", file=target)
            if target.exists() and not target.is_file():
                # Renaming onto a device or a pipe would take it away from everybody.
                raise FileError("cannot be written: this is not an ordinary file", file=target)
            temporary.append(target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp"))
            _write_through(temporary[-1], content.encode("utf-8") if isinstance(content, str) else content)
        with _undisturbed():
            _rename_all(temporary, targets)
            made = []
    except (OSError, ValueError) as error:
        raise FileError(f"cannot be written: {_reason(error)}", file=targets[len(temporary) - 1]) from None
    finally:
        for leftover in temporary:
            leftover.unlink(missing_ok=True)
        for empty in made:
            with contextlib.suppress(OSError):
                empty.rmdir()
    return targets


def _make_folder(folder: Path) -> list[Path]:
    """Makes a folder with its parents; returns those that are new, innermost first."""
    missing: list[Path] = []
    try:
        at = folder
        while not at.exists():
            missing.append(at)
            at = at.parent
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"the folder cannot be made: {_reason(error)}", file=folder) from None
    return missing


def _write_through(path: Path, data: bytes) -> None:
    with path.open("xb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def _rename_all(temporary: list[Path], targets: tuple[Path, ...]) -> None:
    """Renames all; when one cannot be renamed, those before it get their old content back."""
    kept: list[tuple[Path, Path | None]] = []
    try:
        for source, target in zip(temporary, targets, strict=True):
            old = None
            if target.exists() and len(targets) > 1:
                old = target.with_name(source.name + ".old")
                os.replace(target, old)
            kept.append((target, old))
            os.replace(source, target)
    except OSError:
        for target, old in kept:
            target.unlink(missing_ok=True)
            if old is not None:
                os.replace(old, target)
        raise
    for _, old in kept:
        if old is not None:
            old.unlink(missing_ok=True)


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Holds Ctrl-C back while files are renamed: microseconds."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _check_lines(data: bytes, path: object) -> None:
    start, row = 0, 1
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        if end - start > LINE_LIMIT:
            raise FileError(
                "a line is too long",
                file=path,
                row=row,
                found=f"{end - start} bytes",
                expected=f"at most {_megabytes(LINE_LIMIT)}",
            )
        start, row = end + 1, row + 1


def _neighbour(path: Path) -> str | None:
    from robocal.errors import nearest

    try:
        return nearest(path.name, [p.name for p in path.parent.iterdir()])
    except OSError:
        return None


def _reason(error: Exception) -> str:
    return (getattr(error, "strerror", None) or str(error)).lower()


def _megabytes(size: int) -> str:
    return f"{size // MEGABYTE} MB"

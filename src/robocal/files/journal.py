"""The journal of a folder in which several files are being replaced: while it stands, none of them may be read.

It is a line per file name. Whoever writes announces first and finishes last; a process that ended in between left old and
new files side by side, and only writing them again makes them one thing.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Literal

from robocal.errors import FileError

__all__ = ["JOURNAL", "announce", "finish", "flush_folder", "guard", "write_through"]

JOURNAL = ".robocal-writing"


def announce(folder: Path, names: Iterable[str]) -> list[str]:
    """Says that these files are about to change, beside those that another command left unfinished, which it returns; on the disk
    before that."""
    before = _journal_names(folder)
    _write(folder, [*dict.fromkeys([*before, *names])])
    return before


def finish(folder: Path, names: Collection[str]) -> None:
    """Says that these have changed, all of them; what was renamed reaches the disk before the journal goes. What another command
    left unfinished stays named."""
    flush_folder(folder)
    left = [name for name in _journal_names(folder) if name not in names]
    if left:
        _write(folder, left)
    else:
        (folder / JOURNAL).unlink(missing_ok=True)
        flush_folder(folder)


def _journal_names(folder: Path) -> list[str]:
    """The names in the journal of a folder; none where there is no journal."""
    try:
        return (folder / JOURNAL).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return []


def _write(folder: Path, names: Sequence[str]) -> None:
    prepared = folder / (JOURNAL + ".new")
    try:
        write_through(prepared, "".join(f"{name}\n" for name in names).encode(), "wb")
        os.replace(prepared, folder / JOURNAL)
    except OSError:
        prepared.unlink(missing_ok=True)
        raise
    flush_folder(folder)


def write_through(path: Path, data: bytes, mode: Literal["wb", "xb"]) -> None:
    """Writes a file, which is on the disk when this returns; `xb` is for one that is not there yet."""
    with path.open(mode) as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())


def guard(path: Path) -> None:
    """Raises FileError for a file whose folder was being written when the process ended."""
    if path.name in _journal_names(path.parent):
        raise FileError(
            "the command that was writing this did not finish: old and new files may be mixed",
            file=path,
            expected="that command, once more",
        )


def flush_folder(folder: Path) -> None:
    """The names in a folder reach the disk, where the system can do that."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

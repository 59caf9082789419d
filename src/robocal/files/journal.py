"""The journal of a folder in which several files are being replaced: while it stands, none of them may be read.

It is a line per file name. Whoever writes announces first and finishes last; a process that ended in between left old and
new files side by side, and only writing them again makes them one thing.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path

from robocal.errors import FileError

__all__ = ["JOURNAL", "announce", "finish", "flush_folder", "guard"]

JOURNAL = ".robocal-writing"


def announce(folder: Path, names: Iterable[str]) -> None:
    """Says that these files are about to change; on the disk before this returns."""
    prepared = folder / (JOURNAL + ".new")
    try:
        with prepared.open("w", encoding="utf-8") as stream:
            stream.write("".join(f"{name}\n" for name in names))
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(prepared, folder / JOURNAL)
    except OSError:
        prepared.unlink(missing_ok=True)
        raise
    flush_folder(folder)


def finish(folder: Path) -> None:
    """Says that they have changed, all of them; what was renamed reaches the disk before the journal goes."""
    flush_folder(folder)
    (folder / JOURNAL).unlink(missing_ok=True)
    flush_folder(folder)


def guard(path: Path) -> None:
    """Raises FileError for a file whose folder was being written when the process ended."""
    try:
        named = (path.parent / JOURNAL).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return
    if path.name in named:
        raise FileError(
            "the command that was writing this did not end: old and new files may lie side by side",
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

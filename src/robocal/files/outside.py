"""Tables that a data file names outside its own folder are read like any other, but no error repeats what they say.

A data file may come from a stranger, and name any file that its reader can open. A CSV in another folder is a good reason to
look there; a file that is none must not come back line by line in messages.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

from robocal.errors import InputError
from robocal.files.text import Source

__all__ = ["discreet"]

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
            raise type(error)(
                error.message,
                file=error.file,
                row=error.row,
                column=error.column if _names_column(error.column, place) else None,
                expected=f"what {place.name} describes; what it says is not repeated, for it lies outside that folder",
            ) from None

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

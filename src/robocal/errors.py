"""Every exception that robocal raises on purpose; each carries its data.

RobocalError
├── InputError          something that a person gave us is wrong (exit status 2)
│   ├── FileError       a file cannot be read or written
│   ├── FormatError     a file was read, but its content is not what it should be
│   └── ModelError      a robot, parameter or option that makes no sense
├── MissingExtra        an optional dependency is not installed
└── Cancelled           a watcher asked a long function to stop (exit status 130)
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

__all__ = [
    "Cancelled",
    "FileError",
    "FormatError",
    "InputError",
    "MissingExtra",
    "ModelError",
    "RobocalError",
    "nearest",
]


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word closest to `word`, or None when nothing is close."""
    options = list(known)
    found = difflib.get_close_matches(word, options, n=1, cutoff=0.5)
    if not found:
        lowered = {option.lower(): option for option in options}
        found = [lowered[w] for w in difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=0.5)]
    return found[0] if found else None


class RobocalError(Exception):
    """The root of the tree."""


class InputError(RobocalError):
    """Something given from outside is wrong; says where, what was found and what was expected."""

    def __init__(
        self,
        message: str,
        *,
        file: object = None,
        row: int | None = None,
        column: str | int | None = None,
        key: str | None = None,
        found: object = None,
        expected: object = None,
        suggestion: str | None = None,
    ) -> None:
        self.message = message
        self.file = None if file is None else str(file)
        self.row = row
        self.column = column
        self.key = key
        self.found = found
        self.expected = expected
        self.suggestion = suggestion
        super().__init__(str(self))

    def __str__(self) -> str:
        place = [self.file] if self.file else []
        if self.row is not None:
            place.append(f"row {self.row}")
        if self.column is not None:
            place.append(f"column {self.column}")
        if self.key is not None:
            place.append(f"key {self.key}")
        text = f"{', '.join(place)}: {self.message}" if place else self.message
        if self.found is not None:
            text += f"; found {_short(self.found)}"
        if self.expected is not None:
            text += f"; expected {self.expected}"
        if self.suggestion:
            text += f"; did you mean {self.suggestion!r}?"
        return text


class FileError(InputError):
    """A file that cannot be read or written."""


class FormatError(InputError):
    """A file whose content is not what it should be."""


class ModelError(InputError):
    """A robot, parameter or option that makes no sense."""


class MissingExtra(RobocalError):
    """An optional dependency is not installed; carries the pip line that installs it."""

    def __init__(self, extra: str, package: str) -> None:
        self.extra = extra
        self.package = package
        super().__init__(f"this needs {package}: pip install 'robocal[{extra}]'")


class Cancelled(RobocalError):
    """Raised by a watcher to stop a long function cleanly."""


def _short(value: object) -> str:
    text = value if isinstance(value, str) else repr(value)
    text = text if len(text) <= 80 else text[:77] + "..."
    return repr(text) if isinstance(value, str) else text

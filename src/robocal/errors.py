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
    """The known word closest to `word` by insertions, deletions, changes and swaps; None when none is close."""
    lowered = word.lower()
    scored = [(_distance(lowered, option.lower()), option) for option in known]
    if not scored:
        return None
    best, option = min(scored, key=lambda pair: pair[0])
    return option if best <= max(1, len(word) // 2) and best < len(option) else None


def _distance(a: str, b: str) -> int:
    """Optimal string alignment (Damerau 1964): a swap of neighbours, the commonest slip, costs as much as one letter."""
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, x in enumerate(a, start=1):
        last, before, row = before, row, [i]
        for j, y in enumerate(b, start=1):
            row.append(min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (x != y)))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                row[j] = min(row[j], last[j - 2] + 1)
    return row[-1]


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

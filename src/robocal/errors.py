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

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypedDict, TypeVar, Unpack

__all__ = [
    "CONTROL",
    "MESSAGE_LIMIT",
    "Cancelled",
    "FileError",
    "FormatError",
    "InputError",
    "MissingExtra",
    "ModelError",
    "RobocalError",
    "ToWrite",
    "look_up",
    "nearest",
    "one_of",
    "printable",
    "reason_of",
    "require",
    "require_one_of",
    "shorten",
]


T = TypeVar("T")
# What a person can take in at once, and what a slip of the pen can be looked for in.
MESSAGE_LIMIT = 400
FOUND_LIMIT = 80
WORD_LIMIT = 64
WORK_LIMIT = 400_000  # cells of the table of distances: a tenth of a second

# What moves the cursor, changes the colour or the direction of a text: control characters, line separators, embeddings.
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word closest to `word` by insertions, deletions, changes and swaps; None when none is close.

    A slip changes few letters: words that differ in length by more are passed over, words over 64 letters are nobody's slip,
    and of very many words those are tried that are most nearly as long.
    """
    if len(word) > WORD_LIMIT:
        return None
    lowered, slips, work = word.lower(), max(1, len(word) // 2), 0
    best, found = slips + 1, None
    near = (k for k in known if len(k) <= WORD_LIMIT and abs(len(k) - len(word)) <= slips)
    for option in sorted(near, key=lambda k: abs(len(k) - len(word))):
        work += (len(word) + 1) * (len(option) + 1)
        if work > WORK_LIMIT:
            break
        distance = _distance(lowered, option.lower())
        if distance < best and distance < len(option):
            best, found = distance, option
    return found


def one_of(word: object, known: Iterable[str]) -> dict[str, Any]:
    """What an error says of a word that is none of the known ones: `expected` lists these, `suggestion` is the nearest."""
    names = tuple(known)
    return {"expected": ", ".join(names), "suggestion": nearest(str(word), names)}


def look_up(known: Mapping[str, T], name: str, message: str, key: str | None = None) -> T:
    """The entry with this name. Raises ModelError with the nearest name."""
    if name not in known:
        raise ModelError(message, key=key, found=name, **one_of(name, known))
    return known[name]


def require(condition: object, message: str, **facts: Unpack[_FieldsOfError]) -> None:
    """Raises ModelError with this message where a condition does not hold."""
    if not condition:
        raise ModelError(message, **facts)


def require_one_of(name: str, known: Sequence[str], message: str) -> None:
    """Raises ModelError, with the nearest name, for one that is none of a few."""
    if name not in known:
        raise ModelError(message, found=name, expected=" or ".join(known), suggestion=nearest(name, known))


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


def printable(text: str) -> str:
    """A text on one line of a terminal: what would move the cursor or change colours is spelt out (`\\x1b`)."""
    return CONTROL.sub(lambda c: c[0].encode("unicode_escape", "backslashreplace").decode("ascii"), text)


def reason_of(error: Exception) -> str:
    """What the system says of an error, without its number."""
    return (getattr(error, "strerror", None) or str(error)).lower()


def shorten(text: str, most: int) -> str:
    """A text of at most `most` characters; what is too much goes from its middle."""
    if len(text) <= most:
        return text
    tail = (most - 3) // 2
    return f"{text[: most - 3 - tail]}...{text[len(text) - tail :]}"


def _fitting(parts: list[str], most: int) -> list[str]:
    """Parts that together have at most `most` characters: the longest are shortened, all to one length."""
    if sum(map(len, parts)) <= most:
        return parts
    left, share = most, 0
    for i, size in enumerate(sorted(map(len, parts))):
        share = left // (len(parts) - i)
        if size > share:
            break
        left -= size
    return [shorten(part, share) for part in parts]


class ToWrite(str):
    """What a person is to copy into a file, as it stands: it is never shortened."""


def _as_text(value: object) -> str:
    return value if isinstance(value, ToWrite) else str(value)


class RobocalError(Exception):
    """The root of the tree."""


class _FieldsOfError(TypedDict, total=False):
    """What an error says beside its message: where, what was found and what was expected."""

    file: object
    row: int | None
    column: str | int | None
    key: str | None
    argument: str | None
    found: object
    expected: object
    suggestion: str | None


class InputError(RobocalError):
    """Something given from outside is wrong; says where, what was found and what was expected."""

    def __init__(self, message: str, **facts: Unpack[_FieldsOfError]) -> None:
        self.message = message
        self.file = None if facts.get("file") is None else str(facts["file"])
        self.row = facts.get("row")
        self.column = facts.get("column")
        self.key = facts.get("key")
        self.argument = facts.get("argument")
        self.found = facts.get("found")
        self.expected = facts.get("expected")
        self.suggestion = facts.get("suggestion")
        super().__init__(str(self))

    def of_file(self, file: object, **place: Any) -> FormatError:
        """The same of what a file says, with another place in it where one is given."""
        facts = ("row", "column", "key", "found", "expected", "suggestion")
        return FormatError(self.message, file=file, **({k: getattr(self, k) for k in facts} | place))

    def __str__(self) -> str:
        place = [self.file] if self.file else []
        if self.row is not None:
            place.append(f"row {self.row}")
        if self.column is not None:
            place.append(f"column {self.column}")
        if self.argument is not None:
            place.append(f"argument {self.argument}")
        if self.key is not None:
            place.append(self.key if self.key.startswith("--") else f"key {self.key}")  # an option names itself
        parts = [*place, self.message]
        marks = [*([", "] * (len(place) - 1)), *([": "] if place else []), ""]
        for mark, said in (
            ("; found ", None if self.found is None else _short(self.found)),
            ("; expected ", None if self.expected is None else _as_text(self.expected)),
            ("; did you mean ", f"{self.suggestion!r}?" if self.suggestion else None),
        ):
            if said is not None:
                marks[-1] = mark
                parts.append(said)
                marks.append("")
        plain = [printable(part) for part in parts]
        free = [i for i, part in enumerate(parts) if not isinstance(part, ToWrite)]
        fitting = _fitting([plain[i] for i in free], MESSAGE_LIMIT - 1 - sum(map(len, marks)))
        for i, part in zip(free, fitting, strict=True):
            plain[i] = part
        return "".join(part + mark for part, mark in zip(plain, marks, strict=True))


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
    text = shorten(value if isinstance(value, str) else _spelt(value), FOUND_LIMIT)
    return repr(text) if isinstance(value, str) else text


def _spelt(value: object) -> str:
    """What Python would write, of a list or mapping that may be huge: its beginning and its size."""
    from reprlib import Repr

    brief = Repr()
    brief.maxlist = brief.maxtuple = brief.maxdict = brief.maxset = 12
    brief.maxstring = brief.maxother = brief.maxlong = FOUND_LIMIT
    return brief.repr(value)

"""A remark is a code with its numbers; its sentence and its advice stand beside the code, in `english`.

    Remark.of(Code.GAIN_PROVEN, gain=Quantity(3.5e-4, "m"), low=..., high=..., how="held out")

Templates are those of `str.format`. A part in square brackets is said only where every number that it names is there (not
None): "{rms:.3g} rms[, where {stated:.3g} of noise was stated]". Whoever decides on a remark looks at its code and its
numbers, never into its sentence.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from string import Formatter
from typing import Any, Protocol, TypeAlias

from robocal._record import record
from robocal.remarks import english

__all__ = [
    "Message",
    "Number",
    "Quantity",
    "Remark",
    "documents",
    "full_text",
    "percent",
    "remark_fields",
    "sentences",
    "singular",
]

# Factor from SI, and the unit in which people read it.
SHOWN = {"m": (1e3, "mm"), "rad": (180 / math.pi, "deg"), "px": (1.0, "px")}
MANY, LONGEST = 12, 160  # names that a sentence lists, and characters of one
# What sentences count, and the verbs that follow.
NOUNS = (
    "rows",
    "poses",
    "measurements",
    "numbers",
    "parameters",
    "cables",
    "motions",
    "parts",
    "holes",
    "places",
    "draws",
    "unknowns",
    "joints",
    "configurations",
    "visits",
    "targets",
    "trials",
    "points",
    "cells",
    "files",
    "folds",
)
VERBS = {
    "were": "was",
    "are": "is",
    "have": "has",
    "leave": "leaves",
    "end": "ends",
    "equal": "equals",
    "explain": "explains",
}
_ONE = re.compile(rf"(?<![\w.,-])1 ({'|'.join(NOUNS)})\b(?: ({'|'.join(VERBS)})\b)?")
_OPTIONAL = re.compile(r"\[([^\[\]]*)\]")


@record
class Quantity:
    """A number with its SI unit (m, rad, px); formatted, it reads in mm, deg or px. A format that ends in ~ leaves the unit
    out: "{low:.4g~} to {high:.4g}" is "1.2 to 3.4 mm"."""

    value: float
    unit: str = "m"

    def __format__(self, spec: str) -> str:
        factor, word = SHOWN.get(self.unit, (1.0, self.unit))
        number = f"{self.value * factor:{spec.rstrip('~') or '.3g'}}"
        return number if spec.endswith("~") or word in ("", "1") else f"{number} {word}"


Number: TypeAlias = "str | int | float | Quantity | tuple[str, ...] | tuple[int, ...] | None"


@record
class Remark:
    """One thing said: what (`code`) and of what (`numbers`: names, rows, amounts in SI)."""

    code: str  # of the table of codes, or one that a check declares beside itself
    items: tuple[tuple[str, Number], ...] = ()

    @classmethod
    def of(cls, code: str, **numbers: Number) -> Remark:
        """A remark with its numbers by name."""
        return cls(code, tuple(numbers.items()))

    @property
    def numbers(self) -> Mapping[str, Number]:
        """The numbers by name."""
        return dict(self.items)

    @property
    def sentence(self) -> str:
        """The sentence, without a full stop."""
        return _fill(english.phrase_of(self.code).sentence, self.numbers)

    @property
    def advice(self) -> str:
        """What to do about it; empty where there is nothing to do."""
        return _fill(english.phrase_of(self.code).advice, self.numbers)

    @property
    def document(self) -> dict[str, Any]:
        """The same for machines: code, sentence, advice and numbers, quantities in the unit in which they are shown."""
        return {
            "code": self.code,
            "sentence": self.sentence,
            "advice": self.advice,
            "numbers": {k: _plain(v) for k, v in self.items if v is not None},
        }

    def of_file(self, file: object) -> Remark:
        """The same remark on what a file says."""
        return Remark(self.code, (("file", str(file)), *self.items))

    def __str__(self) -> str:
        return self.sentence


class Message(Protocol):
    """What can be shown: a remark, or what result.json keeps of one."""

    @property
    def sentence(self) -> str:
        """The sentence, without a full stop."""
        ...

    @property
    def advice(self) -> str:
        """What to do about it, or nothing."""
        ...


def full_text(said: Message) -> str:
    """Sentence and advice as one text."""
    return f"{said.sentence}. {said.advice}" if said.advice else said.sentence


def sentences(remarks: Iterable[Remark]) -> list[str]:
    """The sentences of remarks, each once."""
    return [r.sentence for r in dict.fromkeys(remarks)]


def documents(remarks: Iterable[Remark]) -> list[dict[str, Any]]:
    """Remarks for machines, each once."""
    return [r.document for r in dict.fromkeys(remarks)]


def remark_fields(remarks: Iterable[Remark], word: str = "warnings") -> dict[str, Any]:
    """What a document says of remarks: their sentences under `word`, the same as data under "remarks"."""
    once = tuple(dict.fromkeys(remarks))
    return {word: sentences(once), "remarks": documents(once)}


def _fill(template: str, numbers: Mapping[str, Number]) -> str:
    known = {k: _shorten_number(v) for k, v in numbers.items() if v is not None}

    def keep_part(part: re.Match[str]) -> str:
        names = {name for _, name, _, _ in Formatter().parse(part[1]) if name}
        return part[1] if names <= set(known) else ""

    return singular(_Spoken().format(_OPTIONAL.sub(keep_part, template), **known))


def singular(text: str) -> str:
    """A sentence that speaks of one thing as of one, where it counts in the plural: "1 rows were" is "1 row was"."""
    return _ONE.sub(lambda found: f"1 {found[1][:-1]}" + (f" {VERBS[found[2]]}" if found[2] else ""), text)


class _Spoken(Formatter):
    """As `str.format`, where a percentage has the space that it has in every other number with its unit."""

    def format_field(self, value: Any, format_spec: str) -> str:
        return percent(value, format_spec) if format_spec.endswith("%") else str(format(value, format_spec))


def percent(share: float, spec: str = ".0%") -> str:
    """A share as people read it: 36 %."""
    return f"{format(share, spec)[:-1]} %"


def _shorten_number(value: Number) -> Number:
    """What a sentence says of a number: of many names the first and the last, of a long name its ends."""
    if isinstance(value, str):
        return _brief(value, LONGEST)
    if not isinstance(value, tuple):
        return value
    words = [_brief(str(v), LONGEST // 2) for v in value]
    return ", ".join(words if len(words) <= MANY else [*words[: MANY - 3], f"... ({len(words)} in all)", *words[-2:]])


def _brief(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most // 2 - 2]}...{text[1 - most // 2 :]}"


def _plain(value: Number) -> object:
    if isinstance(value, Quantity):
        factor, word = SHOWN.get(value.unit, (1.0, value.unit))
        return {"value": value.value * factor, "unit": word}
    return list(value) if isinstance(value, tuple) else value

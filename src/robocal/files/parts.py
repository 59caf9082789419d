"""What several parts of a result are made of: numbers that may be missing, what is said as data, rows that were not read."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, TypeAlias

from robocal._record import field, record
from robocal._version import __version__
from robocal.files.text import InputFile
from robocal.remarks.remark import Remark as Said

__all__ = [
    "SCHEMA",
    "CableDocument",
    "Document",
    "InputHash",
    "Number",
    "Origin",
    "RemarkPart",
    "RowsLeftOut",
    "hashes",
    "provenance_of",
    "unique_remarks",
]  # fmt: skip

SCHEMA = 2  # of documents that only people and their programs read: a key has no unit in its name, the unit stands beside the number

Number: TypeAlias = float | None  # null, where there is no number


@record(kw_only=True)
class RemarkPart:
    """What is said, as data: its code, its sentence, what to do about it, and its numbers by name."""

    code: str
    sentence: str
    advice: str = ""
    numbers: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, said: Said) -> RemarkPart:
        """What a file keeps of a remark."""
        return cls(**said.document)


def unique_remarks(remarks: Iterable[Said]) -> list[RemarkPart]:
    """What a file keeps of remarks, each once."""
    return [RemarkPart.of(r) for r in dict.fromkeys(remarks)]


@record(kw_only=True)
class InputHash:
    """An input file and the SHA-256 of its bytes."""

    file: str
    sha256: str


@record(kw_only=True)
class Origin:
    """What made a document."""

    version: str
    command: str
    inputs: list[InputHash]


def hashes(inputs: Iterable[InputFile]) -> list[InputHash]:
    """What a document keeps of the files that were read."""
    return [InputHash(file=str(i.file), sha256=i.sha256) for i in inputs]


def provenance_of(command: str, inputs: Iterable[InputFile]) -> Origin:
    """What makes a document: this version, by a command, of these files."""
    return Origin(version=__version__, command=command, inputs=hashes(inputs))


@record(kw_only=True)
class Document:
    """What every document holds: its schema, the sentences of its remarks and the same as data."""

    robocal: int = SCHEMA
    warnings: list[str]
    remarks: list[Any]


@record(kw_only=True)
class CableDocument(Document):
    """What every document on a cable robot holds; `assumed` are values that nobody measured."""

    robot: str
    cables: tuple[str, ...]
    assumed: tuple[str, ...]
    provenance: Origin


@record(kw_only=True)
class RowsLeftOut:
    """Rows of a file that were not read, as an editor numbers lines, and why."""

    file: str
    rows: list[int]
    why: Literal["excluded", "missing"]

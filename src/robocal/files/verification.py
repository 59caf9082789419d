"""verify.json: what `verify` finds, and what `report` draws its page of again."""

from __future__ import annotations

from typing import Generic, TypeVar

from robocal._record import record
from robocal.apply.verification import Anova
from robocal.files.parts import SCHEMA, Document, Origin
from robocal.quantities import Amount, DisplayUnit, Listing

__all__ = ["Agreed", "ErrorSpread", "PosePair", "SummaryDocument", "VerifyDocument"]

T = TypeVar("T")


@record
class ErrorSpread:
    """The errors of one source in one view."""

    unit: DisplayUnit
    n: int
    mean: Amount
    sd: Amount | None
    max: Amount


@record
class Agreed:
    """Root mean squares of what two sources differ by, what each errs by itself (null: none left), and the two that share an error."""

    unit: str
    apart: dict[str, float]
    own: dict[str, float]
    shared: list[str] | None


@record
class PosePair(Generic[T]):
    """The same of positions and of orientations."""

    position: T
    orientation: T


@record(kw_only=True)
class VerifyDocument(Document):
    """verify.json."""

    reference: str
    poses: tuple[str, ...]
    sources: dict[str, dict[str, PosePair[ErrorSpread]]]
    anova: dict[str, PosePair[Anova]]
    agreement: PosePair[Agreed] | None
    provenance: Origin


@record(kw_only=True)
class SummaryDocument:
    """What --summary prints."""

    robocal: int = SCHEMA
    groups: tuple[str, ...]
    anova: dict[str, Anova]
    provenance: Origin

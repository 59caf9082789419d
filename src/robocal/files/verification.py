"""verify.json: what `verify` finds, and what `report` draws its page of again."""

from __future__ import annotations

from typing import Generic, TypeAlias, TypeVar

from robocal._record import field, record
from robocal.apply.verification import Anova
from robocal.files.parts import SCHEMA, Document, Origin
from robocal.quantities import Amount, DisplayUnit, Listing

__all__ = ["Agreed", "ErrorSpread", "PosePair", "SummaryDocument", "VerifyDocument", "Views"]

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


Views: TypeAlias = dict[str, PosePair[ErrorSpread]]


@record(kw_only=True)
class VerifyDocument(Document):
    """verify.json: errors of every source by view, of every two sources (`between`) and, where poses have a group, by group (`lists`);
    `places` are poses that are drawn: of the reference, and how far a source is from each."""

    reference: str
    poses: tuple[str, ...]
    sources: dict[str, Views]
    between: dict[str, Views] = field(default_factory=dict)
    lists: dict[str, dict[str, Views]] = field(default_factory=dict)
    places: Listing | None = None
    anova: dict[str, PosePair[Anova]]
    agreement: PosePair[Agreed] | None
    provenance: Origin


@record(kw_only=True)
class SummaryDocument:
    """What --summary prints."""

    robocal: int = SCHEMA
    groups: tuple[str, ...]
    means: Listing | None = None
    anova: dict[str, Anova]
    provenance: Origin

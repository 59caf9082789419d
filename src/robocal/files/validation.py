"""validation.json: what `validate` finds, and what `report` draws its page of again."""

from __future__ import annotations

from typing import Any

from robocal._record import record
from robocal.apply.iso9283 import Standard
from robocal.files.parts import Document, Origin
from robocal.prove.statistics import Statistic
from robocal.quantities import Listing, UnitValue

__all__ = ["ErrorsPart", "GainPart", "ValidationDocument"]


@record
class ErrorsPart:
    """Errors of this robot, and of the one that it is compared with."""

    unit: str
    this: Statistic | None
    against: Statistic | None


@record
class GainPart:
    """The mean reduction of the error, with its 95 % interval."""

    unit: str
    mean: float
    low: float
    high: float


@record(kw_only=True)
class ValidationDocument(Document):
    """validation.json."""

    robot: str
    offsets: str | None
    against: str | None
    trusted: bool
    reasons: list[str]
    errors: ErrorsPart
    angle: ErrorsPart | None
    torque: ErrorsPart | None = None
    position_from_lengths: ErrorsPart | None = None
    orientation_from_lengths: ErrorsPart | None = None
    layer: dict[str, Any] | None
    gain: GainPart | None
    predicting_the_mean: UnitValue | None
    profiled: tuple[str, ...]
    profiled_against: tuple[str, ...]
    iso_9283: Standard
    poses: Listing
    provenance: Origin

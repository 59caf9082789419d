"""The part of result.json that holds the joint offsets fitted alone, with what they are worth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from robocal.files.nongeometric_parts import Gain
from robocal.files.parts import Remark
from robocal.quantities import Amount, Mean, OwnUnit, ShownUnit

__all__ = ["JointOffset", "OffsetsAlone"]


@dataclass(frozen=True, kw_only=True)
class JointOffset:
    """What to add to one joint's value before the nominal model; sigma and interval as fitted. Not seen: 0, and note (remarks are
    the same as data) says what looks like it. fixed: the zero of this joint was not free."""

    joint: str
    unit: OwnUnit
    offset: Amount | None
    sigma: Amount | None = None
    interval: tuple[Amount | None, Amount | None] | None = None
    status: Literal["identified", "dropped", "fixed"]
    note: str = ""
    remarks: list[Remark] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class OffsetsAlone:
    """Joint offsets fitted alone (with frames and tool, all else nominal), and mean errors on the unseen measurements of the
    main proof: the nominal model (before), with these offsets (after), the whole identified model (whole).

    status is improved when the 95 % interval of the gain, before minus after, lies above 0; only then they are exported.
    """

    status: Literal["improved", "not_improved"]
    reason: Remark
    unit: ShownUnit
    before: Mean | None = None
    after: Mean | None = None
    whole: Mean | None = None
    n: int = 0
    gain: Gain | None = None
    how: str = ""
    parameters: list[JointOffset] = field(default_factory=list)

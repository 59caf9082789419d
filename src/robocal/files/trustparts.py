"""What result.json says of where a result can be trusted: bands and their check, the working range, the scale."""

from __future__ import annotations

from dataclasses import dataclass, field

from robocal.calibrate.statistics import Coverage
from robocal.files.parts import Number
from robocal.quantities import Amount, ShownUnit

__all__ = ["Prediction", "Scale", "WorkingRange"]


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Error predicted away from the data: one standard deviation over sampled joint configurations, of which `left` at every
    pose (what the model does not describe); null where no positions were measured. coverage says whether held-out
    measurements lay in their bands as fitted."""

    unit: ShownUnit
    mean: Amount | None = None
    p95: Amount | None = None
    max: Amount | None = None
    left: Amount | None = None
    n: int
    region: str
    coverage: list[Coverage] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class WorkingRange:
    """The working range by name, and rms over n configurations of it: `band`, what the model may be off by, `moved`, how far
    it is from the baseline; `chance` that the baseline is the better one there; and the same in words."""

    name: str
    unit: ShownUnit
    band: Amount | None
    moved: Amount | None
    chance: Number
    n: int
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class Scale:
    """The fitted lengths are 1 + factor times the nominal ones, all together (null where the data do not know); sigma with
    its parts, what the fit and a stated length leave open and what making leaves. stated: the data have no other scale
    than a stated length."""

    factor: Number
    sigma: Number
    fit: Number
    making: Number
    stated: bool
    text: str = ""

"""What result.json says of where a result can be trusted: bands and their check, the working range, the scale."""

from __future__ import annotations

from dataclasses import dataclass, field

from robocal.files.parts import Number

__all__ = ["Coverage", "Prediction", "Scale", "WorkingRange"]


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """How many of n held-out measurements lay in their bands of this level: component by component, and as a whole."""

    quantity: str
    level: float
    components: Number
    whole: Number
    n: int


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Error predicted away from the data: one standard deviation over sampled joint configurations, of which `left` at every
    pose (what the model does not describe); null where no positions were measured. coverage says whether held-out
    measurements lay in their bands as fitted."""

    unit: str
    mean: Number = None
    p95: Number = None
    max: Number = None
    left: Number = None
    n: int
    region: str
    coverage: list[Coverage] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class WorkingRange:
    """The working range by name, and rms over n configurations of it: `band`, what the model may be off by, `moved`, how far
    it is from the baseline; `chance` that the baseline is the better one there; and the same in words."""

    name: str
    unit: str
    band: Number
    moved: Number
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

"""The evidence that result.json holds beside parameters and errors: where a result can be trusted, rows that do not belong, how linear
it was, other estimators, what lies beyond geometry, the joint offsets alone."""

from __future__ import annotations

from typing import Any, Literal

from robocal._record import field, record
from robocal.files.parts import Number, RemarkPart
from robocal.prove.statistics import Coverage
from robocal.quantities import Amount, DisplayUnit, Mean, OwnUnit

__all__ = [
    "Comparison",
    "GainSummary",
    "GroupTried",
    "JointOffset",
    "LayerSummary",
    "LinearStep",
    "Linearity",
    "MethodSummary",
    "NongeometricGroup",
    "OffsetsAlone",
    "OutlierRow",
    "Prediction",
    "ScaleSummary",
    "WorkingRange",
]  # fmt: skip


@record(kw_only=True)
class Prediction:
    """Error predicted away from the data: one standard deviation over sampled joint configurations, of which `left` at every
    pose (what the model does not describe); null where no positions were measured. coverage says whether held-out
    measurements lay in their bands as fitted."""

    unit: DisplayUnit
    mean: Amount | None = None
    p95: Amount | None = None
    max: Amount | None = None
    left: Amount | None = None
    n: int
    region: str
    coverage: list[Coverage] = field(default_factory=list)


@record(kw_only=True)
class WorkingRange:
    """The working range by name, and rms over n configurations of it: `band`, what the model may be off by, `moved`, how far
    it is from the baseline; `chance` that the baseline is the better one there; and the same in words."""

    name: str
    unit: DisplayUnit
    band: Amount | None
    moved: Amount | None
    chance: Number
    n: int
    text: str = ""


@record(kw_only=True)
class ScaleSummary:
    """The fitted lengths are 1 + factor times the nominal ones, all together (null where the data do not know); sigma with
    its parts, what the fit and a stated length leave open and what making leaves. stated: the data have no other scale
    than a stated length."""

    factor: Number
    sigma: Number
    fit: Number
    making: Number
    stated: bool
    text: str = ""


@record(kw_only=True)
class OutlierRow:
    """A row that does not belong to the others: its value (mm, deg, px), distance in robust standard deviations from a fit
    without it, corrected for its leverage; p_value is the chance that the farthest of all rows would be, without any outlier.
    set_aside: not fitted; counted: the verdict counts its error, of a row that was set aside where one of the two models comes near
    it. Of a view that does not belong to the others as a whole, `rows` is how many rows it has, `row` the first of them, and distance
    their median."""

    configuration: str
    group: str
    kind: str
    target: str = ""
    source: str = ""
    row: int | None = None
    rows: int = 1
    distance: Number
    p_value: Number
    leverage: Number = None
    value: list[Number] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    set_aside: bool = False
    counted: bool = False
    cause: RemarkPart | None = None


@record(kw_only=True)
class LinearStep:
    """One linear step, rms per component: before, what the linear equation promises, what the model leaves, the neglected
    terms of second order and beyond, and their share of the step's effect."""

    before: Amount | None
    promised: Amount | None
    left: Amount | None
    neglected: Amount | None
    share: Number
    noise: Amount | None


@record(kw_only=True)
class Linearity:
    """One linear step from the baseline in the fitted parameters and in everything free (no priors), and the largest
    relative curvature within one sigma of the solution, with the parameter that such a step moves most."""

    unit: DisplayUnit
    fitted: LinearStep
    everything: LinearStep | None = None
    curvature: Number = None
    curvature_parameter: str = ""
    misleads: bool = False
    ruins: bool = False


@record(kw_only=True)
class MethodSummary:
    """One estimator: mean errors, verdict, the parameter that ends farthest from the reference in sigmas, seconds; stopped: it
    ended without converging; failed says why there is nothing."""

    method: str
    title: str
    verdict: Literal["improved", "located", "not_improved", "refused", ""] = ""
    reason: str = ""
    stopped: bool = False
    after: Mean | None = None
    held_out: Mean | None = None
    leave_one_out: Mean | None = None
    k_fold: Mean | None = None
    farthest: str = ""
    sigmas: Number = None
    seconds: Number = None
    failed: str = ""


@record(kw_only=True)
class Comparison:
    """Estimators on the same data and split, the reference first, with the frames-only model and predicting the mean."""

    unit: DisplayUnit
    reference: str
    methods: list[MethodSummary] = field(default_factory=list)
    before: Mean | None = None
    held_out_before: Mean | None = None
    leave_one_out_before: Mean | None = None
    constant: Mean | None = None
    k_fold_before: Mean | None = None


@record(kw_only=True)
class GainSummary:
    """A mean reduction of the unseen error, with its paired bootstrap 95 % interval."""

    mean: Amount | None
    low: Amount | None
    high: Amount | None


@record(kw_only=True)
class GroupTried:
    """A group beyond geometry that was asked for: what it gained on blocks of rows that were not used (before: the mean
    error without it), and why it entered or not (code: the same for machines); orders of ripple by joint."""

    name: str
    parameters: int
    entered: bool
    reason: str
    code: str = ""
    unit: DisplayUnit = ""
    before: Amount | None = None
    gain: GainSummary | None = None
    orders: dict[str, list[float]] = field(default_factory=dict)


@record(kw_only=True)
class NongeometricGroup:
    """A group that the identified robot has; options in SI."""

    name: str
    options: dict[str, Any] = field(default_factory=dict)


@record(kw_only=True)
class LayerSummary:
    """The residual layer: mean unseen error in mm without and with it, on blocks of rows that neither model nor layer had
    seen; coverage is the share of unseen components within its 95 % band."""

    used: bool
    reason: str
    code: str = ""
    unit: DisplayUnit = "mm"
    before: Amount | None = None
    after: Amount | None = None
    gain: GainSummary | None = None
    n: int = 0
    points: int = 0
    coverage: Number = None


@record(kw_only=True)
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
    remarks: list[RemarkPart] = field(default_factory=list)


@record(kw_only=True)
class OffsetsAlone:
    """Joint offsets fitted alone (with frames and tool, all else nominal), and mean errors on the unseen measurements of the
    main proof: the nominal model (before), with these offsets (after), the whole identified model (whole).

    status is improved when the 95 % interval of the gain, before minus after, lies above 0; only then they are exported.
    """

    status: Literal["improved", "not_improved"]
    reason: RemarkPart
    unit: DisplayUnit
    before: Mean | None = None
    after: Mean | None = None
    whole: Mean | None = None
    n: int = 0
    gain: GainSummary | None = None
    how: str = ""
    parameters: list[JointOffset] = field(default_factory=list)

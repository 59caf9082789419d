"""result.json: what an identification found, with its evidence. The model here is the format; its JSON Schema is in
the documentation.

Numbers are in the units that stand beside them. What does not exist is null; NaN and infinity are never written.
"""

from __future__ import annotations

import json
import os
from typing import Any, ClassVar, Literal

from robocal._record import field, record, replace
from robocal.files.evidence_parts import (
    Comparison,
    GroupTried,
    LayerSummary,
    Linearity,
    NongeometricGroup,
    OffsetsAlone,
    OutlierRow,
    Prediction,
    ScaleSummary,
    WorkingRange,
)
from robocal.files.parts import InputHash, Number, RemarkPart, RowsLeftOut
from robocal.files.plain import json_text, plain
from robocal.files.text import FORBIDDEN, forbidden_part
from robocal.prove.course import Passes
from robocal.prove.frame_poses import LocatedFrame
from robocal.prove.shape import RobotShape
from robocal.prove.statistics import Coverage, Stages, Statistic
from robocal.quantities import Amount, DisplayUnit, OwnUnit, Value

__all__ = [
    "AngleResiduals",
    "Combination",
    "CombinationTerm",
    "Correlation",
    "Coverage",
    "FitReport",
    "IdentifiabilitySummary",
    "InputHash",
    "Linearity",
    "Observability",
    "OffsetsAlone",
    "OutlierRow",
    "ParameterResult",
    "Prediction",
    "Provenance",
    "RemarkPart",
    "ResidualSummary",
    "Result",
    "RobotSummary",
    "ScaleSummary",
    "SensorGroup",
    "SplitSummary",
    "Statistic",
    "Verdict",
    "WorkingRange",
    "document",
    "read_result",
    "schema",
]


@record(kw_only=True)
class RobotSummary:
    """The robot that was identified; `shape` is what a picture shows of it, in base coordinates."""

    name: str
    convention: str
    joints: int
    source: str = ""
    shape: RobotShape | None = None


@record(kw_only=True)
class Verdict:
    """Whether the corrected model is better on data that it has not seen; `region` is where: in the whole working range, or
    near what was measured; located: nothing but frames was to be found, and they hold there; `remarks` are the reasons as data."""

    status: Literal["improved", "located", "not_improved", "refused"]
    region: Literal["measured", "working"] | None = None
    reasons: list[str] = field(default_factory=list)
    remarks: list[RemarkPart] = field(default_factory=list)


@record(kw_only=True)
class ParameterResult:
    """One parameter; sigma as fitted, with what hidden (dropped) partners may be off by; sigma_conditional if these were
    exactly nominal, sigma_instrument if besides the stated noise were all there is; interval holds the truth with 95 %,
    bootstrap (when asked for) is the 95 % percentile interval of fits to configurations drawn again.

    delta is identified minus nominal, and all sigmas are of that number: of a rotation vector, component by component.
    data_share is how much of its value the data said (1) or the prior (0); expected is the standard deviation of its error before
    anything was measured. remarks are the note as data.
    """

    name: str
    unit: OwnUnit
    nominal: Value | None
    identified: Value | None
    delta: Amount | None
    sigma: Amount | None = None
    sigma_instrument: Amount | None = None
    sigma_conditional: Amount | None = None
    status: Literal["identified", "prior", "dropped", "fixed"]
    data_share: Number = None
    note: str = ""
    remarks: list[RemarkPart] = field(default_factory=list)
    interval: tuple[Value | None, Value | None] | None = None
    bootstrap: tuple[Value | None, Value | None] | None = None
    expected: Amount | None = None


@record(kw_only=True)
class CombinationTerm:
    """One parameter's part in a combination."""

    name: str
    coefficient: Number


@record(kw_only=True)
class Combination:
    """A sum of parameters that the data cannot see, the dropped one first; alone, it has no effect on them."""

    text: str
    code: str = ""
    terms: list[CombinationTerm] = field(default_factory=list)


@record(kw_only=True)
class Observability:
    """Observability indices of Borm and Menq (O1), Driels (O2), Nahvi (O3, O4) and Sun (O5)."""

    O1: Number = None
    O2: Number = None
    O3: Number = None
    O4: Number = None
    O5: Number = None


@record(kw_only=True)
class IdentifiabilitySummary:
    """What the data can tell."""

    rank: int
    n_free: int
    condition: Number = None
    dropped: list[str] = field(default_factory=list)
    combinations: list[Combination] = field(default_factory=list)
    observability: Observability = Observability()
    warnings: list[str] = field(default_factory=list)


@record(kw_only=True)
class AngleResiduals(Stages):
    """Orientation errors."""

    # The same with the gross rows that no mean above counts; null where there are none.
    all_rows: AngleResiduals | None = None


@record(kw_only=True)
class ResidualSummary(AngleResiduals):
    """Position errors; before is the nominal model with instrument and tool fitted, constant is predicting the mean."""

    angle: AngleResiduals | None = None


@record(kw_only=True)
class PoseFromLengths(AngleResiduals):
    """Of a cable robot: errors of the position that lengths alone give, beside what an instrument reads, on unseen configurations;
    those of the orientation, and of lengths."""

    angle: AngleResiduals | None = None
    lengths: AngleResiduals | None = None


@record(kw_only=True)
class SensorGroup:
    """One sensor's share of the fit."""

    name: str
    kind: str
    n: int
    dof: Number = None
    chi2: Number = None
    rms: Amount | None = None
    unit: DisplayUnit = ""
    sigma: Amount | None = None
    sigma_source: str = ""


@record(kw_only=True)
class AgreementRow:
    """A group of sensors, or what was stated beforehand, against the others; length is its rms at the machine, z how many sigma the
    farthest of what was stated is off."""

    name: str
    kind: str
    n: int
    chi2: Number = None
    dof: Number = None
    length: Amount | None = None
    unit: DisplayUnit = "mm"
    farthest: str = ""
    z: Number = None


@record(kw_only=True)
class ObstacleRow:
    """Names that the data do not tell: rivals are groups that would have to be known; own: others of their group too; noise: with all
    known the data say too little."""

    why: Literal["rivals", "own", "noise"]
    names: list[str] = field(default_factory=list)
    rivals: list[str] = field(default_factory=list)


@record(kw_only=True)
class OpenedRow:
    """Numbers of one kind beside a camera: how many were free, how many directions the data see beyond those of the rows before, the names
    that are identified, and the rest. Of a delay, asked says what is known: path (none was measured), asked (nothing was found) or late."""

    name: str
    n: int
    new: int
    identified: list[str] = field(default_factory=list)
    state: Literal["open", "in part", "not open", "fixed"]
    rest: list[ObstacleRow] = field(default_factory=list)
    asked: Literal["", "path", "asked", "late"] = ""


@record(kw_only=True)
class FitReport:
    """How the solver came to its end; history is the cost, passes what stood after every pass, filter after every configuration that a
    filter took in."""

    iterations: int
    reason: str
    history: list[Number] = field(default_factory=list)
    chi2: Number = None
    dof: Number = None
    groups: list[SensorGroup] = field(default_factory=list)
    agreement: list[AgreementRow] = field(default_factory=list)
    opened: list[OpenedRow] = field(default_factory=list)
    sigma_source: str = ""
    passes: Passes | None = None
    filter: Passes | None = None


@record(kw_only=True)
class SplitSummary:
    """Which configurations were fitted and which were held out, by id; embargoed ones share a place with held-out ones
    and are neither. how: what the verdict rests on."""

    held_out_fraction: Number = None
    seed: int | None = None
    fit: list[str] = field(default_factory=list)
    held_out: list[str] = field(default_factory=list)
    embargoed: list[str] = field(default_factory=list)
    how: str = ""


@record(kw_only=True)
class Correlation:
    """Correlations of the identified parameters."""

    names: list[str] = field(default_factory=list)
    matrix: list[list[Number]] = field(default_factory=list)


@record(kw_only=True)
class Provenance:
    """What made this result: enough to make it again."""

    version: str
    command: str = ""
    inputs: list[InputHash] = field(default_factory=list)
    seed: int | None = None
    started: str = ""
    seconds: Number = None
    options: dict[str, Any] = field(default_factory=dict)
    left_out: list[RowsLeftOut] = field(default_factory=list)


@record(kw_only=True)
class Result:
    """result.json."""

    # Its reader refuses unknown keys, of its parts too.
    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    robocal: Literal[1] = 1
    robot: RobotSummary
    method: str
    verdict: Verdict
    parameters: list[ParameterResult]
    identifiability: IdentifiabilitySummary
    residuals: ResidualSummary
    pose_from_lengths: PoseFromLengths | None = None
    prediction: Prediction | None = None
    working_range: WorkingRange | None = None
    scale: ScaleSummary | None = None
    frames: list[LocatedFrame] = field(default_factory=list)
    linearity: Linearity | None = None
    comparison: Comparison | None = None
    outliers: list[OutlierRow] = field(default_factory=list)
    fit: FitReport
    split: SplitSummary = SplitSummary()
    groups_tried: list[GroupTried] = field(default_factory=list)
    beyond: list[NongeometricGroup] = field(default_factory=list)
    layer: LayerSummary | None = None
    offsets: OffsetsAlone | None = None
    correlation: Correlation = Correlation()
    warnings: list[str] = field(default_factory=list)
    remarks: list[RemarkPart] = field(default_factory=list)
    provenance: Provenance
    files: dict[str, str] | None = None  # SHA-256 of the other files of the run folder, report.html aside

    def to_json(self) -> str:
        """The text of result.json."""
        return json_text(self)


def document(result: Result) -> dict[str, Any]:
    """A result as the mapping that its file holds."""
    made: dict[str, Any] = plain(result)
    return made


def schema() -> dict[str, Any]:
    """The JSON Schema of result.json."""
    from robocal.files.schema import adapter

    made = adapter(Result).json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **made, "title": "robocal result.json"}


def read_result(path: str | os.PathLike[str]) -> Result:
    """Reads a result.json. Raises FileError, or FormatError naming line or key."""
    from robocal.files.schema import validate  # pydantic: for reading alone
    from robocal.files.yamlio import read_json

    document = read_json(path, "this is not a result", "an object with the key robocal")
    version = document.data.get("robocal")
    document.insist(version == 1, "this is not a result", ("robocal",), found=version, expected="1")
    if (strange := forbidden_part(document.data)) is not None:
        document.fail(FORBIDDEN, (strange[0],), found=strange[1])
    return validate(Result, replace(document, data=plain(document.data)))


if __name__ == "__main__":
    print(json.dumps(schema(), indent=1, allow_nan=False))

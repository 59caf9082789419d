"""From an identification in SI to what is written and shown: result.json, the columns of residuals.csv, the calibrated
robot.

Parameters speak the units of the robot file; errors are in mm and deg, whatever the files say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.apply.accuracy import accuracy_map
from robocal.errors import ModelError
from robocal.files import evidence_parts as evidence
from robocal.files import result as files
from robocal.files.covariance import COVARIANCE, Knowledge, covariance_text
from robocal.files.display import outlier, to_display
from robocal.files.parts import unique_remarks
from robocal.files.runfolder import (
    ACCURACY,
    COMPARISON,
    LAYER,
    RESIDUAL_COLUMNS,
    accuracy_columns,
    accuracy_text,
    comparison_text,
    layer_text,
    write_run,
)
from robocal.fit.estimators import describe_end, estimator
from robocal.fit.scale import is_scale
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.bootstrap import Resampled
from robocal.prove.frame_poses import LocatedFrame
from robocal.prove.identify import Identification
from robocal.prove.results import ParameterResult, RowTable
from robocal.prove.shape import RobotShape
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, sentences
from robocal.session.opened import Opened

if TYPE_CHECKING:
    from robocal.prove.nongeometric.layer import Layer

__all__ = ["IdentifyOutcome", "map_columns", "residual_columns", "save", "to_result"]

ABOARD = ("lengths", "swivel", "load", "winches", "inclination")  # kinds that say nothing of where the base is
NOTHING = 1e-9  # tolerance: m; two models that differ by rounding are one, and neither is the better


@record
class IdentifyOutcome:
    """What an identification came to: the result, its residuals by column, and the model in SI; `left_out` are numbers
    that the calibrated robot file cannot hold, `compared` what other estimators leave of every row, by column."""

    result: files.Result
    residuals: dict[str, list[Any]]
    identification: Identification[Model]
    robot: Opened[Any]
    written: tuple[Path, ...] = ()
    left_out: tuple[str, ...] = ()
    layer: Layer | None = None
    compared: dict[str, list[Any]] = field(default_factory=dict)

    @property
    def improved(self) -> bool:
        """Whether the verdict is `improved`, in the whole working range unless that was not wanted, or `located`."""
        verdict = self.result.verdict
        if verdict.status == "located":
            return True
        return verdict.status == "improved" and (verdict.region != "measured" or self.identification.options.measured)


def to_result(
    found: Identification[Model], robot: Opened[Any], recipe: files.Provenance, warnings: Sequence[Remark] = ()
) -> files.Result:
    """result.json of an identification."""
    said = tuple(dict.fromkeys((*warnings, *found.warnings)))
    name, joints = found.nominal.name, len(joints_of(found.nominal))
    method, loss = estimator(found.options.method).title, found.options.loss
    return files.Result(
        robot=files.RobotSummary(
            name=name,
            convention=robot.file.convention,
            joints=joints,
            source=robot.file.source,
            shape=None if found.shape is None else to_display(RobotShape, found.shape),
        ),
        method=method if loss == "none" else f"{method}, {loss} loss",
        verdict=to_display(files.Verdict, found.verdict, reasons=sentences(found.verdict.reasons)),
        parameters=[_parameter(p, robot, found.resampled) for p in found.parameters],
        identifiability=_identifiability(found, robot),
        residuals=_residuals(found),
        pose_from_lengths=_pose_from_lengths(found),
        fit=_fit(found, robot),
        split=_split(found),
        prediction=_prediction_part(found),
        working_range=_range_part(found),
        scale=_scale_part(found),
        frames=[to_display(LocatedFrame, f, robot.units) for f in found.frames],
        linearity=None if found.linearity is None else to_display(files.Linearity, found.linearity),
        offsets=None if found.offsets is None else to_display(files.OffsetsAlone, found.offsets, robot.units),
        outliers=[outlier(o) for o in found.outliers],
        correlation=files.Correlation(names=list(found.correlation_names), matrix=found.correlation.tolist()),
        warnings=sentences(said),
        remarks=unique_remarks(said),
        provenance=recipe,
    )


def _split(found: Identification[Model]) -> files.SplitSummary:
    fit, held, embargoed = list(found.fit_ids), list(found.held_out_ids), list(found.embargoed_ids)
    count = len(fit) + len(held) + len(embargoed)
    return files.SplitSummary(
        held_out_fraction=len(held) / count if count else 0.0, seed=found.options.seed, fit=fit, held_out=held, embargoed=embargoed,
        how=found.how,
    )  # fmt: skip


def _parameter(p: ParameterResult, robot: Opened[Any], drawn: Resampled | None) -> files.ParameterResult:
    ends = None
    if drawn is not None and p.name in drawn.names:
        at, unit = drawn.names.index(p.name), robot.units.of(p.unit)
        ends = (unit.from_si(drawn.low[at]), unit.from_si(drawn.high[at]))
    return to_display(files.ParameterResult, p, robot.units, bootstrap=ends)


def _identifiability(found: Identification[Model], robot: Opened[Any]) -> files.IdentifiabilitySummary:
    seen = found.identifiability
    units = {p.name: robot.units.of(p.unit) for p in found.parameters}
    combinations = []
    for c in seen.combinations:
        # name by one unit looks like the partners: the data are blind to name - sum of partners.
        own = units[c.name].factor
        terms = [files.CombinationTerm(name=c.name, coefficient=1.0)]
        terms += [files.CombinationTerm(name=n, coefficient=-v * own / units[n].factor) for n, v in c.partners]
        combinations.append(files.Combination(text=c.remark.sentence, code=c.remark.code, terms=terms))
    hidden = [f"{p.name}: {p.note}" for p in found.parameters if p.status == "prior" and p.note]
    return to_display(
        files.IdentifiabilitySummary, seen, n_free=len(seen.names), combinations=combinations,
        observability=files.Observability(**seen.indices), warnings=hidden,
    )  # fmt: skip


def _residuals(found: Identification[Model]) -> files.ResidualSummary:
    """The errors of positions with those of angles beside them, else of pixels; of bearings alone, those of angles, once."""
    by_unit = {s.unit: s for s in found.stages}
    main = next((by_unit[u] for u in ("m", "px", "rad") if u in by_unit), None)
    beside = by_unit.get("rad") if main is None or main.unit != "rad" else None
    angle = None if beside is None else to_display(files.AngleResiduals, beside)
    return files.ResidualSummary(unit="mm") if main is None else to_display(files.ResidualSummary, main, angle=angle)


def _pose_from_lengths(found: Identification[Model]) -> files.PoseFromLengths | None:
    """What a cable robot is off by, where an instrument saw it."""
    p = found.pose_from_lengths
    if p is None:
        return None
    angle = None if p.orientation is None else to_display(files.AngleResiduals, p.orientation)
    return to_display(
        files.PoseFromLengths, p.position, angle=angle, lengths=to_display(files.AngleResiduals, p.lengths)
    )


def _fit(found: Identification[Model], robot: Opened[Any]) -> files.FitReport:
    sources = list(dict.fromkeys(g.sigma_source for g in found.groups))
    ends = describe_end(found.options.method, found.reason)[0]
    return to_display(files.FitReport, found, robot.units, reason=ends, sigma_source=", ".join(sources))


def _prediction_part(found: Identification[Model]) -> evidence.Prediction | None:
    """The predicted error in mm with the check of the bands; a method that fits what cannot be seen has no honest one."""
    if estimator(found.options.method).blind:
        return None
    shares = list(found.coverage)
    if found.band is None:
        return evidence.Prediction(unit="mm", n=0, region="", coverage=shares) if shares else None
    return to_display(evidence.Prediction, found.band, coverage=shares)


def _range_part(found: Identification[Model]) -> evidence.WorkingRange | None:
    """The working range in mm, and in words; None where nothing was gained and nothing changed."""
    h = found.holds
    if h is None or (h.moved < NOTHING and found.verdict.status != "improved"):
        return None
    band, moved = Quantity(h.band), Quantity(h.moved)
    scale = None if h.sized else "scale"
    left = Quantity(found.band.left) if found.band is not None and found.band.left > 0 else None
    # What unseen measurements do not show, parameters do not prove.
    chance = h.chance if found.verdict.status == "improved" else None
    numbers = {"band": band, "moved": moved, "left": left, "chance": chance}
    said = Remark.of(Code.OVER_THE_RANGE, region=h.name, **numbers, scale=scale)
    return to_display(evidence.WorkingRange, h, text=said.sentence)


def _scale_part(found: Identification[Model]) -> evidence.ScaleSummary | None:
    """The common scale, and in words where a stated length is all that gives it."""
    s = found.scale
    if s is None:
        return None
    told = s.observable or s.implausible
    said = Remark.of(Code.SCALE_SEEN, factor=s.factor, sigma=s.sigma).sentence if s.stated and told else ""
    return to_display(evidence.ScaleSummary, s, factor=s.factor if told else None, text=said)


def residual_columns(found: Identification[Model]) -> dict[str, list[Any]]:
    """The columns of residuals.csv; None where a row has no such number."""
    rows = found.rows
    numbers = {name: np.full(len(rows.parts), None, dtype=object) for name in RESIDUAL_COLUMNS}
    kinds: dict[tuple[tuple[int, int, str], ...], list[int]] = {}
    for i, parts in enumerate(rows.parts):
        kinds.setdefault(parts, []).append(i)
    with np.errstate(over="ignore", invalid="ignore"):  # an infinite error is none that could be told
        for parts, at in kinds.items():
            for name, values in _row_columns(rows, parts, np.array(at)).items():
                numbers[name][at] = values
    words: dict[str, list[Any]] = {
        "configuration": list(rows.configuration),
        "set": ["held_out" if held else "fit" for held in rows.held_out.tolist()],
        "set_aside": ["yes" if aside else "" for aside in rows.aside.tolist()],
        "group": list(rows.group),
        "kind": list(rows.kind),
        "target": list(rows.target),
        "fingerprint": list(map("%016x".__mod__, rows.mark.tolist())),
    }
    return {name: words[name] if name in words else numbers[name].tolist() for name in RESIDUAL_COLUMNS}


def _row_columns(
    rows: RowTable, parts: tuple[tuple[int, int, str], ...], at: NDArray[np.int64]
) -> dict[str, NDArray[Any]]:
    """The numbers of rows (m,) that tell these parts, by column, (m,)."""
    before, after, unseen, place = (v[at] for v in (rows.before, rows.after, rows.unseen, rows.place))
    part = {unit: slice(a, b) for a, b, unit in reversed(parts)}  # the first of a unit
    size = {u: [np.sqrt(np.sum(v[:, own] ** 2, axis=1)) for v in (before, after)] for u, own in part.items()}
    out: dict[str, NDArray[Any]] = {}
    if "m" in part:
        first, last = part["m"].start, part["m"].stop
        out |= {
            "before_mm": size["m"][0] * 1e3,
            "after_mm": size["m"][1] * 1e3,
            "held_out_mm": _none_for_nan(unseen * 1e3),
        }
        for i, axis in enumerate("xyz"):
            out[f"{axis}_mm"] = _none_for_nan(place[:, i] * 1e3)
            if last - first == 3:
                out |= {f"d{axis}_{w}_mm": v[:, first + i] * 1e3 for w, v in (("before", before), ("after", after))}
    if "rad" in part:
        told, left, held = (np.degrees(v) for v in (*size["rad"], rows.unseen_turn[at]))
        out |= {"angle_before_deg": told, "angle_after_deg": left, "angle_held_out_deg": _none_for_nan(held)}
    if "px" in part:
        out |= {"before_px": size["px"][0], "after_px": size["px"][1], "held_out_px": unseen}
    return out


def _none_for_nan(values: Array) -> NDArray[Any]:
    """None where there is no number, (m,)."""
    out = values.astype(object)
    out[~np.isfinite(values)] = None
    return out


def _knowledge(found: Identification[Model]) -> Knowledge:
    """What an identification knows of its parameters."""
    by_name = {p.name: p for p in found.parameters}
    # The scale of an instrument is a factor that nobody fitted.
    values = {n: 1.0 if is_scale(n) else by_name[n].identified for n in found.total.names}
    nominal = {n: 1.0 if is_scale(n) else by_name[n].nominal for n in found.total.names}
    # The first instrument of a unit speaks for new measurements in it.
    noise = {g.unit: g.sigma for g in reversed(found.groups) if math.isfinite(g.sigma)}
    known = _base_is_known(found)
    return Knowledge(found.total, values, nominal, found.joints, found.conditions, noise, known, found.whitened_rows)


def _base_is_known(found: Identification[Model]) -> bool:
    """Whether an instrument stood still on the base: no frame was free, and of a platform on cables one of the instruments is no part
    of the robot."""
    if not freedom_of(found.nominal):
        return all(n in found.nominal.table or is_scale(n) for n in found.total.names)
    frames = [n for n in found.total.names if n not in found.nominal.table and n.rpartition(".")[2] in FRAME_SYMBOLS]
    return not frames and any(g.kind not in ABOARD for g in found.groups)


def map_columns(found: Identification[Model]) -> dict[str, list[Any]]:
    """The columns of accuracy_map.csv; none for a method that knows no errors, or where the model asks for columns that
    nobody recorded."""
    if estimator(found.options.method).blind:
        return {}
    moving, corrected = found.nominal.mechanism, found.corrected.mechanism
    if moving is None or corrected is None or moving.freedom is not None:
        return {}  # joint values do not say where it is
    if not any(n in found.nominal.table for n in found.total.names):
        return {}  # of frames alone no error belongs to the robot
    before = {n: found.baseline[n].value for n in found.nominal.table.names if n in found.baseline}
    try:
        made = accuracy_map(moving.with_values(before), corrected, found.total, found.conditions, found.joints)
    except ModelError:
        return {}
    return accuracy_columns(made)


def _knowledge_files(found: Identification[Model], cells: dict[str, list[Any]]) -> dict[str, str]:
    """The texts by file name; a method that knows no errors has none."""
    if estimator(found.options.method).blind:
        return {}
    units = {p.name: p.unit for p in found.parameters} | {n: "1" for n in found.total.names if is_scale(n)}
    return {COVARIANCE: covariance_text(_knowledge(found), units)} | ({ACCURACY: accuracy_text(cells)} if cells else {})


def save(outcome: IdentifyOutcome, folder: Path) -> IdentifyOutcome:
    """Writes the run folder, all or nothing; warns of values left out."""
    from robocal.report.identified import report

    rendered = outcome.robot.render(outcome.identification)
    if rendered.left_out:
        lacks, result = Remark.of(rendered.code, names=rendered.left_out), outcome.result
        warnings, remarks = [*result.warnings, str(lacks)], [*result.remarks, *unique_remarks((lacks,))]
        result = replace(result, warnings=warnings, remarks=remarks)
        outcome = replace(outcome, result=result, left_out=rendered.left_out)
    cells = map_columns(outcome.identification)
    page = report(outcome.result, outcome.residuals, cells, folder, outcome.compared)
    name = "calibrated.urdf" if outcome.robot.file.format == "urdf" else "calibrated.yaml"
    more = _knowledge_files(outcome.identification, cells)
    if outcome.layer is not None:
        more[LAYER] = layer_text(outcome.layer)
    if outcome.compared:
        more[COMPARISON] = comparison_text(outcome.compared)
    written = write_run(folder, outcome.result, rendered.text, outcome.residuals, page, robot_name=name, more=more)
    return replace(outcome, written=written)

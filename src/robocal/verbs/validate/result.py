"""How wrong a robot model is on data that it was not fitted to.

The robot stays as it is. Frames that the data leave free belong to the instrument's day, so they are fitted again.
That makes every figure a little too good, by sqrt((rows - fitted) / rows) for normal errors; it is put back, and the
figures are labelled `profiled`. The robot to compare with gets its free tool fitted too, as the baseline of an
identification: what its file does not say of the tool is no error of its geometry.

The residual layer of a run folder, on data that it was not learned from.

Measurements that a run was fitted to: they prove nothing about it, whichever file they stand in by now.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal.apply.iso9283 import Standard, standard
from robocal.arms.joint_loads import with_loads
from robocal.diagnose.limits import REMOUNT_SHARE
from robocal.errors import FormatError, ModelError
from robocal.files.parts import provenance_of
from robocal.files.plain import json_text
from robocal.files.runfolder import LAYER, RESIDUALS, Run, find_run, read_layer, read_residuals
from robocal.files.text import InputFile
from robocal.files.validation import ErrorsPart, GainPart, ValidationDocument
from robocal.fit.repeats import places as places_of
from robocal.measure.base import problem
from robocal.measure.data import DataSet, fingerprints
from robocal.measure.machine import Model, freedom_of
from robocal.prove.evidence import bootstrap_gain, constant_errors
from robocal.prove.judge import absolute_observations
from robocal.prove.model_errors import Errors, model_errors, tool_names, tool_positions
from robocal.prove.nongeometric.layer import layer_errors, layer_rows
from robocal.prove.split import leave_one_out_rounds
from robocal.prove.statistics import Statistic
from robocal.quantities import Column, Listing, unit_value
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, documents, sentences
from robocal.session.arm import OpenedArm
from robocal.session.inputs import Inputs, open_machine, read_inputs
from robocal.session.opened import Opened
from robocal.session.reference import offset_robot
from robocal.session.run_frames import with_frames_of_run
from robocal.session.verb_base import VerdictResult
from robocal.session.watching import Watch, computable
from robocal.verbs.validate.torques import torque_reasons

__all__ = ["Validation", "validate_robot"]

TOOL = ("tool.x", "tool.y", "tool.z")
FEWEST = 5  # unseen configurations that can judge a robot


def unseen(inputs: Inputs, places: Iterable[Path | None]) -> tuple[Inputs, tuple[Remark, ...], tuple[Remark, ...]]:
    """The same inputs without what the runs beside these files were fitted to, reasons why nothing is proven all the same, and
    remarks. Where nothing is left, everything is kept, to be told and not to be trusted."""
    runs = {run.folder: run for place in places if place is not None and (run := find_run(place)) is not None}
    data = inputs.data
    used = list(zip(data.observations, _rows(inputs, list(runs.values())), strict=True)) if runs else []
    count = sum(int(rows.sum()) for _, rows in used)
    if not count:
        return inputs, (), ()
    files = tuple(dict.fromkeys(obs.source for obs, rows in used if rows.any()))
    seen = [obs.configuration[rows] for obs, rows in used]
    left = np.setdiff1d(np.arange(len(data.configurations)), np.concatenate(seen))
    if not len(left):
        return inputs, (Remark.of(Code.FITTED_TO_THESE, files=files),), ()
    total = sum(len(o) for o in data.observations)
    told = Remark.of(Code.SEEN_LEFT_OUT, count=count, total=total, files=files, left=len(left))
    few = (Remark.of(Code.FEW_UNSEEN_HERE, left=len(left), fewest=FEWEST),) if len(left) < FEWEST else ()
    return inputs.with_data(data.take(left)), few, (told,)


def _rows(inputs: Inputs, runs: Sequence[Run]) -> list[NDArray[np.bool_]]:
    """Which rows of each of the observations a run was fitted to."""
    known: set[int] = set()
    files: set[str] = set()  # of runs that do not say which rows they were fitted to
    for run in runs:
        place = run.part(RESIDUALS)
        marks = read_residuals(place).get("fingerprint") if place is not None else None
        known |= {_mark(m, place) for m in marks or ()}
        if marks is None:
            files |= {i.sha256 for i in run.result.provenance.inputs}
    again = {str(f.file) for f in inputs.reading.files if f.sha256 in files}
    marks_here = fingerprints(inputs.data)
    wanted = np.array(sorted(known), dtype=np.uint64)
    return [np.isin(m, wanted) | (o.source in again) for m, o in zip(marks_here, inputs.data.observations, strict=True)]


def _mark(cell: str, place: Path | None) -> int:
    """A fingerprint as residuals.csv holds it. Raises FormatError where it is none."""
    if not cell or len(cell) > 16 or set(cell.lower()) - set("0123456789abcdef"):
        message, expected = "not the fingerprint of a row", "16 digits from 0 to f"
        raise FormatError(message, file=place, column="fingerprint", found=cell, expected=expected)
    return int(cell, 16)


def layer_beside(
    robot: str | os.PathLike[str], inputs: Inputs, values: Mapping[str, float], factor: float
) -> Statistic | None:
    """Errors in mm of a run folder's robot with its layer on top; None without a layer, or where it says nothing.

    `values` are the frames as they were fitted to the robot alone, `factor` what that fit took away from the errors.
    Raises FormatError for a broken layer.json, or one of another robot.
    """
    place = Path(robot) / LAYER
    if inputs.opened.arm is None or not Path(robot).is_dir() or not place.is_file():
        return None
    layer = read_layer(place)
    chain = inputs.opened.need_arm().chain
    if layer.joints != chain.joint_names:
        found, expected = ", ".join(layer.joints), ", ".join(chain.joint_names)
        message = "this residual layer is of another robot"
        raise FormatError(message, file=place, key="joints", found=found, expected=expected)
    q = inputs.data.configurations.joints
    made = problem(chain, inputs.data, values=dict(values))
    rows = layer_rows(inputs.data, made, made.start)
    if rows is None or q is None or not np.isfinite(q).all():
        return None
    left = layer_errors(layer, rows, q) * (factor if np.isfinite(factor) else 1.0)
    return Statistic.of(left * 1e3, profiled=factor != 1.0)


OFFSETS = "no --offsets: a length sensor counts from its zero, c1.l0, which `identify` finds"


@record(kw_only=True, eq=False)
class Validation(VerdictResult):
    """Errors of a model, and of another one to compare with; `reasons` why they are not to be trusted."""

    robot: Opened[Any]
    against: Opened[Any] | None
    errors: ErrorsPart
    angle: ErrorsPart | None
    torque: ErrorsPart | None
    gain: GainPart | None
    constant: float | None
    frames: tuple[str, ...]
    frames_against: tuple[str, ...]
    poses: Listing  # one row per measured position
    from_lengths: tuple[ErrorsPart | None, ErrorsPart | None]  # position and orientation
    layer: Statistic | None  # with the residual layer of the run folder on top
    iso: Standard
    offsets: Path | None  # the file of joint offsets that was judged, on the nominal robot

    @property
    def head(self) -> dict[str, Any]:
        """The robot, and what it was compared with."""
        from robocal.report.validation import validation_head

        return validation_head(self.document)

    def texts(self) -> Mapping[str, str | bytes]:
        """The document."""
        return {"validation.json": json_text(self.document)}

    @property
    def document(self) -> ValidationDocument:
        """What validation.json holds."""
        return ValidationDocument(
            robot=self.robot.name,
            offsets=None if self.offsets is None else str(self.offsets),
            against=None if self.against is None else self.against.name,
            trusted=self.trusted,
            reasons=sentences(self.reasons),
            errors=self.errors,
            angle=self.angle,
            torque=self.torque,
            position_from_lengths=self.from_lengths[0],
            orientation_from_lengths=self.from_lengths[1],
            layer=None if self.layer is None else {"unit": "mm"} | asdict(self.layer),
            gain=self.gain,
            predicting_the_mean=unit_value(self.constant, "mm"),
            profiled=self.frames,
            profiled_against=self.frames_against,
            iso_9283=self.iso,
            poses=self.poses,
            warnings=sentences(self.warnings),
            remarks=documents((*self.reasons, *self.warnings)),
            provenance=provenance_of(self.command, self.inputs),
        )


def validate_robot(o: Any, command: str = "", watch: Watch | None = None) -> Validation:
    """Validates a robot on data files, by the options of the verb: compared with another robot when one is given; offsets are
    judged on the nominal robot, and compared with it where nothing else is named. Raises InputError."""
    inputs = read_inputs(o.robot, o.data, base=o.base, tip=o.tip, exclude=o.exclude, watch=watch)
    _need_predictions(inputs)
    inputs = with_frames_of_run(o.robot, inputs)
    other = None if o.against is None else open_machine(o.against, base=o.base, tip=o.tip)
    places = (inputs.opened.file.path, None if o.offsets is None else Path(o.offsets))
    inputs, used, left_out = unseen(inputs, places)
    shifted = None if o.offsets is None else offset_robot(o.robot, inputs.opened.need_arm(OFFSETS), o.offsets)
    if shifted is not None:
        judged = OpenedArm(shifted.robot, inputs.opened.given)
        files = (*inputs.files, InputFile(shifted.file.path, shifted.file.sha256))
        inputs = replace(inputs, opened=judged, files=files, warnings=(*inputs.warnings, *shifted.warnings))
        other = other or OpenedArm(shifted.nominal)
    machine = inputs.opened.machine
    with computable(o.robot, *o.data):
        # Two robots are judged alike: where a file says nothing of the tool, it is fitted to both.
        tool = tool_names(machine) if other is None else tool_names(machine, other.machine)
        both = model_errors(machine, inputs.data, watch, tool=tool), model_errors(machine, inputs.data, watch)
        refitted, kept = both if tool else (both[0], both[0])
        mine = kept if other is None else refitted
        theirs = None if other is None else model_errors(_comparable(other, mine), inputs.data, watch, tool=tool)
        iso = _standing(inputs, other, mine, theirs, o.distances)
        poses = _poses(machine, inputs.data, mine, theirs)
    reasons = list(used)
    if not (mine.converged and (theirs is None or theirs.converged)):
        reasons.append(Remark.of(Code.FRAMES_NOT_CONVERGED))
    if mine.rows < 2 * len(mine.fitted):
        reasons.append(Remark.of(Code.FEW_AFTER_FRAMES, numbers=mine.rows, fitted=len(mine.fitted)))
    if not len(mine.position) and not len(mine.torque):
        reasons.append(Remark.of(Code.NO_LENGTHS))
    elif not np.isfinite(mine.position).all():
        reasons.append(Remark.of(Code.NOT_FINITE))
    constant = _constant(inputs.data)
    worst = float(mine.position.mean()) * mine.factor if len(mine.position) and np.isfinite(mine.factor) else None
    if worst is not None and constant is not None and worst >= 0.9 * constant:
        reasons.append(Remark.of(Code.MEAN_AS_GOOD, error=Quantity(worst), constant=Quantity(constant)))
    reasons += torque_reasons(inputs.data, mine)
    gain = None
    if theirs is not None and len(theirs.position) == len(mine.position) and worst is not None:
        low = bootstrap_gain(theirs.position * theirs.factor, mine.position * mine.factor, mine.position_at, o.seed)
        gain = GainPart("mm", *(1e3 * v for v in low))
    layer = None if shifted is not None else layer_beside(o.robot, inputs, mine.values, mine.factor)
    warnings = (
        *inputs.warnings,
        *left_out,
        *_remount(kept, refitted),
        *(_tool_not_stated(machine, inputs.data, mine) if other is None else ()),
        *(() if layer is None else (Remark.of(Code.LAYER_ON_TOP, mean=Quantity(layer.mean * 1e-3)),)),
        *(w for w in (other.warnings if other else ()) if w not in inputs.warnings),
    )
    turn, torque = (_statistic(mine, unit) for unit in ("rad", "N m"))
    files = (*inputs.files, *(() if other is None or o.against is None else other.inputs))
    return Validation(
        robot=inputs.opened, against=other, errors=ErrorsPart("mm", _statistic(mine, "m"), _statistic(theirs, "m")), gain=gain,
        angle=None if turn is None else ErrorsPart("deg", turn, _statistic(theirs, "rad")),
        torque=None if torque is None else ErrorsPart("N m", torque, _statistic(theirs, "N m")),
        from_lengths=(_of_lengths(mine, theirs, 0, "mm", 1e3), _of_lengths(mine, theirs, 1, "deg", float(np.degrees(1.0)))),
        constant=None if constant is None else constant * 1e3, frames=mine.fitted,
        frames_against=() if theirs is None else theirs.fitted, poses=poses, layer=layer, iso=iso,
        offsets=None if shifted is None else shifted.file.path, reasons=tuple(reasons), warnings=warnings, inputs=files, command=command,
    )  # fmt: skip


def _comparable(other: Opened[Any], mine: Errors) -> Model:
    """The other machine; where torques are judged, with masses and friction of zero that its file does not have."""
    machine: Model = with_loads(other.need_arm().chain) if len(mine.torque) else other.machine
    return machine


def _need_predictions(inputs: Inputs) -> None:
    """Raises ModelError where a machine whose poses are its own has nothing to predict them from."""
    data = inputs.data
    if freedom_of(inputs.opened.machine) is not None and len(absolute_observations(data)) == len(data.observations):
        expected = "what its sensors read at these poses too, as the measured lengths"
        raise ModelError("nothing here predicts the measured poses", key="DATA", found="poses alone", expected=expected)


def _remount(kept: Errors, refitted: Errors) -> tuple[Remark, ...]:
    """That the target sits elsewhere on the tool than the robot has it, where that explains most of what is left."""
    moved = np.array([refitted.values[n] - kept.values[n] for n in TOOL if n in kept.values])
    left, before = (float((e.position**2).sum()) for e in (refitted, kept))
    if not refitted.converged or not moved.any() or left > (1 - REMOUNT_SHARE) * before:
        return ()
    shift = tuple(Quantity(float(v)) for v in moved)
    mean, after = (Quantity(float(e.position.mean()) * e.factor) for e in (kept, refitted))
    return (Remark.of(Code.TARGET_REMOUNTED, x=shift[0], y=shift[1], z=shift[2], mean=mean, after=after),)


def _tool_not_stated(machine: Model, data: DataSet, found: Errors) -> tuple[Remark, ...]:
    """A file that says nothing of the tool: its whole length stands in the errors, and nothing else would say so. An instrument on the
    tool says by itself where on it it sits."""
    own = machine.table
    carried = any(obs.frame is not None and obs.frame.mount == "tool" for obs in data.observations)
    unknown = not carried and all(n in own.free and own[n].value == 0 and n not in found.fitted for n in TOOL)
    return (Remark.of(Code.TOOL_NOT_STATED, names=", ".join(TOOL)),) if unknown else ()


def _standing(
    inputs: Inputs, other: Opened[Any] | None, mine: Errors, theirs: Errors | None, distances: str
) -> Standard:
    """Accuracy and repeatability by ISO 9283, of an arm that is compared with none or with another arm; nothing of a machine whose joint
    values do not command a pose, and of torques alone."""
    if (arm := inputs.opened.arm) is None or (len(mine.torque) and not len(mine.position)):
        return {}
    second = None if other is None or theirs is None else (other.need_arm().chain, theirs.values)
    return standard(inputs.data, (arm.chain, mine.values), second, distances)


def _statistic(e: Errors | None, unit: str) -> Statistic | None:
    if e is None:
        return None
    values = {"m": e.position * 1e3, "rad": np.degrees(e.angle), "N m": e.torque}[unit]
    values = values * e.factor if np.isfinite(e.factor) else values
    return Statistic.of(values, profiled=bool(e.fitted) or e.poses is not None)


def _of_lengths(mine: Errors, theirs: Errors | None, part: int, unit: str, scale: float) -> ErrorsPart | None:
    """Errors of poses from lengths alone, one part of them, of both robots."""
    scales = [scale * e.factor if e is not None and np.isfinite(e.factor) else scale for e in (mine, theirs)]
    found = [None if e is None else s * e.from_lengths[part] for s, e in zip(scales, (mine, theirs), strict=True)]
    this, other = (None if v is None or not len(v) else Statistic.of(v, profiled=True) for v in found)
    return None if this is None else ErrorsPart(unit, this, other)


def _constant(data: DataSet) -> float | None:
    """The mean error of predicting the mean of all the other measurements, where one instrument measured positions."""
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if len(found) != 1 or (found[0].target is not None and len(np.unique(found[0].target)) > 1):
        return None
    values, where = found[0].value[:, :3], found[0].configuration
    if any(o.second is not None for o in data.observations):  # these tie places together
        return float(constant_errors(values, where, leave_one_out_rounds(data)).mean())
    _, place = np.unique(places_of(data.configurations)[where], return_inverse=True)
    values, count = values - values.mean(axis=0), np.bincount(place)
    own = np.stack([np.bincount(place, v) for v in values.T], axis=1)
    if len(count) < 2:
        return math.inf
    others = (values.sum(axis=0) - own) / (len(values) - count)[:, None]
    return float(np.linalg.norm(values - others[place], axis=1).mean())


def _poses(machine: Model, data: DataSet, mine: Errors, theirs: Errors | None) -> Listing:
    """One row per measured position: its configuration, where the model has the tool there in base coordinates, and errors; mm."""
    ids = data.configurations.ids
    units = [ids[unit] for unit in mine.position_at]
    places = 1e3 * tool_positions(machine, data, mine)[mine.position_at]
    columns = [Column("configuration", "", units)]
    columns += [Column(axis, "mm", places[:, i]) for i, axis in enumerate("xyz")]
    columns.append(Column("error", "mm", mine.position * 1e3))
    if theirs is not None and len(theirs.position) == len(mine.position):
        columns.append(Column("against", "mm", theirs.position * 1e3))
    return Listing(tuple(columns))

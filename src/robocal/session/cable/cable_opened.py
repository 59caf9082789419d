"""A cable robot that was opened: its data are lengths beside poses, put together by the ids of their rows.

Data that checks refuse, as wrong input: the file, its key, and what to write there.

Stretch and sag of cables whose lengths were read: by tensions that were read too, or by those that hold the platform's weight.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.hanging import hang
from robocal.cables.pulley import Pulleys, run
from robocal.cables.tension import hold
from robocal.diagnose.cables.columns import ANCHORS, AXES, LENGTHS
from robocal.diagnose.cables.currents import ALIKE, GAIN, ROW, SWAPPED, TURNED, UNBALANCED, UNLIKE
from robocal.diagnose.cables.factors import OTHER_UNIT_OF, TURNED_ROUND
from robocal.diagnose.cables.read_lengths import COPIED, TWO_SIZES, stretch
from robocal.diagnose.cables.rest import CELLS, EXCHANGED, NOT_AT_REST, SHIFTED
from robocal.diagnose.check_registry import CABLES, Context, Finding, Level, When
from robocal.diagnose.check_registry import run as run_checks
from robocal.errors import FormatError, ModelError, ToWrite
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.write import describe_cable, render_cable
from robocal.files.dataset import read_datasets
from robocal.files.kinds.lengths import COMPUTED, CURRENTS
from robocal.files.runfolder import ROBOTS, find_run
from robocal.files.text import InputFile
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.data import DataSet, Observations
from robocal.prove.identify import Identification
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.report.sections import Section
from robocal.session.cable.calibrated import of_file
from robocal.session.cable.carriages import carried
from robocal.session.cable.payload import payload_rows, tensions_of_winches
from robocal.session.cable.statics_options import robot_inputs
from robocal.session.cable.summary import facts, summary
from robocal.session.opened import Data, Inputs, Opened, Rendered
from robocal.session.prediction import Prediction
from robocal.session.simulator import Request, Simulator
from robocal.session.watching import Watch, computable

__all__ = ["OpenedCable", "open_cable"]

WEIGHED = ("load", "winches")  # kinds that say what cables pull with
TAUT = "mid"  # tensions nearest to the middle of their limits
# The key of the data file, what was found there, and what was expected, with the numbers of the finding.
PLACES: dict[str, tuple[str, str | None, str]] = {
    COPIED: ("configuration", "{count} of {of}, such as {one} and {other}", "every measurement once"),
    TWO_SIZES: (
        "{wrong}.unit", "positions that scatter by {positions:.3g} m, by the lengths {lengths:.3g} m",
        "the same; the robot's frame anchors scatter by {frame:.3g} m",
    ),
    OTHER_UNIT_OF: ("{wrong}.unit", "{stated}", "{true}"),
    TURNED_ROUND: ("lengths", None, "every length times -1"),
    ANCHORS: ("cables", None, "the platform anchors in the order of {right}"),
    LENGTHS: ("lengths.columns", None, "{line}"),
    EXCHANGED: ("{kind}.columns", None, "their columns in the order of {one}, {other}"),
    SHIFTED: ("{kind}", None, "each beside the id of its pose"),
    NOT_AT_REST: (
        "{kind}", "they leave {left:.3g} of force, geometry would {allowed:.3g}",
        "the order of the columns as that of the cables, one unit, the platform at rest",
    ),
    CELLS: (
        "{kind}.unit", "{mass:.3g} where the robot's file states {stated:.3g} ({unit}?)",
        "the unit of the cells, or the platform's mass in the robot's file",
    ),
    SWAPPED: ("current.columns", None, "their columns in the order of {one}, {other}"),
    TURNED: ("current", None, "the current of {cable} times -1"),
    UNLIKE: ("current.columns", None, "the current of {cable}, in the unit of the others"),
    ALIKE: ("current", None, "each beside the id of its pose"),
    ROW: ("current", "{value:.4g}", "another value, or not this row"),
    UNBALANCED: (
        "current", None,
        "the order of the columns as that of the cables, one unit, above 0 where a motor pulls; the platform's mass",
    ),
    GAIN: (
        "winch", "{stated:.4g}",
        "{found:.4g}, or another gear, radius or unit of the currents; the platform's mass in the robot's file",
    ),
}  # fmt: skip
for kind, code in AXES.items():
    key = "orientation" if kind == "orientation" else "position.columns"
    PLACES[code] = (key, None, "poses in right-handed axes, T_base_platform")


def data_remarks(file: CableFile, data: DataSet, watch: Watch | None = None) -> tuple[Remark, ...]:
    """What checks of the data say. Raises FormatError for the first finding that refuses."""
    context: Context[CableRobot] = Context(file.robot, data, watch=watch)
    findings = run_checks(When.READ, context, CABLES)
    for finding in findings:
        if finding.level is Level.REFUSE:
            raise FormatError(finding.remark.sentence, **_place(finding, file.path))
    return tuple(f.remark for f in findings)


def _place(finding: Finding, robot: Path | None) -> dict[str, Any]:
    """File (`robot` is the robot's) and key, what was found there, and what was expected."""
    code, n = finding.code, finding.numbers
    key, found, expected = (None if text is None else text.format(**n) for text in PLACES[code])
    to_write = code in (ANCHORS, LENGTHS, EXCHANGED, SWAPPED) and expected is not None
    own = code == ANCHORS or n.get("wrong") == "robot"
    place = {
        "file": robot if own else n["source"],
        "key": "units.length" if n.get("wrong") == "robot" else key,
        "found": found,
    }
    return {**place, "expected": ToWrite(expected) if to_write else expected}


def add_tensions(file: CableFile, data: DataSet) -> tuple[DataSet, tuple[Remark, ...]]:
    """The data with a tension beside every length where it is to be computed, and what is said of stretch and sag.

    Raises ModelError where the robot does not know what is needed, or no tensions within the limits hold the platform.
    """
    said: list[Remark] = []
    out = list(data.observations)
    for i, obs in enumerate(out):
        if obs.kind != "lengths":
            continue
        if obs.options.get("tension") == COMPUTED:
            out[i] = obs = _compute_tensions(file.robot, data, obs)
        if obs.options.get("tension") == CURRENTS:
            out[i] = obs = tensions_of_winches(file.robot, data, obs, _start_poses(file.robot, data))
        context: Context[CableRobot] = Context(file.robot, replace(data, observations=(obs,)))
        said += [f.remark for f in stretch.run(context)]
        if "tension" in obs.extra and file.robot.density is not None:
            out[i], sag = _hanging(file.robot, data, obs)
            said.append(sag)
    return replace(data, observations=tuple(out)), tuple(said)


def _start_poses(robot: CableRobot, data: DataSet) -> Array:
    """The poses (k, 4, 4) from which a fit starts: what it moves them by changes a tension and a sag by little, and lengths by less."""
    start = place_configurations(robot, data).configurations.start
    assert start is not None
    return se3.from_vector(start)


def _compute_tensions(robot: CableRobot, data: DataSet, obs: Observations) -> Observations:
    """Tensions that hold the platform's weight."""
    for what in ("mass", "limits", *(("elasticity",) if robot.density is None else ())):
        robot.need(what)
    at, of = np.unique(obs.configuration, return_inverse=True)
    found = hold(robot, _start_poses(robot, data)[at], TAUT)
    if not found.has_solution.all():
        lost = [data.configurations.ids[at[k]] for k in np.flatnonzero(~found.has_solution)]
        raise ModelError(
            "no tensions within the limits hold the platform", key="tension", found=f"{len(lost)} poses, such as {lost[0]}",
            expected="columns of measured tensions, other limits, or no `tension`",
        )  # fmt: skip
    tension = found.tension[of.ravel(), obs.extra["cable"].astype(np.int64)]
    return replace(obs, extra={**obs.extra, "tension": tension})


def _hanging(robot: CableRobot, data: DataSet, obs: Observations) -> tuple[Observations, Remark]:
    """What sag makes of every length: of some hundredths of a millimetre to a millimetre, what the fit moves poses by changes the ten
    thousandth part."""
    cable, tension = obs.extra["cable"].astype(np.int64), obs.extra["tension"]
    t = _start_poses(robot, data)[obs.configuration]
    d = t[:, :3, 3] + np.einsum("kij,kj->ki", t[:, :3, :3], robot.b[cable]) - robot.a[cable]
    wheels = None if robot.pulleys is None else Pulleys(robot.pulleys.radius[cable], robot.pulleys.axis[cable])
    strain = np.zeros(len(cable)) if robot.elasticity is None else robot.elasticity[cable]
    taut = run(d, wheels)[0] / (1.0 + strain * tension)
    hung = hang(d, tension, robot.need("density")[cable], strain, wheels).length
    lost = ~np.isfinite(hung) & np.isfinite(taut)
    if lost.any():
        at = int(np.flatnonzero(lost)[0])
        raise ModelError(
            f"the tension of {robot.cables[cable[at]]} does not carry its weight", key="tension",
            found=f"{tension[at]:.4g} N, configuration {data.configurations.ids[obs.configuration[at]]}",
            expected="a greater tension, or another density in the robot's file",
        )  # fmt: skip
    share = np.where(np.isfinite(hung), hung / taut, 1.0)
    most = float(np.nanmax(np.abs(hung - taut), initial=0.0))
    return replace(obs, extra={**obs.extra, "hanging": share}), Remark.of(Code.SAG_TAKEN, most=Quantity(most))


@record
class OpenedCable(Opened[CableRobot]):
    """A cable robot."""

    file: CableFile
    noun: ClassVar[str] = "cable robot"
    lacks: ClassVar[tuple[str, ...]] = (*Opened.lacks, "group")

    @property
    def inputs(self) -> tuple[InputFile, ...]:
        """The robot's files."""
        return robot_inputs(self.file, self.given)

    @property
    def facts(self) -> Mapping[str, Any]:
        """Its cables, and what is known of them."""
        return {"cables": list(self.file.robot.cables), "cable_robot": facts(self.file.robot)}

    @property
    def line_to_free(self) -> str:
        """Frame anchors and zeros, and gains where the file states some: what a tape measure and a drawing leave."""
        gains = ", gain" if self.file.robot.states_gains else ""
        return f"calibrate: {{free: [ax, ay, az, l0{gains}]}}"

    def sections(self) -> Iterator[Section]:
        """Every cable, and the platform in a few lines."""
        yield from summary(self.file)

    def read(
        self, data: Data, *, group: str | None = None, exclude: Sequence[str] = (), watch: Watch | None = None
    ) -> Inputs:
        """Data files as one data set, lengths beside poses put together by the ids of their rows. Raises InputError for whatever is
        wrong with them: columns that are no cables, files that no id ties together."""
        file = self.file
        reading = read_datasets(data, file.robot, exclude=exclude)
        seen = tuple(_name_cables(obs, file) for obs in reading.dataset.observations)
        joined = replace(reading.dataset, observations=seen).by_id()
        if len(seen) > 1 and len(joined.configurations) == len(reading.dataset.configurations):
            raise FormatError(
                "the files have no configuration in common", file=str(data[-1]), key="configuration",
                expected="an id in every row of every file (configuration: {id: ...}), the same where the platform stood still",
            )  # fmt: skip
        kinds = {o.kind for o in joined.observations}
        if kinds.intersection(WEIGHED) and not kinds & {"lengths", "swivel"}:
            source = next(o.source for o in joined.observations if o.kind in WEIGHED)
            raise FormatError(
                "load cells without lengths do not determine anchors", file=source, key="kind", found=", ".join(sorted(kinds)),
                expected="the lengths of the cables beside them",
            )  # fmt: skip
        with computable(self.given, *data):
            remarks = data_remarks(file, joined, watch)
            joined, said = add_tensions(file, joined)
            joined = place_configurations(file.robot, joined)
        return self.inputs_of(replace(reading, dataset=joined), *remarks, *said)

    def simulator(self, request: Request) -> Simulator[CableRobot]:
        """Its sensors, and an instrument that sees the platform."""
        from robocal.session.cable.simulate import CableSimulator

        return CableSimulator(self.file, request)

    def predict(self, rows: Path, absolute: bool) -> Prediction:
        """Lengths at poses, or poses at lengths."""
        from robocal.session.cable.predict import predict

        return predict(self.given, rows, absolute)

    @property
    def yaml(self) -> str:
        """The robot as a robot.yaml."""
        return self.file.text if self.file.format == "yaml" else describe_cable(self.file.robot, self.file.units)

    def export(self, form: str) -> tuple[str | list[list[str]], tuple[Remark, ...]]:
        """The table of its cables, and a model for MuJoCo."""
        from robocal.files.cable.cable_table import cable_rows
        from robocal.files.cable.mjcf import mjcf

        robot = self.file.robot
        if form in ("csv", "markdown"):
            return cable_rows(robot, self.file.units), ()
        if form == "mjcf":
            try:
                text = mjcf(robot)
            except ModelError as error:
                error.file = str(self.file.path)
                error.args = (str(error),)
                raise
            return text, (Remark.of(Code.INERTIA_ASSUMED),) if robot.inertia is None else ()
        if form == "yaml":
            return super().export(form)
        message, expected = f"this is a {self.noun}, and an arm is needed", "--format yaml, mjcf, csv or markdown"
        raise ModelError(message, key="--format", found=form, expected=expected)

    def render(self, found: Identification[CableRobot]) -> Rendered:
        """Its file with what was identified, the platform's weight too."""
        values, beyond = of_file(found, {p.name: p.value for p in found.corrected.table.rows})
        text, left_out = render_cable(self.file, values)
        return Rendered(text, (*left_out, *beyond), Code.CABLE_FILE_LACKS)


def open_cable(name: str | os.PathLike[str]) -> OpenedCable:
    """A cable robot from its file, or from a run folder. Raises InputError."""
    place = Path(name)
    run = find_run(place) if place.exists() else None
    file = read_cable(place / ROBOTS[0] if place.is_dir() else place)
    file = file if run is None else replace(file, warnings=(*file.warnings, *run.remarks))
    return OpenedCable(file, os.fspath(name))


def _name_cables(obs: Observations, file: CableFile) -> Observations:
    """What is read of every cable by the names of its columns where these are names of cables, else in the robot's order."""
    if "cable" not in obs.extra:
        return obs
    cables, columns = file.robot.cables, obs.options.get("columns", ())
    assert isinstance(columns, tuple)
    known = [c for c in columns if c in cables]
    if len(columns) != len(cables) or (known and (len(known) < len(columns) or len(set(known)) < len(known))):
        raise FormatError(
            "these are not the cables of the robot", file=obs.source, key=f"{obs.kind}.columns", found=", ".join(columns),
            expected=f"{len(cables)}: {', '.join(cables)}",
        )  # fmt: skip
    obs = replace(obs, options={**obs.options, "cables": cables})
    number = np.array([cables.index(c) for c in columns] if known else range(len(cables)), dtype=float)
    named = replace(obs, extra={**obs.extra, "cable": number[obs.extra["cable"].astype(np.int64)]})
    return payload_rows(file, named) if obs.kind in WEIGHED else carried(file.robot, named)

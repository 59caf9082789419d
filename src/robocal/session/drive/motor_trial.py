"""What `drive simulate` finds: how near an identified cogging is to the true one, and what its compensation is worth on a ramp."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.drives.drive_sweep import sweep_of
from robocal.files.display import listing_text
from robocal.files.drive_log import DriveLog, LogMotor
from robocal.files.drive_tables import compensation_table
from robocal.files.motor_simulation import MotorSimulation, read_motor_simulation
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.yamlio import quote
from robocal.progress import Watch, tell
from robocal.quantities import Column, Listing, UnitValue
from robocal.report.sections import Section
from robocal.session.drive.drive_result import IdentifiedDrive, identify_logs
from robocal.session.drive.drive_settings import DriveSettings
from robocal.session.verb_base import VerbResult
from robocal.simulation.motor.motor_run import LookUp, MotorLog
from robocal.simulation.motor.procedure import Tracking, TrackingGain, compare, sweep, tracking

__all__ = ["MotorTrial", "SimulateDriveDocument", "SweepLog", "simulate_procedure", "try_motor"]

GAINS = (("kp", "N m/rad"), ("ki", "N m/(rad s)"), ("kd", "N m s/rad"))
DECIMALS = 6  # of what a log states, in s, deg and N m
FINE = 2880  # points of one turn at which curves are compared: eight for each degree


@record(eq=False)
class SweepLog:
    """A direction (1, -1), its run, and the torque as it was recorded (m,) N m."""

    direction: int
    log: MotorLog
    torque: Array


@record(eq=False)
class RampResult:
    """The gains of a PID; how it followed the ramp without compensation, with it, and with tables that have no mean; the logs of the first
    two."""

    pid: tuple[float, float, float]
    without: Tracking
    full: Tracking
    no_mean: Tracking
    logs: tuple[MotorLog, MotorLog]

    @property
    def gain(self) -> TrackingGain:
        """What compensation divides by."""
        return compare(self.without, self.full)

    @property
    def gain_no_mean(self) -> TrackingGain:
        """The same of tables without mean."""
        return compare(self.without, self.no_mean)


@record(kw_only=True)
class SimulateDriveDocument(Document):
    """simulate.json: the motor, the gain of its sweep, the largest error of the identified curve and the true peak, lag and friction as
    identified; and a row for each PID."""

    motor: str
    sweep_gain: UnitValue
    curve_error: UnitValue
    peak: UnitValue
    lag: UnitValue
    friction: UnitValue
    ramps: Listing
    improved: bool
    provenance: Origin


@record(kw_only=True, eq=False)
class MotorTrial(VerbResult):
    """One procedure: the motor, the gain of its sweep (N m/rad), the sweep in both directions, what was identified, and the ramps."""

    motor: MotorSimulation
    sweep_gain: float
    sweeps: tuple[SweepLog, ...]
    identified: IdentifiedDrive
    ramps: tuple[RampResult, ...]

    @cached_property
    def curves(self) -> tuple[Array, Array, Array]:
        """Angles of one turn (rad), the true cogging and the identified one there, each without its lag (N m)."""
        angle = 2 * math.pi * np.arange(FINE) / FINE
        return angle, self.motor.plant.cogging.at(angle), self.identified.motor_file.cogging.at(angle)

    @property
    def peak(self) -> float:
        """The largest true cogging (N m)."""
        return float(np.abs(self.curves[1]).max())

    @property
    def curve_error(self) -> float:
        """The largest difference between the identified curve and the true one (N m)."""
        return float(np.abs(self.curves[2] - self.curves[1]).max())

    @property
    def improved(self) -> bool:
        """Whether no PID has a larger error or a larger effort with compensation."""
        return all(min(r.gain.position, r.gain.effort) >= 1 for r in self.ramps)

    @property
    def trusted(self) -> bool:
        """Whether the exit status is 0."""
        return self.improved and self.identified.trusted

    @cached_property
    def listing(self) -> Listing:
        """A row for each PID: errors without and with compensation, and what it divides them by."""
        of = self.ramps
        return Listing((
            *(Column(n, u, [r.pid[i] for r in of], label=n, spec=".4g") for i, (n, u) in enumerate(GAINS)),
            Column("position", "deg", np.degrees([r.without.position for r in of]), digits=6, figures=3, label="position, rms [deg]"),
            Column("position_compensated", "deg", np.degrees([r.full.position for r in of]), digits=6, figures=3, label="compensated"),
            Column("position_ratio", "", [r.gain.position for r in of], digits=6, figures=3, label="position /"),
            Column("effort", "N m", [r.without.effort for r in of], digits=6, figures=3, label="effort, peak [N m]"),
            Column("effort_compensated", "N m", [r.full.effort for r in of], digits=6, figures=3, label="compensated"),
            Column("effort_ratio", "", [r.gain.effort for r in of], digits=6, figures=3, label="effort /"),
            Column("effort_ratio_no_mean", "", [r.gain_no_mean.effort for r in of], digits=6, figures=3, label="effort / (no mean)"),
            Column("speed", "deg/s", np.degrees([r.without.speed for r in of]), digits=6, figures=3, label="speed error, peak [deg/s]"),
            Column("speed_ratio", "", [r.gain.speed for r in of], digits=6, figures=3, label="peak speed error /"),
        ))  # fmt: skip

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (
            ("Sweep gain", f"{self.sweep_gain:g} N m/rad"),
            ("Orders", f"{len(self.identified.motor_file.cogging.orders)}"),
        )
        return {"title": f"Simulated {self.motor.name}", "kind": "Simulation", "facts": facts}

    @property
    def document(self) -> SimulateDriveDocument:
        """What --json says."""
        found = self.identified.motor_file
        return self.document_of(
            SimulateDriveDocument, motor=self.motor.name, sweep_gain=UnitValue(self.sweep_gain, "N m/rad"),
            curve_error=UnitValue(self.curve_error, "N m"), peak=UnitValue(self.peak, "N m"),
            lag=UnitValue(math.degrees(found.cogging.lag), "deg"), friction=UnitValue(found.coulomb, "N m"),
            ramps=self.listing, improved=self.improved,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The document, the log with its description, the truth of one turn, and the ramps."""
        return {
            "simulate.json": json_text(self.document), "sweep.csv": sweep_text(self.sweeps), "sweep.yaml": self._description,
            "truth.csv": listing_text(self._truth()), "ramp.csv": listing_text(self._ramps()),
        }  # fmt: skip

    @property
    def _description(self) -> str:
        return SWEEP_YAML.format(name=quote(self.motor.name), constant=self.motor.plant.torque_constant)

    def _truth(self) -> Listing:
        angle, true, found = self.curves
        return Listing((
            Column("angle", "deg", np.degrees(angle), digits=8),
            Column("cogging", "Nm", true, digits=8),
            Column("identified", "Nm", found, digits=8),
        ))  # fmt: skip

    def _ramps(self) -> Listing:
        """Every tenth row of the ramps, without and with compensation."""
        logs = [(i, int(c), log.rows(0, 10)) for i, r in enumerate(self.ramps) for c, log in enumerate(r.logs)]

        def joined(of: Callable[[MotorLog], Array]) -> Array:
            return np.concatenate([of(log) for _, _, log in logs])

        return Listing((
            Column("pid", "", [i + 1 for i, _, log in logs for _ in range(len(log))]),
            Column("compensated", "", [c for _, c, log in logs for _ in range(len(log))]),
            Column("time", "s", joined(lambda log: log.time), digits=8),
            Column("reference", "deg", np.degrees(joined(lambda log: log.reference)), digits=9),
            Column("angle", "deg", np.degrees(joined(lambda log: log.angle)), digits=9),
            Column("speed", "deg/s", np.degrees(joined(lambda log: log.speed)), digits=7),
            Column("effort", "Nm", joined(lambda log: log.effort), digits=7),
        ))  # fmt: skip

    def details(self) -> Iterator[Section]:
        """The curves and the ramps as pictures."""
        from robocal.report.drive_trial import trial_pictures

        yield from trial_pictures(self)


SWEEP_YAML = """robocal: 1
kind: torque
file: sweep.csv
time: {{column: time, unit: s}}
angle: {{column: angle, unit: deg}}
torque: {{column: torque, unit: Nm}}
motor: {{name: {name}, torque_constant: {{value: {constant!r}, unit: Nm/A}}}}
source: robocal drive simulate
"""
CELLS = 3600  # of the compensation's tables: 0.1 deg


def sweep_text(sweeps: Sequence[SweepLog]) -> str:
    """The log of a sweep: time, desired angle, angle of the encoder and torque; the reverse follows the forward run."""
    start = np.cumsum([0.0, *(s.log.period * len(s.log) for s in sweeps)])
    columns = [
        ("time", "s", np.concatenate([t + s.log.time for t, s in zip(start, sweeps, strict=False)])),
        ("reference", "deg", np.degrees(np.concatenate([s.log.reference for s in sweeps]))),
        ("angle", "deg", np.degrees(np.concatenate([s.log.encoder for s in sweeps]))),
        ("torque", "Nm", np.concatenate([s.torque for s in sweeps])),
    ]
    return listing_text(Listing(tuple(Column(name, unit, v, decimals=DECIMALS) for name, unit, v in columns)))


def drive_log(motor: MotorSimulation, sweeps: Sequence[SweepLog]) -> DriveLog:
    """The log as `drive identify` has it from sweep.csv: angles and torques are rounded as they are written there."""
    angle = np.radians(np.concatenate([np.round(np.degrees(s.log.encoder), DECIMALS) for s in sweeps]))
    torque = np.concatenate([np.round(s.torque, DECIMALS) for s in sweeps])
    time = np.asarray(sweeps[0].log.period * np.arange(len(angle)), np.float64)
    read = sweep_of(motor.name, "N m", time, angle, torque)
    return DriveLog(
        read, Path("sweep.csv"), (motor.file,), LogMotor(motor.name, None, None, motor.plant.torque_constant)
    )


def simulate_procedure(o: Any, watch: Watch | None = None, command: str = "") -> MotorTrial:
    """Reads the motor, sweeps it, identifies its cogging, and tests the compensation. Raises InputError."""
    motor = read_motor_simulation(o.spec)
    return try_motor(motor, motor.gains[0] if o.gain is None else o.gain, o.seed, watch, command)


def try_motor(motor: MotorSimulation, gain: float, seed: int, watch: Watch | None, command: str) -> MotorTrial:
    """The procedure with a proportional gain (N m/rad) in the sweep."""
    rng = np.random.default_rng(seed)
    tell(watch, "sweep")
    sweeps = tuple(SweepLog(d, *sweep(motor.plant, gain, motor.sweep, d, rng)) for d in (1, -1))
    found = identify_logs(DriveSettings(), (drive_log(motor, sweeps),), watch, command)
    tell(watch, "ramp")
    full, bare = (
        LookUp(compensation_table(found.motor_file, "csv", CELLS, "Nm", friction, None).values)
        for friction in (True, False)
    )
    ramps = []
    for pid in motor.controllers:
        (log, without), (other, with_), (_, no_mean) = (
            tracking(motor.plant, pid, motor.ramp, added) for added in (None, full, bare)
        )
        ramps.append(RampResult(pid, without, with_, no_mean, (log, other)))
    return MotorTrial(
        motor=motor, sweep_gain=gain, sweeps=sweeps, identified=found, ramps=tuple(ramps), inputs=(motor.file,), command=command,
        warnings=found.warnings, reasons=found.verdict.remarks if found.verdict.status != "improved" else (),
    )  # fmt: skip

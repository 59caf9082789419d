"""Machines that robocal has never heard of, with files, data and simulators of their own: nothing of the source is touched for them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from prove.machines import Turntable

from robocal.files.csvtable import read_csv
from robocal.files.csvtext import csv_text
from robocal.files.dataset import Reading
from robocal.files.datawrite import data_text, table_text
from robocal.files.opened_file import Bare, parameter_text
from robocal.files.runfolder import ROBOTS, find_run
from robocal.files.text import InputFile, read_text
from robocal.files.units import Units
from robocal.files.yamlio import load
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.measure.rows import Kind, Rows, register
from robocal.parameters import Parameter, ParameterTable, frame_parameters
from robocal.session.inputs import register_machine
from robocal.session.opened import Opened
from robocal.session.simulator import Errors, Simulator

HARMONIC = 7.0  # cogging of the motor, per turn


@dataclass(frozen=True)
class Motor:
    """A motor: what it turns is gain times its counts, with cogging. It has no place, no joints and no poses."""

    table: ParameterTable = field(
        default_factory=lambda: ParameterTable(
            (
                Parameter("motor.gain", 1.0, "1", True, expected=0.01),
                Parameter("motor.offset", 0.0, "rad", True, expected=0.1),
                Parameter("motor.sine", 0.0, "rad", True, expected=0.02),
                Parameter("motor.cosine", 0.0, "rad", True, expected=0.02),
            )
        )
    )
    name: str = "motor"
    geometric: tuple[str, ...] = ("motor.gain", "motor.sine", "motor.cosine")
    lengths: tuple[str, ...] = ()
    anywhere: frozenset[str] = frozenset()
    parts: dict = field(default_factory=lambda: {"winding": ("u", "v", "w")})
    mechanism: None = None

    def part(self, kind):
        return None

    def row(self, name):
        return name

    def with_values(self, values):
        return self.with_table(self.table.with_values(values))

    def with_table(self, table):
        return replace(self, table=table)


class TurnRows(Rows):
    """r = gain c + offset + s sin(7 c) + k cos(7 c) - y."""

    reading = True

    def __init__(self, builder, obs):
        names = ("motor.gain", "motor.offset", "motor.sine", "motor.cosine")
        super().__init__((), obs, np.arange(len(obs)), builder.rows(names))
        c = obs.extra["counts"]
        self.slopes = np.stack([c, np.ones_like(c), np.sin(HARMONIC * c), np.cos(HARMONIC * c)], axis=1)

    def evaluate(self, x, which, first, rows):
        slope = self.slopes[first : first + rows]
        r = (x[:, self.numbers] @ slope.T)[:, :, None] - self.values_at(which, first, rows)
        jac = np.broadcast_to(slope[:, None, self.own], (len(x), rows, 1, len(self.own)))
        return r, jac.copy(), np.zeros((len(x), rows, 1, 0))


def of_rows(builder, obs):
    return [TurnRows(builder, obs)]


register(Kind("motor-turn", 1, of_rows, lambda obs: [], parts=((0, 1, "rad"),), unstated=1e-3))


class OpenedMotor(Opened):
    """Its data are a time series of counts and angles: no data.yaml, no joints, no poses."""

    noun = "motor"

    def read(self, data, *, group=None, exclude=(), watch=None):
        tables = [read_csv(name) for name in data]
        c, y = (np.concatenate([t.numbers([n])[:, 0] for t in tables]) for n in ("counts", "turn"))
        ids = tuple(f"{t.path.name}:{line}" for t in tables for line in t.lines)
        obs = series(c, y, str(tables[0].path))
        files = tuple(InputFile(t.path, t.sha256) for t in tables)
        return self.inputs_of(Reading(DataSet(Configurations(ids), (obs,)), tables[0].path, files))

    def simulator(self, request):
        return MotorSimulator(self.machine, self.units, request)


def series(counts, turn, source=""):
    k = len(counts)
    return Observations(
        "motor-turn", np.arange(k), np.reshape(turn, (k, 1)), np.full((k, 1), 1e-3), extra={"counts": np.asarray(counts)},
        group="encoder", source=source, rows=np.arange(k),
    )  # fmt: skip


class MotorSimulator(Simulator):
    usual = Errors(angle=5e-3)
    kind, noise, imperfect = "motor-turn", 1e-3, ("motor.offset", "motor.sine", "motor.cosine")

    def draw(self, count, rng):
        return rng.uniform(-6, 6, count)

    def measure(self, truth, where, rng):
        ids = tuple(map(str, range(len(where))))
        return synthesise(truth, DataSet(Configurations(ids), (series(where, np.zeros(len(where))),)), rng)

    def largest_error(self, truth, where):
        return 0.0

    def robot_files(self, truth, label):
        return files_of(self.machine, truth, label, self.units, "motor")

    def data_files(self, data, label, stem=""):
        (obs,) = data.observations
        rows = zip(map(repr, obs.extra["counts"].tolist()), map(repr, obs.value[:, 0].tolist()), strict=True)
        return {f"{stem or 'data'}.csv": label + csv_text(["counts", "turn [rad]"], rows)}


class OpenedTurntable(Opened):
    noun = "turntable"

    def simulator(self, request):
        return TurntableSimulator(self.machine, self.units, request)


class TurntableSimulator(Simulator):
    kind, noise, imperfect = "position", 2e-5, ("plate.x", "plate.y")

    def draw(self, count, rng):
        return rng.uniform(-3, 3, (count, 1))

    def measure(self, truth, where, rng):
        k = len(where)
        seen = Observations("position", np.arange(k), np.zeros((k, 3)), np.full((k, 3), self.noise))
        return synthesise(truth, DataSet(Configurations(tuple(f"p{i}" for i in range(k)), where), (seen,)), rng)

    def largest_error(self, truth, where):
        return 0.0

    def robot_files(self, truth, label):
        return files_of(self.machine, truth, label, self.units, "turntable")

    def data_files(self, data, label, stem=""):
        name = stem or "data"
        said = data_text(data, self.machine, f"{name}.csv", self.units) + "frame: {name: world, free: false}\n"
        return {f"{name}.csv": label + table_text(data, self.machine, self.units), f"{name}.yaml": said}


def files_of(nominal, truth, label, units, kind):
    made = {"robot.yaml": nominal, "truth.yaml": truth}
    return {
        n: (label if n == "truth.yaml" else "") + parameter_text(Bare(m, units, convention=kind), {}) for n, m in made.items()
    }  # fmt: skip


def turntable():
    rows = (Parameter("axis.gain", 1.0, "1", True, expected=0.01), *frame_parameters("plate", expected=(0.01, 0.05)))
    return Turntable(
        ParameterTable(rows)
        .with_values({"plate.x": 0.2, "plate.y": 0.05})
        .with_free(("axis.gain", "plate.x", "plate.y"))
    )


def opener(made, opened):
    def opens(name, base, tip):
        place = Path(name)
        run = find_run(place) if place.exists() else None
        place = place / ROBOTS[0] if place.is_dir() else place
        source, data, units = read_text(place), load(place).data, Units()
        rows = data["parameters"].items()
        machine = made.with_values({n: units.of(made.table[n].unit).to_si(float(p["value"])) for n, p in rows})
        doubts = () if run is None else run.remarks
        return opened(
            Bare(machine, units, place, source.text, source.sha256, warnings=doubts, convention=data["kind"]),
            os.fspath(name),
        )

    return opens


def register_all():
    """Makes both kinds known, once."""
    register_machine("motor", MOTOR)
    register_machine("turntable", TURNTABLE)


MOTOR, TURNTABLE = opener(Motor(), OpenedMotor), opener(turntable(), OpenedTurntable)

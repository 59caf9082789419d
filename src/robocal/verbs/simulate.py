"""`simulate`: a robot that is not quite its model, measured by an instrument that is not quite exact."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from robocal._record import record
from robocal.files.parts import SCHEMA
from robocal.quantities import UnitValue
from robocal.report.sections import Section, Text
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.measure.data import DataSet
    from robocal.measure.machine import Model
    from robocal.session.opened import Opened

__all__ = ["Options", "Simulated", "run", "sections"]


@record(kw_only=True)
class SimulatedDocument:
    """What --json prints; `largest_error`: by how much the model is wrong at most, of the measured positions."""

    robocal: int = SCHEMA
    robot: str
    simulated: bool = True
    kind: str
    configurations: int
    seed: int
    largest_error: UnitValue
    written: list[str]


@record
class Options(BaseOptions):
    """Simulate measurements of a robot that differs from its model: data, and the true robot to compare with.

    \b
    robocal simulate irb-120 -n 80 --noise 0.05 -o sim
    robocal identify sim/robot.yaml sim/data.yaml
    robocal simulate rv-2aj --set j2.r=1.0 --length-error 0 --angle-error 0 -o sim
    robocal simulate cables.yaml -n 60 --fresh 30 -o sim
    """

    robot: w.Robot
    output: Path = option(..., "Folder for robot, data and truth", "DIR", short="-o")
    poses: int = option(
        80,
        "Configurations drawn within the joint limits, or within the frame",
        "N",
        short="-n",
        least=1,
        most=1_000_000,
    )
    at: str | None = option(
        None, "Take the joint values of this data file or list of poses, or the platform's poses", "FILE"
    )
    kind: str | None = option(
        None,
        f"What is measured: {w.KINDS}; of a cable robot position or pose, beside its lengths",
        "KIND",
        otherwise="position; pose of a platform that turns",
    )
    noise: w.Noise = None
    angle_noise: float | None = option(
        None, "The same for orientations", "SIGMA", unit="angle", least=0, otherwise="0.1 mrad, converted"
    )
    cable_noise: float | None = option(
        None, "Of the lengths of cables", "SIGMA", unit="length", least=0, otherwise="0.5 mm, converted"
    )
    length_error: float | None = option(
        None,
        "Standard deviation of true lengths around nominal ones",
        "SIGMA",
        unit="length",
        least=0,
        otherwise="0.3 mm, converted; 10 mm of a cable robot's anchors and zeros",
    )
    angle_error: float | None = option(
        None, "The same for angles", "SIGMA", unit="angle", least=0, otherwise="1 mrad, converted"
    )
    settings: tuple[str, ...] = option(
        (), "A true value, in the robot file's units; may be repeated", "NAME=VALUE", name="--set"
    )
    frame: w.Frame = "auto"
    fresh: int = option(
        0, "As many more configurations of the same robot, to validate with", "N", least=0, most=1_000_000
    )
    seed: w.Seed = 0
    force: w.Force = False
    base: w.Base = None
    tip: w.Tip = None


@record
class Simulated:
    """The nominal and the true machine, the data in SI, the files that were written, and how far the model is off, in m."""

    opened: Opened[Any]
    truth: Model
    data: DataSet
    seed: int
    largest_error: float
    written: tuple[Path, ...] = ()


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Simulated]:
    """Simulates and writes robot, truth and data into a folder; everything that it writes says simulated. Raises InputError."""
    import numpy as np

    from robocal.files.writing import refuse_existing, write_files
    from robocal.session.inputs import open_machine
    from robocal.session.simulator import LABEL, Request, errors_of, true_model

    opened = open_machine(o.robot, base=o.base, tip=o.tip)
    si = o.si(opened.units)
    asked = Request(o.at, o.kind, si.noise, si.angle_noise, si.cable_noise, o.frame)
    simulator = opened.simulator(asked)
    machine, length = simulator.machine, opened.units.of("m")
    wrong = errors_of(machine, opened.units, simulator.usual, si.length_error, si.angle_error, o.settings)
    streams = [np.random.default_rng(seed) for seed in np.random.SeedSequence(o.seed).spawn(5)]
    truth = true_model(machine, simulator.imperfect, wrong, streams[0])
    where = simulator.draw(o.poses, streams[1])
    if watch:
        watch({"stage": "simulating"})
    data = simulator.measure(truth, where, streams[2])
    count = len(where)
    label = f"{LABEL}{count} configurations, seed {o.seed}, noise {length.from_si(simulator.noise):.6g} {length.name}\n"
    texts = {**simulator.robot_files(truth, label), **simulator.data_files(data, label)}
    if o.fresh:
        again = simulator.measure(truth, simulator.draw(o.fresh, streams[3]), streams[4])
        texts |= simulator.data_files(again, label, "fresh")
    refuse_existing(o.output, list(texts), o.force)
    largest = simulator.largest_error(truth, where)
    made = Simulated(opened, truth, data, o.seed, largest, write_files(o.output, texts))
    document = SimulatedDocument(
        robot=opened.name, kind=simulator.kind, configurations=len(data.configurations), seed=o.seed,
        largest_error=UnitValue(largest * 1e3, "mm"), written=[str(p) for p in made.written],
    )  # fmt: skip
    return Outcome(made, lambda: document, written=made.written)


def sections(made: Outcome[Simulated]) -> Iterator[Section]:
    """How wrong the model is, the files, and the next commands."""
    found: Simulated = made.result
    tables = {p.stem for p in made.written if p.suffix != ".csv"}  # those that a file beside them describes
    names = [p for p in made.written if p.stem != "truth" and (p.suffix != ".csv" or p.stem not in tables)]
    robot, data = names[0], [p for p in names[1:] if not p.stem.startswith("fresh")]
    fresh = [p for p in names[1:] if p.stem.startswith("fresh")]
    wrong = f"{len(found.data.configurations)} configurations, the model is wrong by up to {found.largest_error * 1e3:.3g} mm."
    run = robot.parent / "run"
    following = [["identify", robot, *data, *(["-o", run] if fresh else [])]]
    following += [["validate", run, *fresh, "--against", robot]] if fresh else []
    yield Section.of(
        "",
        Text.of(f"Simulated {found.opened.name}: {wrong}"),
        *(Text.of(str(path), indent=2) for path in made.written),
        *(Text.of(f"next: robocal {' '.join(quote(str(w)) for w in words)}") for words in following),
    )

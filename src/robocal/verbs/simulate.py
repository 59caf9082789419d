"""`simulate`: a robot that is not quite its model, measured by an instrument that is not quite exact."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from robocal.files.parts import SCHEMA
from robocal.quantities import UnitValue
from robocal.report.sections import Section, Text
from robocal.verbs import words as w
from robocal.verbs.option import Told, opt
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.session.simulate import Simulated

__all__ = ["Options", "run", "sections"]


@dataclass(frozen=True, kw_only=True)
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


@dataclass(frozen=True)
class Options(Told):
    """Simulate measurements of a robot that differs from its model: data, and the true robot to compare with.

    \b
    robocal simulate irb-120 -n 80 --noise 0.05 -o sim
    robocal identify sim/robot.yaml sim/data.yaml
    robocal simulate rv-2aj --set j2.r=1.0 --length-error 0 --angle-error 0 -o sim
    """

    robot: w.Robot
    output: Path = opt(..., "Folder for robot, data and truth", short="-o", metavar="DIR")
    poses: int = opt(
        80, "Configurations drawn within the joint limits", short="-n", metavar="N", least=1, most=1_000_000
    )
    at: str | None = opt(
        None, "Take the joint values of this data file or list of poses instead of drawing them", metavar="FILE"
    )
    kind: w.Kind = "position"
    noise: w.Noise = None
    angle_noise: float | None = opt(
        None, "The same for orientations", metavar="SIGMA", unit="angle", least=0, otherwise="0.1 mrad, converted"
    )
    length_error: float | None = opt(
        None,
        "Standard deviation of true lengths around nominal ones",
        metavar="SIGMA",
        unit="length",
        least=0,
        otherwise="0.3 mm, converted",
    )
    angle_error: float | None = opt(
        None, "The same for angles", metavar="SIGMA", unit="angle", least=0, otherwise="1 mrad, converted"
    )
    settings: tuple[str, ...] = opt(
        (), "A true value, in the robot file's units; may be repeated", name="--set", metavar="NAME=VALUE"
    )
    frame: w.Frame = "auto"
    seed: w.Seed = 0
    force: w.Force = False
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Simulated]:
    """Simulates and writes robot, truth and data into a folder; everything that it writes says simulated. Raises InputError."""
    import numpy as np

    from robocal.errors import ModelError, nearest
    from robocal.files.poses import read_poses
    from robocal.files.writing import refuse_existing, write_files
    from robocal.session import simulate as s
    from robocal.simulation.rigs import CONTACTS, RIGS, measure

    if o.kind not in RIGS:
        near = nearest(o.kind, RIGS)
        raise ModelError("unknown kind", key="--kind", found=o.kind, expected=", ".join(RIGS), suggestion=near)
    if o.at is not None and o.kind in CONTACTS:
        raise ModelError(
            "for a contact, the joint values follow from the contact", key="--at", found=o.at, expected="--poses"
        )
    arm = s.written_whole(o.robot, o.base, o.tip)
    si = o.si(arm.units)
    instrument = s.instrument_of(arm, o.kind, si.noise, si.angle_noise, o.frame)
    wrong = s.errors_of(arm, si.length_error, si.angle_error, o.settings)
    streams = [np.random.default_rng(seed) for seed in np.random.SeedSequence(o.seed).spawn(3)]
    truth = s.true_chain(arm.chain, wrong, streams[0])
    q = s.sample_joints(arm.chain, o.poses, streams[1]) if o.at is None else read_poses(o.at, arm.chain)[1]
    if watch:
        watch({"stage": "simulating"})
    data, length = measure(truth, q, instrument, streams[2]), arm.units.length
    about = f"{len(q)} configurations, seed {o.seed}, noise {length.from_si(instrument.noise):.6g} {length.name}"
    texts = s.simulated_files(arm, truth, data, about)
    refuse_existing(o.output, list(texts), o.force)
    largest = float(np.linalg.norm(truth.pose(q)[:, :3, 3] - arm.chain.pose(q)[:, :3, 3], axis=1).max())
    made = s.Simulated(arm, truth, data, wrong, instrument, o.seed, largest, write_files(o.output, texts))
    document = SimulatedDocument(
        robot=arm.name, kind=o.kind, configurations=len(data.configurations), seed=o.seed, largest_error=UnitValue(largest * 1e3, "mm"),
        written=[str(p) for p in made.written],
    )  # fmt: skip
    return Outcome(made, lambda: document, written=made.written)


def sections(made: Outcome[Simulated]) -> Iterator[Section]:
    """How wrong the model is, the files, and the next command."""
    found = made.result
    names = {p.stem: p for p in made.written if p.suffix != ".csv"}
    wrong = f"{len(found.data.configurations)} configurations, the model is wrong by up to {found.largest_error * 1e3:.3g} mm."
    yield Section.of(
        "",
        Text.of(f"Simulated {found.robot.name}: {wrong}"),
        *(Text.of(str(path), indent=2) for path in made.written),
        Text.of(f"next: robocal identify {quote(str(names['robot']))} {quote(str(names['data']))}"),
    )

"""Files to start from."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal.arms import catalog
from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS
from robocal.errors import ModelError, nearest
from robocal.files.cable.cable_templates import cable_templates
from robocal.files.cable.data_templates import data_templates
from robocal.files.opened_file import machine_kind
from robocal.files.runfolder import ROBOTS, Run, find_run
from robocal.files.table_description import UNSTATED, describe_table
from robocal.files.templates import TORQUES, convention_chain, templates
from robocal.files.units import UNITS
from robocal.files.writing import refuse_existing, write_files
from robocal.measure.data import DataSet
from robocal.session.cable.calibrated import open_robot
from robocal.session.inputs import open_arm
from robocal.session.simulated_robot import sample_joints
from robocal.simulation.rigs import RIGS, Instrument, measure

__all__ = ["CABLE", "Catalogue", "New", "listing", "new"]

ROWS = 12  # of the example table
BLANK = 20  # rows to fill in, of a cable robot
CABLE = "cable"  # what a cable robot is asked for by


@record
class New:
    """What the files are of, the robot's own file, and what was written; a cable robot has no convention. `table` is the one that they
    describe, where somebody has it, and `unstated` what stands there in place of a unit that nobody has said."""

    name: str
    convention: str | None
    robot: Path
    written: tuple[Path, ...]
    table: Path | None = None
    unstated: str = ""

    @property
    def chooses(self) -> bool:
        """Whether poses to measure are chosen by a verb of cable robots."""
        return self.convention is None

    @property
    def command(self) -> str:
        """What the data files are for: a run is judged by those of another day."""
        return "validate" if self.convention is None and self.robot.is_dir() else "check"


@record
class CatalogueRobot:
    """An arm that has a name of its own."""

    name: str
    robot: str
    convention: str
    joints: int
    source: str


@record
class ConventionPart:
    """A convention: each joint by its formula; `complete`: every small geometric error can be written."""

    name: str
    formula: str
    complete: bool
    source: str


@record
class Catalogue:
    """What `new` can start from."""

    robots: tuple[CatalogueRobot, ...]
    conventions: tuple[ConventionPart, ...]


def listing() -> Catalogue:
    """What `new` can start from: the catalogue and the conventions."""
    arms = [(name, catalog.get(name)) for name in catalog.names()]
    return Catalogue(
        tuple(CatalogueRobot(n, a.name, a.convention, len(a.joints), a.source) for n, a in arms),
        tuple(ConventionPart(c.name, c.formula, c.complete, c.source) for c in CONVENTIONS.values()),
    )


def new(o: Any) -> New:
    """Writes robot.yaml, data.yaml and measurements.csv of an arm, by the options of the verb; of one that has a file of its own,
    all but the first; of a cable robot robot.yaml, poses.csv and data files. Raises ModelError for an unknown name, FileError for a
    file that exists."""
    if o.robot == CABLE:
        o.refuse(("joints", "table", "base", "tip"), "a cable robot does not have this option", "an arm")
        return _write(o, "my cable robot", None, None, cable_templates(o.kind))
    kind, robot = o.kind or "position", o.robot
    if _is_cable(robot):
        return _of_cables(o)
    kinds = (*RIGS, TORQUES)
    if kind not in kinds:
        near, expected = nearest(kind, kinds), ", ".join(kinds)
        raise ModelError("unknown kind", key="--kind", found=kind, expected=expected, suggestion=near)
    own = Path(robot) if os.path.isfile(robot) else None
    if own is not None:
        arm = open_arm(own, base=o.base, tip=o.tip).chain
    elif robot in catalog.names():
        arm = catalog.get(robot)
    elif robot in CONVENTIONS:
        arm = convention_chain(robot, o.joints)
    else:
        near = nearest(robot, [*catalog.names(), *CONVENTIONS, CABLE])
        message = "neither a file nor a robot of the catalogue, nor a convention, nor cable"
        expected = "a name of robocal new --list, or the file of a robot"
        raise ModelError(message, found=robot, expected=expected, suggestion=near)
    texts = templates(arm, kind=kind, example=_example(arm, kind))
    if o.table is not None:
        del texts["measurements.csv"]
        texts["data.yaml"] = describe_table(o.table, arm, o.kind, o.output)
    if own is not None:
        del texts["robot.yaml"]
    return _write(o, arm.name, arm.convention, own, texts)


def _is_cable(robot: str) -> bool:
    """Whether this is the file or the run folder of a cable robot."""
    place = Path(robot)
    return machine_kind(place / ROBOTS[0] if place.is_dir() else place) == CABLE


def _of_cables(o: Any) -> New:
    """Data files of a cable robot that has a file of its own, for its sensors and an instrument."""
    o.refuse(("joints", "table", "base", "tip"), "a cable robot does not have this option", "an arm")
    file = open_robot(o.robot)
    ids = [f"p{i + 1:02d}" for i in range(BLANK)]
    run = find_run(Path(o.robot))
    known = {} if run is None else _stated(run)
    noise = (known.get(("pose", "m")) or known.get(("position", "m")), known.get(("pose", "rad")))
    sigma = known.get(("lengths", "m"))
    texts = data_templates(file.robot, file.units, ids, sigma=sigma, noise=noise, kind=o.kind)
    return _write(o, file.robot.name, None, Path(o.robot), texts)


def _stated(run: Run) -> dict[tuple[str, str], float]:
    """Standard deviations that were stated of the measurements of a run, in SI, by their kind and SI unit; of two of a kind nothing."""
    out: dict[tuple[str, str], list[float]] = {}
    for g in run.result.fit.groups:
        if g.unit in UNITS and g.sigma_source == "stated" and g.sigma is not None:
            unit = UNITS[g.unit]
            out.setdefault((g.kind, unit.si), []).append(unit.to_si(float(g.sigma)))
    return {what: found[0] for what, found in out.items() if len(found) == 1}


def _write(o: Any, name: str, convention: str | None, own: Path | None, texts: Mapping[str, str]) -> New:
    refuse_existing(o.output, list(texts), o.force)
    written = write_files(o.output, texts)
    unstated = UNSTATED if UNSTATED in texts.get("data.yaml", "") else ""
    return New(name, convention, own or written[0], written, o.table, unstated)


def _example(arm: Chain, kind: str) -> DataSet | None:
    """Rows that a perfect instrument would read of the nominal robot; the templates make those of positions, poses and torques."""
    if kind in ("position", "pose", TORQUES):
        return None
    within = np.clip(sample_joints(arm, ROWS, np.random.default_rng(1)), -1.0, 1.0)
    slides = [j.type == "prismatic" for j in arm.joints]
    # Joint values that are short to read.
    short = np.where(slides, np.round(within, 2), np.radians(np.round(np.degrees(within))))
    return measure(arm, short, Instrument(kind), None)

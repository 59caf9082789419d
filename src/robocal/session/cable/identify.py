"""The verb `identify` for a cable robot: what was measured, lengths beside poses put together by the ids of their rows, and
anchors and sensor zeros from it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.dataset import Reading, read_datasets
from robocal.files.text import InputFile
from robocal.fit.options import Options
from robocal.fit.starts.own import placed
from robocal.measure.data import DataSet, Observations
from robocal.prove.identification import Identification
from robocal.prove.identify import identify as solve
from robocal.remarks.remark import Remark
from robocal.session.cable.load import robot_inputs
from robocal.session.cable.refusals import data_remarks
from robocal.session.cable.stretch import stretched
from robocal.session.cable.weighed import weighed
from robocal.session.inputs import chosen
from robocal.session.watching import Watch, computable

__all__ = ["Measured", "Solved", "identify_cable", "read_measured"]


# What is said of arms alone.
ARMS = ("groups", "layer", "compare", "region", "base", "tip", "group")


@dataclass(frozen=True)
class Solved:
    """A cable robot as it was identified, the data, and what came of them."""

    robot: CableFile
    measured: Measured
    found: Identification[CableRobot]


def identify_cable(
    file: CableFile,
    robot: str,
    data: Sequence[str | os.PathLike[str]],
    options: Options,
    words: dict[str, Any],
    watch: Watch | None = None,
    exclude: Sequence[str] = (),
) -> Solved:
    """Identifies a cable robot from files; `words` are the choices of a person by name. Raises InputError for whatever is
    wrong with them, and for a choice that only arms have."""
    for name in ARMS:
        if words.get(name) and not (name == "region" and words[name] == "measured"):
            raise ModelError(
                "this is for arms", key=f"--{name}", found=str(words[name]), expected="nothing, for a cable robot"
            )
    measured = read_measured(file, robot, data, exclude, watch)
    picked = {key: words[key] for key in ("free", "fix", "prior")}
    table, seen = chosen(file.robot, file.units, measured.data, **picked)
    machine = replace(file.robot, table=table)
    with computable(*(i.file for i in measured.files)):
        found: Identification[CableRobot] = solve(machine, seen, options, watch)
    return Solved(replace(file, robot=machine), measured, found)


@dataclass(frozen=True)
class Measured:
    """A cable robot and its data as one data set, with every file that was read and what is odd about them."""

    robot: CableFile
    reading: Reading
    data: DataSet
    files: tuple[InputFile, ...]
    warnings: tuple[Remark, ...]


def read_measured(
    file: CableFile,
    robot: str,
    data: Sequence[str | os.PathLike[str]],
    exclude: Sequence[str] = (),
    watch: Watch | None = None,
) -> Measured:
    """Reads data files of a cable robot. Raises InputError for whatever is wrong with them: columns that are no cables, files
    that no id ties together."""
    if watch:
        watch({"stage": "read"})
    reading = read_datasets(data, file.robot, exclude=exclude)
    seen = tuple(_named(obs, file) for obs in reading.dataset.observations)
    joined = replace(reading.dataset, observations=seen).by_id()
    if len(seen) > 1 and len(joined.configurations) == len(reading.dataset.configurations):
        raise FormatError(
            "the files have no configuration in common",
            file=str(data[-1]),
            key="configuration",
            expected="an id in every row of every file (configuration: {id: ...}), the same where the platform stood still",
        )
    kinds = {o.kind for o in joined.observations}
    if "load" in kinds and not kinds & {"lengths", "swivel"}:
        source = next(o.source for o in joined.observations if o.kind == "load")
        raise FormatError(
            "load cells without lengths tell nothing of anchors", file=source, key="kind", found=", ".join(sorted(kinds)),
            expected="the lengths of the cables beside them",
        )  # fmt: skip
    with computable(robot, *data):
        told = data_remarks(file, joined, watch)
        joined, said = stretched(file, joined)
        joined = placed(file.robot, joined)
    return Measured(
        file,
        reading,
        joined,
        (*robot_inputs(file, robot), *reading.files),
        (*file.warnings, *reading.warnings, *told, *said),
    )


def _named(obs: Observations, file: CableFile) -> Observations:
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
    return weighed(file, named) if obs.kind == "load" else named

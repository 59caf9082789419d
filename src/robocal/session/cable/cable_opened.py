"""A cable robot that was opened: its data are lengths beside poses, put together by the ids of their rows."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.show import describe_cable
from robocal.files.cable.write import render_cable
from robocal.files.dataset import read_datasets
from robocal.files.runfolder import ROBOTS, find_run
from robocal.files.text import InputFile
from robocal.fit.starts.own import place_configurations
from robocal.measure.data import Observations
from robocal.prove.identification import Identification
from robocal.remarks.code import Code
from robocal.report.sections import Section
from robocal.session.cable.payload import payload_rows
from robocal.session.cable.refusals import data_remarks
from robocal.session.cable.sensor_gains import of_file
from robocal.session.cable.statics_options import robot_inputs
from robocal.session.cable.stretch import add_tensions
from robocal.session.cable.summary import facts, summary
from robocal.session.opened import Data, Inputs, Opened, Rendered
from robocal.session.prediction import Prediction
from robocal.session.simulator import Request, Simulator
from robocal.session.watching import Watch, computable

__all__ = ["OpenedCable", "open_cable"]


@dataclass(frozen=True)
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
                "the files have no configuration in common",
                file=str(data[-1]),
                key="configuration",
                expected="an id in every row of every file (configuration: {id: ...}), the same where the platform stood still",
            )
        kinds = {o.kind for o in joined.observations}
        if "load" in kinds and not kinds & {"lengths", "swivel"}:
            source = next(o.source for o in joined.observations if o.kind == "load")
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

    def render(self, found: Identification[CableRobot]) -> Rendered:
        """Its file with what was identified, the platform's weight too."""
        values = {p.name: p.value for p in found.corrected.table.rows}
        values, beyond = of_file(found, values)
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
    return payload_rows(file, named) if obs.kind == "load" else named

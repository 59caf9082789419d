"""A machine that was opened, whichever it is: its file, how its data are read, and what it lacks.

What only one machine has hangs on a class of its own, beside that machine: `session/arm.py`, `session/cable/cable_opened.py`. This class
serves every other machine, from Python too: `Opened(Bare(machine))`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar

import numpy as np

from robocal._record import record, replace
from robocal.diagnose.camera_changes import half_turns_open
from robocal.diagnose.half_turns import undo_half_turns
from robocal.errors import FormatError, ModelError
from robocal.files.dataset import Reading, read_datasets
from robocal.files.opened_file import MachineFile, Speaks, parameter_text
from robocal.files.robot import Robot
from robocal.files.text import InputFile
from robocal.fit.starts.own import place_configurations
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model, freedom_of
from robocal.prove.identify import Identification
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.sections import Section
from robocal.session.base_markers import leave_lone_targets, place_targets
from robocal.session.prediction import Prediction
from robocal.session.watching import Watch, computable

if TYPE_CHECKING:
    from robocal.session.simulator import Request, Simulator

__all__ = ["Inputs", "Opened", "Rendered", "every_frame", "one_frame_per_name", "without_half_turns"]

M = TypeVar("M", bound=Model)
Data = Sequence[str | os.PathLike[str]]


@record
class Inputs:
    """A machine and what was measured on it; `files` are all that were read, with their hashes."""

    opened: Opened[Any]
    reading: Reading
    files: tuple[InputFile, ...]
    warnings: tuple[Remark, ...]

    @property
    def data(self) -> DataSet:
        """The data set."""
        return self.reading.dataset

    def with_data(self, data: DataSet) -> Inputs:
        """The same with another data set."""
        return replace(self, reading=replace(self.reading, dataset=data))


@record
class Rendered:
    """The text of a corrected machine's file, the names that it cannot hold, and the code of the remark on them."""

    text: str
    left_out: tuple[str, ...] = ()
    code: str = Code.URDF_LACKS


@record
class Opened(Generic[M]):
    """A machine with its file; `given` is the path or the name of the catalogue that it was opened by."""

    file: MachineFile[M]
    given: str = ""

    noun: ClassVar[str] = "machine"
    # Choices of one identification that only an arm has: its joints are driven, bend and ripple.
    lacks: ClassVar[tuple[str, ...]] = ("groups", "layer", "region", "base", "tip")

    @property
    def name(self) -> str:
        """What people call it."""
        return self.file.machine.name

    @property
    def machine(self) -> M:
        """The model of it."""
        return self.file.machine

    @property
    def units(self) -> Speaks:
        """The units in which its file and its reports speak."""
        return self.file.units

    @property
    def warnings(self) -> tuple[Remark, ...]:
        """What is odd about its file."""
        return self.file.warnings

    @property
    def inputs(self) -> tuple[InputFile, ...]:
        """The files that it was read from; none where a program made it."""
        return () if self.file.path is None else (InputFile(self.file.path, self.file.sha256),)

    @property
    def arm(self) -> Robot | None:
        """The file of an arm, which has joint effects, offsets and a base and tool; None for another machine."""
        return None

    @property
    def facts(self) -> Mapping[str, Any]:
        """What its file says that only such a machine has, as keys of a document."""
        return {}

    def sections(self) -> Iterator[Section]:
        """The same for people."""
        yield from ()

    @property
    def line_to_free(self) -> str:
        """What to write into its file where nothing is free: what a calibration of such a machine finds, as a rule."""
        names = dict.fromkeys(n.rpartition(".")[2] for n in self.machine.geometric)
        return f"calibrate: {{free: [{', '.join(names)}]}}" if names else ""

    def need_arm(self, expected: str = "an arm") -> Robot:
        """The file of an arm. Raises ModelError for another machine; `expected` says what to do with that."""
        if self.arm is None:
            raise ModelError(f"this is a {self.noun}, and an arm is needed", found=self.machine.name, expected=expected)
        return self.arm

    def refuse(self, choices: Mapping[str, Any]) -> None:
        """Raises ModelError for a choice of one run, by the names of options, that means nothing for this machine."""
        for name in self.lacks:
            if choices.get(name) and not (name == "region" and choices[name] == "measured"):
                found, expected = str(choices[name]), f"nothing, for a {self.noun}"
                raise ModelError("this option is for arms", key=f"--{name}", found=found, expected=expected)

    def with_machine(self, machine: M) -> Self:
        """Another machine of the same file."""
        return replace(self, file=self.file.with_machine(machine))

    def read(
        self, data: Data, *, group: str | None = None, exclude: Sequence[str] = (), watch: Watch | None = None
    ) -> Inputs:
        """Data files as one data set, without the rows that `exclude` names. Raises InputError for whatever is wrong with them."""
        reading = read_datasets(data, self.machine, group=group, exclude=exclude)
        one_frame_per_name(reading)
        if freedom_of(self.machine) is not None:
            reading = replace(reading, dataset=place_configurations(self.machine, reading.dataset.by_id()))
        reading, undone = without_half_turns(self.machine, reading)
        return self.inputs_of(reading, *undone)

    def inputs_of(self, reading: Reading, *remarks: Remark) -> Inputs:
        """The machine with what was read of it, where targets of unknown places begin too, and remarks."""
        joined, lone = leave_lone_targets(reading.dataset)
        reading = replace(reading, dataset=place_targets(self.machine, joined))
        if lone:
            remarks = (*remarks, Remark.of(Code.TARGETS_SEEN_ONCE, targets=lone))
        return Inputs(self, reading, (*self.inputs, *reading.files), (*self.warnings, *reading.warnings, *remarks))

    def simulator(self, request: Request) -> Simulator[M]:
        """Who simulates what such a machine records. Raises ModelError where nobody does."""
        raise self._unknown("measured")

    def predict(self, rows: Path, absolute: bool) -> Prediction:
        """What a run folder of such a machine knows of rows that nobody measured. Raises ModelError where nothing says how."""
        raise self._unknown("predicted")

    def _unknown(self, done: str) -> ModelError:
        message = f"nothing says what is {done} of a {self.noun}"
        return ModelError(message, found=self.name, expected="an arm or a cable robot")

    @property
    def yaml(self) -> str:
        """The machine as a robot.yaml."""
        return parameter_text(self.file, {})

    def export(self, form: str) -> tuple[str | list[list[str]], tuple[Remark, ...]]:
        """The machine in a form for another program: a text, or the rows of a table below their header; and what is to be said of it.
        Raises ModelError for a form that it has not."""
        if form == "yaml":
            return self.yaml, ()
        message = f"this is a {self.noun}, and an arm is needed"
        raise ModelError(message, key="--format", found=form, expected="--format yaml")

    def render(self, found: Identification[M]) -> Rendered:
        """The text of the machine's file with what was identified."""
        values = {p.name: p.value for p in found.corrected.table.rows}
        return Rendered(parameter_text(self.file, values))


def every_frame(obs: Observations) -> tuple[Frame, ...]:
    """The instrument's frame, the targets, and the places and ends of the kind."""
    return (*((obs.frame,) if obs.frame else ()), *obs.targets, *kind_of(obs).frames(obs))


def without_half_turns(machine: Model, reading: Reading) -> tuple[Reading, tuple[Remark, ...]]:
    """The same where half turns of targets are undone, as far as the files ask for it, and what was undone."""
    seen = reading.dataset.observations
    if not any(map(half_turns_open, seen)):
        return reading, ()
    with computable(*(o.source for o in seen)):
        data, turned = undo_half_turns(machine, reading.dataset)
    total = sum(len(np.unique(seen[i].configuration)) for i in turned)
    count = sum(int(t[np.unique(seen[i].configuration)].sum()) for i, t in turned.items())
    names = tuple(seen[i].label for i in turned)
    told = Remark.of(Code.HALF_TURNS_UNDONE, count=count, total=total, instruments=names)
    return replace(reading, dataset=data), (told,)


def one_frame_per_name(reading: Reading) -> None:
    """Frames named alike in several files are one. Raises FormatError for files that say different things of it."""
    known: dict[str, tuple[object, str]] = {}
    for obs in reading.dataset.observations:
        for frame in every_frame(obs):
            said = (frame.value, frame.free, frame.mount)
            first = known.setdefault(frame.name, (said, obs.source))
            if first[0] != said:
                raise FormatError(
                    "a frame of this name is described differently in another file", file=obs.source, key=frame.name,
                    expected=f"what the data file of {first[1]} says, or another name",
                )  # fmt: skip

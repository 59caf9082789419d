"""A calibration of any machine, read from its run folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robocal.errors import FileError
from robocal.files.covariance import COVARIANCE, Knowledge
from robocal.files.runfolder import Run, open_run
from robocal.files.text import InputFile, read_text
from robocal.session.cable.calibrated import open_calibrated
from robocal.session.inputs import open_machine
from robocal.session.opened import Opened
from robocal.session.pose_prediction import knowledge_of

__all__ = ["Calibration", "open_calibration"]

IDENTIFIED = ("identified", "prior")


@dataclass(frozen=True)
class Calibration:
    """A run folder, its machine as identified, what is known of its parameters, and the files that were read."""

    run: Run
    opened: Opened[Any]
    known: Knowledge
    files: tuple[InputFile, ...]

    @property
    def identified(self) -> tuple[str, ...]:
        """The parameters of the machine that the run identified."""
        table = self.opened.machine.table
        return tuple(p.name for p in self.run.result.parameters if p.status in IDENTIFIED and p.name in table)


def open_calibration(place: Path) -> Calibration:
    """Opens a run folder of any machine. Raises InputError where it is none, or does not say how far its parameters may be off."""
    run = open_run(place)
    opened = open_machine(place)
    if opened.arm is not None:
        known = knowledge_of(place, opened.arm)
        own = InputFile(place / COVARIANCE, read_text(place / COVARIANCE).sha256)
        return Calibration(run, opened, known, (*opened.inputs, own))
    read = open_calibrated(str(place))
    if read.knowledge is None:
        raise FileError(
            "this run does not say how far its parameters may be off", file=place,
            expected=f"{COVARIANCE}: identify once more with this version",
        )  # fmt: skip
    file = read.file
    return Calibration(
        run, opened.with_machine(file.robot), read.knowledge, (InputFile(file.path or place, file.sha256), *file.beside)
    )

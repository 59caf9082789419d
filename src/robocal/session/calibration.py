"""A calibration of any machine, read from its run folder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from robocal.files.covariance import COVARIANCE, Knowledge
from robocal.files.runfolder import Run, open_run
from robocal.files.text import InputFile, read_text
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
    known = knowledge_of(place, opened.arm)
    own = InputFile(place / COVARIANCE, read_text(place / COVARIANCE).sha256)
    found = Calibration(run, opened, known, (*opened.inputs, own))
    if opened.arm is not None:
        return found
    # The file of another machine may round what was identified, or lack a place for it.
    values = {n: known.values[n] for n in found.identified if n in known.values}
    return replace(found, opened=opened.with_machine(opened.machine.with_values(values)))

"""A cable robot from its file, or from a run folder with what is known of its numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocal.cables.calibration.drift import Known
from robocal.cables.geometry import CableRobot
from robocal.errors import FileError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.robot import read_cable
from robocal.files.covariance import COVARIANCE, read_covariance
from robocal.files.runfolder import Run, find_run

__all__ = ["Calibrated", "calibrated"]


@dataclass(frozen=True)
class Calibrated:
    """One calibration: its robot, and where it is a run folder, the run and what is known of its numbers."""

    place: str
    file: CableFile
    run: Run | None
    known: Known | None

    @property
    def robot(self) -> CableRobot:
        """The robot as it was found."""
        return self.file.robot


def calibrated(place: str) -> Calibrated:
    """A run folder, or a robot file by itself, of which nothing is known but its numbers. Raises InputError."""
    run = find_run(place)
    if run is None:
        return Calibrated(place, read_cable(place), None, None)
    own = run.robot
    if own is None:
        raise FileError("this run has no calibrated robot", file=run.folder, expected="a run of `identify`")
    told = run.part(COVARIANCE)
    if told is None:
        return Calibrated(place, read_cable(own), run, None)
    read = read_covariance(told)
    total = read.total
    fitted = [i for i, n in enumerate(total.names) if total.noise[i, i] > 0 and n in read.values]
    hidden = np.asarray(total.hidden)[fitted]
    known = Known(
        tuple(total.names[i] for i in fitted), np.array([read.values[total.names[i]] for i in fitted]), total.noise[np.ix_(fitted, fitted)],
        hidden if hidden.any() else None,
    )  # fmt: skip
    return Calibrated(place, read_cable(own), run, known)

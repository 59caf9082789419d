"""A cable robot from its file, or from a run folder with what is known of its numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from robocal.apply.difference import Known
from robocal.cables.geometry import CableRobot
from robocal.errors import FileError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.covariance import COVARIANCE, Knowledge, read_covariance
from robocal.files.runfolder import Run, find_run
from robocal.files.text import InputFile, read_text
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.cable.sensor_gains import SensorGains, names_of_gains, sensor_gains
from robocal.session.runs import verdict_remarks

__all__ = ["Calibrated", "open_calibrated"]


@dataclass(frozen=True)
class Calibrated:
    """One calibration: its robot, and where it is a run folder, the run, what is known of its numbers, what it found beyond the
    robot's file, and of that what lengths are not read with."""

    place: str
    file: CableFile
    run: Run | None
    knowledge: Knowledge | None
    gains: SensorGains = field(default_factory=SensorGains)
    aside: tuple[str, ...] = ()

    @property
    def base_is_known(self) -> bool:
        """Whether the base stood still in an instrument's frame."""
        return self.knowledge is None or self.knowledge.placed

    @cached_property
    def estimates(self) -> Known | None:
        """What is known of the numbers that were fitted."""
        if self.knowledge is None:
            return None
        total, values = self.knowledge.total, self.knowledge.values
        fitted = [i for i, n in enumerate(total.names) if total.noise[i, i] > 0]
        names, hidden = tuple(total.names[i] for i in fitted), np.asarray(total.hidden)[fitted]
        noise = total.noise[np.ix_(fitted, fitted)]
        return Known(names, np.array([values[n] for n in names]), noise, hidden if hidden.any() else None)

    @property
    def cautions(self) -> tuple[Remark, ...]:
        """What is to be said of a run that did not improve the robot."""
        return verdict_remarks(None if self.run is None else self.run.result, self.place)

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """What is to be said of poses from lengths that it is asked for."""
        taken = tuple(dict.fromkeys((*self.gains.gains, *self.gains.owned)))
        out = [Remark.of(Code.BEYOND_TAKEN, names=taken, run=self.place)] if taken else []
        if self.aside:
            out.append(Remark.of(Code.ZEROS_LEFT_ASIDE, names=self.aside, run=self.place))
        return (*out, *self.cautions)

    @property
    def robot(self) -> CableRobot:
        """The robot as it was found."""
        return self.file.robot


def open_calibrated(place: str) -> Calibrated:
    """A run folder, or a robot file by itself, of which nothing is known but its numbers. Raises InputError."""
    run = find_run(place)
    if run is None:
        return Calibrated(place, read_cable(place), None, None)
    own = run.robot
    if own is None:
        raise FileError("this run has no calibrated robot", file=run.folder, expected="a run of `identify`")
    file, told = read_cable(own), run.part(COVARIANCE)
    seen = [p.name for p in run.result.parameters if p.status in ("identified", "prior")]
    names = names_of_gains(file.robot, seen)
    if told is None:
        if names:
            message = f"this run knows {', '.join(names[:3])}, and not how large they are"
            raise FileError(message, file=run.folder, expected=COVARIANCE)
        return Calibrated(place, file, run, None)
    read = read_covariance(told)
    values = {n: read.values[n] for n in seen if n in read.values}
    robot = file.robot.with_values({n: v for n, v in values.items() if n in file.robot.table})
    file = replace(file, robot=robot, beside=(*file.beside, InputFile(told, read_text(told).sha256)))
    found = {n: values[n] for n in names if n in values}
    more = sensor_gains(robot, found, any(n.endswith(".l0") for n in seen), place)
    aside = tuple(n for n in found if n not in (*more.gains, *more.owned))
    return Calibrated(place, file, run, read, more, aside)

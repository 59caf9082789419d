"""A cable robot from its file, or from a run folder with what is known of its numbers. What a file of lengths has of its own, gains of
drums and zeros of one power-up, is the robot's from here on: its file is written with them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.apply.difference import Known
from robocal.cables.geometry import GAIN, PLATFORM, CableRobot
from robocal.errors import FileError, ModelError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.covariance import COVARIANCE, Knowledge, read_covariance
from robocal.files.runfolder import Run, find_run
from robocal.files.text import InputFile, read_text
from robocal.prove.identify import Identification
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.runs import verdict_remarks

__all__ = ["Calibrated", "SensorGains", "of_file", "open_calibrated", "open_robot"]


@record
class SensorGains:
    """Gains of the drums (m,) and zeros (m,) that some lengths had of their own, and the names of their parameters (m,); None where they
    were the robot's."""

    gain: Array | None = None
    gains: tuple[str, ...] = ()
    zeros: Array | None = None
    owned: tuple[str, ...] = ()

    def values(self, robot: CableRobot) -> dict[str, float]:
        """The same by the names that they have as the robot's."""
        both = ((GAIN, self.gain), ("l0", self.zeros))
        return {
            f"{c}.{symbol}": float(v)
            for symbol, numbers in both
            if numbers is not None
            for c, v in zip(robot.cables, numbers, strict=True)
        }

    def columns(self, shown: Array) -> dict[str, Array]:
        """What lengths less what the drums wound up (k, m) change by with each parameter, where sensors show (k, m)."""
        out: dict[str, Array] = {}
        for names, of in ((self.gains, shown), (self.owned, np.ones_like(shown))):
            for i, name in enumerate(names):
                out.setdefault(name, np.zeros_like(shown))[:, i] -= of[:, i]
        return out


def names_of_gains(robot: CableRobot, names: Iterable[str]) -> tuple[str, ...]:
    """Those of some parameters that some lengths had of their own."""
    ends = (f".{GAIN}", *(f".{c}" for c in robot.cables))
    return tuple(n for n in names if n not in robot.table and not n.startswith(f"{PLATFORM}.") and n.endswith(ends))


def of_file(found: Identification[Any], values: dict[str, float]) -> tuple[dict[str, float], tuple[str, ...]]:
    """What the robot's file is written with: the identified weight beside its own values, and gains and zeros of one file of lengths as
    those of the robot; and what it cannot hold, since several files say it differently."""
    seen = {p.name: p.identified for p in found.parameters if p.status in ("identified", "prior")}
    weight = {n: v for n, v in seen.items() if n.startswith(f"{PLATFORM}.") and n not in values}
    robot, names = found.corrected, names_of_gains(found.corrected, seen)
    try:
        own = sensor_gains(robot, {n: seen[n] for n in names}, _has_zeros(seen), "this run")
    except ModelError:
        return values | weight, names
    return values | weight | own.values(robot), tuple(n for n in names if n not in (*own.gains, *own.owned))


def _has_zeros(names: Iterable[str]) -> bool:
    """Whether zeros of the robot are among some identified names."""
    return any(n.endswith(".l0") for n in names)


def sensor_gains(robot: CableRobot, found: dict[str, float], zeros_found: bool, run: str) -> SensorGains:
    """Of the identified numbers of a run by name. Raises ModelError where it has several drums or power-ups, and nobody says which are
    meant."""
    names = names_of_gains(robot, found)
    gains = [n for n in names if n.endswith(f".{GAIN}")]
    owners = {n.partition(".")[0] for n in gains}
    if len(owners) > 1:
        raise ModelError("this run has several drums", key="ROBOT", found=", ".join(sorted(owners)), expected="one")
    out = SensorGains()
    for owner in owners:  # one, or none
        each = tuple(n if (n := f"{owner}.{c}.{GAIN}") in found else f"{owner}.{GAIN}" for c in robot.cables)
        out = SensorGains(np.array([found[n] for n in each]), each)
    powers = {n.rpartition(".")[0] for n in names if n not in gains}
    if zeros_found or not powers:
        return out
    if len(powers) > 1:
        raise ModelError(
            f"{run} identified zeros of several power-ups, but not those of the robot", key="ROBOT", found=", ".join(sorted(powers)),
            expected="a run whose lengths count from one zero",
        )  # fmt: skip
    (power,) = powers
    owned = tuple(f"{power}.{c}" for c in robot.cables)
    return replace(out, zeros=np.array([found[n] for n in owned]), owned=owned)


@record
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
        out = [Remark.of(Code.BEYOND_TAKEN, names=_spans(taken), run=self.place)] if taken else []
        if self.aside:
            out.append(Remark.of(Code.ZEROS_LEFT_ASIDE, names=_spans(self.aside), run=self.place))
        return (*out, *self.cautions)

    @property
    def robot(self) -> CableRobot:
        """The robot as it was found."""
        return self.file.robot


def _spans(names: Iterable[str]) -> tuple[str, ...]:
    """Names of which each owner has many, by the first and the last: first.c1 to first.c8."""
    of: dict[str, list[str]] = {}
    for name in names:
        first, *_, last = name.split(".")
        of.setdefault(f"{first} {GAIN if last == GAIN else ''}", []).append(name)
    return tuple(w for own in of.values() for w in (own if len(own) < 3 else [f"{own[0]} to {own[-1]}"]))


def open_robot(place: str | os.PathLike[str], zeros: bool = True) -> CableFile:
    """A cable robot to be asked: its file, or that of a run folder as it was identified, with what is to be said of the run; without the
    zeros of power-ups unless `zeros` are wanted. Raises InputError."""
    found = open_calibrated(os.fspath(place), zeros)
    if found.run is None:
        return found.file
    return replace(found.file, warnings=(*found.file.warnings, *found.run.remarks, *found.cautions))


def open_calibrated(place: str, zeros: bool = True) -> Calibrated:
    """A run folder, or a robot file by itself, of which nothing is known but its numbers; `zeros`: with those of its power-up. Raises
    InputError."""
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
    found = {n: values[n] for n in names if n in values}
    more = sensor_gains(robot, found, _has_zeros(seen) or not zeros, place)
    robot = robot if more.gain is None else robot.having(gain=more.gain)
    robot = robot.with_values({n: v for n, v in more.values(robot).items() if n in robot.table})
    file = replace(file, robot=robot, beside=(*file.beside, InputFile(told, read_text(told).sha256)))
    aside = tuple(n for n in found if n not in (*more.gains, *more.owned))
    return Calibrated(place, file, run, read, more, aside)

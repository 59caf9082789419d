"""What an identification found of a cable robot that is no parameter of its own: gains of drums, zeros of one power-up, the weight."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import PLATFORM, CableRobot
from robocal.errors import ModelError
from robocal.prove.identify import Identification

__all__ = ["SensorGains", "names_of_gains", "of_file", "sensor_gains"]

GAIN = "gain"


@dataclass(frozen=True)
class SensorGains:
    """Gains of the drums (m,) and zeros (m,) that lengths of this robot are read with, and the names of their parameters (m,); None
    where they are as the robot says."""

    gain: Array | None = None
    gains: tuple[str, ...] = ()
    zeros: Array | None = None
    owned: tuple[str, ...] = ()

    def lengths(self, robot: CableRobot, shown: Array) -> Array:
        """Lengths (k, m) that the robot's model has, of what its sensors show: g y, and l0 of the robot."""
        out = shown if self.gain is None else shown * self.gain
        return out if self.zeros is None else out + self.zeros - robot.zeros

    def readings(self, robot: CableRobot, full: Array) -> Array:
        """What sensors show of lengths (k, m) that the robot's model has: the inverse of `lengths`."""
        out = full if self.zeros is None else full - self.zeros + robot.zeros
        return out if self.gain is None else out / self.gain

    def columns(self, shown: Array) -> dict[str, Array]:
        """What lengths less those of the model (k, m) change by with each parameter."""
        out: dict[str, Array] = {}
        for names, of in ((self.gains, shown), (self.owned, np.ones_like(shown))):
            for i, name in enumerate(names):
                out.setdefault(name, np.zeros_like(shown))[:, i] -= of[:, i]
        return out


def names_of_gains(robot: CableRobot, names: Iterable[str]) -> tuple[str, ...]:
    """Those of some parameters that lengths are read with and the robot's file cannot hold."""
    owned = {f".{c}" for c in robot.cables}
    return tuple(
        n for n in names
        if n not in robot.table and not n.startswith(f"{PLATFORM}.") and (n.endswith(f".{GAIN}") or any(n.endswith(o) for o in owned))
    )  # fmt: skip


def of_file(found: Identification[Any], values: dict[str, float]) -> tuple[dict[str, float], tuple[str, ...]]:
    """What the robot's file is written with, the identified weight beside its own values; and what it cannot hold."""
    seen = {p.name: p.identified for p in found.parameters if p.status in ("identified", "prior")}
    weight = {n: v for n, v in seen.items() if n.startswith(f"{PLATFORM}.") and n not in values}
    return values | weight, names_of_gains(found.corrected, seen)


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

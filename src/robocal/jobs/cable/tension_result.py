"""What `cable tension` found, and the document that says it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.tension import Distribution
from robocal.files.cable.lists import WRENCH
from robocal.files.text import InputFile
from robocal.jobs.cable.document import framed
from robocal.remarks.remark import Remark

__all__ = ["Tensions"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Tensions:
    """Tensions of k poses with what they hold: `spread` as `tension.distribute` gives it, in N and N m; capacity
    margins (k,) in N; missing wrenches (k, d) along `robot.axes`; the CSV; and `doubts`: which poses are not held."""

    robot: CableRobot
    names: tuple[str, ...]
    poses: Array
    spread: Distribution
    margin: Array
    missing: Array
    power: float
    length: float
    mass: float
    text: str
    warnings: tuple[Remark, ...]
    doubts: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str = ""

    @property
    def axes(self) -> tuple[str, ...]:
        """The components of wrenches, by name."""
        return tuple(WRENCH[i] for i in self.robot.axes)

    @property
    def used_power(self) -> float | None:
        """The power of the sum, of a method that has one."""
        return self.power if self.spread.method == "p-norm" else None

    @property
    def document(self) -> dict[str, Any]:
        """What tension.json holds."""
        spread = self.spread
        rows = zip(self.names, spread.tension, self.margin, self.missing, spread.wrench, strict=True)
        found = {
            "method": spread.method,
            "power": self.used_power,
            "limits_N": spread.limits,
            "mass_kg": self.mass,
            "length_m": self.length,
            "wrenches": {"axes": self.axes, "unit": "N, N m"},
            "feasible": int(spread.feasible.sum()),
            "poses": [
                {
                    "name": name,
                    "T_base_platform": self.poses[i],
                    "feasible": bool(spread.feasible[i]),
                    "tension_N": tension if spread.found[i] else None,
                    "margin_N": margin,
                    "wrench": wrench,
                    "missing": None if spread.feasible[i] else missing,
                }
                for i, (name, tension, margin, missing, wrench) in enumerate(rows)
            ],
        }
        said = (*self.warnings, *self.doubts)
        return framed(self.robot, found, warnings=said, inputs=self.inputs, command=self.command)

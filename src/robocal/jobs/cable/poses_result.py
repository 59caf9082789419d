"""What `cable poses` found, and the document that says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from robocal.cables.geometry import CableRobot
from robocal.cables.poses import LIMITS, PoseBox, PoseList
from robocal.cables.program import Program
from robocal.cables.start import Clearance, Start
from robocal.files.cable.program import list_text
from robocal.files.cable.values import CableUnits
from robocal.files.text import InputFile
from robocal.jobs.cable.document import framed
from robocal.planning.cable import Choice
from robocal.remarks.remark import Remark

__all__ = ["EXPECTED_OF", "STOPPED_BY", "Listed"]

# LIMITS, and the groups of `Choice.expected`, in words.
STOPPED_BY: Mapping[str, str] = MappingProxyType(
    {
        "box": "nothing: X_r was reached",
        "statics": "the tension limits",
        "cable-cable": "two cables that would touch",
        "cable-platform": "a cable that would touch the platform",
    }
)
EXPECTED_OF: Mapping[str, str] = MappingProxyType(
    {"a": "frame anchors a", "b": "platform anchors b", "l0": "zeros of lengths", "position": "platform's position"}
)


@dataclass(frozen=True, eq=False)
class Listed:
    """A list of poses with its start, the box Z, waypoints, what was chosen from it, and what was written."""

    units: CableUnits
    robot: CableRobot  # with the mass and limits that were asked for
    names: tuple[str, ...]
    start: Start
    box: PoseBox
    clearance: Clearance
    listing: PoseList
    program: Program
    method: str
    margin: float
    seed: int
    choice: Choice | None
    warnings: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str = ""

    @property
    def text(self) -> str:
        """poses.csv."""
        choice = self.choice
        rank = None if choice is None else {int(i): k + 1 for k, i in enumerate(choice.chosen)}
        return list_text(self.robot, self.names, self.listing, self.program, self.units, rank=rank)

    @property
    def limits(self) -> dict[str, int]:
        """How many motions each of LIMITS stopped; `box`: none of them did."""
        return {name: int((self.listing.limit == i).sum()) for i, name in enumerate(LIMITS)}

    @property
    def lengths(self) -> str:
        """Which lengths the list holds."""
        return "stretched by the tensions" if self.program.stretched else "geometric"

    @property
    def document(self) -> dict[str, Any]:
        """What list.json holds."""
        made, listing, (k, l) = self.program, self.listing, self.start.nearest
        who = listing.contacts.names(self.robot.cables)
        found = {
            "start": {
                "T_base_platform": self.start.pose,
                "tension_N": self.start.tensions.tension[0],
                "margin_N": self.start.margin,
                "nearest": None if k < 0 else [self.robot.cables[k], self.robot.cables[l]],
                "gap_m": self.start.gap,
            },
            "box": {"half_m": self.box.translation, "half_rad": self.box.rotation, "offset_m": self.box.offset},
            "mu": self.margin,
            "seed": self.seed,
            "method": self.method,
            "mass_kg": self.robot.mass,
            "limits_N": self.robot.limits,
            "diameter_m": self.clearance.diameter,
            "reached": listing.reached,
            "stopped_by": self.limits,
            "lengths": self.lengths,
            "steps": len(made.shares) - 1,
            "poses": [
                {
                    "name": name,
                    "T_base_platform": made.pose[i, -1],
                    "lengths_m": made.lengths[i, -1],
                    "tension_N": made.tension[i, -1],
                    "lambda": listing.fraction[i],
                    "limit": LIMITS[listing.limit[i]],
                    "contact": who[i] if listing.limit[i] > 1 else None,
                }
                for i, name in enumerate(self.names)
            ],
            "choice": self._chosen(),
        }
        return framed(self.robot, found, warnings=self.warnings, inputs=self.inputs, command=self.command)

    def _chosen(self) -> dict[str, Any] | None:
        choice = self.choice
        if choice is None:
            return None
        return {
            "criterion": choice.criterion,
            "poses": [self.names[i] for i in choice.chosen],
            "value": choice.design.value,
            "limit": choice.limit,
            "parameters": list(choice.parameters),
            "sigma_m": choice.noise.length,
            "sigma_position_m": choice.noise.position,
            "sigma_orientation_rad": choice.noise.orientation,
            "expected_rms_m": choice.expected,
        }

"""Whether a list of poses may start at a pose, what is missing there, and where it could start instead.

Section 3.4.5 of the thesis behind `examples/cable-laval` takes X_0 = (mean of the frame anchors, identity), asks whether
(3.80) has a solution there, and if not, leaves the choice of another pose to the reader.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot, straight
from robocal.cables.grid_regions import frame_box
from robocal.cables.interference import Body, Contacts, distances, first_contact
from robocal.cables.pulley import leaving
from robocal.cables.tension import Distribution, hold
from robocal.cables.workspace import Demand, margins

__all__ = ["Clearance", "Start", "examine", "propose"]

CELLS = 15  # along each direction in which a start is looked for


@record
class Clearance:
    """What the search for contacts knows of cables and platform: diameters (m,) in m, the platform's body, and the relief in
    m as for `interference.first_contact`."""

    diameter: Array
    body: Body | None = None
    relief: float | None = None


@record(eq=False)
class Start:
    """A start examined: its tensions (a Distribution of one pose), capacity `margin` in N, who touches there (empty: nobody),
    the two cables nearest to each other (-1, -1 where every pair has a common end) and the `gap` in m between them."""

    pose: Array
    tensions: Distribution
    margin: float
    touching: str
    nearest: tuple[int, int]
    gap: float

    @property
    def feasible(self) -> bool:
        """Whether the cables hold the platform there."""
        return bool(self.tensions.feasible[0])

    @property
    def missing(self) -> Array:
        """The wrench (d,) [N, N m] that is missing; zero where the platform is held."""
        return np.asarray(self.tensions.missing()[0])


def examine(robot: CableRobot, pose: ArrayLike, clearance: Clearance) -> Start:
    """Asks a pose (4, 4) whether it can be held, with which margin, and what touches.

    Raises ModelError when mass or limits of the robot are not known, and for a cable without length.
    """
    x = np.asarray(pose, float)[None]
    tensions = hold(robot, x)
    margin = float(margins(robot, Demand(np.array([robot.need("mass")])), x)[0])
    met = _contacts(robot, x, clearance)
    who = "" if met.free[0] else met.names(robot.cables)[0]
    return Start(x[0], tensions, margin, who, *_nearest(robot, x, clearance.diameter))


def propose(robot: CableRobot, clearance: Clearance) -> Array | None:
    """The pose (4, 4) with the largest capacity margin among CELLS cells along every direction that the robot has, at identity,
    that is held and where nothing touches; None where there is none.

    Cells fill the box in which the frame can hold its platform (`room.frame_box`).
    """
    low, high = frame_box(robot)[0].T
    steps = (np.arange(CELLS) + 0.5) / CELLS
    lines = [low[i] + (high - low)[i] * steps if i in robot.axes else robot.home[i : i + 1, 3] for i in range(3)]
    pose = np.tile(np.eye(4), (int(np.prod([len(x) for x in lines])), 1, 1))
    pose[:, :3, 3] = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    margin = margins(robot, Demand(np.array([robot.need("mass")])), pose)
    held = np.flatnonzero(margin > 0)
    held = held[_contacts(robot, pose[held], clearance).free] if len(held) else held
    return pose[held[np.argmax(margin[held])]] if len(held) else None


def _contacts(robot: CableRobot, pose: Array, clearance: Clearance) -> Contacts:
    """What touches where the platform stands still."""
    still, body, relief = np.zeros((len(pose), 3)), clearance.body, clearance.relief
    diameter, pulleys = clearance.diameter, robot.pulleys
    return first_contact(robot.a, robot.b, pose, still, diameter=diameter, pulleys=pulleys, body=body, relief=relief)


def _nearest(robot: CableRobot, pose: Array, diameter: Array) -> tuple[tuple[int, int], float]:
    """The pair of cables without a common end that are nearest to each other at a pose (1, 4, 4), and the room between."""
    _, _, lever = straight(robot, pose)
    ends = pose[0, :3, 3] + lever[0]
    k, l = np.triu_indices(len(robot.cables), 1)
    apart = [np.linalg.norm(p[k] - p[l], axis=1) > 1e-9 for p in (robot.a, ends)]
    k, l = k[apart[0] & apart[1]], l[apart[0] & apart[1]]
    if not len(k):
        return (-1, -1), float("inf")
    near = robot.a + leaving(ends - robot.a, robot.pulleys)
    gap = distances(near[k], ends[k], near[l], ends[l]) - (diameter[k] + diameter[l]) / 2
    i = int(np.argmin(gap))
    return (int(k[i]), int(l[i])), float(gap[i])

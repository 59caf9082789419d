"""A given path: poses one after the other by straight motions, what each meets first, and how far it can be held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array, Bools
from robocal.cables.boundary import statics_along
from robocal.cables.geometry import CableRobot
from robocal.cables.interference import Body, Contacts, first_contact
from robocal.cables.workspace import Demand
from robocal.errors import require
from robocal.geometry import se3

__all__ = ["Legs", "legs"]


@dataclass(frozen=True)
class Legs:
    """Of n motions from `starts` (n, 4, 4) to `ends` (n, 4, 4): `contacts`, and the share `feasible_share` (n,) of each that the
    tension limits hold, 1 for all of it, 0 where its start is not held, not a number where they were not computed."""

    contacts: Contacts
    feasible_share: Array
    starts: Array
    ends: Array

    @property
    def free(self) -> Array:
        """The share (n,) of each that is possible."""
        return np.fmin(self.contacts.fraction, self.feasible_share)

    @property
    def whole(self) -> Bools:
        """Whether all of it can be, (n,)."""
        return np.asarray(self.contacts.free & ~(self.feasible_share < 1.0))

    @property
    def end_poses(self) -> Array:
        """Where each ends, (n, 4, 4)."""
        v, w = (self.free[:, None] * whole for whole in se3.displacement(self.starts, self.ends))
        return se3.displace(self.starts, v, w)


def legs(
    robot: CableRobot,
    poses: ArrayLike,
    *,
    demand: Demand | None = None,
    diameter: ArrayLike = 0.0,
    body: Body | None = None,
    relief: float | None = None,
    from_first: bool = False,
) -> Legs:
    """The motions from each of the poses (k, 4, 4) to the next, or `from_first` to every other one: the platform's origin on a straight
    line, turning about one axis. Without a demand only contacts are looked for; diameter, body and relief as for `first_contact`.
    Raises ModelError for fewer than two poses."""
    t = np.asarray(poses, float)
    require(t.ndim == 3 and len(t) >= 2, "a path has two poses or more", found=len(t))
    starts, ends = np.repeat(t[:1], len(t) - 1, axis=0) if from_first else t[:-1], t[1:]
    v, w = se3.displacement(starts, ends)
    wheels = robot.pulleys
    contacts = first_contact(
        robot.a, robot.b, starts, v, w, diameter=diameter, pulleys=wheels, body=body, relief=relief
    )
    held = np.full(len(v), np.nan)
    if demand is not None:
        # None where the start itself is not held.
        held = np.nan_to_num(statics_along(robot, demand)(starts, v, w))
    return Legs(contacts, held, starts, ends)

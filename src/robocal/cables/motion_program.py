"""What a controller follows to visit a list of poses: waypoints on every way, their cable lengths and tensions.

Each way leads straight from X_0 to its pose and straight back, so it can be walked both ways. A motion is feasible as far as
it was looked at: `restrict_to_feasible` asks every waypoint again, so that none is commanded that the cables cannot hold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot
from robocal.cables.pose_list import LIMITS, PoseList
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.cables.tension_choice import METHOD
from robocal.cables.workspace import Demand, holds
from robocal.errors import ModelError

__all__ = ["MotionProgram", "program", "restrict_to_feasible"]


@dataclass(frozen=True, eq=False)
class MotionProgram:
    """K + 1 waypoints on each of n ways, the first X_0, the last the pose: shares (K + 1,) of the way, poses
    (n, K + 1, 4, 4), tensions (n, K + 1, m) in N, and lengths (n, K + 1, m) in m as the sensors show them: `stretched` by the
    tensions where the robot's elasticity is known."""

    shares: Array
    pose: Array
    tension: Array
    lengths: Array
    stretched: bool


def restrict_to_feasible(robot: CableRobot, demand: Demand, listing: PoseList, steps: int) -> PoseList:
    """The same list with every way cut where one of its `steps` + 1 waypoints cannot be held, by the margin that it keeps.

    For workspaces with holes or thin walls, which a search along rays may step over; as a rule nothing changes.
    """
    shares = np.linspace(0.0, 1.0, steps + 1)
    share = np.divide(
        listing.fraction, listing.furthest, where=listing.furthest > 0, out=np.ones(len(listing.fraction))
    )
    while True:
        ok = holds(robot, demand, listing.along(shares).reshape(-1, 4, 4)).reshape(-1, steps + 1)
        bad = ~ok.all(axis=1)
        if not bad.any():
            return listing
        last = np.maximum(ok.argmin(axis=1) - 1, 0)
        furthest = np.where(bad, shares[last] * listing.fraction, listing.furthest)
        # A way that is not even held at its start has no length, and is not asked again for ever.
        if not (furthest[bad] < listing.fraction[bad]).all() or not ok[:, 0].all():
            raise ModelError("the start X_0 is not feasible", expected="a start that the cables can hold")
        limit = np.where(bad, LIMITS.index("statics"), listing.limit)
        listing = replace(listing, furthest=furthest, fraction=share * furthest, limit=limit)


def program(robot: CableRobot, listing: PoseList, steps: int, method: str = METHOD) -> MotionProgram:
    """Waypoints in `steps` equal steps on every way, with tensions by `method` (see `tension.distribute`) and lengths.

    Raises ModelError where the method gives no tensions, and when mass or limits of the robot are not known.
    """
    shares = np.linspace(0.0, 1.0, steps + 1)
    pose = listing.along(shares)
    every = pose.reshape(-1, 4, 4)
    w = gravity_wrench(every, float(robot.need("mass")), robot.com)[:, list(robot.axes)]
    found = distribute(structure_of(robot, every), w, robot.need("limits"), method)
    if not found.has_solution.all():
        raise ModelError(
            "this method gives no tensions within the limits at every waypoint",
            key="method",
            found=f"{method}: none at {int((~found.has_solution).sum())} of {len(every)} waypoints",
            expected="norm or mid, which find tensions wherever there are any",
        )
    stretched = robot.elasticity is not None
    lengths, _ = inverse(robot, every, found.tension if stretched else None)
    shape = (*pose.shape[:2], len(robot.cables))
    return MotionProgram(shares, pose, found.tension.reshape(shape), lengths.reshape(shape), stretched)

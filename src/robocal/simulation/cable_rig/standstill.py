"""Where a platform comes to rest under a controller that believes another geometry.

    t = t_0 + L_b f        W(T) t + w = 0        L_b^T (y(T, t) - y_b(X)) = 0

The controller pulls with the tensions t_0 that hold its platform, and adds what its position loop asks for, forces f that act along
its own lengths, until the pose that it computes from what sensors show is the pose X that was asked for. The true lengths y stretch,
and the true platform weighs what it weighs. Unknown are the true pose T and f: twelve equations of statics and geometry, by Newton.
What drives are wired to may differ: `torque` (m, m) says which tension a command raises, `counts` (m, m) what a reading counts.
"""

from __future__ import annotations

import numpy as np

from robocal._record import field, record
from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.geometry import se3

__all__ = ["Standstill", "Wiring", "stand_still"]

ITERATIONS = 60
STEP = 1e-6  # grid: m and rad, of differences
ENOUGH = 1e-10  # tolerance: m, rad and N of a step of Newton's
FURTHEST = 0.05, 20.0  # m or rad, and N: a step goes no further


@record(eq=False)
class Wiring:
    """What m commands of torque do to the cables, and what m readings count of them, each (m, m); the first lengths (m,) in m are those
    from which readings count."""

    torque: Array
    counts: Array
    first: Array

    def shown(self, lengths: Array) -> Array:
        """What sensors show (m,) where cables are as long as (m,)."""
        return np.asarray(self.counts @ (lengths - self.first))


@record(eq=False)
class Standstill:
    """A platform at rest: pose (4, 4), tensions (m,) in N of the plant and as they were commanded, what sensors show (m,) in m, the force
    and moment (6,) that the position loop adds in base axes, and whether a rest was found at which every cable pulls."""

    pose: Array
    tension: Array
    commanded: Array
    shown: Array
    added: Array
    found: bool = field(default=True)


def stand_still(
    true: CableRobot, wiring: Wiring, believed: CableRobot, target: Array, ahead: Array, start: Array
) -> Standstill:
    """Where the true robot rests when the controller, which believes another, asks for a pose (4, 4) with tensions `ahead` (m,) in N, from a
    pose `start` (4, 4) nearby."""
    goal, slope = inverse(believed, target[None])
    mass, com = float(true.need("mass")), true.com
    gradient = slope[0]  # (m, 6)

    def look(x: Array) -> tuple[Array, Array, Array, Array]:
        pose = se3.displace(start, x[:3], x[3:6])
        pulls = wiring.torque @ (ahead + gradient @ x[6:])
        w = structure_of(true, pose[None])[0]
        short = inverse(true, pose[None], np.maximum(pulls, 0.0))[0][0]
        shown = wiring.shown(short)
        left = np.concatenate([w @ pulls + gravity_wrench(pose[None], mass, com)[0], gradient.T @ (shown - goal[0])])
        return left, pose, pulls, shown

    x, found = np.zeros(12), False
    most = np.repeat(FURTHEST, 6)
    left, pose, pulls, shown = look(x)
    for _ in range(ITERATIONS):
        slopes = np.column_stack([(look(x + STEP * e)[0] - left) / STEP for e in np.eye(12)])
        try:
            step = -np.linalg.solve(slopes, left)
        except np.linalg.LinAlgError:
            break
        x = x + step * min(1.0, float((most / np.maximum(np.abs(step), 1e-300)).min()))
        if not np.isfinite(x).all() or np.abs(x[:6]).max() > 10.0:  # tolerance: m, no platform is there
            break
        left, pose, pulls, shown = look(x)
        if np.abs(step).max() < ENOUGH:
            found = True
            break
    return Standstill(pose, pulls, ahead + gradient @ x[6:], shown, -gradient.T @ gradient @ x[6:], found and bool((pulls > 0).all()))

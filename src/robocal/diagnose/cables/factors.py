"""Lengths, positions or the robot's own lengths in another unit, and lengths that count the other way, by poses in the robot's frame.

    e_kj = |s R_k b_j + f p_k - s a_j| - g y_kj - mean over k

Robot, positions and lengths are multiplied by s, f and g. Zeros fall out with the mean. One of the three is another unit, or g has the
other sign, or both.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from typing import NamedTuple

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.diagnose.cables.columns import beside_poses
from robocal.diagnose.check_registry import Context, Finding, Given, When, check, refuse
from robocal.diagnose.limits import COLUMN_CLEARLY, COLUMN_POSES, FACTOR_LEAVES
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["OTHER_UNIT_OF", "TURNED_ROUND"]

UNITS = {"mm": 1e-3, "cm": 1e-2, "inch": 0.0254, "m": 1.0}
OTHER_UNIT_OF = declare(
    "cables-in-another-unit",
    "{what} in {true}, not in {stated}[, and the lengths count the other way{turned}]: with that, what they leave falls from "
    "{before:.3g} to {left:.3g}",
    "State that unit.",
)
TURNED_ROUND = declare(
    "lengths-count-the-other-way",
    "the lengths count the other way, they fall where cables grow: with that, what they leave falls from {before:.3g} to {left:.3g}",
    "Write every length times -1.",
)
WORDS = {"robot": "the robot's own lengths are", "position": "the positions are", "lengths": "the lengths are"}


class _Trial(NamedTuple):
    """What the robot, positions and lengths are multiplied by; what is in the unit `true` and not in the one that is `stated`."""

    robot: float = 1.0
    position: float = 1.0
    lengths: float = 1.0
    what: str = ""
    true: str = ""
    stated: str = ""


@check("factors", When.READ, order=15, given=Given.ACCEPTED, needs=("data",))
def factors(context: Context[CableRobot]) -> Iterator[Finding]:
    """The factor that explains lengths and poses, where as stated does not."""
    robot, seen = context.model, beside_poses(context)
    if seen is None or (seen[1].frame is not None and any(seen[1].frame.free)):
        return
    read, pose, t, y = seen
    whole = np.isfinite(y).all(axis=1)
    t, y = t[whole], y[whole]
    if len(y) < COLUMN_POSES:
        return
    tried = [_Trial()]
    for true, stated in permutations(UNITS, 2):
        f = UNITS[true] / UNITS[stated]
        tried += [
            _Trial(robot=f, what="robot", true=true, stated=stated),
            _Trial(position=f, what="position", true=true, stated=stated),
            *(_Trial(lengths=g, what="lengths", true=true, stated=stated) for g in (f, -f)),
        ]
    tried.append(_Trial(lengths=-1.0))
    left = np.array([_left(robot, t, y, trial) for trial in tried])
    best = int(np.argmin(left))
    if left[best] > FACTOR_LEAVES or left[best] * COLUMN_CLEARLY > left[0]:
        return
    won = tried[best]
    spread = float(y.std(axis=0).mean()) * abs(won.lengths)
    amounts = {"before": Quantity(left[0] * spread), "left": Quantity(left[best] * spread)}
    source = pose.source if won.what == "position" else read.source
    if not won.what:
        yield refuse(TURNED_ROUND, source=source, wrong="lengths", **amounts)
        return
    turned = {"turned": ""} if won.lengths < 0 else {}
    yield refuse(
        OTHER_UNIT_OF,
        source=source,
        wrong=won.what,
        what=WORDS[won.what],
        true=won.true,
        stated=won.stated,
        **turned,
        **amounts,
    )


def _left(robot: CableRobot, t: Array, y: Array, trial: _Trial) -> float:
    """What a trial leaves, as a share of the scatter of the lengths."""
    p = t[:, None, :3, 3] * trial.position
    b = np.einsum("kij,mj->kmi", t[:, :3, :3], robot.b) * trial.robot
    d = np.linalg.norm(p + b - robot.a * trial.robot, axis=2)
    read = y * trial.lengths
    read = read - read.mean(axis=0)
    e = d - d.mean(axis=0) - read
    return float(np.sqrt(np.mean(e**2) / max(np.mean(read**2), 1e-300)))

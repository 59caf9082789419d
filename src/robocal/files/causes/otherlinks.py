"""Whether another chain of the URDF was measured than the one that was chosen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robocal.arms.chain import Chain
from robocal.calibrate.hypotheses.explain import Doubt, alike, left_of
from robocal.calibrate.hypotheses.sights import sights
from robocal.errors import InputError
from robocal.files.robot import Robot
from robocal.files.urdfchains import other_chains
from robocal.measure.data import DataSet

__all__ = ["Other", "Reread", "option", "other_links"]

Reread = Callable[[Chain], DataSet]


@dataclass(frozen=True)
class Other:
    """Another chain, and what it leaves (m)."""

    robot: Robot
    left: float


def other_links(robot: Robot, data: DataSet, doubt: Doubt, reread: Reread) -> tuple[Other, ...]:
    """The chains that explain the data, alike, those that leave least first."""
    if robot.format != "urdf":
        return ()
    seen = sights(robot.chain, [data])
    assert seen is not None
    turned = 6 if seen.turned.any() else 3
    base_free, tip_free = bool(seen.frames_free.all()), bool(seen.things_free[:, :turned].all())
    sizes = [(o.kind, len(o)) for o in data.observations]
    found = []
    for other in other_chains(robot, base_free=base_free, tip_free=tip_free):
        try:
            read = reread(other.chain)
        except InputError:  # there are no columns for its joints
            continue
        if [(o.kind, len(o)) for o in read.observations] != sizes:
            continue
        left = left_of(other.chain, read, doubt)
        if doubt.met(left):
            found.append(Other(other, left))
    best = min((f.left for f in found), default=np.inf)
    return tuple(sorted((f for f in found if alike(f.left, best)), key=lambda f: f.left))


def option(robot: Robot, other: Robot) -> str:
    """What to give on the command line for another chain."""
    return f"--tip {other.tip}" if other.root == robot.root else f"--base {other.root} --tip {other.tip}"

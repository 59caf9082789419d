"""Where the arms of a study are measured, and at which other poses they are judged."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.files.pose_table import read_poses
from robocal.files.studyfile import Point
from robocal.planning.candidates import Template, joint_range
from robocal.planning.pose_selection import PlanOptions, plan

__all__ = ["ArmPoses"]

JUDGED = 300  # poses at which a trial is judged, where no list says which


class ArmPoses:
    """The poses of one point: a list, so many drawn within the joint limits in every trial, or so many that `plan` chooses once, with its
    defaults and the study's seed, for an instrument like the template's.

    Where a list says at which poses the robot has to be accurate (`tests`), its first, third, ... are planned for and those between are
    judged; otherwise poses drawn within the joint limits are, others for either.
    """

    def __init__(self, point: Point, chain: Chain, template: Template, seed: int) -> None:
        self.point, self.chain, self.template, self.seed = point, chain, template, seed
        # Read at once, so that a list that is not there is told before the first trial, whatever the trials say of it.
        self.listed = self._list("poses.file")
        self.tests = self._list("poses.tests")  # where the robot has to be accurate, (t, n)

    @cached_property
    def common(self) -> Array | None:
        """What is measured in every trial, (m, n); None where every trial draws its own."""
        if self.listed is not None:
            return self.listed
        p = self.point
        if p["poses.choose"] == "random":
            return None
        options = PlanOptions(p["poses.count"], p["poses.criterion"], seed=self.seed)
        wanted = None if self.tests is None else self.tests[::2]
        return plan(self.chain, self.template, options, tests=wanted).q

    def draw_joints(self, rng: np.random.Generator) -> Array:
        """The joint values of one trial, (m, n)."""
        return self._drawn(self.point["poses.count"], rng) if self.common is None else self.common

    def draw_tests(self, rng: np.random.Generator) -> Array:
        """Joint values (t, n) that were neither measured nor planned for."""
        return self._drawn(JUDGED, rng) if self.tests is None else self.tests[1::2]

    def _drawn(self, count: int, rng: np.random.Generator) -> Array:
        low, high = joint_range(self.chain).T
        return rng.uniform(low, high, (count, len(low)))

    def _list(self, key: str) -> Array | None:
        return None if self.point[key] is None else read_poses(self.point[key], self.chain)[1]

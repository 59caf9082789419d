"""The Laval robot before a precise instrument: lengths to 0.5 mm, poses to 0.2 mm and 0.02 degrees."""

from __future__ import annotations

import numpy as np
from cables.test_calibration import read

from robocal.geometry import se3, so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations

LENGTH = 5e-4
POSE = np.array([2e-4] * 3 + [np.radians(0.02)] * 3)


def measured(robot, rng, poses=100):
    """Up to 0.7 m about the middle, 15 degrees about each axis."""
    turned = np.concatenate([rng.uniform(-0.7, 0.7, (poses, 3)), np.radians(rng.uniform(-15, 15, (poses, 3)))], axis=1)
    t = se3.from_vector(turned + np.r_[robot.a.mean(axis=0), 0, 0, 0])
    y = read(robot, t) + LENGTH * rng.normal(size=(poses, 8))
    e = POSE * rng.normal(size=(poses, 6))
    t[:, :3, 3] += e[:, :3]
    t[:, :3, :3] = so3.exp(e[:, 3:]) @ t[:, :3, :3]
    still = Frame("camera", (0.0,) * 6, (False,) * 6)
    return DataSet(
        Configurations(tuple(f"p{i}" for i in range(poses))),
        (
            Observations(
                "lengths", np.repeat(np.arange(poses), 8), y.reshape(-1, 1), np.full((8 * poses, 1), LENGTH),
                extra={"cable": np.tile(np.arange(8), poses)},
            ),
            Observations("pose", np.arange(poses), se3.to_vector(t), np.tile(POSE, (poses, 1)), still),
        ),
    )  # fmt: skip

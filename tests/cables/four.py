"""Four cables with swivelling pulleys and an inclinometer on the platform: true and nominal robot, and what is read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.cables.geometry import cable_robot
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Observations

LENGTH, SWIVEL, TILT = 2e-3, np.radians(0.1), np.radians(0.05)
ZEROS = np.array([0.5, -1.0, 2.0, 3.0])
FRAME = np.array([(2.5, 2, 3.2), (-2.5, 2, 3.0), (-2.5, -2, 3.1), (2.5, -2, 3.0)])
PLATFORM = np.array([(0.25, 0.2, 0.1), (-0.25, 0.2, 0.12), (-0.25, -0.2, 0.1), (0.25, -0.2, 0.15)])
CALIBRATED = ("ax", "ay", "az", "l0")


def robots(rng, off):
    truth = cable_robot("four", FRAME, PLATFORM, [0.3, 0.4, 0.5, 0.2], free=CALIBRATED)
    a, zeros = FRAME + off * rng.normal(size=FRAME.shape), truth.zeros + off * rng.normal(size=4)
    return truth, cable_robot("four", a, PLATFORM, zeros, free=CALIBRATED)


def measured(truth, rng, poses):
    """Up to 1.4 m about the middle and 15 degrees about each axis; the true poses with them."""
    shift = rng.uniform(-1, 1, (poses, 3)) * [1.4, 1.1, 0.7] + [0, 0, 1.2]
    start = np.concatenate([shift, np.radians(rng.uniform(-15, 15, (poses, 3)))], axis=1)
    row, cable = np.repeat(np.arange(poses), 4), np.tile(np.arange(4), poses)
    each, mine = np.zeros((4 * poses, 1)), {"cable": cable.astype(float)}
    seen = (
        Observations("lengths", row, each, each + LENGTH, extra=mine),
        Observations("swivel", row, each, each + SWIVEL, extra=mine, options={"cables": truth.cables}),
        Observations("inclination", np.arange(poses), np.zeros((poses, 2)), np.full((poses, 2), TILT)),
    )
    where = Configurations(tuple(f"p{i}" for i in range(poses)), start=start)
    length, turned, tilt = synthesise(truth, DataSet(where, seen), rng).observations
    turned = replace(turned, value=turned.value - ZEROS[cable][:, None])
    return DataSet(replace(where, start=None), (length, turned, tilt)), se3.from_vector(start)

"""A camera that moves steadily while its views are taken is told, by how much; one that stands still, or whose robot errs, is not."""

from __future__ import annotations

import numpy as np
import pytest
from prove.test_hand_eye_coverage import BOARD_AT, HAND, draw

from robocal._record import replace
from robocal.diagnose.camera_drift import camera_drift
from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.machine import Rig
from robocal.parameters import ParameterTable
from robocal.prove.decision import decide

MOVE = np.array([4e-3, 0.0, 0.0]), np.array([0.0, 4e-3, 0.0])


# obeys: camera-drift
@pytest.mark.parametrize(("size", "robot"), [(1.0, (0.0, 0.0)), (0.0, (0.0, 0.0)), (0.0, (5e-4, 1e-3))])
def test_a_camera_that_moves_steadily(size, robot):
    """4 mm and 4 mrad from the first view to the last; fastened, nothing is said."""
    data, _ = draw(3, robot)
    hand, board = se3.from_vector(HAND), se3.from_vector(BOARD_AT)
    flange, out = se3.from_vector(data.configurations.starts), []
    for pose, t in zip(flange, np.linspace(-0.5, 0.5, len(flange)), strict=True):
        moved = se3.displace(hand[None], size * t * MOVE[0][None], size * t * MOVE[1][None])[0]
        out.append(se3.to_vector(board @ se3.inverse(moved @ se3.inverse(hand) @ se3.inverse(pose) @ board)))
    data = replace(data, configurations=replace(data.configurations, start=np.array(out)))
    told = list(camera_drift.run(decide(Rig("rig", ParameterTable(), ()), data, Options())))
    assert len(told) == bool(size)
    if told:
        numbers = told[0].numbers
        assert numbers["shift"].value == pytest.approx(4e-3, rel=0.3) and numbers["turn"].value == pytest.approx(
            4e-3, rel=0.3
        )

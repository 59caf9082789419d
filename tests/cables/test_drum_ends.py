"""A drum that gives less with every turn holds so much cable and no more."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import box

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot
from robocal.errors import ModelError


def drums(build_up):
    plain = box()
    return cable_robot("box", plain.a, plain.b, gain=np.ones(8), build_up=np.full(8, build_up))


@pytest.mark.parametrize("build_up", [-0.02, 0.02])
def test_what_a_drum_holds_goes_there_and_back(build_up):
    robot = drums(build_up)
    shown = inverse(robot, robot.home[None])[0]
    assert np.allclose(forward(robot, shown).pose, robot.home, atol=1e-9)


def test_what_it_does_not_hold_is_refused():
    """l = y - y^2 / 2 is half a metre at most, and cables of metres would get a quiet number."""
    robot = drums(-0.5)
    with pytest.raises(ModelError, match="cable c1 is longer than all that its drum holds") as failure:
        inverse(robot, robot.home[None])
    assert failure.value.key == "c1"
    with pytest.raises(ModelError, match="its drum holds"):
        forward(robot, np.full((1, 8), 2.0))

"""Orientation forms against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.files import orientation
from robocal.geometry import so3


@pytest.mark.parametrize("order", ["XYZ", "ZYX", "ZYZ", "XZY"])
@pytest.mark.parametrize("intrinsic", [True, False])
def test_euler_agrees_with_scipy(rng, order, intrinsic):
    angles = rng.uniform(-3, 3, (20, 3))
    expected = Rotation.from_euler(order if intrinsic else order.lower(), angles).as_matrix()
    np.testing.assert_allclose(orientation.euler(angles, order, intrinsic=intrinsic), expected, atol=1e-14)


@pytest.mark.parametrize("intrinsic", [True, False])
def test_euler_axes_are_the_derivative(rng, intrinsic):
    angles = rng.uniform(-1, 1, (5, 3))
    axes = orientation.euler_axes(angles, "ZYX", intrinsic=intrinsic)
    r = orientation.euler(angles, "ZYX", intrinsic=intrinsic)
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-6
        moved = orientation.euler(angles + step, "ZYX", intrinsic=intrinsic)
        np.testing.assert_allclose(so3.log(moved @ np.swapaxes(r, 1, 2)) / 1e-6, axes[..., i], atol=1e-5)


def test_quaternion_and_rpy(rng):
    q = Rotation.random(20, rng=rng)
    np.testing.assert_allclose(orientation.quaternion(q.as_quat()), q.as_matrix(), atol=1e-14)
    angles = so3.roll_pitch_yaw(q.as_matrix())
    np.testing.assert_allclose(orientation.rpy(angles), q.as_matrix(), atol=1e-14)
    poles = orientation.rpy([[0.3, np.pi / 2, 0.1], [0.3, -np.pi / 2, 0.4], [0, 0, np.pi]])
    np.testing.assert_allclose(orientation.rpy(so3.roll_pitch_yaw(poles)), poles, atol=1e-14)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize("away", [0.0, 1e-16, 1e-12, 3e-10, 1e-8, 1e-5])
def test_roll_pitch_yaw_is_exact_near_the_poles(rng, pitch, away):
    """Roll and yaw alone are not known there; what they say together is."""
    angles = np.column_stack([rng.uniform(-3, 3, 50), pitch + away * rng.normal(size=50), rng.uniform(-3, 3, 50)])
    turns = Rotation.from_euler("xyz", angles).as_matrix()
    back = Rotation.from_euler("xyz", so3.roll_pitch_yaw(turns)).as_matrix()
    np.testing.assert_allclose(back, turns, atol=3e-14)

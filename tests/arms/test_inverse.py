"""Inverse kinematics: what it returns is reached, within the limits, and the same every time."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.arms import catalog
from robocal.arms.conventions import chain
from robocal.arms.inverse_kinematics import inverse_point, inverse_pose
from robocal.errors import ModelError
from robocal.geometry import se3, so3

DEG = np.pi / 180


def random_joints(robot, rng, m):
    return rng.uniform(*np.clip(robot.limits.T, -3.0, 3.0), (m, len(robot.joints)))


def inside(robot, q):
    return ((q >= robot.limits[:, 0]) & (q <= robot.limits[:, 1])).all()


def turned(a, b):
    return np.linalg.norm(so3.log(a[..., :3, :3] @ np.swapaxes(b[..., :3, :3], -1, -2)), axis=-1)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", ["ur10", "irb-120", "panda", "iiwa-14", "rv-2aj"])
def test_poses_are_reached_within_the_limits(name, rng):
    robot = catalog.get(name)
    target = robot.pose(random_joints(robot, rng, 200))
    found = inverse_pose(robot, target)
    made = robot.pose(found.joints)
    gap = np.linalg.norm(made[:, :3, 3] - target[:, :3, 3], axis=1)
    assert found.success.all() and inside(robot, found.joints)
    assert gap.max() <= 1e-9 and turned(made, target).max() <= 1e-9
    np.testing.assert_allclose(found.position, gap, atol=1e-14)
    np.testing.assert_allclose(found.angle, turned(made, target), atol=1e-14)


def test_a_calibrated_arm_is_no_harder(rng):
    """Frames that no closed form knows: every geometric parameter is off."""
    robot = catalog.get("ur10")
    real = robot.with_values({n: robot.table[n].value + rng.normal(0, 2e-3) for n in robot.geometric})
    real = real.with_values({"base.x": 0.3, "base.rz": 0.4, "tool.y": 0.05, "tool.rx": -0.3, "j2.gain": 1.001})
    target = real.pose(random_joints(robot, rng, 100))
    found = inverse_pose(real, target)
    assert found.success.all()
    np.testing.assert_allclose(real.pose(found.joints), target, atol=2e-9)


def test_point_only(rng):
    robot = catalog.get("rv-2aj")
    target = robot.pose(random_joints(robot, rng, 50))[:, :3, 3]
    found = inverse_point(robot, target)
    assert found.success.all() and (found.angle == 0).all()
    np.testing.assert_allclose(robot.pose(found.joints)[:, :3, 3], target, atol=1e-9)


def test_slides_have_limits_too(rng):
    rows = [
        {"type": "prismatic", "limits": (0.0, 0.6)},
        {"alpha": 90 * DEG, "a": 0.1, "limits": (-2, 2)},
        {"a": 0.4, "limits": (-2.5, 2.5)},
        {"alpha": -90 * DEG, "a": 0.3, "limits": (-2, 2)},
    ]
    robot = chain("gantry", "mdh", rows, tool=(0.1, 0.05, 0, 0, 0, 0))
    target = robot.pose(random_joints(robot, rng, 100))[:, :3, 3]
    found = inverse_point(robot, target)
    assert found.success.all() and inside(robot, found.joints)
    lifted = robot.pose([[0.0, 0.3, 0.2, 0.1]])[0, :3, 3] - [0, 0, 0.9]
    assert not inverse_point(robot, lifted).success.any()


def test_out_of_reach_is_said_and_the_nearest_is_kept():
    robot = chain("elbow", "mdh", [{}, {"a": 1.0}], tool=(1.0, 0, 0, 0, 0, 0))
    found = inverse_point(robot, [[3.0, 0, 0], [0.0, 1.2, 0], [0, 0, 0.5]])
    assert list(found.success) == [False, True, False]
    assert found.position[0] == pytest.approx(1.0, abs=1e-6)  # stretched out, one metre short
    assert found.position[2] == pytest.approx(0.5, abs=1e-6)  # folded up below it
    free = inverse_pose(robot, robot.pose([0.3, 0.4]))
    assert free.success.all()
    twisted = robot.pose([0.3, 0.4]) @ se3.from_vector([0, 0, 0, 0.2, 0, 0])
    assert not inverse_pose(robot, twisted).success.any()


def test_limits_decide_between_two_elbows():
    rows = [{"limits": (-3, 3)}, {"a": 1.0, "limits": (0.1, 3)}]
    up = chain("elbow", "mdh", rows, tool=(1.0, 0, 0, 0, 0, 0))
    down = chain("elbow", "mdh", [rows[0], {**rows[1], "limits": (-3, -0.1)}], tool=(1.0, 0, 0, 0, 0, 0))
    at = [[1.2, 0.7, 0.0]]
    a, b = inverse_point(up, at), inverse_point(down, at)
    assert a.success.all() and b.success.all()
    assert a.joints[0, 1] == pytest.approx(-b.joints[0, 1], abs=1e-8)
    shut = chain("elbow", "mdh", [{"limits": (-0.1, 0.1)}, rows[1]], tool=(1.0, 0, 0, 0, 0, 0))
    stuck = inverse_point(shut, at)
    assert not stuck.success.any() and inside(shut, stuck.joints)


def test_a_start_is_tried_first(rng):
    robot = catalog.get("panda")
    q = random_joints(robot, rng, 50)
    near = inverse_pose(robot, robot.pose(q), start=q)
    np.testing.assert_array_equal(near.joints, q)
    close = inverse_pose(robot, robot.pose(q[0]), start=q[0] + 1e-3)
    assert np.abs(close.joints - q[0]).max() < 5e-3


def test_the_answer_does_not_depend_on_company_or_time(rng):
    robot = catalog.get("irb-120")
    target = robot.pose(random_joints(robot, rng, 30))
    together, again = inverse_pose(robot, target), inverse_pose(robot, target)
    np.testing.assert_array_equal(together.joints, again.joints)
    alone = inverse_point(robot, target[7, :3, 3])
    assert alone.success.all() and alone.joints.shape == (1, 6)


def test_columns_of_a_configuration_count(rng):
    """An arm whose lift grows with temperature is solved at each target's own temperature."""
    from dataclasses import replace

    from robocal.geometry.path.program import Element, Term
    from robocal.parameters import Parameter, ParameterTable

    robot = catalog.get("irb-120")
    warm = replace(
        robot,
        elements=(*robot.elements[:1], Element("tz", (Term("growth", "temperature"),)), *robot.elements[1:]),
        table=robot.table + ParameterTable((Parameter("growth", 1e-3, "m"),)),
    )
    q, kelvin = random_joints(robot, rng, 20), rng.uniform(0, 30, 20)
    found = inverse_pose(warm, warm.pose(q, {"temperature": kelvin}), extra={"temperature": kelvin})
    assert found.success.all()
    np.testing.assert_allclose(
        warm.pose(found.joints, {"temperature": kelvin}), warm.pose(q, {"temperature": kelvin}), atol=2e-9
    )


def test_empty_and_misshapen_targets():
    robot = catalog.get("irb-120")
    assert inverse_pose(robot, np.empty((0, 4, 4))).joints.shape == (0, 6)
    for bad in (np.eye(3), np.zeros((2, 4, 3))):
        with pytest.raises(ModelError):
            inverse_pose(robot, bad)
    for point, more in ((np.zeros((2, 2)), {}), (np.zeros(3), {"start": (0.0, 0.0)})):
        with pytest.raises(ModelError):
            inverse_point(robot, point, **more)

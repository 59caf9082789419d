"""One pose at a time: as the batch functions, to rounding; whatever is asked is answered and never raised."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import box, poses, published
from cables.test_calibration import listed, made

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot, straight
from robocal.cables.prepared import Drums, Prepared
from robocal.cables.pulley import Pulleys
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.errors import ModelError
from robocal.geometry import se3

SAME = 1e-12


def robots(name, rng):
    if name.endswith("T"):
        robot = made(3, 5 if name == "3T" else 4, name)
        return robot, listed(robot, rng, 40), np.tile([1.0, 900.0], (len(robot.cables), 1))
    robot = published("laval")
    if name == "pulleys":
        axis = np.tile([0.1, -0.05, 1.0], (8, 1))
        robot = robot.having(pulleys=Pulleys(np.full(8, 0.05), axis / np.linalg.norm(axis[0])))
    return robot, poses(robot, rng, 60), robot.limits


@pytest.mark.parametrize("method", ["norm", "mid", "closed", "barycentre", "p-norm"])
@pytest.mark.parametrize("name", ["laval", "pulleys", "1R2T", "2T", "3T"])
def test_tensions_are_those_of_the_batch(name, method, rng):
    robot, t, limits = robots(name, rng)
    one = Prepared(robot, mass=5.0, com=(0.01, 0.0, -0.02), limits=limits, method=method)
    wrench = np.array([3.0, -2.0, 5.0, 0.2, 0.1, -0.3])
    load = (gravity_wrench(t, 5.0, [0.01, 0.0, -0.02]) + wrench)[:, list(robot.axes)]
    every = distribute(structure_of(robot, t), load, limits, method)
    assert every.has_solution.any()
    for pose, tension, found in zip(t, every.tension, every.has_solution, strict=True):
        held = one.tension(pose, wrench)
        assert held.feasible == found
        np.testing.assert_allclose(held.tension, tension, rtol=SAME, atol=SAME * limits.max())


@pytest.mark.parametrize("sigma", [None, 1e-3])
@pytest.mark.parametrize("name", ["laval", "pulleys", "1R2T", "2T", "3T"])
def test_poses_are_those_of_the_batch(name, sigma, rng):
    robot, t, limits = robots(name, rng)
    one = Prepared(robot, mass=5.0, limits=limits, sigma=sigma)
    y = inverse(robot, t)[0] + 1e-3 * rng.normal(size=(len(t), len(robot.cables)))
    step = np.zeros((len(t), 6))
    step[:, list(robot.axes)] = rng.normal(scale=0.02, size=(len(t), len(robot.axes)))
    start = se3.from_vector(se3.to_vector(t) + step)
    every = forward(robot, y, start, sigma=sigma)
    assert every.converged.all()
    for i in range(len(t)):
        found = one.forward(y[i], start[i])
        assert found.converged
        np.testing.assert_allclose(found.pose, every.pose[i], rtol=0, atol=SAME)
        np.testing.assert_allclose(found.residual, every.residual[i], rtol=0, atol=SAME)
        # Where residuals say the noise, what rounding makes of them counts twice.
        spread = 0.0 if sigma else 4 * SAME / np.linalg.norm(every.residual[i])
        size = np.abs(every.covariance[i]).max()
        np.testing.assert_allclose(found.covariance, every.covariance[i], rtol=0, atol=(1e-10 + spread) * size)


@pytest.mark.parametrize("name", ["laval", "pulleys", "1R2T", "2T", "3T"])
def test_twists_from_rates(name, rng):
    robot, t, limits = robots(name, rng)
    one = Prepared(robot, mass=5.0, limits=limits)
    twist = np.zeros((len(t), 6))
    twist[:, list(robot.axes)] = rng.normal(size=(len(t), len(robot.axes)))
    rates = (straight(robot, t)[1] @ twist[..., None])[..., 0]
    for pose, rate, v in zip(t, rates, twist, strict=True):
        np.testing.assert_allclose(one.twist(pose, rate), v, rtol=0, atol=1e-9)


def test_nothing_that_is_asked_raises(rng):
    robot, t, limits = robots("laval", rng)
    one = Prepared(robot, limits=limits)
    far = t[0].copy()
    far[:3, 3] += 50.0
    heavy = one.tension(t[0], np.array([0, 0, -1e5, 0, 0, 0.0]))
    for held in (one.tension(far), one.tension(np.full((4, 4), np.nan)), heavy):
        assert not held.feasible and np.isnan(held.tension).all()
    on_anchor = t[0].copy()
    on_anchor[:3, 3] = robot.a[0] - t[0, :3, :3] @ robot.b[0]
    assert not one.tension(on_anchor).feasible
    lost = one.forward(np.full(8, np.nan), t[0])
    assert not lost.converged and np.isnan(lost.pose).all()
    assert np.isfinite(one.forward(np.full(8, 1e3), t[0]).residual).all()
    wheels = robot.having(pulleys=Pulleys(np.full(8, 0.5), np.tile([0.0, 0.0, 1.0], (8, 1))))
    inside = t[0].copy()
    inside[:3, 3] = robot.a[0] + [0.4, 0.0, 0.0] - t[0, :3, :3] @ robot.b[0]
    assert not Prepared(wheels, limits=limits).tension(inside).feasible


def test_a_singular_pose_has_no_twist_and_no_covariance():
    a = np.array([[x, y, 1.0] for x in (-1.0, 1) for y in (-1.0, 1)] * 2)
    b = 0.1 * a - [0, 0, 0.1]
    b[:, 2] = 0
    flat = cable_robot("flat", a, b)
    one = Prepared(flat, mass=1.0, limits=np.tile([1.0, 100.0], (8, 1)))
    pose = np.eye(4)
    pose[2, 3] = 1.0
    assert np.isnan(one.twist(pose, np.ones(8))).any()
    assert np.isnan(one.forward(inverse(flat, pose[None])[0][0], pose).covariance).all()


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({"limits": [[5.0, 1.0]] * 8}, "limits"),
        ({"method": "quickest"}, "unknown tension method"),
        ({"sigma": 0.0}, "noise"),
        ({"mass": -1.0}, "mass"),
        ({"method": "p-norm", "power": 1.0}, "power"),
        ({"com": [0.0, 0.0]}, "centre of mass"),
        ({"com": [0.0, 0.0, np.nan]}, "centre of mass"),
        ({"mass": "heavy"}, "no numbers"),
        ({"sigma": [1e-3] * 8}, "noise"),
        ({"method": None}, "unknown tension method"),
    ],
)
def test_what_cannot_be_prepared(known, words):
    robot = box().having(mass=5.0, limits=np.tile([1.0, 900.0], (8, 1)))
    with pytest.raises(ModelError, match=words):
        Prepared(robot, **known)


def test_arrays_of_another_shape_are_refused():
    one = Prepared(box(), mass=5.0, limits=np.tile([1.0, 900.0], (8, 1)))
    for call in (
        lambda: one.tension(np.eye(3)), lambda: one.tension(np.eye(4), np.zeros(3)), lambda: one.forward(np.zeros(7), np.eye(4)),
        lambda: one.twist(np.eye(4), np.zeros((8, 1))),
    ):  # fmt: skip
        with pytest.raises(ModelError, match="another shape"):
            call()
    for given in (np.eye(4, dtype=complex), None, "pose", [[1.0, 2.0], [3.0]]):
        with pytest.raises(ModelError, match="no numbers"):
            one.tension(given)


BAD_POSES = {
    "scaled": lambda t: np.diag([2.0, 2, 2, 1]) @ t,
    "mirrored": lambda t: t @ np.diag([1.0, 1, -1, 1]),
    "transposed": lambda t: t.T,
    "zero": lambda t: np.zeros((4, 4)),
    "one place lost": lambda t: np.where(np.arange(16).reshape(4, 4) == 3, np.nan, t),
}


@pytest.mark.parametrize("name", BAD_POSES)
def test_a_pose_that_is_no_rigid_motion_is_not_answered(name, rng):
    """Neither with tensions nor with a pose that has its axes; one that was printed with seven digits is."""
    robot = box()
    t, limits = poses(robot, rng, 1), np.tile([1.0, 900.0], (8, 1))
    one, y = Prepared(robot, mass=5.0, limits=limits), inverse(robot, t)[0]
    bad = BAD_POSES[name](t[0])
    found = one.forward(y[0], bad)
    assert not found.converged and np.isnan(found.pose).all() and np.isnan(found.covariance).all()
    assert not one.tension(bad).feasible and np.isnan(one.twist(bad, np.ones(8))).all()
    printed = np.array([[float(f"{v:.7g}") for v in row] for row in t[0]])
    assert one.forward(y[0], printed).converged and one.tension(printed).feasible == one.tension(t[0]).feasible


def test_what_may_be_entered_in_any_way(rng):
    """Lists, slices and integers mean the same as arrays."""
    robot, t, limits = robots("laval", rng)
    one = Prepared(robot, limits=limits)
    right = one.tension(t[0]).tension
    wide = np.zeros((4, 8))
    wide[:, ::2] = t[0]
    for pose in (t[0].tolist(), np.asfortranarray(t[0]), wide[:, ::2]):
        np.testing.assert_array_equal(one.tension(pose).tension, right)


def test_torques_of_the_motors():
    drums = Drums.of(0.04, gear=10.0, efficiency=0.8)
    assert np.isclose(drums.torque(np.array([100.0]))[()], 100 * 0.04 / 8).all()
    each = Drums.of([0.04, 0.05], gear=[1.0, 2.0])
    np.testing.assert_allclose(each.torque(np.array([10.0, 20.0])), [0.4, 0.5])
    for wrong in ({"radius": 0.0}, {"radius": 0.04, "gear": -1.0}, {"radius": 0.04, "efficiency": 1.2}):
        with pytest.raises(ModelError, match="a drum has no such"):
            Drums.of(**wrong)
    one, rows = Drums.of(0.04), [[10.0, 20.0], [30.0, 40.0]]
    np.testing.assert_allclose(each.torque(rows), [[0.4, 0.5], [1.2, 1.0]])
    np.testing.assert_allclose(one.torque([10.0, 20.0]), [0.4, 0.8])
    for tension in (np.ones(3), np.ones((2, 1)), 1.0):  # not to be spread over the cables
        with pytest.raises(ModelError, match="another shape"):
            each.torque(tension)
    with pytest.raises(ModelError, match="as many cables"):
        Drums.of([0.04] * 8, gear=[1.0, 2.0])
    with pytest.raises(ModelError, match="no numbers"):
        Drums.of("thick")

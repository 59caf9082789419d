"""Structure matrix, null vector, weight and stiffness against definitions and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import box
from laws import check_jacobian

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import cable_robot, lengths, straight
from robocal.cables.pulley import Pulleys, curvature, run
from robocal.cables.statics import gravity_wrench, stiffness, structure, structure_of
from robocal.cables.tension import distribute
from robocal.errors import ModelError
from robocal.geometry import so3


@pytest.fixture
def rig(rng):
    a, b = rng.uniform(-3, 3, (8, 3)) * [1, 1, 0.3] + [0, 0, 1], rng.uniform(-0.3, 0.3, (8, 3))
    pose = np.tile(np.eye(4), (20, 1, 1))
    pose[:, :3, 3], pose[:, :3, :3] = rng.uniform(-0.5, 0.5, (20, 3)), so3.exp(rng.uniform(-0.5, 0.5, (20, 3)))
    return pose, a, b


def moved(pose, v, turn):
    out = pose.copy()
    out[:, :3, 3] += v
    out[:, :3, :3] = so3.exp(turn) @ pose[:, :3, :3]
    return out


def test_structure_matrix_is_minus_the_gradient_of_the_lengths(rig):
    pose, a, b = rig
    cable = np.column_stack([a, b, np.zeros(8)])
    _, by_pose, _ = lengths(np.tile(pose, (8, 1, 1, 1)), cable)
    np.testing.assert_allclose(structure(pose, a, b), -np.transpose(by_pose, (1, 2, 0)), atol=1e-14)


def wheeled(a, b, **known):
    """Robot over pulleys."""
    m = len(a)
    return cable_robot("wheels", a, b, pulleys=Pulleys(np.full(m, 0.05), np.tile([0.0, 0, 1], (m, 1))), **known)


@pytest.mark.parametrize(
    ("degrees", "plane"), [("3R3T", "xz"), ("1R2T", "xz"), ("1R2T", "xy"), ("2T", "xz"), ("2T", "xy"), ("3T", "xz")]
)
def test_structure_of_a_robot_has_its_rows_and_heeds_its_pulleys(rig, degrees, plane):
    pose, a, b = rig
    for robot in (
        cable_robot("plain", a, b, degrees=degrees, plane=plane),
        wheeled(a, b, degrees=degrees, plane=plane),
    ):
        w, gradient = structure_of(robot, pose), straight(robot, pose)[1]
        np.testing.assert_allclose(w, -gradient.swapaxes(1, 2)[:, list(robot.axes)], atol=1e-14)
    assert np.abs(w - structure(pose, a, b)[:, list(robot.axes)]).max() > 1e-3


def test_weight_is_the_gradient_of_the_potential(rig, rng):
    pose, _, _ = rig
    com, mass, h = rng.normal(0, 0.2, 3), 7.0, 1e-6

    def potential(p):
        return mass * 9.80665 * (p[:, :3, 3] + p[:, :3, :3] @ com)[:, 2]

    steps = np.eye(6) * h
    slope = [(potential(moved(pose, s[:3], s[3:])) - potential(moved(pose, -s[:3], -s[3:]))) / (2 * h) for s in steps]
    np.testing.assert_allclose(gravity_wrench(pose, mass, com), -np.stack(slope, axis=1), atol=1e-6)


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T", "2T", "3T"])
@pytest.mark.parametrize("wheels", [False, True])
def test_stiffness_is_the_difference_of_wrenches(rig, rng, wheels, degrees):
    """At locked winches: unstretched lengths stay what they are, tensions follow from the length model, and pull where
    the cables arrive."""
    pose, a, b = rig
    known = {"elasticity": rng.uniform(1e-5, 1e-4, 8), "com": np.array([0.1, -0.05, 0.2]), "degrees": degrees}
    robot = wheeled(a, b, **known) if wheels else cable_robot("plain", a, b, **known)
    tension, h, rows = rng.uniform(50, 500, (20, 8)), 1e-6, list(robot.axes)
    load, (locked, _) = np.array([3.0, -5.0, -90.0]), inverse(robot, pose, tension)

    def wrench(p):
        t = (inverse(robot, p)[0] / locked - 1) / robot.elasticity
        pull = np.einsum("kdm,km->kd", structure_of(replace(robot, degrees="3R3T"), p), t)
        force = np.broadcast_to(load, (len(p), 3))
        return pull + np.concatenate([force, np.cross(p[:, :3, :3] @ robot.com, force)], axis=1)

    columns = [
        (wrench(moved(pose, s[:3], s[3:])) - wrench(moved(pose, -s[:3], -s[3:]))) / (2 * h) for s in np.eye(6) * h
    ]
    k = stiffness(robot, pose, tension, load)
    expected = -np.stack(columns, axis=2)[:, rows][:, :, rows]
    np.testing.assert_allclose(k, expected, rtol=1e-6, atol=1e-6 * np.abs(k).max())
    if wheels:
        assert np.abs(k - stiffness(robot.having(pulleys=None), pose, tension, load)).max() > 1e-3 * np.abs(k).max()


def test_curvature_over_a_pulley(rng):
    for _ in range(5):
        axis, radius, d = rng.normal(size=3), rng.uniform(0.05, 0.2), rng.normal(size=3) * 2
        for pulley in (None, *(Pulleys(np.array(r), axis / np.linalg.norm(axis)) for r in (radius, 0.0))):
            check_jacobian(
                lambda x, pulley=pulley: run(x, pulley)[1],
                lambda x, pulley=pulley: curvature(x, pulley),
                d,
                tolerance=1e-7,
            )
    mixed = curvature(
        np.array([[0, 0, -1.0], [1.0, 0, 0.2]]), Pulleys(np.array([0.0, 0.1]), np.tile([0.0, 0, 1], (2, 1)))
    )
    np.testing.assert_allclose(mixed[0], np.diag([1.0, 1, 0]))


def test_stiffness_is_symmetric_but_for_the_moment_that_is_not_balanced(rig, rng):
    pose, a, b = rig
    tension = rng.uniform(50, 500, (1, 8))
    pull = (structure(pose[:1], a, b) @ tension[..., None])[0, :, 0]
    # One force balances the cables' force and that part of their moment which is square to it.
    force = -pull[:3]
    lever = np.cross(force, -pull[3:]) / (force @ force)
    rest = pull[3:] + np.cross(lever, force)
    robot = cable_robot("plain", a, b, elasticity=np.full(8, 2e-5), com=pose[0, :3, :3].T @ lever)
    k = stiffness(robot, pose[:1], tension, force)[0]
    skew = k[3:, 3:] - k[3:, 3:].T
    np.testing.assert_allclose(skew, so3.skew(rest), atol=1e-9 * np.abs(k).max())


@pytest.mark.parametrize(
    ("degrees", "plane"), [("3R3T", "xz"), ("1R2T", "xz"), ("1R2T", "yz"), ("2T", "xy"), ("3T", "xz")]
)
def test_structure_matrix_over_pulleys_by_differences_of_lengths(rig, degrees, plane):
    """W = -L^T where L is measured on the lengths themselves."""
    pose, a, b = rig
    robot = wheeled(a, b, degrees=degrees, plane=plane)
    w, h = structure_of(robot, pose), 1e-5
    for row, axis in enumerate(robot.axes):
        step = np.eye(6)[axis] * h
        ends = [inverse(robot, moved(pose, sign * step[:3], sign * step[3:]))[0] for sign in (1, -1)]
        np.testing.assert_allclose(w[:, row], -(ends[0] - ends[1]) / (2 * h), rtol=1e-6, atol=1e-8)


def test_cables_over_pulleys_hold_a_weight_from_above(rng):
    """The sign of it all: the weight pulls down, so that what the cables add up to points up, and is m g."""
    robot = replace(box(), mass=7.0, com=np.array([0.02, 0, 0.05]), limits=np.tile([20.0, 800.0], (8, 1)))
    wheel = Pulleys(np.full(8, 0.05), np.tile([0.0, 0, 1], (8, 1)))
    for machine in (robot, robot.having(pulleys=wheel)):
        pose = machine.home[None]
        w, load = structure_of(machine, pose), gravity_wrench(pose, machine.mass, machine.com)
        found = distribute(w, load, machine.limits)
        assert found.feasible.all() and load[0, 2] < 0
        sum_ = np.einsum("kdm,km->kd", w, found.tension)[0]
        np.testing.assert_allclose(sum_[:3], [0, 0, 7 * 9.80665], atol=1e-9)
        d = pose[:, :3, 3] + machine.b - machine.a
        _, arrives = run(d, machine.pulleys)
        forces = -found.tension[0][:, None] * arrives  # each cable pulls back along itself
        np.testing.assert_allclose(np.cross(machine.b, forces).sum(axis=0), -load[0, 3:], atol=1e-9)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda p, a, b: structure(p, a[:7], b), "of one length"),
        (lambda p, a, b: structure(p[0], a, b), r"\(k, 4, 4\)"),
        (lambda p, a, b: structure(p, p[0, :3, 3] + b @ p[0, :3, :3].T, b), "no length"),
        (lambda p, a, b: structure_of(cable_robot("", a, b, degrees="2R"), p), "3R3T"),
        (lambda p, a, b: structure_of(cable_robot("", p[0, :3, 3] + b @ p[0, :3, :3].T, b), p), "no length"),
        (lambda p, a, b: structure_of(wheeled(p[0, :3, 3] + b @ p[0, :3, :3].T, b), p), "no length"),
        (lambda p, a, b: gravity_wrench(p, np.nan, np.zeros(3)), "mass"),
    ],
)
def test_what_makes_no_sense_is_named(rig, call, word):
    with pytest.raises(ModelError, match=word):
        call(*rig)

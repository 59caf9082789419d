"""Structure matrix, null vector, weight and stiffness against definitions and differences."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.cables.geometry import cable_robot, lengths, straight
from robocal.cables.pulley import Pulleys
from robocal.cables.statics import gravity_wrench, null_vector, stiffness, structure, structure_of
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
    ("degrees", "plane"), [("3R3T", "xz"), ("1R2T", "xz"), ("1R2T", "xy"), ("2T", "xz"), ("2T", "xy")]
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


def test_planar_null_vector_is_the_cross_product(rng):
    a = np.array([[0, 0, 0], [2, 0, 0], [1, 2, 0]]) + rng.normal(0, 0.1, (3, 3)) * [1, 1, 0]
    pose = np.tile(np.eye(4), (50, 1, 1))
    share = rng.dirichlet([1, 1, 1], 50)
    pose[:, :3, 3] = share @ a
    w = structure_of(cable_robot("flat", a, np.zeros((3, 3)), degrees="2T", plane="xy"), pose)
    u = null_vector(w)
    cross = np.cross(w[:, 0], w[:, 1])
    cross /= np.linalg.norm(cross, axis=1, keepdims=True)
    np.testing.assert_allclose(u, cross * np.sign(cross.sum(axis=1, keepdims=True)), atol=1e-13)
    assert (u > 0).all()  # inside the triangle all three pull
    np.testing.assert_allclose(np.einsum("kdm,km->kd", w, u), 0, atol=1e-14)


def test_weight_is_the_gradient_of_the_potential(rig, rng):
    pose, _, _ = rig
    com, mass, h = rng.normal(0, 0.2, 3), 7.0, 1e-6

    def potential(p):
        return mass * 9.81 * (p[:, :3, 3] + p[:, :3, :3] @ com)[:, 2]

    steps = np.eye(6) * h
    slope = [(potential(moved(pose, s[:3], s[3:])) - potential(moved(pose, -s[:3], -s[3:]))) / (2 * h) for s in steps]
    np.testing.assert_allclose(gravity_wrench(pose, mass, com), -np.stack(slope, axis=1), atol=1e-6)


def test_stiffness_is_the_difference_of_wrenches(rig, rng):
    pose, a, b = rig
    tension, elasticity, com, h = rng.uniform(50, 500, (20, 8)), 2e-5, np.array([0.1, -0.05, 0.2]), 1e-6
    load = np.array([3.0, -5.0, -90.0])

    def length(p):
        return np.linalg.norm(a - p[:, None, :3, 3] - np.einsum("kij,mj->kmi", p[:, :3, :3], b), axis=-1)

    start = length(pose)

    def wrench(p):
        t = tension + (length(p) - start) / (elasticity * start)
        pull = np.einsum("kdm,km->kd", structure(p, a, b), t)
        force = np.broadcast_to(load, (len(p), 3))
        return pull + np.concatenate([force, np.cross(p[:, :3, :3] @ com, force)], axis=1)

    columns = [
        (wrench(moved(pose, s[:3], s[3:])) - wrench(moved(pose, -s[:3], -s[3:]))) / (2 * h) for s in np.eye(6) * h
    ]
    k = stiffness(pose, a, b, tension, elasticity, load, com)
    np.testing.assert_allclose(k, -np.stack(columns, axis=2), rtol=1e-6, atol=1e-6 * np.abs(k).max())


def test_stiffness_is_symmetric_but_for_the_moment_that_is_not_balanced(rig, rng):
    pose, a, b = rig
    tension = rng.uniform(50, 500, (1, 8))
    pull = (structure(pose[:1], a, b) @ tension[..., None])[0, :, 0]
    # One force balances the cables' force and that part of their moment which is square to it.
    force = -pull[:3]
    lever = np.cross(force, -pull[3:]) / (force @ force)
    rest = pull[3:] + np.cross(lever, force)
    k = stiffness(pose[:1], a, b, tension, 2e-5, force, pose[0, :3, :3].T @ lever)[0]
    skew = k[3:, 3:] - k[3:, 3:].T
    np.testing.assert_allclose(skew, so3.skew(rest), atol=1e-9 * np.abs(k).max())


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda p, a, b: structure(p, a[:7], b), "of one length"),
        (lambda p, a, b: structure(p[0], a, b), r"\(k, 4, 4\)"),
        (lambda p, a, b: structure(p, p[0, :3, 3] + b @ p[0, :3, :3].T, b), "no length"),
        (lambda p, a, b: null_vector(structure(p, a, b)), "one cable more"),
        (lambda p, a, b: structure_of(cable_robot("", a, b, degrees="2R"), p), "3R3T"),
        (lambda p, a, b: structure_of(cable_robot("", p[0, :3, 3] + b @ p[0, :3, :3].T, b), p), "no length"),
        (lambda p, a, b: structure_of(wheeled(p[0, :3, 3] + b @ p[0, :3, :3].T, b), p), "no length"),
        (lambda p, a, b: gravity_wrench(p, np.nan, np.zeros(3)), "mass"),
    ],
)
def test_what_makes_no_sense_is_named(rig, call, word):
    with pytest.raises(ModelError, match=word):
        call(*rig)

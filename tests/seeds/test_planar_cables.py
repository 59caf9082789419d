"""Chapter 2 of the cable thesis: the planar robot with three cables, its equations as printed (errata put right) against
robocal's, and what the chapter leaves out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot, straight
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.geometry import se3

FOLDER = Path(__file__).parents[2] / "examples" / "cable-planar"


@pytest.fixture(scope="module")
def robot():
    return read_cable(FOLDER / "robot.yaml").robot


@pytest.fixture(scope="module")
def poses(robot):
    return read_platform_poses(FOLDER / "poses.csv", robot).values


def legs(robot, pose):
    """p + b_i - a_i in the plane, (k, m, 2)."""
    return (pose[:, None, :3, 3] + robot.b - robot.a)[..., [0, 2]]


def printed_jacobian(robot, pose):
    """(2.5)."""
    c = legs(robot, pose)
    return c / np.linalg.norm(c, axis=-1, keepdims=True)


def test_loop_closure_and_jacobian(robot, poses):
    """(2.1) to (2.5); the text has W for the transpose of J, and its own directions (2.14) say -J^T."""
    lengths, gradient = inverse(robot, poses)
    c = legs(robot, poses)
    np.testing.assert_allclose(lengths**2, (c * c).sum(axis=-1), rtol=1e-14)
    jacobian = printed_jacobian(robot, poses)
    np.testing.assert_allclose(gradient[..., [0, 2]], jacobian, atol=1e-15)
    np.testing.assert_allclose(structure_of(robot, poses), -jacobian.swapaxes(1, 2), atol=1e-15)
    ahead = poses.copy()
    step = np.array([0.3, -0.7]) * 1e-5
    ahead[:, [0, 2], 3] += step
    behind = poses.copy()
    behind[:, [0, 2], 3] -= step
    np.testing.assert_allclose((inverse(robot, ahead)[0] - inverse(robot, behind)[0]) / 2, jacobian @ step, atol=1e-12)


def test_gauss_newton(robot, poses, rng):
    """(2.6) to (2.9) from the middle of the frame: where `forward` arrives, also with lengths that no position explains."""
    lengths = inverse(robot, poses)[0] + rng.normal(0, 2e-3, (len(poses), 3))
    at = np.broadcast_to(robot.home, poses.shape).copy()
    for _ in range(12):
        jacobian = printed_jacobian(robot, at)
        residual = np.linalg.norm(legs(robot, at), axis=-1) - lengths
        normal = jacobian.swapaxes(1, 2) @ jacobian
        step = -np.linalg.solve(normal, jacobian.swapaxes(1, 2) @ residual[..., None])[..., 0]
        at[:, [0, 2], 3] += step
    assert np.abs(step).max() < 1e-12
    found = forward(robot, lengths, starts=0)
    assert found.converged.all()
    np.testing.assert_allclose(found.pose, at, atol=1e-8)
    assert np.abs(at - poses)[:, :3, 3].max() > 1e-4  # the noise did something


def seeds_tension(structure, load, least):
    """(2.16) to (2.19): t = -W^+ w + k u with the least k for which t >= t_min; returns t, u and k."""
    q, _ = np.linalg.qr(structure.swapaxes(1, 2), mode="complete")
    u = q[:, :, 2]
    u = u * np.sign(u.sum(axis=1, keepdims=True))
    held = -(np.linalg.pinv(structure) @ load[..., None])[..., 0]
    k = ((least - held) / u).max(axis=1)
    return held + k[:, None] * u, u, k


def test_null_vector_is_the_cross_product(robot, poses):
    w = structure_of(robot, poses)
    cross = np.cross(w[:, 0], w[:, 1])
    cross /= np.linalg.norm(cross, axis=1, keepdims=True) * np.sign(cross.sum(axis=1, keepdims=True))
    np.testing.assert_allclose(seeds_tension(w, w[:, :, 0], 0.0)[1], cross, atol=1e-14)


def test_least_k_is_the_least_norm_wherever_the_cables_pull_against_each_other(rng):
    """Inside the triangle of the cables u > 0. -W^+ w is across u, so one of its tensions is not positive: k is never
    negative there, and the least k is the least norm, since |t|^2 = |W^+ w|^2 + k^2."""
    a = np.zeros((400, 3, 3))
    a[..., [0, 2]] = rng.uniform(-3, 3, (400, 3, 2))
    w, load = [], rng.normal(0, 15, (400, 2))
    for anchors, share in zip(a, rng.dirichlet(np.ones(3), 400), strict=True):
        pose = np.eye(4)[None].copy()
        pose[0, :3, 3] = share @ anchors
        rig = cable_robot("r", anchors, np.zeros((3, 3)), degrees="2T")
        w.append(structure_of(rig, pose)[0])
    w = np.array(w)
    limits = np.array([[5.0, 150.0], [2.0, 150.0], [9.0, 150.0]])
    t, u, k = seeds_tension(w, load, limits[:, 0])
    assert (u > 0).all() and (k > 0).all()
    found = distribute(w, load, limits)
    np.testing.assert_array_equal(found.feasible, (t <= 150.0).all(axis=1))
    assert 100 < found.feasible.sum() < 400
    np.testing.assert_allclose(found.tension[found.has_solution], t[found.has_solution], atol=1e-9)
    np.testing.assert_allclose((t - limits[:, 0]).min(axis=1), 0, atol=1e-9)


def test_a_hanging_platform_takes_the_smallest_k_of_either_sign():
    """Below its triangle u has two signs. More k then relaxes a cable: "the least k" says nothing, the least norm does."""
    rig = cable_robot(
        "hung", [[-1, 0, 2], [0, 0, 2], [1, 0, 2]], np.zeros((3, 3)), degrees="2T", limits=np.tile([1.0, 90.0], (3, 1))
    )
    pose = np.eye(4)[None].copy()
    pose[0, :3, 3] = 0.1, 0, 0.5
    w, load = structure_of(rig, pose), gravity_wrench(pose, 5.0, np.zeros(3))[:, [0, 2]]
    u = seeds_tension(w, load, 0.0)[1][0]
    assert u.min() < 0 < u.max()
    held = -np.linalg.pinv(w[0]) @ load[0]
    assert (held > 1.0).all()
    np.testing.assert_allclose(distribute(w, load, rig.limits).tension[0], held, atol=1e-10)  # k = 0
    tight = np.tile([1.05 * held.min(), 90.0], (3, 1))
    t = distribute(w, load, tight).tension[0]
    ends = np.sort(np.stack([(tight[:, 0] - held) / u, (tight[:, 1] - held) / u]), axis=0)
    interval = ends[0].max(), ends[1].min()
    k = min(interval, key=abs)
    np.testing.assert_allclose(t, held + k * u, atol=1e-10)


def test_the_platform_turns(robot, poses):
    """The chapter says that the platform turns a little and that its lengths hardly notice. With this geometry it turns until
    the three cables meet in a point: what the README says of it."""
    free = replace(robot, degrees="1R2T")

    def moment(x, z, angle):
        pose = se3.from_vector(np.array([[x, 0.0, z, 0.0, angle, 0.0]]))
        load = gravity_wrench(pose, robot.mass, robot.com)[:, [0, 2]]
        t = distribute(structure_of(robot, pose), load, robot.limits).tension
        return (structure_of(free, pose) @ t[..., None])[0, 2, 0], pose[0]

    turned, angles = [], []
    for pose in poses:
        x, z = pose[0, 3], pose[2, 3]
        assert moment(x, z, 0.3)[0] < 0 < moment(x, z, -0.3)[0]  # it is driven back from either side
        angles.append(brentq(lambda angle, x=x, z=z: moment(x, z, angle)[0], -0.3, 0.3, xtol=1e-12))
        turned.append(moment(x, z, angles[-1])[1])
    change = straight(robot, turned)[0] - straight(robot, poses)[0]
    believed = forward(robot, straight(robot, turned)[0] - robot.zeros, start=poses, starts=0).pose
    off = np.linalg.norm((believed - poses)[:, :3, 3], axis=1)
    said = (FOLDER / "README.md").read_text(encoding="utf-8")
    for value, unit in (
        (np.degrees(np.abs(angles).max()), "degrees"),
        (1e3 * np.abs(change).max(), "mm"),
        (1e3 * off.max(), "mm"),
    ):
        assert f"{value:.1f} {unit}" in " ".join(said.split()), value

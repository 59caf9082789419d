"""The catalogue against published points, other people's forward kinematics, and real joint angles."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.arms import catalog
from robocal.errors import ModelError
from robocal.geometry import se3, so3

DEG = np.pi / 180


@pytest.mark.parametrize("name", catalog.names())
def test_every_arm_is_whole(name, rng):
    robot = catalog.get(name)
    assert robot.source and robot.table.free == () and len(robot.usual) >= 4 * len(robot.joints)
    low, high = np.clip(robot.limits.T, -np.pi, np.pi)
    assert (low < high).all()
    t = robot.pose(rng.uniform(low, high, (20, len(robot.joints))))
    np.testing.assert_allclose(
        t[:, :3, :3] @ np.swapaxes(t[:, :3, :3], 1, 2), np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-14
    )
    assert np.linalg.norm(t[:, :3, 3], axis=1).max() < 1.6
    assert all(n in robot.table for n in robot.meta.get("order", ()))


def test_an_unknown_arm_is_named():
    with pytest.raises(ModelError) as caught:
        catalog.get("pandas")
    assert caught.value.suggestion == "panda"


def test_rv_2aj_public_point():
    """The manufacturer's own answer for one posture of the flange, printed to 1e-4 mm for joints printed to 1e-4
    deg."""
    robot = catalog.get("rv-2aj")
    flange = robot.with_values({"tool.z": robot.meta["flange"][2]})
    q = np.array([-107.7560, 32.1796, 104.1809, 42.9295, 66.1123]) * DEG
    # 0.5e-4 deg on five joints moves a point 0.7 m away by less than 2.5e-3 mm.
    np.testing.assert_allclose(flange.pose(q)[0, :3, 3] * 1e3, [-74.5500, -232.8100, 323.8098], atol=1e-4)
    assert robot.parallel_axes() == (("j2", "j3"), ("j3", "j4"))


def test_ur10_against_another_program(shared_data):
    """Twenty postures computed elsewhere, with that program's lengths."""
    table = np.loadtxt(shared_data / "ur10-laser-tracker" / "ur10-forward-kinematics.csv", delimiter=",")
    robot = catalog.get("ur10").with_values({"j1.d": 0.118, "j2.a": -0.6127, "j3.a": -0.5716, "j4.d": 0.1639})
    t, other = robot.pose(table[:, :6] * DEG), table[:, 6:].reshape(-1, 4, 4)
    assert len(table) == 20
    np.testing.assert_allclose(t[:, :3, :3], other[:, :3, :3], atol=1e-12)
    np.testing.assert_allclose(t[:, :3, 3] * 1e3, other[:, :3, 3], atol=1e-9)


def ball_in_sockets(robot, folder):
    """Least squares of p_i + R_i b = s_k over two sockets: ball b (3,), sockets (2, 3), rms distance; linear, so it
    needs no start."""
    rows, values = [], []
    for k in (0, 1):
        for t in robot.pose(np.loadtxt(folder / f"hole_{k}.csv", delimiter=",")):
            row = np.zeros((3, 9))
            row[:, :3], row[:, 3 + 3 * k : 6 + 3 * k] = t[:3, :3], -np.eye(3)
            rows.append(row)
            values.append(-t[:3, 3])
    a, b = np.vstack(rows), np.concatenate(values)
    x = np.linalg.lstsq(a, b, rcond=None)[0]
    return x[:3], x[3:].reshape(2, 3), np.sqrt(np.mean(((a @ x - b).reshape(-1, 3) ** 2).sum(axis=1)))


@pytest.mark.parametrize("place", ["front", "left_back", "raised_left"])
def test_iiwa_keeps_a_ball_in_its_socket(shared_data, place):
    """About thirty real postures per socket hold one point within 0.7 mm, and the sockets 50 mm apart: the nominal
    table is right."""
    ball, sockets, rms = ball_in_sockets(catalog.get("iiwa-14"), shared_data / "sockets" / "kuka_14" / place)
    assert rms < 0.7e-3
    assert abs(np.linalg.norm(sockets[0] - sockets[1]) - 0.05) < 2e-4
    assert np.abs(ball[:2]).max() < 0.3e-3 and 0.040 < ball[2] < 0.042


def test_panda_agrees_with_its_controller(shared_data):
    """Flange to end effector is one constant transform in 30 postures: a hand 0.1034 m long, turned by -45 degrees.

    Joints and pose were not read at one instant: the largest differences found are 0.065 mm and 1.11 mrad.
    """
    folder = shared_data / "sockets" / "panda_1" / "right"
    said = np.loadtxt(folder / "hole_0_pose.csv", delimiter=",")
    w, x, y, z = said[:, 3:7].T
    q = np.stack([x, y, z], axis=1)
    vector = 2 * np.arctan2(np.linalg.norm(q, axis=1), w)[:, None] * q / np.linalg.norm(q, axis=1, keepdims=True)
    controller = se3.compose(so3.exp(vector), said[:, :3])
    hand = se3.inverse(catalog.get("panda").pose(np.loadtxt(folder / "hole_0.csv", delimiter=","))) @ controller
    expected = se3.compose(so3.exp([0, 0, -np.pi / 4]), [0, 0, 0.1034])
    assert len(hand) == 30
    assert np.abs(hand[:, :3, 3] - expected[:3, 3]).max() < 1e-4
    assert np.linalg.norm(so3.log(hand[:, :3, :3] @ expected[:3, :3].T), axis=1).max() < 1.2e-3


def test_irb_120_home_and_senses():
    """At zero the flange is at x = 374, z = 630 mm and looks ahead; joints 2, 3 and 5 lower or advance it, as the
    product manual draws."""
    robot = catalog.get("irb-120")
    home = robot.pose(np.zeros(6))[0]
    np.testing.assert_allclose(home[:3, 3], [0.374, 0, 0.630], atol=1e-12)
    np.testing.assert_allclose(home[:3, 2], [1, 0, 0], atol=1e-12)
    moved = robot.pose(0.1 * np.eye(6))[:, :3, 3] - home[:3, 3]
    assert moved[0, 1] > 0 and moved[1, 0] > 0 and moved[2, 2] < 0 and moved[4, 2] < 0


def test_iiwa_and_panda_at_known_postures():
    np.testing.assert_allclose(catalog.get("iiwa-14").pose(np.zeros(7))[0, :3, 3], [0, 0, 1.306], atol=1e-12)
    np.testing.assert_allclose(catalog.get("panda").pose(np.zeros(7))[0, :3, 3], [0.088, 0, 0.926], atol=1e-12)
    np.testing.assert_array_equal(catalog.get("fr3").pose(np.full(7, 0.5)), catalog.get("panda").pose(np.full(7, 0.5)))

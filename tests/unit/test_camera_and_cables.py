"""Projection and cable lengths: independent formulas and central differences."""

from __future__ import annotations

import numpy as np
import pytest
from laws import check_jacobian
from twists import exp

from robocal.cables.geometry import SYMBOLS as CABLE_SYMBOLS
from robocal.cables.geometry import cable_robot, lengths
from robocal.geometry import so3
from robocal.vision.camera import SYMBOLS, image_of, project

LENS = np.array([900.0, 880.0, 320.0, 245.0, -0.2, 0.05, 0.004, -0.003, 0.02])


def points(rng, m=6):
    return np.column_stack([rng.uniform(-0.4, 0.4, (m, 2)), rng.uniform(0.7, 2.0, m)])


def test_projection_is_opencvs(rng):
    cv2 = pytest.importorskip("cv2")
    p = points(rng, 50)
    k = np.array([[LENS[0], 0, LENS[2]], [0, LENS[1], LENS[3]], [0, 0, 1]])
    expected = cv2.projectPoints(p, np.zeros(3), np.zeros(3), k, LENS[4:])[0][:, 0]
    np.testing.assert_allclose(project(p, LENS)[0], expected, atol=1e-9)


def test_projection_written_out(rng):
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = LENS
    for point, uv in zip(points(rng), project(points(np.random.default_rng(20240229)), LENS)[0], strict=True):
        x, y = point[0] / point[2], point[1] / point[2]
        r = np.hypot(x, y)
        d = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
        u = fx * (x * d + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2)) + cx
        v = fy * (y * d + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y) + cy
        np.testing.assert_allclose(uv, [u, v], atol=1e-10)


def test_projection_jacobians(rng):
    scale = np.array([1e3, 1e3, 1e3, 1e3, 1, 1, 1, 1, 1])
    scale = np.array([1e3, 1e3, 1e3, 1e3, 1, 1, 1, 1, 1])
    for p in points(rng):
        check_jacobian(lambda x: project(x, LENS)[0], lambda x: project(x, LENS)[1], p)
        check_jacobian(
            lambda z, p=p: project(p, z * scale)[0], lambda z, p=p: project(p, z * scale)[2] * scale, LENS / scale
        )


def test_projection_broadcasts(rng):
    p, lens = points(rng).reshape(2, 3, 3), LENS * np.array([[[1.0]], [[1.1]]])
    uv, jp, ji = project(p, lens)
    assert uv.shape == (2, 3, 2) and jp.shape == (2, 3, 2, 3) and ji.shape == (2, 3, 2, 9) and len(SYMBOLS) == 9
    np.testing.assert_array_equal(uv, image_of(p, lens))
    np.testing.assert_array_equal(uv[1, 2], project(p[1, 2], lens[1, 0])[0])


def rig(rng):
    return cable_robot(
        "r", rng.normal(size=(4, 3)) + [0, 0, 3], 0.2 * rng.normal(size=(4, 3)), np.arange(4) / 10, free=("l0", "bx")
    )


def test_cable_robot_names_every_number(rng):
    robot = rig(rng)
    assert robot.cables == ("c1", "c2", "c3", "c4") and robot.table.names[:7] == tuple(f"c1.{s}" for s in CABLE_SYMBOLS)
    assert robot.table.free == tuple(f"c{i}.{s}" for i in range(1, 5) for s in ("bx", "l0"))
    assert cable_robot("r", np.zeros((2, 3)), np.ones((2, 3))).table["c2.l0"].value == 0


def test_length_is_the_distance_between_anchors_less_the_zero(rng):
    robot, pose = rig(rng), exp(rng.normal(scale=0.3, size=(1, 5, 6)))
    for i in range(4):
        numbers = robot.table.values[7 * i : 7 * i + 7]
        length, _, _ = lengths(pose, numbers[None])
        for m in range(5):
            anchor = pose[0, m, :3, :3] @ numbers[3:6] + pose[0, m, :3, 3]
            assert length[0, m] == pytest.approx(np.linalg.norm(anchor - numbers[:3]) - numbers[6])


def test_length_jacobians(rng):
    numbers, pose = rig(rng).table.values[:7], exp(rng.normal(scale=0.3, size=6))

    def stepped(d):
        out = pose.copy()
        out[:3, 3] += d[:3]
        out[:3, :3] = so3.exp(d[3:]) @ pose[:3, :3]
        return out[None, None]

    check_jacobian(
        lambda d: lengths(stepped(d), numbers[None])[0][0, 0],
        lambda d: lengths(stepped(d), numbers[None])[1][0, 0],
        np.zeros(6),
    )
    check_jacobian(
        lambda c: lengths(stepped(np.zeros(6)), c[None])[0][0, 0],
        lambda c: lengths(stepped(np.zeros(6)), c[None])[2][0, 0],
        numbers,
    )

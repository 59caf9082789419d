"""Arrays as a laboratory has them, simulated, not measured: tables of a robot, joint values or lengths, and poses from a tracker."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import robocal as rc
from robocal.geometry import so3

Array = NDArray[np.float64]
DH = np.array([
    [0, 0.1625, 0, np.pi / 2], [0, 0, -0.425, 0], [0, 0, -0.3922, 0],
    [0, 0.1333, 0, np.pi / 2], [0, 0.0997, 0, -np.pi / 2], [0, 0.0996, 0, 0],
])  # fmt: skip
OUT = Path(tempfile.mkdtemp(prefix="laboratory"))  # where the examples write
COLUMNS = ("theta", "d", "a", "alpha")
FRAME = np.array([[x, y, z] for x in (-2.0, 2.0) for y in (-1.5, 1.5) for z in (0.2, 2.5)])
PLATFORM = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (0.15, -0.15)])


def arm(rows: int = 60) -> tuple[Array, Array]:
    """Joint values (rows, 6) in rad, and poses (rows, 4, 4) in m of an arm that is not quite its table."""
    rng = np.random.default_rng(0)
    nominal = rc.robot(DH, convention="dh-hayati", columns=COLUMNS).model.chain
    table = nominal.table
    built = nominal.with_values({n: table[n].value + float(rng.normal(0, 5e-4)) for n in table.free})
    joints = rng.uniform(-2, 2, (rows, 6))
    poses = built.pose(joints)
    poses[:, :3, 3] += rng.normal(0, 5e-5, (rows, 3))
    poses[:, :3, :3] = poses[:, :3, :3] @ so3.exp(rng.normal(0, 1e-4, (rows, 3)))
    return joints, poses


def cables(rows: int = 60) -> tuple[Array, Array, Array]:
    """Lengths (rows, 8) as sensors show them, positions (rows, 3) in m and quaternions (rows, 4), scalar last, of a platform.

    Its anchors are not quite where the table says, and its sensors do not count from zero."""
    rng = np.random.default_rng(1)
    anchors, zeros = FRAME + rng.normal(0, 5e-3, FRAME.shape), rng.normal(0, 0.02, len(FRAME))
    built = rc.cable.robot(frame_anchors=anchors, platform_anchors=PLATFORM, zeros=zeros)
    position = rng.uniform([-0.8, -0.6, 0.8], [0.8, 0.6, 1.8], (rows, 3))
    poses = np.tile(np.eye(4), (rows, 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = position, so3.exp(rng.normal(0, 0.15, (rows, 3)))
    lengths = built.inverse(poses) + rng.normal(0, 5e-4, (rows, len(FRAME)))
    turned = poses[:, :3, :3] @ so3.exp(rng.normal(0, 2e-4, (rows, 3)))
    w = np.sqrt(1 + np.trace(turned, axis1=1, axis2=2)) / 2  # small turns: the scalar is far from zero
    odd = turned - turned.transpose(0, 2, 1)
    vector = np.stack([odd[:, 2, 1], odd[:, 0, 2], odd[:, 1, 0]], axis=1) / (4 * w[:, None])
    return lengths, position + rng.normal(0, 2e-4, (rows, 3)), np.column_stack([vector, w])

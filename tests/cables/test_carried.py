"""What a calibration leaves of poses that follow from lengths: what is foretold is what draws show."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import poses, published
from cables.test_calibration import listed, made
from laws import check_jacobian

from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.gradient import by_parameters, pose_covariance
from robocal.cables.pulley import Pulleys
from robocal.geometry import so3


def robots(name):
    if name == "pulleys":
        robot = published("laval")
        return robot.having(pulleys=Pulleys(np.full(8, 0.05), np.tile([0.0, 0.0, 1.0], (8, 1))))
    return published("laval") if name == "laval" else made(3, 4, name)


@pytest.mark.parametrize("name", ["laval", "pulleys", "1R2T"])
def test_poses_err_as_foretold(name):
    robot, rng = robots(name), np.random.default_rng(0)
    t = (listed if name == "1R2T" else poses)(robot, rng, 4)
    names = [n for n in robot.table.names if n.split(".")[1] in ("ax", "az", "l0", "bz", "radius", "nx")]
    root = 1e-4 * rng.normal(size=(len(names), len(names))) / np.sqrt(len(names))
    foretold = pose_covariance(robot, t, names, root @ root.T)
    y, _ = inverse(robot, t)
    found = []
    for _ in range(300):
        off = root @ rng.normal(size=len(names))
        wrong = robot.with_values({n: robot.table[n].value + e for n, e in zip(names, off, strict=True)})
        found.append(forward(wrong, y, start=t).pose)
    p = np.array(found)
    twist = np.concatenate(
        [p[..., :3, 3] - t[:, :3, 3], so3.log(p[..., :3, :3] @ t[:, :3, :3].swapaxes(1, 2))], axis=-1
    )[..., list(robot.axes)]
    drawn = np.einsum("bki,bkj->kij", twist, twist) / len(twist)
    # Each by the root of what is foretold: a covariance of 300 draws is known to a tenth.
    for one, other in zip(drawn, foretold, strict=True):
        scale = np.sqrt(np.diag(other))
        np.testing.assert_allclose(one / np.outer(scale, scale), other / np.outer(scale, scale), atol=0.35)


@pytest.mark.parametrize("name", ["laval", "pulleys", "1R2T"])
def test_gradients_are_those_of_the_lengths(name, rng):
    robot = robots(name)
    t, names = poses(published("laval"), rng, 3) if name != "1R2T" else listed(robot, rng, 3), robot.table.names

    def lengths(x):
        return inverse(robot.with_values(dict(zip(names, x, strict=True))), t)[0]

    x = robot.table.values
    check_jacobian(lengths, lambda x: by_parameters(robot, t, names)[1], x, tolerance=1e-7)


def test_a_pose_that_is_none_has_none(rng):
    robot = published("laval")
    t = poses(robot, rng, 3)
    t[1] = np.nan
    out = pose_covariance(robot, t, ["c1.ax"], np.eye(1))
    assert np.isnan(out[1]).all() and np.isfinite(out[[0, 2]]).all()

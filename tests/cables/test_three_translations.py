"""A platform that only shifts (3T), such as a point on cables: kinematics, statics, workspace and contacts in space without turns."""

from __future__ import annotations

import numpy as np
import pytest
from cables.test_lengths import MODELS
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from robocal.cables.boundary import surface
from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.cables.geometry import cable_robot
from robocal.cables.interference import first_contact
from robocal.cables.statics import gravity_wrench, stiffness, structure_of
from robocal.cables.tension import capacity_margin, distribute
from robocal.cables.workspace import Demand, grid, margins
from robocal.geometry import se3

# A pyramid of 4 m x 4 m x 3 m, tip down.
PYRAMID = np.array([(2.0, 2, 3), (-2, 2, 3), (-2, -2, 3), (2, -2, 3), (0, 0, 0)])


def point(a=PYRAMID, **known):
    return cable_robot("point", a, np.zeros_like(a), degrees="3T", **known)


def places(rng, n, size=0.8):
    return np.column_stack([rng.uniform(-size, size, (n, 2)), rng.uniform(1.4, 2.4, n)])


@pytest.mark.parametrize("model", MODELS)
def test_forward_finds_where_it_was(model, rng):
    """Every length model of eight cables in a box, from 0.3 m away and from nothing; orientations stay."""
    a = np.array([(x, y, z) for x in (-2.0, 2) for y in (-2.0, 2) for z in (0.0, 3)])
    change, pull, sags = MODELS[model]
    robot = change(point(a + rng.normal(0, 0.05, a.shape)), rng)
    pose = se3.compose(np.eye(3), places(rng, 30))
    measured, _ = inverse(robot, pose, pull, sag=sags)
    away = rng.normal(size=(30, 3))
    start = se3.compose(np.eye(3), pose[:, :3, 3] + 0.3 * away / np.linalg.norm(away, axis=1, keepdims=True))
    for found in (
        forward(robot, measured, start, tension=pull, sag=sags),
        forward(robot, measured[:8], tension=pull, sag=sags, starts=12, rng=rng),
    ):
        np.testing.assert_allclose(found.pose, pose[: len(found.pose)], atol=1e-9)
        assert found.covariance.shape[1:] == (3, 3)
    assert (found.solutions == 1).all()


def test_forces_alone_are_balanced(rng):
    """Tensions are those of a linear program, a margin does not depend on the length that divides moments: there are none."""
    limits = np.tile([5.0, 100.0], (5, 1))
    robot = point(limits=limits, mass=3.0, elasticity=np.full(5, 1e-4))
    where = places(rng, 60, 1.9)
    pose = se3.compose(np.eye(3), where)
    w, load = structure_of(robot, pose), gravity_wrench(pose, 3.0, robot.com)[:, :3]
    u = (PYRAMID - where[:, None]) / np.linalg.norm(PYRAMID - where[:, None], axis=2, keepdims=True)
    np.testing.assert_allclose(w, u.swapaxes(1, 2), atol=1e-14)
    spread = distribute(w, load, limits)
    for one, held, own in zip(w, spread.feasible, load, strict=True):
        assert held == (linprog(np.zeros(5), A_eq=one, b_eq=-own, bounds=limits).status == 0)
    assert 10 < spread.feasible.sum() < 60
    near = capacity_margin(w, load, limits, robot.lengths_of_rows(1.0))
    np.testing.assert_array_equal(near, capacity_margin(w, load, limits, robot.lengths_of_rows(0.01)))
    told = [margins(robot, Demand(np.array([3.0]), length=long), where) for long in (1.0, 0.01)]
    np.testing.assert_array_equal(*told)
    # By hand: a push of the margin's size, whichever way, is held, and one way a little more is not.
    pushes = rng.normal(size=(400, 3))
    pushes /= np.linalg.norm(pushes, axis=1, keepdims=True)
    i = int(np.argmax(near))
    many = np.tile(w[i : i + 1], (400, 1, 1))
    assert distribute(many, load[i] + 0.999 * near[i] * pushes, limits).feasible.all()
    assert not distribute(many, load[i] + 1.3 * near[i] * pushes, limits).feasible.all()
    assert stiffness(robot, pose, spread.tension).shape == (60, 3, 3)


def test_the_closed_workspace_is_the_hull_of_the_anchors():
    """Any force is held strictly within the hull of the anchors and nowhere else: 16 m3 of a pyramid."""
    robot, anything = point(), Demand(np.zeros(1), closure=True)
    box = [[-2, 2], [-2, 2], [0, 3]]
    cells = grid(robot, anything, box, (40, 40, 40))
    hull = ConvexHull(PYRAMID)
    x = np.stack(np.meshgrid(*cells.axes, indexing="ij"), axis=-1).reshape(-1, 3)
    depth = (x @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    clear = np.abs(depth) > 1e-9
    np.testing.assert_array_equal(cells.inside.ravel()[clear], depth[clear] < 0)
    # What the flat triangles between rays cut off.
    assert surface(robot, anything, [0, 0, 2.2], box, count=4000).volume == pytest.approx(16.0, rel=0.02)


def test_cables_of_a_point_meet_where_one_lies_along_another():
    """All of them share the point, so the angle decides, 2 sin(angle / 2) = 1 / 10: behind the anchor of one, in line with the other."""
    a = np.array([(-2.0, 0, 2), (2, 0, 2)])
    first = np.array([-3.0, 0.4, 1.5])
    way = np.array([0, -0.8, 1.0])  # half of it leads to the line of the anchors
    found = first_contact(a, np.zeros((2, 3)), se3.compose(np.eye(3), first[None]), way[None], diameter=0.01)
    assert found.names(["c1", "c2"]) == ["c1 meets c2"] and found.fraction[0] < 0.5
    u = a - (first + found.fraction[0] * way)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    assert np.linalg.norm(u[0] - u[1]) == pytest.approx(0.1, abs=1e-4)
    between = first_contact(
        a, np.zeros((2, 3)), se3.compose(np.eye(3), np.array([[0.0, 0, 1]])), [[0, 0, 0.9]], diameter=0.01
    )
    assert between.free.all()

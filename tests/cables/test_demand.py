"""Sets of demands (orientations, payloads, wrenches, accelerations, a reserve) against two independent judges: hyperplanes of
the balanceable wrenches found by brute force, and linear programs for the worst case that they name."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from cables.rigs import box, slack

from robocal.cables.geometry import cable_robot
from robocal.cables.pulley import Pulleys
from robocal.cables.statics import GRAVITY, structure, structure_of
from robocal.cables.workspace import Demand, accelerations, grid, holds, margins
from robocal.geometry import so3

MANY = Demand(
    np.array([15.0, 40.0]),
    so3.exp(np.array([[0.0, 0, 0], [0.05, 0, -0.15], [0, -0.08, 0.1]])),
    np.array([[0.0] * 6, [10.0, -5, 0, 0, 1, 2]]),
    acceleration=0.6,
    reserve=4.0,
    length=0.5,
)
PLANE = replace(MANY, masses=np.array([4.0, 9.0]), rotations=so3.exp(np.array([[0.0, 0.05, 0], [0, -0.2, 0]])))


@pytest.fixture
def machine():
    """Eight cables, crossed, with a centre of mass off the origin."""
    corners = np.array([[x, y, z] for z in (0.0, 3.0) for x, y in ((-4, -3), (4, -3), (4, 3), (-4, 3))])
    skew = np.array([[0.05, -0.02, 0.04], [-0.03, 0.06, 0], [0, 0.02, 0.1], [0.07, 0, -0.05]] * 2)
    platform = np.array(
        [[x, y, z] for z in (0.2, -0.2) for x, y in ((0.1, -0.4), (0.1, -0.35), (-0.1, 0.4), (-0.1, 0.35))]
    )
    return cable_robot(
        "crossed", corners + skew, platform, limits=np.tile([10.0, 400.0], (8, 1)), com=np.array([0.02, 0, 0.1])
    )


def upright():
    """Five cables for a platform in the plane x z that also turns."""
    a = [[-2.0, 0, 0.1], [2.1, 0, 0], [2, 0, 3], [-2, 0, 2.9], [0.2, 0, 3.2]]
    b = [[-0.2, 0, 0.15], [0.2, 0, 0.15], [0.25, 0, -0.1], [-0.2, 0, -0.12], [0.05, 0, 0.2]]
    limits, com = np.array([[5.0, 200], [5, 200], [8, 300], [5, 250], [10, 200]]), np.array([0.03, 0, -0.05])
    return cable_robot("upright", a, b, limits=limits, com=com, degrees="1R2T", plane="xz")


def over_pulleys(machine):
    return machine.having(pulleys=Pulleys(np.full(8, 0.08), np.tile([0.0, 0.0, 1.0], (8, 1))))


def worst(robot, demand, position):
    """The reserve [N] that is left at the worst of everything demanded, and that case: W and its wrench without the reserve,
    the direction in which it is least. By all hyperplanes through cable directions, each from a singular value
    decomposition."""
    low, high, rows = *robot.limits.T, list(robot.axes)
    ball = np.diag([1.0 if row < 3 else demand.length for row in rows])
    least, case = np.inf, None
    for rotation in demand.rotations:
        pose = np.eye(4)[None].copy()
        pose[0, :3, 3], pose[0, :3, :3] = position, rotation
        w = structure_of(robot, pose)[0]
        columns = np.stack([w[:, list(those)].T for those in combinations(range(len(low)), len(rows) - 1)])
        normal = np.linalg.svd(columns)[2][:, -1]
        normal = np.concatenate([normal, -normal])
        seen = normal @ w
        reach = np.maximum(-seen * low, -seen * high).sum(axis=1)
        for mass in demand.masses:
            push = np.vstack([np.eye(3), np.cross(rotation @ robot.com, np.eye(3)).T])[rows]
            for extra in demand.extra:
                load = mass * push @ np.array(GRAVITY) + extra[rows]
                along = demand.acceleration * mass * np.linalg.norm(normal @ push, axis=1)
                size = np.linalg.norm(normal @ ball, axis=1)
                room = (reach - normal @ load - along) / size
                k = int(np.argmin(room))
                if room[k] < least:
                    e, f = push.T @ normal[k], ball @ normal[k]
                    e = demand.acceleration * mass * push @ e / max(np.linalg.norm(e), 1e-300)
                    least, case = room[k], (w, load + e, ball @ f / np.linalg.norm(f))
    return least, case


@pytest.mark.sampled(1)
@pytest.mark.parametrize("kind", ["crossed", "over pulleys", "upright"])
def test_everything_at_once_against_hyperplanes_and_linear_programs(kind, machine, rng):
    machine = {"crossed": machine, "over pulleys": over_pulleys(machine), "upright": upright()}[kind]
    demand = MANY if kind != "upright" else PLANE
    low, high = ([-3, -2.2, 0.3], [3, 2.2, 2.7]) if kind != "upright" else ([-1.8, 0, 0.3], [1.8, 0, 2.7])
    where = rng.uniform(low, high, (150, 3))
    found, left = holds(machine, demand, where), margins(machine, demand, where)
    assert 20 < found.sum() < 130
    for k, point in enumerate(where):
        truth, (w, load, way) = worst(machine, demand, point)
        if truth > 0:
            assert left[k] == pytest.approx(truth, abs=1e-7)
        assert found[k] == (truth >= demand.reserve) or abs(truth - demand.reserve) < 1e-6
        # The case that decides is one that a linear program cannot do, or only just can.
        needed = load + demand.reserve * way
        assert (slack(w, needed, machine.limits) < 0) == found[k] or abs(truth - demand.reserve) < 1e-6


def test_what_lies_between_the_corners_of_a_payload_range_is_held(machine, rng):
    """Any mass of the range, accelerated in any direction, with any disturbance of the reserve on top: convexity."""
    where = rng.uniform([-3, -2.2, 0.3], [3, 2.2, 2.7], (150, 3))
    where = where[holds(machine, MANY, where)]
    ball = np.diag([1, 1, 1, MANY.length, MANY.length, MANY.length])
    for point in where:
        way, disturbance = rng.normal(size=3), rng.normal(size=6)
        mass, share = rng.uniform(*MANY.masses), rng.uniform()
        rotation = MANY.rotations[rng.integers(3)]
        pose = np.eye(4)[None].copy()
        pose[0, :3, 3], pose[0, :3, :3] = point, rotation
        force = mass * (np.array(GRAVITY) + MANY.acceleration * way / np.linalg.norm(way))
        load = np.concatenate([force, np.cross(rotation @ machine.com, force)]) + share * MANY.extra[1]
        load = load + MANY.reserve * ball @ disturbance / np.linalg.norm(disturbance)
        assert slack(structure(pose, machine.a, machine.b)[0], load, machine.limits) < 0


def test_the_parts_of_a_demand_fit_together(machine, rng):
    """The acceleration that is possible beside a reserve leaves exactly that reserve, and a grid says what `holds` says."""
    where = rng.uniform([-2, -1.5, 0.6], [2, 1.5, 2.2], (60, 3))
    for demand in (
        MANY,
        replace(MANY, masses=np.array([20.0]), reserve=0.0),
        replace(MANY, masses=np.array([0.0, 20.0])),
    ):
        most = accelerations(machine, demand, where)
        for point, top in zip(where[most > 0.01], most[most > 0.01], strict=True):
            edge = margins(machine, replace(demand, acceleration=top), point[None])[0]
            assert edge == pytest.approx(demand.reserve, abs=1e-6)
    sides = box(machine)
    made = grid(machine, MANY, sides, (7, 7, 7), with_margins=True)
    points = np.stack(np.meshgrid(*made.axes, indexing="ij"), axis=-1).reshape(-1, 3)
    assert (made.inside.ravel() == holds(machine, MANY, points)).all() and made.inside.any() and not made.inside.all()
    calm = margins(machine, replace(MANY, acceleration=0.0), points)
    assert (made.margin.ravel() <= calm + 1e-9).all() and (made.margin.ravel() < calm - 1.0).any()


def test_a_singular_pose_promises_nothing_that_is_taken(machine):
    """All cables meet in the origin: weights are held there, moments are not, so neither is a reserve or an acceleration."""
    point = replace(
        machine,
        table=machine.table.with_values({f"c{i}.b{x}": 0.0 for i in range(1, 9) for x in "xyz"}),
        com=np.zeros(3),
    )
    demand, where = Demand(np.array([20.0])), [[0.0, 0, 1.2]]
    assert holds(point, demand, where)[0] and margins(point, demand, where)[0] == 0.0
    assert not holds(point, replace(demand, acceleration=0.1), where)[0]
    assert not holds(point, replace(demand, reserve=0.1), where)[0]

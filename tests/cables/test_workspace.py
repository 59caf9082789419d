"""Workspace by grid, rays and linear programs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, published
from cables.rigs import box, poses, slacks

from robocal.cables import boundary
from robocal.cables.boundary import first_exit, outline, rays, statics_along, surface
from robocal.cables.geometry import cable_robot
from robocal.cables.statics import gravity_wrench, structure
from robocal.cables.tension import is_feasible
from robocal.cables.workspace import Demand, accelerations, grid, holds, margins
from robocal.errors import ModelError
from robocal.geometry import so3


@pytest.fixture
def machine(rng):
    """Eight cables, crossed, one metre of platform in a hall."""
    corners = np.array([[x, y, z] for z in (0.0, 3.0) for x, y in ((-4, -3), (4, -3), (4, 3), (-4, 3))])
    platform = np.array(
        [[x, y, z] for z in (0.2, -0.2) for x, y in ((0.1, -0.4), (0.1, -0.35), (-0.1, 0.4), (-0.1, 0.35))]
    )
    limits = np.tile([10.0, 400.0], (8, 1))
    return cable_robot(
        "hall", corners + rng.normal(0, 0.05, (8, 3)), platform, limits=limits, com=np.array([0, 0, 0.1])
    )


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", PUBLISHED)
def test_cells_agree_with_a_linear_program(name, rng):
    machine = published(name)
    made = grid(machine, Demand(np.array([machine.mass])), box(machine), (9, 9, 9), with_margins=True)
    plain = grid(machine, Demand(np.array([machine.mass])), box(machine), (9, 9, 9))
    assert (
        (made.inside == plain.inside).all()
        and ((made.margin > 0) == made.inside).all()
        and 0.05 < made.inside.mean() < 0.95
    )
    cells = np.argwhere(np.ones((9, 9, 9)))[rng.permutation(729)[:300]]
    pose = np.tile(np.eye(4), (300, 1, 1))
    pose[:, :3, 3] = np.stack([made.axes[i][cells[:, i]] for i in range(3)], axis=1)
    w, load = structure(pose, machine.a, machine.b), gravity_wrench(pose, machine.mass, machine.com)
    truth = slacks(w, load, machine.limits)
    sure = np.abs(truth) > 1e-6
    assert ((truth < 0) == made.inside[tuple(cells.T)])[sure].all() and sure.sum() > 295


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_volumes_of_published_robots(name):
    machine = published(name)
    volumes_agree(machine, Demand(np.array([machine.mass])), (41, 41, 41), 4000)


def test_volume_by_grid_and_by_rays(machine):
    volumes_agree(machine, Demand(np.array([30.0])), (21, 21, 21), 3000)


def volumes_agree(machine, demand, cells, count):
    made = grid(machine, demand, box(machine), cells)
    middle = np.array(
        [made.axes[i][c] for i, c in enumerate(np.argwhere(made.inside).mean(axis=0).round().astype(int))]
    )
    skin = surface(machine, demand, middle, box(machine), count)
    assert skin.volume == pytest.approx(made.volume, rel=0.02)
    # A closed surface: every edge belongs to two triangles, once in each direction.
    edges = np.concatenate([skin.faces[:, [0, 1]], skin.faces[:, [1, 2]], skin.faces[:, [2, 0]]])
    assert sorted(map(tuple, edges)) == sorted(map(tuple, edges[:, ::-1]))


def test_rays_end_at_the_boundary(machine, rng):
    demand = Demand(np.array([30.0]))
    ends = rng.normal(size=(200, 3)) * 20
    start = np.array([0.0, 0, 1.2])
    lam = rays(machine, demand, start, ends)
    assert (lam > 0).all() and (lam < 1).all()
    at = start + lam[:, None] * (ends - start)
    assert np.abs(margins(machine, demand, at)).max() < 1e-6
    assert holds(machine, demand, start + 0.9999 * (at - start)).all()
    assert not holds(machine, demand, start + 1.0001 * (at - start)).any()


def test_rays_that_turn(machine, rng):
    demand = Demand(np.array([30.0]))
    start = np.eye(4)
    start[:3, 3], start[:3, :3] = [0, 0, 1.2], so3.exp([0, 0, 0.1])
    ends = poses(machine, 100, rng, 0.8)
    lam = rays(machine, demand, start, ends)
    arrived = holds(machine, demand, ends)
    assert (arrived[lam == 1]).all() and 3 < (lam == 1).sum() < 97
    some = np.flatnonzero(lam < 1)
    at = np.tile(np.eye(4), (len(some), 1, 1))
    at[:, :3, 3] = start[:3, 3] + lam[some, None] * (ends[some, :3, 3] - start[:3, 3])
    turn = so3.log(ends[some, :3, :3] @ start[:3, :3].T)
    at[:, :3, :3] = so3.exp(lam[some, None] * turn) @ start[:3, :3]
    assert np.abs(margins(machine, demand, at)).max() < 1e-6


def test_the_first_exit_is_found_where_a_ray_comes_back():
    def inside(ray, lam):
        return (lam < 0.3) | ((lam > 0.5) & (lam < 0.8)) | (ray == 1)

    lam = first_exit(lambda ray, lam: inside(ray, lam) & (ray != 2), 3)
    assert lam[0] == pytest.approx(0.3, abs=1e-11) and lam[1] == 1.0 and np.isnan(lam[2])


@pytest.mark.parametrize("count", [1, 5, 300])
@pytest.mark.parametrize("steps", [1, 7, 64])
def test_asking_for_many_points_at_once_changes_nothing(count, steps, rng, monkeypatch):
    edges = np.sort(rng.uniform(0, 1.3, (count, 4)), axis=1)
    asked = []

    def inside(ray, lam):
        asked.append(len(ray))
        return (lam < edges[ray, 0]) | ((lam > edges[ray, 1]) & (lam < edges[ray, 2])) | (lam > edges[ray, 3])

    together, calls = first_exit(inside, count, steps), len(asked)
    asked.clear()
    monkeypatch.setattr(boundary, "AT_ONCE", 1)
    np.testing.assert_array_equal(first_exit(inside, count, steps), together)
    assert calls < len(asked) / 4 if count == 1 and steps == 64 else calls <= len(asked)


def test_everything_demanded_is_held_at_once(machine, rng):
    where = poses(machine, 300, rng, 0.0)[:, :3, 3]
    masses, turned = np.array([20.0, 40.0]), so3.exp(np.array([[0.0, 0, 0.1], [0.05, 0, -0.1]]))
    extra = np.array([[0.0] * 6, [10.0, 0, 0, 0, 1, 0]])
    truth = np.ones(300, bool)
    for r in turned:
        pose = np.tile(np.eye(4), (300, 1, 1))
        pose[:, :3, 3], pose[:, :3, :3] = where, r
        for mass in masses:
            for e in extra:
                w = structure(pose, machine.a, machine.b)
                truth &= is_feasible(w, gravity_wrench(pose, mass, machine.com) + e, machine.limits)
    demand = Demand(masses, turned, extra)
    assert (holds(machine, demand, where) == truth).all() and 20 < truth.sum() < 280
    assert ((margins(machine, demand, where) > 0) == truth).all()
    reserve = replace(demand, reserve=5.0)
    assert (holds(machine, reserve, where) == (margins(machine, demand, where) >= 5.0)).all()
    # A mass between two that can be held can be held.
    assert holds(machine, replace(demand, masses=np.array([31.0])), where[truth]).all()


def test_accelerations_up_to_the_margin_can_be_held_and_no_more(machine, rng):
    demand, mass = Demand(np.array([30.0])), 30.0
    where = np.array([[0.0, 0, 1.2], [1.0, -0.5, 1.0]])
    most = accelerations(machine, demand, where)
    way = rng.normal(size=(3000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for point, top in zip(where, most, strict=True):
        pose = np.tile(np.eye(4), (3000, 1, 1))
        pose[:, :3, 3] = point
        w, still = structure(pose, machine.a, machine.b), gravity_wrench(pose, mass, machine.com)
        force = -mass * way
        inertia = np.concatenate([force, np.cross(machine.com, force)], axis=1)
        assert is_feasible(w, still + 0.9999 * top * inertia, machine.limits).all()
        assert not is_feasible(w, still + 1.02 * top * inertia, machine.limits).all()
    at = np.array([holds(machine, replace(demand, acceleration=f * most[0]), where[:1])[0] for f in (0.999, 1.001)])
    assert at.tolist() == [True, False]


def test_a_platform_anchor_on_its_frame_anchor_is_outside(machine):
    """One such cell of a grid is no reason to refuse the others."""
    where = np.array([[0, 0, 1.2], machine.a[0] - machine.b[0]])
    for mass in (0.0, 30.0):
        demand = Demand(np.array([mass]))
        assert holds(machine, demand, where).tolist() == [True, False]
        assert (margins(machine, demand, where) > 0).tolist() == [True, False]
    assert accelerations(machine, demand, where)[1] == -np.inf


def test_a_planar_robot_and_a_section(machine):
    """Three cables, no weight: with a small lower limit the workspace is nearly the triangle of the anchors."""
    a = np.array([[0.0, 0, 0], [2, 0, 0], [1, 2, 0]])
    limits = np.tile([1e-6, 1e3], (3, 1))
    flat = cable_robot("flat", a, np.zeros((3, 3)), limits=limits, degrees="2T", plane="xy")
    demand = Demand(np.array([0.0]))
    sides = np.array([[-0.47, 2.51], [-0.53, 2.52], [0, 0]])
    edge = outline(flat, demand, [1.0, 0.7, 0], sides, count=1200)
    assert edge.area == pytest.approx(2.0, rel=2e-3)
    assert grid(flat, demand, sides, (80, 80, 1)).volume == pytest.approx(2.0, rel=2e-2)
    cut = outline(machine, Demand(np.array([30.0])), [0, 0, 1.2], box(machine), axes=(0, 2))
    assert np.ptp(cut.points[:, 1]) == 0 and cut.area > 1.0


def test_motions_end_where_statics_end(machine, rng):
    """lambda_s of the pose lists: held just before, not just after; NaN from a start that is not held."""
    demand, start = Demand(np.array([30.0])), np.eye(4)
    start[2, 3] = 1.4
    v, w = rng.uniform(-4, 4, (40, 3)), rng.uniform(-0.5, 0.5, (40, 3))
    share = statics_along(machine, demand)(start, v, w)
    assert share.min() > 0.0 and (share < 1.0).sum() > 10
    for more, held in ((-1e-6, True), (1e-6, False)):
        ends = np.flatnonzero(share < 1.0)
        lam = share[ends, None] + more
        pose = np.tile(start, (len(ends), 1, 1))
        pose[:, :3, 3] += lam * v[ends]
        pose[:, :3, :3] = so3.exp(lam * w[ends])
        assert (holds(machine, demand, pose) == held).all()
    start[2, 3] = 9.0
    assert np.isnan(statics_along(machine, demand)(start, v, w)).all()


def test_what_makes_no_sense_is_named(machine):
    demand = Demand(np.array([30.0]))
    with pytest.raises(ModelError, match="start inside"):
        rays(machine, demand, [50.0, 0, 0], [[0.0, 0, 1]])
    with pytest.raises(ModelError, match="outside the box"):
        surface(machine, demand, [0, 0, 1], [[1, 2], [1, 2], [1, 2]])
    with pytest.raises(ModelError, match="three rows"):
        grid(machine, demand, [[1, 0], [0, 1], [0, 1]], (3, 3, 3))
    with pytest.raises(ModelError, match="at least one cell"):
        grid(machine, demand, [[0, 1], [0, 1], [0, 1]], (3, 0, 3))
    with pytest.raises(ModelError, match="masses"):
        holds(machine, Demand(np.empty(0)), [[0, 0, 1]])
    with pytest.raises(ModelError, match="3R3T or 3T or 1R2T or 2T"):
        holds(replace(machine, degrees="6D"), demand, [[0, 0, 1]])
    with pytest.raises(ModelError, match="positions"):
        holds(machine, demand, [0, 0, 1])
    with pytest.raises(ModelError, match="too few rays"):
        surface(machine, demand, [0, 0, 1], [[-1, 1], [-1, 1], [0, 2]], count=3)
    with pytest.raises(ModelError, match="along two axes"):
        outline(machine, demand, [0, 0, 1], [[-1, 1], [-1, 1], [0, 2]], axes=(1, 1))
    with pytest.raises(ModelError, match="steps"):
        rays(machine, demand, [0, 0, 1], [[0.0, 0, 1.1]], steps=0)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"acceleration": np.nan}, "acceleration"),
        ({"acceleration": -1.0}, "acceleration"),
        ({"reserve": np.nan}, "reserve"),
        ({"reserve": -5.0}, "reserve"),
        ({"rotations": 2 * np.eye(3)[None]}, "rotation matrix"),
        ({"rotations": -np.eye(3)[None]}, "rotation matrix"),
        ({"gravity": (0.0, 0.0)}, "three components"),
    ],
)
def test_a_demand_that_makes_no_sense_is_not_taken_for_less(machine, wrong, word):
    """A NaN is no acceleration at all to a comparison, and a matrix of twice a rotation a platform twice as large."""
    with pytest.raises(ModelError, match=word):
        holds(machine, Demand(np.array([30.0]), **wrong), [[0, 0, 1]])


def test_cells_across_a_flat_box_count_once(machine):
    demand, sides = Demand(np.array([30.0])), [[0, 0], [-2, 2], [0.5, 2.5]]
    one, five = (grid(machine, demand, sides, (n, 12, 12)).volume for n in (1, 5))
    assert one == pytest.approx(five) and one > 1

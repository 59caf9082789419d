"""Starts are examined and proposed; what a controller follows is held, within the limits and long enough, at every waypoint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import published
from cables.motions import pose
from scipy.optimize import linprog

from robocal.cables.boundary import statics_along
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import cable_robot
from robocal.cables.interference import first_contact, hull
from robocal.cables.list_start import Clearance, examine, propose
from robocal.cables.pose_list import LIMITS, PoseBox, program, reachable_poses, restrict_to_feasible
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.workspace import Demand, holds, margins
from robocal.errors import ModelError

LIMIT = np.array([10.0, 400.0])


CORNERS = np.array([(x, y) for x, y in ((-2, -1.5), (-2, 1.5), (2, 1.5), (2, -1.5))])


def robot(**more):
    """Eight cables, low anchors to the upper corners of the platform: nothing touches in the middle."""
    a = [(x, y, z) for z, lean in ((0.1, 0.2), (3.0, -0.2)) for x, y in CORNERS + [0.0, lean]]
    b = [(0.15 * x, 0.1 * y, z) for z in (0.1, -0.12) for x, y in CORNERS + 0.1]
    return cable_robot(
        "box", a, b, np.linspace(0, 0.7, 8), mass=8.0, limits=np.tile(LIMIT, (8, 1)), diameter=np.full(8, 0.004), **more
    )


def listed(machine, n=60, seed=0, steps=256, **more):
    clear = Clearance(machine.diameter, hull(machine.b))
    held = statics_along(machine, Demand(np.array([machine.mass])), steps)
    return reachable_poses(
        machine.a, machine.b, n, np.random.default_rng(seed), feasible=held, diameter=clear.diameter, body=clear.body,
        axes=machine.axes, **more,
    )  # fmt: skip


def planar(**more):
    a = [[-2, 0, 3], [2, 0, 3], [0, 0, 0]]
    return cable_robot(
        "planar", a, np.zeros((3, 3)), degrees="2T", plane="xz", mass=2.0, limits=np.tile([5.0, 60.0], (3, 1)),
        diameter=np.full(3, 0.003), **more,
    )  # fmt: skip


# Starts.


def test_a_start_that_is_held_has_a_margin_and_the_nearest_pair():
    machine = robot()
    found = examine(machine, machine.home, Clearance(machine.diameter, hull(machine.b)))
    assert found.feasible and found.margin > 0 and not found.touching and not found.missing.any()
    k, l = found.nearest
    s = np.linspace(0, 1, 801)[:, None]
    ends = machine.home[:3, 3] + machine.b
    lines = [machine.a[i] + s * (ends[i] - machine.a[i]) for i in range(8)]
    apart = [
        (np.linalg.norm(lines[i][:, None] - lines[j][None], axis=2).min(), i, j)
        for i in range(8)
        for j in range(i + 1, 8)
    ]
    assert min(apart)[1:] == (k, l) and min(apart)[0] - 0.004 == pytest.approx(found.gap, abs=1e-3)


def test_a_start_that_is_not_held_says_what_is_missing_and_another_is_proposed():
    machine = robot()
    machine = replace(machine, mass=60.0, limits=np.tile([10.0, 300.0], (8, 1)))
    clear = Clearance(machine.diameter, hull(machine.b))
    found = examine(machine, pose([0, 0, 2.95]), clear)
    assert not found.feasible
    w, limits = structure_of(machine, found.pose[None])[0], machine.limits
    missing = -gravity_wrench(found.pose[None], 60.0, machine.com)[0] - found.missing
    answer = linprog(np.zeros(8), A_eq=w, b_eq=missing, bounds=limits, method="highs")
    assert answer.status == 0  # with the wrench that is said to be missing, tensions within the limits hold it
    assert found.missing[2] > 0  # pulled up
    other = propose(machine, clear)
    again = examine(machine, other, clear)
    assert again.feasible and again.margin > 0 and not again.touching


def test_the_proposal_is_the_best_of_its_cells_and_below_a_flat_frame():
    machine = published("cogiro")
    machine = replace(machine, mass=91.058, limits=np.tile([100.0, 5000.0], (8, 1)))
    clear = Clearance(np.zeros(8), hull(machine.b))
    assert not examine(machine, machine.home, clear).feasible
    other = propose(machine, clear)
    assert 0 < other[2, 3] < machine.a[:, 2].min() - 0.5
    rng = np.random.default_rng(1)
    around = np.tile(other, (300, 1, 1))
    around[:, :2, 3] = rng.uniform(machine.a[:, :2].min(axis=0), machine.a[:, :2].max(axis=0), (300, 2))
    around[:, 2, 3] = rng.uniform(0, machine.a[:, 2].max(), 300)
    best = margins(machine, Demand(np.array([91.058])), around).max()
    assert examine(machine, other, clear).margin > 0.9 * best


def test_no_start_where_nothing_can_be_held():
    machine = replace(robot(), mass=1e5)
    assert propose(machine, Clearance(machine.diameter)) is None


def test_a_planar_start_keeps_its_plane():
    machine = planar()
    other = propose(machine, Clearance(machine.diameter, hull(machine.b)))
    found = examine(machine, other, Clearance(machine.diameter))
    assert other[1, 3] == 0 and found.feasible and found.nearest == (-1, -1) and found.missing.shape == (2,)


# Programs.


@pytest.mark.parametrize("machine", [robot(), planar()], ids=["eight cables", "planar"])
def test_every_waypoint_is_held_within_the_limits_and_free(machine):
    listing = listed(machine)
    demand = Demand(np.array([machine.mass]))
    made = program(machine, listing, 12)
    assert made.tension.shape == (60, 13, len(machine.cables))
    low, high = machine.limits.T
    assert (made.tension >= low - 1e-9).all() and (made.tension <= high + 1e-9).all()
    every = made.pose.reshape(-1, 4, 4)
    w = gravity_wrench(every, machine.mass, machine.com)[:, list(machine.axes)]
    left = np.einsum("kdm,km->kd", structure_of(machine, every), made.tension.reshape(len(every), -1)) + w
    assert np.abs(left).max() < 1e-8
    np.testing.assert_allclose(made.pose[:, 0], np.broadcast_to(listing.start, (60, 4, 4)), atol=1e-12)
    np.testing.assert_allclose(made.pose[:, -1], listing.poses, atol=1e-12)
    # Between the waypoints too, at places that no step of the search has seen.
    dense = listing.along(np.random.default_rng(2).uniform(0, 1, 300)).reshape(-1, 4, 4)
    assert holds(machine, demand, dense).all()
    still = first_contact(
        machine.a, machine.b, dense, np.zeros((len(dense), 3)), diameter=machine.diameter, body=hull(machine.b)
    )
    assert still.free.all()


def test_lengths_are_what_the_sensors_show():
    machine = robot()
    listing = listed(machine, 8)
    plain, stretched = program(machine, listing, 3), program(machine.having(elasticity=np.full(8, 2e-5)), listing, 3)
    assert not plain.stretched and stretched.stretched
    geometric, _ = inverse(machine, plain.pose.reshape(-1, 4, 4))
    np.testing.assert_allclose(plain.lengths.reshape(-1, 8), geometric, atol=1e-12)
    full = plain.lengths + machine.zeros
    np.testing.assert_allclose(stretched.lengths + machine.zeros, full / (1 + 2e-5 * stretched.tension), atol=1e-12)


def test_a_way_through_a_hole_in_the_workspace_is_cut():
    """A search that steps over what cannot be held is not believed: here it does not look at all."""
    machine = planar()
    ask = {"diameter": machine.diameter, "axes": machine.axes}
    wide = PoseBox(np.array([2.5, 0, 2.5]), np.zeros(3))
    blind = reachable_poses(machine.a, machine.b, 200, np.random.default_rng(7), box=wide, margin=0.9, **ask)
    demand = Demand(np.array([machine.mass]))
    assert not holds(machine, demand, blind.poses).all()
    cut = restrict_to_feasible(machine, demand, blind, 40)
    assert holds(machine, demand, cut.along(np.linspace(0, 1, 41)).reshape(-1, 4, 4)).all()
    changed = cut.fraction != blind.fraction
    np.testing.assert_allclose(cut.fraction, 0.9 * cut.furthest)
    assert (cut.fraction[changed] < blind.fraction[changed]).all()
    assert (cut.limit[changed] == LIMITS.index("statics")).all()
    seeing = listed(machine, box=wide, n=200, seed=7, margin=0.9)
    assert restrict_to_feasible(machine, demand, seeing, 40) is seeing
    # What was cut lies where the search along rays ends, to within a waypoint.
    assert changed.sum() > 50 and np.abs(cut.furthest - seeing.furthest)[changed].max() < 1 / 40


def test_a_method_that_finds_nothing_is_refused_and_the_mass_is_needed():
    machine = replace(robot(), limits=np.tile([10.0, 60.0], (8, 1)))
    listing = listed(machine, 40, margin=1.0)
    with pytest.raises(ModelError, match="no tensions|gives no tensions"):
        program(machine, listing, 4, "closed")
    with pytest.raises(ModelError, match="the mass of box is not known"):
        program(replace(machine, mass=None), listing, 4)

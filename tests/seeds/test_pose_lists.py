"""Lists of reachable poses as the thesis on the Laval robot tells them: figure 3.6, section 3.4.5, and what its missing numbers decide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocal.cables.boundary import statics_along
from robocal.cables.geometry import SYMBOLS
from robocal.cables.interference import distances, hull
from robocal.cables.list_start import Clearance, examine
from robocal.cables.pose_list import LIMITS, PoseBox, default_box, program, reachable_poses
from robocal.cables.workspace import Demand, holds, margins
from robocal.errors import ModelError
from robocal.files.cable.cable_robot import read_cable

EXAMPLES = Path(__file__).parents[2] / "examples"


def listed(robot, n, box=None, seed=0, diameter=None, **more):
    d = np.zeros(len(robot.cables)) if robot.diameter is None else robot.diameter
    return reachable_poses(
        robot.a, robot.b, n, np.random.default_rng(seed), box=box, axes=robot.axes, body=hull(robot.b),
        diameter=d if diameter is None else diameter, feasible=statics_along(robot, Demand(np.array([robot.mass])), 128), **more,
    )  # fmt: skip


# Figure 3.6: a robot with two degrees of freedom and three boxes Z. The figure prints no numbers, so this is the planar robot of chapter 2.


@pytest.fixture(scope="module")
def planar():
    return read_cable(EXAMPLES / "cable-planar" / "robot.yaml").robot


def test_the_larger_the_box_the_more_poses_lie_on_the_boundary(planar):
    stopped = []
    for scale in (0.2, 0.6, 1.1, 2.0):
        made = listed(planar, 800, default_box(planar.a, scale), margin=1.0)
        by_statics = made.limit == LIMITS.index("statics")
        # On the boundary: nothing to spare there, and a hair further not held.
        assert np.abs(margins(planar, Demand(np.array([planar.mass])), made.poses[by_statics])).max(initial=0) < 1e-6
        stopped.append(by_statics.mean())
    assert stopped[0] == 0 and (np.diff(stopped) > 0.1).all() and stopped[-1] > 0.8


def test_a_small_box_is_reached_everywhere(planar):
    made = listed(planar, 300, PoseBox(np.array([0.3, 0, 0.3]), np.zeros(3)), margin=0.95)
    np.testing.assert_array_equal(made.fraction, 0.95)
    assert made.reach_share == 1


def test_a_box_to_the_side_gives_an_uneven_density(planar):
    """The robot is symmetric about x = 0; so is what a centred box gives, and not what one to the right does."""
    z = default_box(planar.a)
    right = replace(z, offset=np.array([1.0, 0, 0]))
    shares = []
    for box in (z, right):
        x = listed(planar, 2000, box).poses[:, 0, 3]
        shares.append((x > 0).mean())
    assert shares[0] == pytest.approx(0.5, abs=0.04) and shares[1] > 0.7
    # The left part of the workspace is hardly seen at all.
    low = listed(planar, 2000, z).poses[:, 0, 3].min()
    assert x.min() > 0.8 * low


# The Laval robot, with what is assumed about its attachments.


@pytest.fixture(scope="module")
def laval():
    return read_cable(EXAMPLES / "cable-laval" / "robot.yaml").robot


def test_the_example_is_table_d1(laval, shared_data):
    other = read_cable(shared_data / "cable-robots" / "laval.yaml").robot
    np.testing.assert_allclose(laval.numbers, other.numbers, atol=1e-12)
    np.testing.assert_allclose(laval.limits, other.limits)
    assert (laval.mass, *laval.elasticity[:1], *laval.density[:1], *laval.diameter[:1]) == pytest.approx(
        (other.mass, other.elasticity[0], other.density[0], other.diameter[0])
    )
    assert {f"c{i}.b" for i in range(1, 9)} | {"mass", "com"} <= set(laval.assumed)
    assert not any(name.endswith((".a", ".zero", ".diameter")) for name in laval.assumed)


def test_the_start_of_the_thesis_is_held_and_two_cables_pass_eight_millimetres_apart(laval):
    found = examine(laval, laval.home, Clearance(laval.diameter, hull(laval.b)))
    assert found.feasible and found.margin > 20 and not found.touching
    assert [laval.cables[i] for i in found.nearest] == ["c3", "c7"]
    assert found.gap + 4.8e-3 == pytest.approx(8.0e-3, abs=5e-5)


def test_every_way_is_held_and_free_all_along(laval, rng):
    """Not only at the waypoints, and asked in a way of its own: the platform put at 200 places of every way, at rest."""
    listing = listed(laval, 150)
    made = program(laval, listing, 10)
    assert made.tension.min() >= 20 - 1e-9 and made.tension.max() <= 125 + 1e-9
    dense = listing.along(rng.uniform(0, 1, 200)).reshape(-1, 4, 4)
    assert holds(laval, Demand(np.array([laval.mass])), dense).all()
    ends = dense[:, None, :3, 3] + np.einsum("kij,mj->kmi", dense[:, :3, :3], laval.b)
    for k, l in zip(*np.triu_indices(8, 1), strict=True):
        apart = distances(
            np.broadcast_to(laval.a[k], ends[:, k].shape),
            ends[:, k],
            np.broadcast_to(laval.a[l], ends[:, l].shape),
            ends[:, l],
        )
        assert apart.min() > 4.8e-3


def attached(robot, b):
    values = {
        f"{c}.{s}": float(v)
        for c, row in zip(robot.cables, b, strict=True)
        for s, v in zip(SYMBOLS[3:6], row, strict=True)
    }
    return replace(robot, table=robot.table.with_values(values))


def test_what_is_reached_hangs_on_what_is_assumed(laval):
    """Ends of the low cables a quarter turn further on the same prism: no cable meets another any more, and four times as much is reached.
    Ends of the high cables 10 mm to the side: two cables touch at X_0 itself."""
    quarter, nudged = laval.b.copy(), laval.b.copy()
    quarter[:4, :2] *= [1 / 3, 3]
    nudged[4:, 0] -= 0.01
    assumed, turned = listed(laval, 3000, seed=1), listed(attached(laval, quarter), 3000, seed=1)
    meets = [(made.limit == LIMITS.index("cable-cable")).mean() for made in (assumed, turned)]
    assert meets[0] > 0.6 and meets[1] < 0.01
    assert 2.5 * assumed.reach_share < turned.reach_share and np.median(turned.fraction) > 1.4 * np.median(
        assumed.fraction
    )
    with pytest.raises(ModelError, match="cable 3 meets cable 7"):
        listed(attached(laval, nudged), 10)

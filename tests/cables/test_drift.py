"""Calibrations of one cable robot side by side: what moved, how they scatter, what nobody could see."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import sizes
from cables.cable_robots import published

from robocal.apply.anchors import compare_anchors as compared
from robocal.apply.difference import POWER, Known
from robocal.cables.calibration.comparison import calibration_scatter
from robocal.cables.geometry import cable_robot
from robocal.diagnose.limits import DRIFT_PART_CHANCE
from robocal.errors import ModelError
from robocal.geometry import se3

ROBOT = published("laval")
NAMES = tuple(f"{c}.{s}" for c in ROBOT.cables for s in ("ax", "ay", "az", "l0"))


def known(rng, values, covariance):
    drawn = values + np.linalg.cholesky(covariance) @ rng.normal(size=len(values))
    return Known(NAMES, drawn, covariance)


def truth(robot=ROBOT):
    return np.hstack([robot.a, robot.zeros[:, None]]).ravel()


def blocks(across=3e-4, along=4e-3):
    """A covariance as calibrations have: of every cable, anchor and zero hide each other along the line of sight."""
    out = np.zeros((32, 32))
    for i in range(8):
        sight = ROBOT.home[:3, 3] + ROBOT.b[i] - ROBOT.a[i]
        v = np.append(sight / np.linalg.norm(sight), -1.0) / np.sqrt(2)
        out[4 * i : 4 * i + 4, 4 * i : 4 * i + 4] = across**2 * np.eye(4) + along**2 * np.outer(v, v)
    return out


def test_an_anchor_that_moved_is_named():
    rng, c = np.random.default_rng(0), blocks()
    moved = truth().reshape(8, 4).copy()
    moved[5, :3] += [0.003, -0.002, 0.003]
    found = compared(ROBOT, known(rng, truth(), c), known(rng, moved.ravel(), c), zeros_unchanged=True)
    assert found.cables_moved == ("c6",) and found.chance < 1e-6
    np.testing.assert_allclose(found.cables[5].shift, [0.003, -0.002, 0.003], atol=2e-3)
    assert not any(x.doubtful for x in found.cables)


def test_the_chance_is_what_it_says():
    """Of many comparisons without a change about one in a hundred names a cable; a drift of the smallest size that is told is named in
    95 of 100."""
    rng, c, count = np.random.default_rng(1), blocks(), sizes.size(1000, 500)
    sight = ROBOT.home[:3, 3] + ROBOT.b[2] - ROBOT.a[2]
    # It follows from the covariance, which all draws have in common.
    sure = Known(NAMES, truth(), c)
    least = compared(ROBOT, sure, sure).cables[2].smallest[0] * sight / np.linalg.norm(sight)
    wrong = seen = 0
    for _ in range(count):
        a = known(rng, truth(), c)
        wrong += bool(compared(ROBOT, a, known(rng, truth(), c)).cables_moved)
        moved = truth().reshape(8, 4).copy()
        moved[2, :3] += least
        seen += "c3" in compared(ROBOT, a, known(rng, moved.ravel(), c)).cables_moved
    assert wrong < 3 * count * DRIFT_PART_CHANCE and abs(seen / count - POWER) < 0.03


def test_along_the_line_of_sight_anchor_and_zero_look_alike():
    """A sensor that was set anew is no drift of an anchor, nor is it nothing."""
    rng, c = np.random.default_rng(2), blocks(1e-4, 20e-3)
    moved = truth().reshape(8, 4).copy()
    moved[3, 3] += 0.01
    one, two = known(rng, truth(), c), known(rng, moved.ravel(), c)
    found = compared(ROBOT, one, two)
    assert not found.cables_moved and [x.cable for x in found.cables if x.doubtful] == ["c4"]
    along, across = found.cables[3].smallest
    assert along > 20 * across
    sharp = compared(ROBOT, one, two, zeros_unchanged=True)
    # Whoever says that zeros are the same hears of the anchor.
    assert sharp.cables_moved == ("c4",) and sharp.cables[3].smallest[0] < 0.02 * along


def test_a_base_elsewhere_is_no_drift():
    rng, c = np.random.default_rng(3), blocks(1e-4, 1e-3)
    t = se3.from_vector([0.01, -0.02, 0.005, 0.001, -0.002, 0.003])
    a = ROBOT.a @ t[:3, :3].T + t[:3, 3]
    elsewhere = np.hstack([a, ROBOT.zeros[:, None]])
    one = known(rng, truth(), c)
    assert compared(ROBOT, one, known(rng, elsewhere.ravel(), c)).cables_moved
    found = compared(ROBOT, one, known(rng, elsewhere.ravel(), c), base_moves=True)
    assert not found.cables_moved and found.base is not None
    np.testing.assert_allclose(found.base[3:], [0.001, -0.002, 0.003], atol=5e-4)
    elsewhere[6, 1] += 0.01
    assert compared(ROBOT, one, known(rng, elsewhere.ravel(), c), base_moves=True).cables_moved == ("c7",)


def test_a_frame_that_grew():
    c = blocks(1e-5, 1e-5)
    middle = ROBOT.a.mean(axis=0)
    grown = np.hstack([middle + 1.002 * (ROBOT.a - middle), ROBOT.zeros[:, None]])
    found = compared(ROBOT, Known(NAMES, truth(), c), Known(NAMES, grown.ravel(), c))
    assert found.scale == pytest.approx(0.002, rel=1e-6) and found.scale_sigma < 1e-5


@pytest.mark.parametrize("about", [(0.0, 0.0, 0.0), (4.0, -7.0, 1.5)])
@pytest.mark.parametrize("zeros_unchanged", [True, False])
def test_another_size_is_one_cause_about_any_point(about, zeros_unchanged):
    """An instrument whose scale is another grows the frame about wherever its coordinates begin: no anchor moved."""
    rng, c = np.random.default_rng(4), blocks(1e-4, 5e-4)
    for size in (0.003, -0.0015):
        a = np.array(about) + (1 + size) * (ROBOT.a - about)
        one, two = known(rng, truth(), c), known(rng, np.hstack([a, ROBOT.zeros[:, None]]).ravel(), c)
        found = compared(ROBOT, one, two, zeros_unchanged=zeros_unchanged)
        assert found.grown and not found.cables_moved
        assert abs(found.scale - size) < 3 * found.scale_sigma < 0.2 * abs(size)
        a[5] += [0.006, -0.004, 0.006]
        moved = compared(ROBOT, one, known(rng, np.hstack([a, ROBOT.zeros[:, None]]).ravel(), c), zeros_unchanged=True)
        assert moved.grown and moved.cables_moved == ("c6",) and abs(moved.scale - size) < 3 * moved.scale_sigma


def test_a_size_is_named_as_seldom_as_a_part():
    rng, c = np.random.default_rng(5), blocks()
    named = sum(compared(ROBOT, known(rng, truth(), c), known(rng, truth(), c)).grown for _ in range(400))
    assert named < 3 * 400 * DRIFT_PART_CHANCE


def test_an_anchor_that_moved_far_is_no_size():
    rng, c = np.random.default_rng(6), blocks()
    for i in range(8):
        moved = truth().reshape(8, 4).copy()
        moved[i, :3] += 0.02 * (ROBOT.a[i] - ROBOT.a.mean(axis=0)) / np.linalg.norm(ROBOT.a[i] - ROBOT.a.mean(axis=0))
        found = compared(ROBOT, known(rng, truth(), c), known(rng, moved.ravel(), c), zeros_unchanged=True)
        assert not found.grown and found.cables_moved == (ROBOT.cables[i],)


def test_a_robot_in_a_plane_is_told_its_smallest_drift():
    """Two numbers of an anchor are seen: a drift of the size that is told is named in 95 of 100."""
    a = np.array([[0, 0, 0], [0, 0, 2], [3, 0, 0], [3, 0, 2]], float)
    b = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, -1], [1, 0, 1]]) * 0.1
    robot = cable_robot("planar", a, b, np.zeros(4), degrees="1R2T", plane="xz", free=("ax", "az", "l0"))
    names = tuple(f"{c}.{s}" for c in robot.cables for s in ("ax", "az", "l0"))
    at, c = np.hstack([a[:, [0, 2]], np.zeros((4, 1))]).ravel(), 3e-4**2 * np.eye(12)
    rng, seen = np.random.default_rng(7), 0

    def drawn(values):
        return Known(names, values + 3e-4 * rng.normal(size=12), c)

    for _ in range(400):
        one = drawn(at)
        cable = compared(robot, one, one, zeros_unchanged=True).cables[1]
        along, across = cable.smallest
        assert 0 < along < 0.01 and 0 < across < 0.01
        moved = at.copy()
        moved[3:5] += along * cable.sight[[0, 2]]
        seen += robot.cables[1] in compared(robot, one, drawn(moved), zeros_unchanged=True).cables_moved
    assert abs(seen / 400 - POWER) < 0.04


def test_what_both_hide_alike_cancels():
    """A number that was held at the same wrong value in both runs moves both alike."""
    c, hidden = blocks(1e-4, 1e-4), np.zeros((32, 1))
    hidden[0] = 0.05
    one, two = (Known(NAMES, truth() + 0.03, c, hidden) for _ in range(2))
    moved = truth().reshape(8, 4).copy() + 0.03
    moved[0, 0] += 0.005
    assert not compared(ROBOT, one, two).cables_moved
    assert compared(ROBOT, one, Known(NAMES, moved.ravel(), c, hidden)).cables_moved == ("c1",)
    assert not compared(ROBOT, one, Known(NAMES, moved.ravel(), c, -hidden)).cables_moved


def test_nothing_in_common_is_an_error():
    one = Known(("c1.ax",), np.zeros(1), np.eye(1))
    with pytest.raises(ModelError, match="nothing in common"):
        compared(ROBOT, one, Known(("c2.ax",), np.zeros(1), np.eye(1)))


@pytest.fixture
def tables(shared_data):
    """Tables D.1 to D.3: three calibrations of one robot, mm."""
    with (shared_data / "seeds" / "calib_D.csv").open(encoding="utf-8") as f:
        rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
    take = {
        s: np.array([[float(r[k]) for k in ("ax", "ay", "az", "rho0")] for r in rows if r["sample"] == s])
        for s in "ABC"
    }
    return 1e-3 * np.stack([take[s] for s in "ABC"])


def test_tables_of_annex_d(tables):
    """Section 3.9 prints 316 mm and "24 times"; by (3.39a) it is 88.2 mm of a component, 152.7 mm of a point. A third of the squares is
    another place of the base, another third another size of the frame: a scale that a camera's map leaves, and no robot."""
    robot = cable_robot("laval", tables[0, :, :3], ROBOT.b, tables[0, :, 3])
    found = calibration_scatter(robot, tables[..., :3], tables[..., 3])
    assert 1e3 * found.component == pytest.approx(88.2, abs=0.05) and 1e3 * found.point == pytest.approx(
        152.7, abs=0.05
    )
    squares = np.array([found.component, found.moved, found.scaled]) ** 2
    shares = -np.diff(squares) / squares[0]
    print(f"base {shares[0]:.0%}, size {shares[1]:.0%}, rest {1 - shares.sum():.0%}; sizes {100 * found.size} %")
    np.testing.assert_allclose(shares, [0.33, 0.37], atol=0.02)
    np.testing.assert_allclose(100 * found.size, [3.6, 1.1, -4.4], atol=0.1)
    # What is left is largest along the lines of sight, where zeros hide it.
    assert found.along > 1.3 * found.across

"""The covariance of what was done (columns dropped, priors held) against Monte Carlo; quantiles and radii; bands of rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from unit.arm_data import FREE, arm, measured
from unit.plain_terms import linear, plain_problem
from unseen import bands_of_data

from robocal.estimate.uncertainty import quantile, radius, total, uneven
from robocal.fit.options import Options
from robocal.measure.data import Frame
from robocal.parameters import ParameterTable
from robocal.prove.bands import coverage
from robocal.prove.identify import identify
from robocal.prove.place_bands import base_motion, motion_field, sample_joints


@pytest.mark.parametrize("prior", [None, 0.3])
def test_total_is_the_covariance_of_estimate_minus_truth(rng, prior):
    """Truth is drawn from what is expected, some columns are not fitted, one may have a prior."""
    a = rng.normal(size=(12, 5)) @ rng.normal(size=(5, 5))
    expected = np.array([0.5, 1.0, 2.0, 0.2, 0.3])
    held = [None] * 4 + [prior]
    expected[4] = prior or expected[4]
    p = plain_problem(linear(a, np.zeros(12)), np.zeros(5), expected=list(expected), prior=held)
    kept = ["b1", "b3", "b5"]
    off = total(p, tuple(kept), p.start)
    trials = 100_000
    truth = rng.normal(size=(trials, 5)) * expected
    y = truth @ a.T + rng.normal(size=(trials, 12))
    k = [0, 2, 4]
    info = np.diag([0, 0, 0 if prior is None else 1 / prior**2])
    found = np.zeros((trials, 5))
    found[:, k] = y @ a[:, k] @ np.linalg.inv(a[:, k].T @ a[:, k] + info)
    error = found - truth
    size = np.sqrt(np.diag(off.covariance))
    empirical = np.cov(error.T) / np.outer(size, size)
    np.testing.assert_allclose(empirical, off.covariance / np.outer(size, size), atol=5 / np.sqrt(trials))
    np.testing.assert_allclose(off.sigma[[1, 3]], expected[[1, 3]])
    assert (off.noise[[1, 3]] == 0).all()


def test_a_column_without_effect_is_as_uncertain_as_expected(rng):
    a = np.column_stack([rng.normal(size=(9, 2)), np.zeros(9)])
    p = plain_problem(linear(a, np.zeros(9)), np.zeros(3), expected=[1.0, 1.0, 0.7])
    for kept in (("b1", "b2"), ("b1", "b2", "b3")):
        assert total(p, kept, p.start).sigma[2] == pytest.approx(0.7)
    assert np.isfinite(total(p, (), p.start).covariance).all()


def test_quantiles_are_those_of_student_and_gauss():
    assert quantile() == pytest.approx(stats.norm.isf(0.025), rel=1e-6)
    assert quantile(7) == pytest.approx(stats.t.isf(0.025, 7)) and quantile(0) == np.inf


@pytest.mark.parametrize("shape", [(1.0, 1.0, 1.0), (3.0, 1.0, 0.3), (1.0, 0.0, 0.0), (2.0, 1.9, 0.01)])
def test_the_radius_holds_95_percent(rng, shape):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    root = turn * np.array(shape)
    size = np.linalg.norm(rng.normal(size=(200_000, 3)) @ root.T, axis=1)
    held = (size <= radius(root @ root.T)).mean()
    assert held == pytest.approx(0.95, abs=0.004)
    # With estimated noise the same with one chi squared in common.
    scale = np.sqrt(rng.chisquare(12, 200_000) / 12)
    assert (size <= scale * radius(root @ root.T, 12)).mean() == pytest.approx(0.95, abs=0.006)
    assert radius(np.zeros((3, 3))) == 0


def test_bands_of_new_measurements_hold_them():
    found = identify(arm(), measured(60, stated=False), Options(hold_out=0.0, leave_one_out=False))
    other = measured(300, seed=8, stated=False)
    values = dict(zip(found.table.names, found.table.values, strict=True))
    (got,) = coverage(bands_of_data(found.nominal, other, values, found.total, found.groups), found.total.dof)
    assert got.n == 300 and 0.92 < got.components < 0.98 and 0.91 < got.whole < 0.985


def test_a_motion_of_the_base_is_taken_out_whole(rng):
    points = rng.normal(size=(30, 3))
    field = motion_field(points)
    motion = rng.normal(size=(6, 2))
    np.testing.assert_allclose(base_motion(field @ motion, points), motion, atol=1e-10)
    v, w = rng.normal(size=3), rng.normal(size=3)
    np.testing.assert_allclose(field[4] @ np.concatenate([v, w]), np.concatenate([v + np.cross(w, points[4]), w]))


def test_joints_are_drawn_within_limits_or_where_measured():
    robot = arm(limits=(-1.5, 1.5))
    q, region = sample_joints(robot, None, 1000)
    assert np.abs(q).max() <= 1.5 and np.abs(q).max() > 1.4 and region == "joint limits"
    free = arm(limits=(-np.inf, np.inf))
    q, region = sample_joints(free, np.tile([0.2, 0.3], (5, 1)), 100)
    assert q.min() >= 0.2 and q.max() <= 0.3 and "measured" in region


def test_noise_that_sits_where_the_leverage_is_enlarges_the_bars(rng):
    """Even noise is left alone; noise three times larger at the rows that decide the fit is noticed, and by how much."""
    a = rng.normal(size=(120, 8))
    a[:12] *= 4.0
    loud = np.where(np.arange(120) < 12, 3.0, 1.0)
    unit = np.arange(120) // 2

    def factors(sigma, count):
        out = []
        for _ in range(count):
            y = sigma * rng.normal(size=120)
            p = plain_problem(linear(a, y, configuration=unit), np.zeros(8))
            out.append(uneven(p, np.linalg.lstsq(a, y, rcond=None)[0]))
        return np.array(out)

    assert (factors(1.0, 200) == 1.0).mean() > 0.97
    inverse = np.linalg.inv(a.T @ a)
    true = np.trace(np.linalg.solve(inverse, inverse @ (a.T * loud**2) @ a @ inverse)) / 8
    spread = (loud**2 @ (1 - np.einsum("ij,jk,ik->i", a, inverse, a))) / (120 - 8)
    found = factors(loud, 200)
    print(f"variance {true / spread:.2f} times that of even noise, told {np.median(found):.2f}")
    assert np.median(found) == pytest.approx(true / spread, rel=0.25)


def test_a_parameter_that_is_hardly_seen_does_not_hide_the_check_of_the_bands():
    """It touches every row, and is as uncertain as expected: that is a band like any other."""
    robot = arm()
    rows = [replace(p, free=True, expected=1e-9) if p.name == "j2.r" else p for p in robot.table.rows]
    robot = replace(robot, table=ParameterTable(tuple(rows)))
    data = measured(60, seed=3)
    found = identify(robot, data, Options(leave_one_out=False))
    alone = [c.name for c in found.identifiability.combinations if not c.partners]
    assert alone == ["j2.r"], "and no other parameter can be blamed"
    assert found.coverage and found.coverage[0].n == len(found.held_out_ids)
    unproven = identify(robot, data, Options(hold_out=0.0, leave_one_out=False))
    assert not unproven.coverage and "band-unchecked" in {r.code for r in unproven.warnings}


# obeys: band-blind
def test_bands_that_cannot_be_checked_are_told():
    """Every group has a marker of its own: nothing that was fitted has met the one that is held out."""
    free = (True, True, True, False, False, False)
    markers = [Frame(f"m{i}", (0.03 * i, 0.02, 0.05, 0.0, 0.0, 0.0), free, "tool") for i in range(5)]
    data = measured(60, targets=markers, target=np.repeat(np.arange(5), 12))
    groups = tuple(f"g{i}" for i in np.repeat(np.arange(5), 12))
    data = replace(data, configurations=replace(data.configurations, groups=groups))
    found = identify(arm(free=FREE), data, Options(hold_out="group", leave_one_out=False))
    assert found.held_out_ids and not found.coverage
    (said,) = [r for r in found.warnings if r.code == "band-blind"]
    assert "m" in said.sentence and all(n.startswith("m") for n in said.numbers["names"])
    mixed = identify(arm(free=FREE), data, Options(hold_out=0.2, leave_one_out=False))
    assert mixed.coverage and "band-blind" not in {r.code for r in mixed.warnings}


@pytest.mark.parametrize("dof", [np.inf, 1.0, 7.5])
@pytest.mark.parametrize("d", [1, 2, 3, 6])
def test_radii_of_many_are_those_of_each(d, dof):
    rng = np.random.default_rng(d)
    root = rng.standard_normal((300, d, d)) * np.exp(rng.uniform(-5, 5, (300, 1, d)))
    root[0], root[1] = np.eye(d), np.eye(d) * (np.arange(d) == 0)  # all directions alike, and one alone
    many = root @ np.swapaxes(root, 1, 2)
    np.testing.assert_allclose(radius(many, dof), [radius(one, dof) for one in many], rtol=1e-8)

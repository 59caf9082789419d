"""Wrench closure, tension factor and condition number: by hand, against linear programs and against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import published
from scipy.optimize import linprog
from sizes import size

from robocal.cables.boundary import outline
from robocal.cables.closure import condition_number, dexterity, tension_factor
from robocal.cables.geometry import cable_robot
from robocal.cables.statics import structure_of
from robocal.cables.workspace import Demand, dexterities, grid, holds, margins
from robocal.errors import ModelError
from robocal.geometry import so3

TRIANGLE = np.array([(-2.0, 0, 0), (3, 0, 1), (0.5, 0, 4)])
ANY = Demand(np.zeros(1), closure=True)


def by_linear_program(w):
    """The greatest x with W t = 0 and x <= t <= 1, for W of full rank."""
    d, m = w.shape
    found = linprog(
        np.r_[np.zeros(m), -1.0], A_ub=np.c_[-np.eye(m), np.ones(m)], b_ub=np.zeros(m), A_eq=np.c_[w, np.zeros(d)], b_eq=np.zeros(d),
        bounds=[(0.0, 1.0)] * (m + 1),
    )  # fmt: skip
    return found.x[-1]


def flat(anchors=TRIANGLE, **known):
    return cable_robot("flat", anchors, np.zeros_like(anchors), degrees="2T", plane="xz", **known)


@pytest.mark.parametrize(("d", "m"), [(2, 3), (2, 5), (3, 4), (3, 7), (6, 7), (6, 8), (6, 9), (6, 12)])
def test_the_tension_factor_is_that_of_a_linear_program(d, m, rng):
    w = rng.normal(size=(size(200, 20), d, m))
    some = w[::2]
    some[..., -1] = -(some[..., :-1] * rng.uniform(0.3, 1.0, (len(some), 1, m - 1))).sum(axis=-1)  # closed
    w[::2] = some
    found = tension_factor(w)
    np.testing.assert_allclose(found, [by_linear_program(one) for one in w], atol=1e-9)
    assert (found[::2] > 0).all()
    # Neither the unit of a row nor the frame in which a wrench is told matters.
    np.testing.assert_allclose(tension_factor(w * rng.uniform(0.1, 10, (1, d, 1))), found, atol=1e-9)
    np.testing.assert_allclose(tension_factor(rng.normal(size=(d, d)) @ w), found, atol=1e-8)


def test_of_published_robots(rng):
    for name in ("ipanema_1", "ipanema_3"):
        robot = published(name)
        pose = np.tile(robot.home, (30, 1, 1))
        pose[:, :3, :3] = so3.exp(rng.uniform(-0.3, 0.3, (30, 3)))
        pose[:, :3, 3] += rng.uniform(-0.6, 0.6, (30, 3))
        w = structure_of(robot, pose)
        found = dexterity(w, robot.lengths_of_rows(0.4))
        np.testing.assert_allclose(found.tension_factor, [by_linear_program(one) for one in w], atol=1e-9)
        scaled = w / np.array([1, 1, 1, 0.4, 0.4, 0.4])[:, None]
        np.testing.assert_allclose(found.condition, np.linalg.cond(scaled), rtol=1e-9)
        assert found.in_closure.any()


def test_by_hand():
    """Three cables at 120 degrees pull alike; at right angles and against both, the third one pulls sqrt(2) as much."""
    turns = 2 * np.pi * np.arange(3) / 3
    even = np.array([np.cos(turns), np.sin(turns)])
    assert tension_factor(even[None])[0] == pytest.approx(1) and condition_number(even[None])[0] == pytest.approx(1)
    corner = np.array([[1.0, 0, -np.sqrt(0.5)], [0, 1, -np.sqrt(0.5)]])
    assert tension_factor(corner[None])[0] == pytest.approx(np.sqrt(0.5))
    # W W^T = [[3/2, 1/2], [1/2, 3/2]] has the eigenvalues 2 and 1.
    assert condition_number(corner[None])[0] == pytest.approx(np.sqrt(2))


def test_what_is_not_closed():
    """All to one side; a cable too few; in one line, where t > 0 with W t = 0 exist and no force across is held."""
    fan, pair = np.array([[[1.0, 0.8, -0.1], [0.1, 0.6, 1]]]), np.eye(2)[None]
    line = np.array([[[1.0, -1, 1], [0, 0, 0]]])
    for w in (fan, pair, line):
        found = dexterity(w)
        assert found.tension_factor[0] == 0 and not found.in_closure[0]
    assert condition_number(line)[0] == np.inf and condition_number(np.ones((1, 3, 2)))[0] == np.inf


def test_a_point_on_three_cables_is_closed_within_their_triangle():
    robot = flat()
    # The outline is joined by straight lines from rays, the edges are straight: only corners are cut.
    line = outline(robot, ANY, [0.5, 0, 1.5], [[-3, 4], [0, 0], [-1, 5]], axes=(0, 2), count=3000)
    u, v = TRIANGLE[1] - TRIANGLE[0], TRIANGLE[2] - TRIANGLE[0]
    assert line.area == pytest.approx(abs(u[0] * v[2] - u[2] * v[0]) / 2, rel=1e-4)
    cells = grid(robot, ANY, [[-3, 4], [0, 0], [-1, 5]], (60, 1, 60), with_margins=True)
    assert cells.volume == pytest.approx(line.area, rel=0.01)
    assert (np.isfinite(cells.margin) == cells.inside).all() and np.nanmax(cells.margin) > 0.9


def test_closure_is_to_hold_any_wrench(rng):
    """Where it is closed, limits can be so wide that a wrench is held; elsewhere there is a wrench that none hold."""
    robot = published("ipanema_1")
    where = robot.home[:3, 3] + rng.uniform(-1.5, 1.5, (200, 3))
    closed = holds(robot, ANY, where)
    assert 20 < closed.sum() < 180
    wide = robot.having(limits=np.tile([0.0, 1e6], (8, 1)))
    wrench = np.concatenate([np.vstack([np.eye(6), -np.eye(6)]), rng.normal(size=(40, 6))])
    held = np.all([holds(wide, Demand(np.zeros(1), extra=one[None]), where) for one in wrench], axis=0)
    factor = dexterities(robot, ANY, where).tension_factor
    assert held[closed & (factor > 1e-3)].all() and not held[~closed].any()
    np.testing.assert_array_equal(np.isfinite(margins(robot, ANY, where)), closed)


def test_the_worst_of_several_orientations_counts(rng):
    robot = published("ipanema_1")
    where = robot.home[:3, 3] + rng.uniform(-0.5, 0.5, (20, 3))
    turns = so3.exp(rng.uniform(-0.4, 0.4, (3, 3)))
    both = dexterities(robot, Demand(np.zeros(1), turns, length=0.3, closure=True), where)
    each = [dexterities(robot, Demand(np.zeros(1), one[None], length=0.3, closure=True), where) for one in turns]
    np.testing.assert_allclose(both.tension_factor, np.min([one.tension_factor for one in each], axis=0))
    np.testing.assert_allclose(both.condition, np.max([one.condition for one in each], axis=0))


def test_a_structure_of_nothing_is_singular():
    assert condition_number(np.zeros((1, 3, 4)))[0] == np.inf and tension_factor(np.zeros((1, 3, 4)))[0] == 0


def test_what_makes_no_sense_is_named():
    with pytest.raises(ModelError, match="structure matrices"):
        tension_factor(np.full((1, 2, 3), np.nan))
    with pytest.raises(ModelError, match="length"):
        condition_number(np.ones((1, 3, 4)), -1.0)
    with pytest.raises(ModelError, match="length"):
        condition_number(np.ones((1, 3, 4)), [1.0, 1.0])

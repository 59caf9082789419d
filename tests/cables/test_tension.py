"""Tension distributions, missing wrenches and margins against quadratic programs, linear programs and convex hulls."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, published
from cables.rigs import problem, slack, slacks
from scipy.optimize import linprog, lsq_linear
from scipy.spatial import ConvexHull
from sizes import size

from robocal.cables.statics import gravity_wrench, structure
from robocal.cables.tension import METHODS, capacity_margin, distribute, disturbance_margin, is_feasible, missing_wrench
from robocal.errors import ModelError


def random_rig(d, m, count, rng, lower=1.0, upper=20.0):
    """Structure matrices, wrenches (about half of them feasible) and limits."""
    w = rng.normal(size=(count, d, m))
    limits = np.stack([np.full(m, lower), rng.uniform(0.5, 1.5, m) * upper], axis=1)
    beyond = 8 if m > d else 1
    t = rng.uniform(limits[:, 0] - beyond, limits[:, 1] + beyond, (count, m))
    return w, -np.einsum("kdm,km->kd", w, t), limits


def least_norm(w, load, limits):
    """quadprog's answer, None when it finds none."""
    quadprog = pytest.importorskip("quadprog")
    d, m = w.shape
    matrix = np.hstack([w.T, np.eye(m), -np.eye(m)])
    try:
        return quadprog.solve_qp(np.eye(m), np.zeros(m), matrix, np.r_[-load, limits[:, 0], -limits[:, 1]], d)[0]
    except ValueError:
        return None


def agrees_with_quadprog(w, load, limits, tolerance):
    found = distribute(w, load, limits)
    worst = 0.0
    for k in range(len(w)):
        t = least_norm(w[k], load[k], limits)
        if (t is not None) != found.feasible[k]:
            assert abs(slack(w[k], load[k], limits)) < 1e-6, k
        elif t is not None:
            worst = max(worst, np.abs(t - found.tension[k]).max())
    assert worst < tolerance
    return found.feasible


SHAPES = [(2, 2), (2, 3), (3, 4), (2, 4), (6, 6), (6, 7), (6, 8), (3, 6), (6, 9), (6, 12), (2, 8)]


@pytest.mark.parametrize(("d", "m"), SHAPES)
def test_least_norm_is_quadprogs(d, m, rng):
    feasible = agrees_with_quadprog(*random_rig(d, m, 300, rng), 1e-8)
    assert 10 < feasible.sum() < 290


@pytest.mark.sampled(5)
@pytest.mark.parametrize(("d", "m"), SHAPES)
def test_every_method_balances_within_limits_and_agrees_on_feasibility(d, m, rng):
    w, load, limits = random_rig(d, m, 200, rng)
    truth = slacks(w, load, limits)
    sure = np.abs(truth) > 1e-6
    for method in METHODS:
        if method == "barycentre" and m - d > 2:
            continue
        out = distribute(w, load, limits, method)
        assert (out.feasible == (truth < 0))[sure].all()
        if method != "closed":
            assert (out.has_solution == out.feasible).all()
        t = out.tension[out.has_solution]
        assert np.isnan(out.tension[~out.has_solution]).all()
        assert np.abs(np.einsum("kdm,km->kd", w[out.has_solution], t) + load[out.has_solution]).max() < 1e-9
        assert (t >= limits[:, 0] - 1e-9).all() and (t <= limits[:, 1] + 1e-9).all()


def test_closed_form_is_the_one_nearest_to_the_middle_wherever_it_holds(rng):
    w, load, limits = random_rig(6, 8, 400, rng)
    closed, middle = distribute(w, load, limits, "closed"), distribute(w, load, limits, "mid")
    assert 20 < closed.has_solution.sum() < middle.has_solution.sum()
    np.testing.assert_allclose(closed.tension[closed.has_solution], middle.tension[closed.has_solution], atol=1e-9)


@pytest.mark.parametrize(("d", "m"), [(2, 4), (6, 8), (6, 10)])
def test_power_two_is_the_norm_and_higher_powers_cannot_be_bettered(d, m, rng):
    w, load, limits = random_rig(d, m, 100, rng)
    norm = distribute(w, load, limits)
    two = distribute(w, load, limits, "p-norm", 2.0)
    np.testing.assert_allclose(two.tension[norm.has_solution], norm.tension[norm.has_solution], atol=1e-7)
    eight = distribute(w, load, limits, "p-norm", 8.0)
    # No feasible way lowers the sum: towards the other methods' tensions it rises.
    for other in ("norm", "mid"):
        to = distribute(w, load, limits, other).tension[norm.has_solution]
        at = eight.tension[norm.has_solution]
        assert ((at**8).sum(axis=1) <= (to**8).sum(axis=1) * (1 + 1e-12)).all()
        slope = (8 * (at / 20) ** 7 * (to - at)).sum(axis=1)
        assert (slope > -1e-6 * (at / 20).max(axis=1) ** 7).all()


@pytest.mark.parametrize("above", [1.0, 1e4])
@pytest.mark.parametrize(("d", "m"), [(2, 3), (6, 8), (6, 10)])
def test_high_powers_come_to_the_least_greatest_tension(d, m, above, rng):
    """max t <= |t|_p <= m^(1/p) min max t, the last by a linear program; also where limits lie far above the tensions."""
    w, limits = rng.normal(size=(30, d, m)), np.tile([0.0, 20.0], (m, 1))
    load = -np.einsum("kdm,km->kd", w, rng.uniform(0, 20, (30, m)))
    ones = np.ones((m, 1))
    least = [
        linprog(
            np.r_[np.zeros(m), 1.0],
            A_ub=np.c_[np.eye(m), -ones],
            b_ub=np.zeros(m),
            A_eq=np.c_[w[k], np.zeros(d)],
            b_eq=-load[k],
            bounds=[(0, 20)] * m + [(None, None)],
        ).fun
        for k in range(30)
    ]
    for power in (30.0, 100.0, 1000.0):
        out = distribute(w, load, limits * [1.0, above], "p-norm", power)
        assert out.has_solution.all()
        assert (out.tension.max(axis=1) <= m ** (1 / power) * np.array(least) * (1 + 1e-9)).all()


@pytest.mark.parametrize("seed", [54, 78, 99, 161, 895])
def test_high_powers_leave_the_wrench_balanced_where_newton_loses_its_digits(seed):
    """Nine cables between corners of cubes, among 1700 such machines some at which a step was wrong, or was not found."""
    rng = np.random.default_rng(seed)
    a, b = np.sign(rng.normal(size=(9, 3))), np.sign(rng.normal(size=(9, 3))) * rng.choice([0.05, 0.2, 1])
    pose = np.tile(np.eye(4), (1000, 1, 1))
    pose[:, :3, 3] = rng.uniform(-0.8, 0.8, (1000, 3))
    w, limits = structure(pose, a, b), np.tile([1.0, 6000.0], (9, 1))
    load = -np.einsum("kdm,km->kd", w, rng.uniform(1, 6000, (1000, 9)))
    out = distribute(w, load, limits, "p-norm", 40.0)
    assert out.has_solution.all()
    assert np.abs(np.einsum("kdm,km->kd", w, out.tension) + load).max() < 1e-6


def test_centre_of_a_segment_is_its_middle(rng):
    """One cable held at a given tension leaves a segment of the polygon."""
    w, t = rng.normal(size=(100, 6, 8)), rng.uniform(5, 15, 8)
    limits = np.tile([1.0, 20.0], (8, 1))
    limits[3] = t[3]
    out = distribute(w, -w @ t, limits, "barycentre")
    u = np.linalg.svd(np.concatenate([w, np.broadcast_to(np.eye(8)[3], (100, 1, 8))], axis=1))[2][:, 7]
    u[:, 3] = 1.0
    room = np.stack([(limits[:, 0] - out.tension) / u, (limits[:, 1] - out.tension) / u])
    up, down = room.max(axis=0), room.min(axis=0)
    up[:, 3], down[:, 3] = np.inf, -np.inf
    np.testing.assert_allclose(up.min(axis=1) + down.max(axis=1), 0, atol=1e-7)


def test_centre_is_that_of_the_polygon(rng):
    """Against the mean of points drawn evenly from the polygon, and the middle of the interval."""
    w, load, limits = random_rig(6, 8, 60, rng)
    out = distribute(w, load, limits, "barycentre")
    k = int(np.argmax(out.has_solution))
    basis = np.linalg.svd(w[k])[2][6:]
    spread = rng.uniform(-80, 80, (400_000, 2)) @ basis + out.tension[k]
    inside = spread[((spread >= limits[:, 0]) & (spread <= limits[:, 1])).all(axis=1)]
    error = inside.std(axis=0) / np.sqrt(len(inside))
    assert len(inside) > 300
    assert (np.abs(inside.mean(axis=0) - out.tension[k]) < 5 * error + 1e-9).all()
    w, load, limits = random_rig(6, 7, 60, rng)
    out = distribute(w, load, limits, "barycentre")
    u = np.linalg.svd(w)[2][:, 6]
    with np.errstate(invalid="ignore"):
        room = np.stack([(limits[:, 0] - out.tension) / u, (limits[:, 1] - out.tension) / u])
    up, down = room.max(axis=0).min(axis=1), room.min(axis=0).max(axis=1)
    np.testing.assert_allclose((up + down)[out.has_solution], 0, atol=1e-8)


def test_centre_is_continuous_along_a_path():
    machine = published("ipanema_3")
    pose = np.tile(np.eye(4), (4001, 1, 1))
    pose[:, :3, 3] = np.linspace([-3, -2, 0.5], [3, 2, 2.0], 4001)
    out = distribute(
        structure(pose, machine.a, machine.b),
        gravity_wrench(pose, machine.mass, machine.com),
        machine.limits,
        "barycentre",
    )
    step = np.abs(np.diff(out.tension, axis=0)).max()
    coarse = np.abs(np.diff(out.tension[::4], axis=0)).max()
    assert out.has_solution.all() and step < 0.3 * coarse  # steps shrink with the path's: no jump


@pytest.mark.parametrize(("d", "m"), [(2, 3), (3, 4), (6, 8), (6, 10)])
def test_missing_wrench_is_the_least_squares_residual(d, m, rng):
    w, load, limits = random_rig(d, m, 200, rng)
    scale = np.array([1.0] * {2: 2, 3: 2, 6: 3}[d] + [1 / 0.3] * {2: 0, 3: 1, 6: 3}[d])
    missing = missing_wrench(w, load, limits, 0.3)
    feasible = is_feasible(w, load, limits)
    assert (np.linalg.norm(missing, axis=1) > 1e-7).tolist() == (~feasible).tolist()
    for k in np.flatnonzero(~feasible)[:40]:
        other = lsq_linear(scale[:, None] * w[k], -scale * load[k], limits.T, method="bvls", tol=1e-15)
        np.testing.assert_allclose(scale * missing[k], -other.fun, atol=1e-7)
    # With what was missing the wrench can be balanced; with a little less it cannot.
    bad = ~feasible
    assert (np.abs(missing_wrench(w[bad], load[bad] + missing[bad], limits, 0.3)) < 1e-7).all()
    assert not is_feasible(w[bad], load[bad] + 0.999 * missing[bad], limits).any()
    np.testing.assert_array_equal(distribute(w, load, limits).missing(0.3)[feasible], 0)


@pytest.mark.parametrize("length", [1e-6, 1e-4, 1e3, 1e5])
def test_missing_wrench_is_the_least_whatever_the_length(length, rng):
    """No wrench is missing that a direction n does not miss: |missing| = n . (-w) - max n . W t, n along it."""
    w, load, limits = random_rig(6, 12, 400, rng, lower=0.0)
    w[:, :, 11] = w[:, :, 0]
    load *= 10.0 ** rng.uniform(-3, 3, (400, 1))
    scale = np.array([1.0, 1, 1, 1 / length, 1 / length, 1 / length])
    missing = scale * missing_wrench(w, load, limits, length)
    size = np.linalg.norm(missing, axis=1)
    most = np.abs(scale * load).max(axis=1) + 20 * np.linalg.norm(scale[:, None] * w, axis=1).max(axis=1)
    some = size > 1e-6 * most
    n = missing[some] / size[some, None]
    seen = np.einsum("kd,kdm->km", n * scale, w[some])
    bound = (n * -scale * load[some]).sum(axis=1) - np.maximum(seen * limits[:, 0], seen * limits[:, 1]).sum(axis=1)
    assert some.sum() > 100
    np.testing.assert_array_less(np.abs(size[some] - bound), 1e-9 * most[some])


@pytest.mark.parametrize(("d", "m"), [(2, 2), (2, 3), (3, 4), (2, 4), (3, 6), (3, 7)])
def test_margin_is_the_distance_to_the_hull(d, m, rng):
    w, load, limits = random_rig(d, m, 60, rng)
    margin = capacity_margin(w, load, limits, 0.5)
    scale = np.array([1.0, 1.0] + [1 / 0.5] * (d - 2))
    corners = np.array(list(itertools.product(*limits)))
    for k in range(60):
        hull = ConvexHull(-(corners @ w[k].T) * scale)
        distance = -(hull.equations[:, :-1] @ (scale * load[k]) + hull.equations[:, -1]).max()
        assert margin[k] == pytest.approx(distance, abs=1e-8)
    assert ((margin > 0) == is_feasible(w, load, limits)).all()


def test_margin_is_the_largest_disturbance_that_is_always_balanced(rng):
    w, load, limits = random_rig(6, 8, 40, rng)
    shape = rng.normal(size=(40, 6, 3))
    reach = disturbance_margin(w, load, limits, shape)
    way = rng.normal(size=(2000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for k in np.flatnonzero(reach > 0)[:10]:
        ball = load[k] + reach[k] * way @ shape[k].T
        assert is_feasible(np.repeat(w[k : k + 1], 2000, axis=0), load[k] + 0.9999 * (ball - load[k]), limits).all()
        far = load[k] + 1.25 * (ball - load[k])
        assert not is_feasible(np.repeat(w[k : k + 1], 2000, axis=0), far, limits).all()


def test_margin_of_several_wrenches_is_the_least(rng):
    w, load, limits = random_rig(6, 8, 50, rng)
    several = load[:, None] + rng.normal(size=(50, 3, 6))
    each = np.stack([capacity_margin(w, several[:, v], limits) for v in range(3)])
    np.testing.assert_allclose(capacity_margin(w, several, limits), each.min(axis=0), atol=1e-10)


def test_a_point_held_by_cables_is_singular_and_still_right(rng):
    """All platform anchors in one point: no moment can be balanced; forces are those of three rows."""
    a = rng.uniform(-3, 3, (6, 3)) + [0, 0, 1]
    pose = np.tile(np.eye(4), (50, 1, 1))
    pose[:, :3, 3] = rng.uniform(-2, 2, (50, 3))
    w, load, limits = structure(pose, a, np.zeros((6, 3))), np.r_[0, 0, -50.0, 0, 0, 0], np.tile([2.0, 90.0], (6, 1))
    six, three = distribute(w, load, limits), distribute(w[:, :3], load[:3], limits)
    assert (six.feasible == three.feasible).all() and 5 < six.feasible.sum() < 50
    np.testing.assert_allclose(six.tension[six.has_solution], three.tension[six.has_solution], atol=1e-9)
    assert not is_feasible(w, load + [0, 0, 0, 1e-3, 0, 0], limits).any()
    margin = capacity_margin(w, load, limits)
    assert (margin[six.feasible] == 0).all() and (margin[~six.feasible] < 0).all()
    worse = np.stack([np.broadcast_to(load, (50, 6)), np.broadcast_to(load + [0, 0, -20, 1, 0, 0], (50, 6))], axis=1)
    short = np.stack([missing_wrench(w, worse[:, v], limits, 0.5) for v in range(2)], axis=1) * ([1] * 3 + [2] * 3)
    size = np.linalg.norm(short, axis=2).max(axis=1)
    np.testing.assert_allclose(capacity_margin(w, worse, limits, 0.5), -size, rtol=1e-12)


@pytest.mark.parametrize(("d", "m"), [(2, 4), (3, 5), (6, 7), (6, 8), (6, 10)])
@pytest.mark.parametrize("size", [0.0, 1e-13, 1e-11, 1e-9, 1e-6])
def test_parallel_cables_and_rows_that_nearly_depend_lose_nothing(d, m, size, rng):
    """The wrench of given tensions can be balanced, however near to singular the pose is."""
    w = rng.normal(size=(50, d, m))
    w[:, :, :2] = w[:, :, -2:]
    w[:, d - 1] = 0.5 * w[:, 0] + size * rng.normal(size=(50, m))
    limits, t = np.tile([1.0, 20.0], (m, 1)), rng.uniform(1, 20, (50, m))
    load = -np.einsum("kdm,km->kd", w, t)
    for method in METHODS:
        if method != "barycentre" or m - d <= 2:
            out = distribute(w, load, limits, method)
            assert out.feasible.all()
            x = out.tension[out.has_solution]
            assert (
                np.abs(np.einsum("kdm,km->kd", w[out.has_solution], x) + load[out.has_solution]).max(initial=0) < 1e-7
            )
    assert (capacity_margin(w, load, limits) > -1e-6).all()


def test_limits_that_touch_leave_one_answer(rng):
    """Cables held at given tensions, the others free: a polygon of one point or one edge is not lost by rounding."""
    w = rng.normal(size=(100, 6, 8))
    t = rng.uniform(5, 15, 8)
    load = -w @ t
    for held in ((2,), (2, 5), tuple(range(8))):
        limits = np.tile([1.0, 20.0], (8, 1))
        limits[list(held)] = t[list(held), None]
        for method in ("norm", "mid", "barycentre", "p-norm"):
            out = distribute(w, load, limits, method)
            assert out.feasible.all() and out.has_solution.all()
            if len(held) > 1:
                np.testing.assert_allclose(out.tension, np.broadcast_to(t, (100, 8)), atol=1e-7)


def test_limits_that_touch_to_rounding_are_met_however_little_one_cable_changes():
    """The second cable misses its limit by 4e-12 N of 5 N, and the way there would be 4 N of the first."""
    w, limits = np.array([[[1e-12, -1.0]]]), np.array([[0.0, 1.0], [5 + 5e-12, 5 + 5e-12]])
    out = distribute(w, [5.0], limits)
    assert out.feasible.all()
    np.testing.assert_allclose(out.tension[0], [1.0, 5.0], atol=1e-9)
    assert not is_feasible(w, [5.0 - 1e-9], limits).any()


def test_cross_checks_of_ipanema_3():
    machine = published("ipanema_3")
    pose = np.eye(4)[None].copy()
    pose[0, 2, 3] = 1.0
    w = structure(pose, machine.a, machine.b)
    closed = np.array([1433.1, 1514.7, 1532.3, 1533.7, 1447.6, 1561.3, 1673.4, 1637.7])
    norm = np.array([360.8, 381.4, 377.2, 380.5, 100.0, 100.0, 118.2, 108.6])
    load = gravity_wrench(pose, machine.mass, machine.com, (0, 0, -9.80665))
    np.testing.assert_allclose(distribute(w, load, machine.limits, "closed").tension[0], closed, atol=0.1)
    np.testing.assert_allclose(distribute(w, load, machine.limits).tension[0], norm, atol=0.1)
    # Each agrees to the digits printed with a gravity of its own: the first one's is 9.81.
    np.testing.assert_allclose(distribute(w, load, machine.limits).tension[0], norm, atol=0.0501)
    load = gravity_wrench(pose, machine.mass, machine.com, (0, 0, -9.81))
    np.testing.assert_allclose(distribute(w, load, machine.limits, "closed").tension[0], closed, atol=0.0501)


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_robots(name, rng):
    machine = published(name)
    w, load = problem(machine, 400, rng)
    feasible = is_feasible(w, load, machine.limits)
    truth = slacks(w[:100], load[:100], machine.limits)
    assert ((truth < 0) == feasible[:100])[np.abs(truth) > 1e-6].all()
    assert ((capacity_margin(w, load, machine.limits) > 0) == feasible).all()
    assert 20 < agrees_with_quadprog(w, load, machine.limits, 1e-8).sum() < 380


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_published_robots_at_ten_thousand_poses(name, rng):
    machine = published(name)
    many = size(10_000, 2_500)
    w, load = problem(machine, 12 * many, rng)
    feasible = is_feasible(w, load, machine.limits)
    truth = slacks(w[:many], load[:many], machine.limits)
    sure = np.abs(truth) > 1e-6
    assert ((truth < 0) == feasible[:many])[sure].all() and sure.mean() > 0.999
    some = np.flatnonzero(feasible)[:many]
    assert len(some) == many
    assert agrees_with_quadprog(w[some], load[some], machine.limits, 1e-8).all()
    for power in (4.0, 16.0, 100.0):  # one in thousands only crawls at the bottom, by rounding
        assert distribute(w[some], load[some], machine.limits, "p-norm", power).has_solution.all()


RIG = (np.tile(np.eye(2, 3), (4, 1, 1)), np.zeros((4, 2)), np.tile([1.0, 9.0], (3, 1)))


@pytest.mark.parametrize(
    ("structure_", "wrench", "limits", "more", "word"),
    [
        (RIG[0][:, :, :1], RIG[1], RIG[2][:1], {}, "fewer cables"),
        (RIG[0], RIG[1], RIG[2][:2], {}, "one row per cable"),
        (RIG[0], RIG[1], RIG[2][:, ::-1], {}, "c1: tension limits are crossed"),
        (RIG[0], RIG[1], RIG[2] - [5, 0], {}, "cannot push"),
        (RIG[0], RIG[1], RIG[2] + [0, np.inf], {}, "not finite"),
        (RIG[0], RIG[1][:3], RIG[2], {}, "wrenches are"),
        (RIG[0], RIG[1] * np.nan, RIG[2], {}, "finite"),
        (RIG[0][0], RIG[1], RIG[2], {}, r"\(k, d, m\)"),
        (RIG[0], RIG[1], RIG[2], {"method": "nrom"}, "did you mean 'norm'"),
        (RIG[0], RIG[1], RIG[2], {"method": "p-norm", "power": 1.0}, "at least 2"),
        (np.ones((1, 2, 5)), RIG[1][:1], np.tile([1.0, 9.0], (5, 1)), {"method": "barycentre"}, "two redundant"),
    ],
)
def test_what_makes_no_sense_is_named(structure_, wrench, limits, more, word):
    with pytest.raises(ModelError, match=word):
        distribute(structure_, wrench, limits, **more)


@pytest.mark.parametrize(
    "wrong", [{"shape": np.full((2, 1), np.nan)}, {"shape": np.zeros((2, 0))}, {"taken": [[np.nan], [0.0]]}]
)
def test_a_disturbance_that_is_none_is_refused(wrong):
    with pytest.raises(ModelError, match="disturbance"):
        disturbance_margin(*RIG, **{"shape": np.eye(2), **wrong})


def test_no_pose_is_no_error():
    out = distribute(np.empty((0, 6, 8)), np.empty((0, 6)), np.tile([1.0, 9.0], (8, 1)))
    assert out.tension.shape == (0, 8) and out.missing().shape == (0, 6)

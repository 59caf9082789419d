"""What is computed in pieces, in one pass or only roughly is what the plain way gives."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import scipy
from arms.test_groups import LINKS, arm, grown, recorded
from unit.arm_data import arm as measured_arm
from unit.arm_data import measured
from unit.test_outliers import spoiled

from robocal.arms import chain as chains
from robocal.arms.gravity_load import Gravity, drive, link_end
from robocal.diagnose import gross
from robocal.diagnose.scatter import WhitenedRows, _ratio, _shorten
from robocal.diagnose.segments.robust_model import _inverse_root
from robocal.diagnose.segments.running_sums import RunningSums, SegmentScan
from robocal.estimate.priors._kernels import held_by
from robocal.estimate.terms import spread
from robocal.fit.noise import apply_noise, under
from robocal.fit.repeats import NEAR as PLACE
from robocal.fit.repeats import joined
from robocal.fit.soft_fit import EXACT, NEAR
from robocal.geometry.path.program import Element, Term, compile_path
from robocal.measure import reach as reaching
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet
from robocal.parameters import Parameter, ParameterTable
from robocal.prove import evidence
from robocal.prove.split import _cells


def test_columns_of_one_element_are_its_screw_times_each():
    """Many terms on one joint, some shared with another element, one joint that is driven plainly."""
    rng = np.random.default_rng(0)
    table = ParameterTable(tuple(Parameter(f"p.{i}", v) for i, v in enumerate(rng.normal(0, 0.3, 9))))
    many = tuple(Term(f"p.{i}", f"c{i}", 0.5 + i) for i in range(5))
    elements = (
        Element("rz", (Term("p.6", "c0"), Term("p.5"))), Element("tx", (Term("p.7"), Term("p.8", "c1"))),
        Element("ry", many), Element("screw", (Term("p.2", "c3"),), 0.1, (0.1, 0.2, -0.3, 0.6, 0.0, 0.8)),
        Element("ty", (Term("p.4"),)),
    )  # fmt: skip
    program = compile_path(elements, table)
    assert [program.columns[i] for i in program.turning[0]] == ["c0"]
    phi, theta = rng.normal(size=(1, 7, len(program.columns))), table.values[None]
    jac = program.run(theta, phi, program.entries(np.arange(9)), 9)[1][0]
    for i in range(9):
        step = np.zeros((1, 9))
        step[0, i] = 1e-6
        ahead, behind = (program.run(theta + s, phi)[0][0, :, :3, 3] for s in (step, -step))
        np.testing.assert_allclose(jac[:, :3, i], (ahead - behind) / 2e-6, atol=1e-8)


def test_rows_of_one_place_say_the_same_turned_and_as_few():
    """What blocks of whole places are asked for, with more rows at a place than columns, fewer, and of a smaller rank."""
    rng = np.random.default_rng(2)
    place = rng.permutation(np.repeat(np.arange(9), [30, 40, 3, 25, 60, 5, 18, 33, 21]))
    j, r = rng.normal(size=(len(place), 12)), rng.normal(size=len(place))
    j[place == 4] = j[place == 4][:, :3] @ rng.normal(size=(3, 12))
    h = np.linalg.inv(j.T @ j) * 0.9
    few = _shorten(j, r, place)
    counts = np.minimum(np.bincount(place), 12)
    counts[4] = 3
    np.testing.assert_array_equal(np.bincount(few[0]), counts)
    x, names, blocks = rng.normal(size=(6, 12)), tuple("abcdefghijkl"), np.array([0, 0, 1, 1, 2, 2, 2, 3, 3])
    told = []
    for at, jac, left in ((place, j, r), few):
        rows = WhitenedRows(names, np.zeros((9, 6)), at, jac, left, 1.3, 1.0)
        told.append(_ratio((rows, rows), [(jac @ h @ x.T, jac, h)] * 2, (blocks, blocks[::-1].copy())))
    np.testing.assert_allclose(told[0], told[1], rtol=1e-9)


@pytest.mark.parametrize("batch", [1, 3])
def test_normal_equations_of_any_width_are_the_products(batch):
    made = problem(measured_arm(), measured(60))
    rng = np.random.default_rng(1)
    weights = rng.uniform(0, 2, (batch, made.configurations)) * (rng.random((batch, made.configurations)) < 0.8)
    x = np.repeat(made.start, batch, axis=0)
    for many in range(1, len(made.free), 3):
        some = made.with_free(made.free[:many]).with_weights(weights)
        found = some.normal(x)
        for b in range(batch):
            line = some.with_weights(weights[b]).linearize(x[b])
            length = np.linalg.norm(line.j, axis=0)
            gap = (np.tril(found.a[b]) - np.tril(line.j.T @ line.j)) / np.outer(length, length)
            assert np.abs(gap).max() < 1e-14
            assert np.abs((found.g[b] - line.j.T @ line.r) / length).max() < 1e-14 * np.linalg.norm(line.r)


def test_two_columns_may_feed_one():
    narrow = np.random.default_rng(2).normal(size=(4, 3, 3))
    assert spread(narrow, np.arange(3), 3) is narrow
    twice = spread(narrow, np.array([1, 0, 1]), 4)
    np.testing.assert_array_equal(twice[..., 1], narrow[..., 0] + narrow[..., 2])
    np.testing.assert_array_equal(spread(narrow, np.array([3, 0, 1]), 4)[..., [3, 0, 1]], narrow)


@pytest.mark.parametrize("convention", ["dh", "poe"])
def test_poses_in_pieces_are_the_poses(convention, monkeypatch):
    rng = np.random.default_rng(3)
    model = grown(arm(convention, rng))
    q, extra = rng.normal(size=(23, 3)), recorded(model, 23, rng)
    names = model.table.names
    plain = (*model.run(q, extra, model.entries(names), len(names)), *reaching.reach(model, q, names, extra))
    monkeypatch.setattr(chains, "CHUNK", 5)
    monkeypatch.setattr(reaching, "CHUNK", 7)
    pieces = (*model.run(q, extra, model.entries(names), len(names)), *reaching.reach(model, q, names, extra))
    for a, b in zip(plain, pieces, strict=True):
        np.testing.assert_array_equal(a, b)


def test_moments_in_one_pass_are_the_sum_over_loads():
    rng = np.random.default_rng(4)
    model = arm("dh", rng)
    weight = Gravity(model, model.joint_names, LINKS, (0.3, -0.2, -9.7))
    q = rng.normal(size=(6, 3))
    found, order = weight.columns(q, {}), [*model.joint_names, ""]

    def behind(count):
        return chains.replace(model, elements=model.elements[:count]).pose(q)

    for joint in model.joint_names:
        at = behind(drive(model, joint) + 1)
        moment = np.zeros((6, 3))
        for load in LINKS:
            if order.index(load.link) >= order.index(joint):
                end = behind(link_end(model, load.link) if load.link else len(model.elements))
                place = end[:, :3, :3] @ np.array(load.at) + end[:, :3, 3]
                moment += np.cross(place - at[:, :3, 3], load.mass * np.array(weight.acceleration))
        square = sum(found[f"gravity.{joint}{end}"] ** 2 for end in ("", ".u", ".v"))
        np.testing.assert_allclose(square, np.sum(moment**2, axis=1), rtol=1e-10, atol=1e-10)


def test_draws_in_pieces_are_the_draws(monkeypatch):
    rng = np.random.default_rng(5)
    for units in (np.arange(40), rng.integers(0, 30, 40)):
        before, after = rng.random(40), rng.random(40)
        plain = evidence.bootstrap_gain(before, after, units, 7)
        monkeypatch.setattr(evidence, "AT_ONCE", 100)
        assert evidence.bootstrap_gain(before, after, units, 7) == plain
        monkeypatch.undo()


def test_places_are_those_of_all_pairs():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        q = rng.integers(0, 5, (60, 3)) * rng.choice([PLACE, 0.3]) + rng.normal(0, PLACE / 4, (60, 3))
        near = (np.abs(q[:, None] - q[None]) <= PLACE).all(axis=-1)
        label = scipy.sparse.csgraph.connected_components(near, directed=False)[1]
        np.testing.assert_array_equal(joined(Configurations(tuple(map(str, range(60))), q), PLACE), label)


def test_cells_are_halved_from_the_largest():
    rng = np.random.default_rng(6)
    where = Configurations(tuple(map(str, range(97))), rng.normal(size=(97, 2)))
    cells, _ = _cells(where, rng, 11, 0)
    sizes = [len(c) for c in cells]
    assert sorted(np.concatenate(cells)) == list(range(97)) and max(sizes) <= 2 * min(sizes) + 1


def test_another_sigma_is_the_problem_made_again():
    data = measured(30)
    tau = {(data.observations[0].label, "m"): 3e-4}
    again, same = problem(measured_arm(), apply_noise(data, tau)), under(problem(measured_arm(), data), data, tau)
    x = again.start
    np.testing.assert_array_equal(again.normal(x).a, same.normal(x).a)


def test_a_rough_fit_finds_the_same_gross_rows(monkeypatch):
    """Asked is which rows are far, and a fit that creeps on along a valley says the same."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        off = {int(i): rng.normal(0, 1, 3) * 10 ** rng.uniform(-3.5, -1) for i in rng.choice(60, 6, replace=False)}
        data, units = spoiled(measured(60), off), np.arange(60)
        found = []
        for tolerance in (NEAR, EXACT):
            monkeypatch.setattr(gross, "NEAR", tolerance)
            found.append(gross.sift(measured_arm(), data, units).data)
        rough, exact = found
        for a, b in zip(rough.observations, exact.observations, strict=True):
            assert (a.used is None) == (b.used is None) and np.array_equal(a.used, b.used)


def test_the_map_picks_by_joints_and_geometry_what_the_whole_model_would(rng):
    """What bends and ripples is millimetres: without it the tool is there all the same, and an arm that has none is exactly there."""
    plain, q = measured_arm(), rng.uniform(-2, 2, (50, 5))
    np.testing.assert_allclose(reaching.places_by_joints(plain, q), reaching.reach(plain, q)[0][:, :3, 3], atol=1e-12)
    bare = arm("mdh-hayati", rng)
    bent, q = grown(bare), rng.uniform(-1, 1, (50, 3))
    assert bent.derived
    np.testing.assert_allclose(reaching.places_by_joints(bent, q), bare.pose(q)[:, :3, 3], atol=1e-12)


def test_the_same_rows_are_one_problem_and_no_others():
    """What was worked out of a problem is kept for as long as nothing of it is another: a row, a sigma, the machine."""
    data, machine = measured(30), measured_arm()
    first = problem(machine, data)
    assert problem(machine, DataSet(data.configurations, tuple(replace(o) for o in data.observations))) is first
    (obs,) = data.observations
    moved = replace(data, observations=(replace(obs, value=obs.value + 1e-3),))
    for other in (
        problem(machine, moved),
        problem(machine, data, free=machine.table.free[:3]),
        problem(measured_arm(), data),
    ):
        assert other is not first
    away = problem(machine, moved).residuals(first.start)[0].value - first.residuals(first.start)[0].value
    np.testing.assert_allclose(away, -1e-3, atol=1e-12)


def test_what_priors_hold_is_the_trace(rng):
    """Cholesky in place against the formula, with a prior of its own and with one that several share; none where it is open."""
    j, root = rng.normal(size=(40, 7)), np.diag(rng.uniform(0.5, 2.0, 7))
    root[2:4, 2:5] = rng.normal(size=(2, 3))
    a = j.T @ j + root.T @ root
    trace, least = held_by(np.tril(a), root)
    np.testing.assert_allclose(trace, np.trace(np.linalg.solve(a, root.T @ root)), rtol=1e-12)
    assert 0 < least < 1 and held_by(np.tril(np.ones((3, 3))), np.eye(3))[1] <= 1e-12


@pytest.mark.parametrize("k", [60, 400])  # rows that are summed at once, and in blocks
def test_no_pair_of_ends_near_by_gains_more(rng, k):
    """The search by the products of ends, and what is found by each segment alone."""
    left = rng.normal(size=(k, 3))
    left[k // 3 : 2 * k // 3] += 1.0
    model = [rng.normal(size=(k, 3, 5)), rng.normal(size=(k, 3, 4))]
    rows = rng.normal(size=(k, 3, 2)) + 1, left, rng.uniform(0.5, 1, (k, 3)), model, 0.05 * rng.normal(size=(9, 11))
    scan = SegmentScan(*rows)

    def gain(a, b):
        enough = min(b - a, k - b + a) >= scan.fewest
        return RunningSums.at((0, a, b, k), *rows).gain(1, 2)[0] if enough else 0.0

    first, last = scan.find()
    best = gain(first, last) * (1 + 1e-9)
    near = range(-scan.near, scan.near + 1)
    assert all(gain(first + i, last) <= best for i in near if 0 <= first + i < last)
    assert all(gain(first, last + i) <= best for i in near if first < last + i <= k)
    assert all(gain(a, b) <= best for a, b in combinations(scan.marks.tolist()[:: k // 60], 2))


def test_an_open_direction_is_left_out(rng):
    """A root of an information with W W^T its inverse, by halves where it is large."""
    large = rng.normal(size=(200, 101))
    w = _inverse_root(large.T @ large)
    np.testing.assert_allclose(w @ w.T, np.linalg.inv(large.T @ large), atol=1e-9)
    j = rng.normal(size=(20, 5))
    for rows, rank in ((j, 5), (j @ np.diag([1.0, 1, 1, 1, 0]), 4)):
        w = _inverse_root(rows.T @ rows)
        assert w.shape == (5, rank)
        np.testing.assert_allclose(w @ w.T, np.linalg.pinv(rows.T @ rows), atol=1e-9)

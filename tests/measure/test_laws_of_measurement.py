"""The laws of every measurement: its Jacobian is the derivative of its residual, and `normal` is `linearize`
squared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms.arm_samples import NAMES
from arms.arm_samples import arm as sample_arm
from laws import check_jacobian, numeric_jacobian
from measure.scenarios import SCENARIOS, build, made, observations

from robocal.estimate import problem as problem_module
from robocal.estimate.least_squares import least_squares
from robocal.estimate.losses import TUNING
from robocal.geometry import so3
from robocal.measure import pixels as pixels_module
from robocal.measure.base import KINDS

CONVENTIONS = [(c, k) for c in NAMES for k in ("position", "pose")]


def columns(p):
    """How many columns all free parameters and local blocks have."""
    return p.n + sum(f.count * f.size for f in p.families)


def split(p, step):
    """The step (1, n) of the free columns, and of the blocks of every family, (1, L, l)."""
    out, first = [step[None, : p.n]], p.n
    for f in p.families:
        out.append(step[None, first : first + f.count * f.size].reshape(1, f.count, f.size))
        first += f.count * f.size
    return out


def dense(p, lin):
    """J (N, n + L l + M q), the local columns in their places."""
    out = np.zeros((len(lin.r), columns(p)))
    out[:, : p.n] = lin.j
    if p.families:
        size = p.families[0].size
        for b in range(p.families[0].count):
            rows = lin.local == b
            at = p.n + b * size
            out[rows, at : at + size] = lin.jl[rows]
        out[:, columns(p) - lin.jm.shape[1] :] = lin.jm
    return out


def check(p, scale=1.0):
    # A strain per newton is a small number: its column is compared per millionth.
    unit = np.ones(columns(p))
    unit[: len(p.free)] = [1e-6 if p.table[n].unit == "1/N" else 1.0 for n in p.free]

    def residual(step):
        return p.linearize(p.retract(p.start, *split(p, unit * step))).r

    def jacobian(step):
        return scale * unit * dense(p, p.linearize(p.retract(p.start, *split(p, unit * step))))

    check_jacobian(residual, jacobian, np.zeros(columns(p)), tolerance=1e-7)


def test_every_kind_has_a_scenario():
    assert {name.partition("/")[0] for name in SCENARIOS} - {"mixed"} == {
        k for k, kind in KINDS.items() if kind.terms.__module__.startswith("robocal.")
    }  # other tests register kinds of their own


@pytest.mark.parametrize("name", SCENARIOS)
def test_jacobian_is_the_derivative(name):
    check(build(name))


@pytest.mark.parametrize(("convention", "kind"), CONVENTIONS)
def test_jacobian_for_every_convention(convention, kind):
    rng = np.random.default_rng(3)
    check(made(sample_arm(convention, "RRPR", rng), [observations(kind, 3, 1e-3)], rng, 3, free=None))


@pytest.mark.parametrize("name", ["pose/arm, instrument in hand", "lengths/free poses"])
def test_a_wrong_jacobian_fails(name):
    with pytest.raises(AssertionError, match="jacobian is wrong"):
        check(build(name), scale=1 + 1e-5)


def rho(loss, c, s):
    """The textbook's rho(s) and rho'(s) of a squared norm s, independent of the kernel."""
    root = np.sqrt(s)
    if loss == "huber":
        return np.where(root <= c, s, 2 * c * root - c**2), np.where(root <= c, 1.0, c / np.maximum(root, 1e-300))
    if loss == "cauchy":
        return c**2 * np.log(1 + s / c**2), 1 / (1 + s / c**2)
    if loss == "tukey":
        inside = np.maximum(1 - s / c**2, 0)
        return c**2 / 3 * (1 - inside**3), inside**2
    return s, np.ones_like(s)


def expected_normal(p, x):
    """Cost, gradient and matrix from the dense linearisation, with weights, loss and priors put in by hand."""
    plain = p.with_weights(None).linearize(x)
    weight = np.ones(p.configurations) if p.weights is None else p.weights[0]
    s = np.bincount(plain.observation, plain.r**2)
    value, slope = rho(p.loss, p.tuning or TUNING[p.loss], s)
    # What is no reading of the machine (a known distance between two frames) is weighed down by no loss.
    reading = plain.reading[np.unique(plain.observation, return_index=True)[1]]
    value, slope = np.where(reading, value, s), np.where(reading, slope, 1.0)
    configuration = plain.configuration[np.unique(plain.observation, return_index=True)[1]]
    row = (weight[configuration] * slope)[plain.observation]
    j = dense(p, plain)
    cost = 0.5 * np.sum(weight[configuration] * value)
    g, a = j.T @ (row * plain.r), j.T @ (row[:, None] * j)
    if p.priors and any(p.table[name].prior for name in p.free):
        sigma = [p.table[name].prior for name in p.free]
        info = np.array([0.0 if s is None else s**-2 for s in sigma] + [0.0] * (len(g) - p.n))
        d = np.array([tangent(p, x, i) for i in range(p.n)] + [0.0] * (len(g) - p.n))
        slope = np.eye(len(g))
        slope[: p.n, : p.n] = numeric_jacobian(lambda e: steps_to(p, x, e), np.zeros(p.n))
        cost += 0.5 * np.sum(info * d**2)
        g, a = g + slope.T @ (info * d), a + slope.T @ (info[:, None] * slope)
    return cost, g, a


def steps_to(p, x, e):
    moved = p.retract(x, e[None])
    return np.array([tangent(p, moved, i) for i in range(p.n)])


def tangent(p, x, i):
    """Component i of the step from the table's value to x."""
    at = p.table.index[p.free[i]]
    if not p.table.rows[at].turn:
        return x[0, at] - p.table.values[at]
    first = max(t for t in p.table.turns if t <= at)
    w = so3.log(so3.exp(x[0, first : first + 3]) @ so3.exp(p.table.values[first : first + 3]).T)
    return w[at - first]


def compare(p, x, tolerance=1e-12):
    n, got = p.n, p.normal(x)
    cost, g, a = expected_normal(p, x)
    size = np.abs(a).max()
    np.testing.assert_allclose(got.cost[0], cost, rtol=1e-11)
    np.testing.assert_allclose(
        np.concatenate([got.g[0], got.gl[0].ravel(), got.gm[0].ravel()]), g, rtol=1e-8, atol=1e-11 * np.abs(g).max()
    )
    np.testing.assert_allclose(np.tril(got.a[0]), np.tril(a[:n, :n]), atol=tolerance * size)
    assert not np.triu(got.a[0], 1).any()
    first, places = n, []
    for i, f in enumerate(p.families):
        places.append([slice(first + f.size * b, first + f.size * (b + 1)) for b in range(f.count)])
        for b, at in enumerate(places[-1]):
            np.testing.assert_allclose(got.of_family(i)[1][0, b], a[at, at], atol=tolerance * size)
            np.testing.assert_allclose(got.of_family(i)[2][0, b], a[:n, at], atol=tolerance * size)
        first += f.size * f.count
    if len(p.families) > 1:
        between = np.zeros((columns(p), columns(p)))
        for (one, two), cross in zip(p.pairs, got.cross[0], strict=True):
            between[places[0][one], places[1][two]] += cross
        ends = places[0][-1].stop
        np.testing.assert_allclose(between[n:ends, ends:], a[n:ends, ends:], atol=tolerance * size)


FIELDS = ("cost", "g", "a", "gl", "al", "asl", "gm", "am", "asm", "cross")


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("loss", ["none", "huber", "cauchy", "tukey"])
def test_normal_is_linearize_squared(name, loss):
    p = build(name)
    x = p.start
    # A tuning amid the residuals, so that some rows lie on either side of it.
    lin = p.linearize(x)
    c = 1.1 * float(np.sqrt(np.median(np.bincount(lin.observation, lin.r**2))))
    compare(p.with_loss(loss, c if loss != "none" else None), x)
    weights = np.linspace(0, 2, p.configurations)
    compare(p.with_loss(loss, c if loss != "none" else None).with_weights(weights), x)


def curvature(loss, c, s):
    """2 s rho'' / rho', the textbook's."""
    u = s / c**2
    if loss == "huber":
        return np.where(u <= 1, 0.0, -1.0)
    if loss == "cauchy":
        return -2 * u / (1 + u)
    return np.where(u < 1, -4 * u / np.where(u < 1, 1 - u, 1.0), -np.inf)


@pytest.mark.parametrize(
    "name", [n for n in SCENARIOS if n.startswith(("position/arm", "pose/free", "pixels", "lengths", "mixed"))]
)
@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_the_curvature_of_a_loss_bends_the_matrix_and_nothing_else(name, loss):
    p = build(name)
    lin = p.linearize(p.start)
    square = np.bincount(lin.observation, lin.r**2)
    c = 1.1 * float(np.sqrt(np.median(square)))
    robust = p.with_loss(loss, c)
    plain, bent = robust.normal(p.start), robust.normal(p.start, curved=np.ones(1, dtype=bool))
    for field in ("cost", "g", "gl", "gm"):
        np.testing.assert_allclose(getattr(bent, field), getattr(plain, field), rtol=1e-10, atol=1e-10)
    _, slope = rho(loss, c, square)
    reading = lin.reading[np.unique(lin.observation, return_index=True)[1]]
    less = np.where(reading, np.minimum(-np.maximum(curvature(loss, c, square), -1.0), 1.0), 0.0)
    j, expected = dense(p, lin), dense_matrix(p, plain)
    for i in np.flatnonzero((less > 0) & (slope > 0) & reading):
        rows = lin.observation == i
        q = j[rows].T @ lin.r[rows]
        expected -= slope[i] * less[i] / square[i] * np.outer(q, q)
    np.testing.assert_allclose(dense_matrix(p, bent), expected, atol=1e-10 * np.abs(expected).max())


def dense_matrix(p, normal):
    """The Gauss-Newton matrix of all columns."""
    out, first = np.zeros((columns(p), columns(p))), p.n
    out[: p.n, : p.n] = normal.a[0]
    places = []
    for i, f in enumerate(p.families):
        places.append([slice(first + f.size * b, first + f.size * (b + 1)) for b in range(f.count)])
        for b, at in enumerate(places[-1]):
            out[at, at], out[at, : p.n] = normal.of_family(i)[1][0, b], normal.of_family(i)[2][0, b].T
        first += f.size * f.count
    for (one, two), cross in zip(p.pairs, normal.cross[0], strict=True):
        out[places[1][two], places[0][one]] += cross.T
    return np.tril(out) + np.tril(out, -1).T


def test_default_tunings_are_used():
    p = build("position/arm alone")
    for loss in ("huber", "cauchy", "tukey"):
        compare(p.with_loss(loss), p.start)


@pytest.mark.parametrize(
    "name", ["position/arm, instrument on the base", "pose/arm, targets eliminated", "lengths/free poses"]
)
def test_priors_pull_in_the_tangent(name):
    p = build(name)
    table = p.table.with_priors({n: 0.01 * (i + 1) for i, n in enumerate(p.free) if i % 2 == 0})
    rng = np.random.default_rng(2)
    p = p.with_table(table)
    near = p.retract(p.start, rng.normal(scale=1e-2, size=(1, p.n)))
    compare(p, near, 1e-8)
    silent = replace(p, priors=False)
    compare(silent, near)
    assert silent.normal(near).cost[0] < p.normal(near).cost[0]


@pytest.mark.parametrize("name", SCENARIOS)
def test_chunks_do_not_matter(name, monkeypatch):
    p = build(name).with_loss("huber")
    x = p.retract(np.repeat(p.start, 3, axis=0), np.random.default_rng(0).normal(scale=1e-2, size=(3, p.n)))
    whole = p.normal(x)
    for chunk in (1, 40, 400):
        monkeypatch.setattr(problem_module, "CHUNK", chunk)
        monkeypatch.setattr(pixels_module, "CHUNK", chunk)
        parts = p.normal(x)
        for field in FIELDS:
            want = getattr(whole, field)
            np.testing.assert_allclose(
                getattr(parts, field), want, atol=1e-12 * np.abs(want).max(initial=1), err_msg=f"{field}, {chunk}"
            )


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_batch_is_its_singles(name):
    p = build(name)
    rng = np.random.default_rng(0)
    local = [rng.normal(scale=1e-2, size=(4, f.count, f.size)) for f in p.families]
    x = p.retract(np.repeat(p.start, 4, axis=0), rng.normal(scale=1e-2, size=(4, p.n)), *local)
    batch = p.with_weights(rng.uniform(size=(4, p.configurations)))
    together = batch.normal(x)
    for b in range(4):
        alone = batch.normal(x[[b]], np.array([b]))
        for field in FIELDS:
            want = getattr(alone, field)[0]
            np.testing.assert_allclose(
                getattr(together, field)[b], want, atol=1e-12 * np.abs(want).max(initial=1), err_msg=field
            )
        single = p.with_weights(batch.weights[b]).normal(x[[b]])
        np.testing.assert_allclose(single.cost[0], together.cost[b], rtol=1e-12)
    several = p.residuals(x)
    for r, one in zip(several, p.residuals(x[2]), strict=True):
        np.testing.assert_allclose(r.value[2], one.value, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("name", SCENARIOS)
def test_problems_that_differ_in_their_weights_alone_are_their_singles(name):
    """Each without one configuration, and one with half of another: of some kinds by what each lacks of all."""
    p = build(name)
    x, weight = np.repeat(p.start, 6, axis=0), np.ones((6, p.configurations))
    weight[np.arange(5), np.arange(5) % p.configurations] = 0
    weight[5, 0] = 0.5
    batch = p.with_weights(weight)
    together = batch.normal(x)
    for b in range(6):
        alone = batch.normal(x[[b]], np.array([b]))
        for field in FIELDS:
            want = getattr(alone, field)[0]
            np.testing.assert_allclose(
                getattr(together, field)[b], want, atol=1e-11 * np.abs(want).max(initial=1), err_msg=field
            )


@pytest.mark.parametrize("name", SCENARIOS)
def test_linearize_takes_configurations_and_weights(name):
    p = build(name)
    everything, one = p.linearize(p.start), p.linearize(p.start, np.array([1]))
    rows = everything.configuration == 1
    np.testing.assert_array_equal(one.r, everything.r[rows])
    np.testing.assert_array_equal(one.j, everything.j[rows])
    weights = np.ones(p.configurations)
    weights[1] = 0
    np.testing.assert_array_equal(p.with_weights(weights).linearize(p.start).r, everything.r[~rows])
    heavy = p.with_weights(4 * np.ones(p.configurations)).linearize(p.start)
    np.testing.assert_allclose(heavy.r, 2 * everything.r, rtol=1e-14)
    np.testing.assert_allclose(heavy.j, 2 * everything.j, rtol=1e-14)


def test_an_uneven_prior_on_a_turn_is_minimised(rng):
    """One axis held a hundred times tighter than the others, far from the start: the gradient is that of the cost."""
    p = build("pose/arm, instrument on the base")
    names = [f"tracker.{s}" for s in ("rx", "ry", "rz")]
    p = (
        p.with_free(names)
        .with_table(p.table.with_priors(dict(zip(names, (1e-3, 0.1, 0.3), strict=True))))
        .with_weights(1e-4 * np.ones(p.configurations))
    )
    x = p.retract(p.start, np.array([[0.4, -0.3, 0.5]]))

    def cost(step):
        return p.normal(p.retract(x, step[None])).cost

    check_jacobian(cost, lambda step: p.normal(p.retract(x, step[None])).g, np.zeros(3), tolerance=1e-7)
    s = least_squares(p, x, cost_tolerance=1e-18)
    assert s.reasons[0].converged
    around = p.retract(np.repeat(s.x, 60, axis=0), rng.normal(scale=1e-4, size=(60, 3)))
    assert (p.normal(around).cost >= s.cost).all()

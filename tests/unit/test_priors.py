"""Priors: of several parameters together, of local blocks, in the decision what is kept, and against dense formulas."""

from __future__ import annotations

import numpy as np
import pytest
from laws import check_jacobian
from measure.scenarios import HAND, TAGS, TRACKER, arm, made, observations, platform
from unit.plain_terms import Plain, linear, plain_problem

from robocal.errors import ModelError
from robocal.estimate.elimination import beside_blocks, block_columns, eliminate
from robocal.estimate.identifiability import analyse
from robocal.estimate.kalman import kalman
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import effective_columns, total, uncertainty
from robocal.parameters import TYPICAL, WIDE, Parameter, ParameterTable


def covariance(rng, n, size=1.0):
    a = rng.normal(size=(n, n))
    return size**2 * (a @ a.T + 0.1 * np.eye(n))


def together(p, names, c):
    return p.with_table(p.table.with_covariance(names, c))


# --- in the table -----------------------------------------------------------------------------------------------------------


def test_a_covariance_says_each_ones_own_prior_and_the_last_word_counts(rng):
    table = ParameterTable(tuple(Parameter(n, free=True) for n in ("a", "b", "c", "d")))
    c = covariance(rng, 3)
    said = table.with_covariance(("c", "a", "b"), c)
    assert [said[n].prior for n in "cab"] == pytest.approx(list(np.sqrt(np.diag(c)))) and said["d"].prior is None
    np.testing.assert_allclose(said.together[0].of(("a", "c")), c[np.ix_([1, 0], [1, 0])])
    # Another word about b alone leaves what is known of the others; about two, nothing is shared any more.
    one = said.with_priors({"b": 0.5})
    assert one.together[0].names == ("c", "a") and one["b"].prior == 0.5
    np.testing.assert_allclose(one.together[0].of(("c", "a")), c[:2, :2])
    assert one.with_priors({"a": None}).together == () and one.with_priors({"a": None})["c"].prior == one["c"].prior
    # It stays through every other change.
    for other in (
        said.with_values({"a": 1.0}),
        said.with_free(["a"]),
        said.with_preferences({"a": 1}),
        said + [Parameter("e")],
    ):
        assert other.together == said.together


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        ([[1.0, 2.0], [2.0, 1.0]], "positive definite"),
        ([[1.0, 1.0], [1.0, 1.0]], "positive definite"),
        ([[1.0, 0.5], [0.1, 1.0]], "symmetric"),
        ([[1.0, np.nan], [0.0, 1.0]], "finite"),
        ([[1.0, 0.0], [0.0, -1.0]], "above zero"),
        ([[1.0, 0.0], [0.0, 0.0]], "above zero"),
        (np.eye(3), "another size"),
        ([1.0, 1.0], "another size"),
    ],
)
def test_what_is_no_covariance_is_refused(matrix, words):
    table = ParameterTable((Parameter("a"), Parameter("b")))
    with pytest.raises(ModelError, match=words) as e:
        table.with_covariance(("a", "b"), matrix)
    assert e.value.key == "a, b"


def test_names_of_a_covariance_are_known_and_different():
    table = ParameterTable((Parameter("length"), Parameter("b")))
    with pytest.raises(ModelError, match="did you mean 'length'"):
        table.with_covariance(("lenght", "b"), np.eye(2))
    with pytest.raises(ModelError, match="twice"):
        table.with_covariance(("b", "b"), np.eye(2))


def test_units_of_different_size_make_no_covariance_indefinite(rng):
    """Pixels beside coefficients of 1e-9: what counts is the correlation."""
    scale = np.array([1e4, 1e-9, 1.0])
    c = covariance(rng, 3) * np.outer(scale, scale)
    assert ParameterTable(tuple(Parameter(n) for n in "abc")).with_covariance("abc", c)["b"].prior == pytest.approx(
        np.sqrt(c[1, 1])
    )


# --- in the estimate --------------------------------------------------------------------------------------------------------


def test_a_shared_prior_is_the_dense_estimate(rng):
    """Mean, covariance, chi2, degrees of freedom and the filter against the formulas; b2 is held, so it says nothing."""
    a, y, c = rng.normal(size=(9, 5)), rng.normal(size=9), covariance(rng, 4, 0.3)
    p = plain_problem(
        linear(a, y, sigma=0.5, configuration=np.repeat(np.arange(3), 3)), rng.normal(size=5), prior=[None] * 4 + [0.3]
    )
    p = together(p, ("b3", "b1", "b2", "b4"), c).with_free(("b1", "b3", "b4", "b5"))
    at, mean = [0, 2, 3, 4], p.table.values
    info = np.zeros((4, 4))
    order = [1, 0, 3]  # b1, b3, b4 in c
    info[:3, :3] = np.linalg.inv(c[np.ix_(order, order)])
    info[3, 3] = 1 / 0.09
    j, r = a[:, at] / 0.5, (a @ mean - y) / 0.5
    step = -np.linalg.solve(j.T @ j + info, j.T @ r)
    s = least_squares(p, cost_tolerance=1e-20)
    np.testing.assert_allclose(s.x[0, at], mean[at] + step, atol=1e-9)
    u = uncertainty(p, s.x)
    np.testing.assert_allclose(u.covariance, np.linalg.inv(j.T @ j + info), atol=1e-12)
    assert u.chi2 == pytest.approx(np.sum((r + j @ step) ** 2) + step @ info @ step) and u.dof == 9
    assert s.cost[0] == pytest.approx(u.chi2 / 2)
    assert effective_columns(p, s.x) == pytest.approx(np.trace(np.linalg.solve(j.T @ j + info, j.T @ j)))
    f = kalman(p)
    np.testing.assert_allclose(f.x, s.x, atol=1e-9)
    np.testing.assert_allclose(f.covariance, u.covariance, atol=1e-12)
    # What the truth contributes is drawn from the same prior: in all it is the posterior.
    np.testing.assert_allclose(total(p, p.free, s.x).covariance, u.covariance, atol=1e-10)
    np.testing.assert_allclose(analyse(p, s.x[0]).posterior, u.covariance, atol=1e-10)


def test_without_priors_a_shared_one_is_off(rng):
    from dataclasses import replace

    p = together(plain_problem(linear(np.eye(2), np.ones(2)), np.zeros(2)), ("b1", "b2"), covariance(rng, 2))
    off = replace(p, priors=False)
    np.testing.assert_allclose(least_squares(off).x, 1.0, atol=1e-9)
    assert not off.has_prior.any() and not off.prior_root.any() and off.scales == pytest.approx([TYPICAL["1"]] * 2)


@pytest.mark.parametrize("free", [None, ["hand.x", "hand.rx", "hand.rz", "tag0.z"]])
def test_the_gradient_of_a_shared_prior_is_right_far_from_its_mean(rng, free):
    """Rotation vectors that share a prior with lengths, half a radian off: cost, gradient and matrix against differences."""
    p = made(arm(), [observations("pose", 3, 1e-3, HAND, TAGS)], rng, 3, free=free or [f"hand.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")])  # fmt: skip
    p = together(p, p.free, covariance(rng, p.n, 0.2)).with_weights(np.zeros((1, p.configurations)))
    x = p.retract(p.start, 0.5 * rng.normal(size=(1, p.n)))

    def moved(d):
        return p.retract(x, d[None])

    if free is None:  # a rotation that is free in part has no exact tangent
        check_jacobian(lambda d: p.normal(moved(d)).cost, lambda d: p.normal(moved(d)).g, np.zeros(p.n))
    full = p.normal(x)
    matrix = full.a[0] + np.tril(full.a[0], -1).T
    assert np.linalg.eigvalsh(matrix).min() > 0
    assert least_squares(p, x).cost[0] < 1e-12


# --- local blocks -----------------------------------------------------------------------------------------------------------


def with_blocks(rng, ranks=(3, 3, 3, 3), each=5):
    """Blocks of three numbers with rows of two groups' worth, and rows without a block."""
    count, size = len(ranks), 3
    m = count * each + 4
    local = np.concatenate([np.repeat(np.arange(count), each), [-1] * 4])
    block = np.zeros((m, 1, size))
    for b, rank in enumerate(ranks):
        block[local == b, 0] = rng.normal(size=(each, rank)) @ rng.normal(size=(rank, size))
    a, y = rng.normal(size=(m, 1, 2)), rng.normal(size=(m, 1))
    unit = np.maximum(local, 0)
    term = Plain(lambda x: a @ x - y, lambda x: a, (m, 1), local=local, block=block, configuration=unit)
    p = plain_problem(
        term, np.zeros(2), blocks=count, block_size=size, prior=[0.7, 0.4], local_start=rng.normal(size=3 * count)
    )
    dense = np.zeros((m, 2 + size * count))
    dense[:, :2] = a[:, 0]
    for i in np.flatnonzero(local >= 0):
        dense[i, 2 + size * local[i] :][:size] = block[i, 0]
    return p, dense, y[:, 0]


@pytest.mark.parametrize("ranks", [(3, 3, 3, 3), (3, 1, 2, 0)])
def test_priors_of_local_blocks_are_the_dense_estimate(rng, ranks):
    p, dense, y = with_blocks(rng, ranks)
    c = np.array([covariance(rng, 3) for _ in ranks])
    q = p.with_local_prior(covariance=c)
    info = np.diag([1 / 0.49, 1 / 0.16] + [0.0] * 12)
    for b, own in enumerate(c):
        info[2 + 3 * b : 5 + 3 * b, 2 + 3 * b : 5 + 3 * b] = np.linalg.inv(own)
    mean = q.start[0]
    whole = dense.T @ dense + info
    x = mean - np.linalg.solve(whole, dense.T @ (dense @ mean - y))
    s = least_squares(q, cost_tolerance=1e-20)
    np.testing.assert_allclose(s.x[0], x, atol=1e-8)
    u, inverse = uncertainty(q, s.x), np.linalg.inv(whole)
    np.testing.assert_allclose(u.covariance, inverse[:2, :2], atol=1e-10)
    assert u.chi2 == pytest.approx(np.sum((dense @ x - y) ** 2) + (x - mean) @ info @ (x - mean)) and u.dof == len(y)
    assert s.cost[0] == pytest.approx(u.chi2 / 2)
    # The rows pay what the data, not the priors, say of a block.
    lin = q.linearize(s.x)
    local = np.linalg.inv((dense.T @ dense + info)[2:, 2:])
    np.testing.assert_allclose(
        beside_blocks(lin)[0], np.einsum("ij,jk,ik->i", dense[:, 2:], local, dense[:, 2:]), atol=1e-10
    )
    reduced = eliminate(lin)
    np.testing.assert_allclose(reduced.T @ reduced + info[:2, :2], np.linalg.inv(inverse[:2, :2]), atol=1e-9)
    f = kalman(q)
    np.testing.assert_allclose(f.x[0, :2], x[:2], atol=1e-8)
    np.testing.assert_allclose(f.covariance, inverse[:2, :2], atol=1e-10)


@pytest.mark.parametrize("ranks", [(3, 3, 3, 3), (3, 1, 2, 0)])
def test_leverage_without_priors_is_the_rank(rng, ranks):
    p, dense, _ = with_blocks(rng, ranks)
    lin = p.linearize(p.start)
    taken = beside_blocks(lin)[0]
    assert taken.sum() == pytest.approx(sum(ranks)) == block_columns(lin) and not taken[lin.local < 0].any()
    hat = dense[:, 2:] @ np.linalg.pinv(dense[:, 2:], rcond=1e-10)
    np.testing.assert_allclose(taken, np.diag(hat), atol=1e-9)


def test_vague_and_infinite_priors_of_blocks_are_none_and_tight_ones_hold(rng):
    p, _, _ = with_blocks(rng)
    free, vague = least_squares(p).x, least_squares(p.with_local_prior(sigma=[1e6, np.inf, 1e6])).x
    np.testing.assert_allclose(vague, free, atol=1e-6)
    assert uncertainty(p, free).dof == uncertainty(p.with_local_prior(sigma=[np.inf] * 3), free).dof
    held = least_squares(p.with_local_prior(sigma=np.full((4, 3), 1e-9))).x
    np.testing.assert_allclose(held[0, 2:], p.families[0].start.ravel(), atol=1e-6)
    assert p.with_local_prior(sigma=[1.0] * 3).with_local_prior().families[0].prior is None


@pytest.mark.parametrize(
    ("prior", "words"),
    [
        ({"sigma": [1.0, 1.0]}, "another shape"),
        ({"sigma": [1.0, 0.0, 1.0]}, "above zero"),
        ({"covariance": np.ones((3, 3))}, "positive definite"),
        ({"covariance": np.eye(2)}, "another shape"),
        ({"covariance": np.zeros((4, 3, 3))}, "above zero"),
    ],
)
def test_what_is_no_prior_of_blocks_is_refused(rng, prior, words):
    with pytest.raises(ModelError, match=words) as e:
        with_blocks(rng)[0].with_local_prior(**prior)
    assert e.value.key == "prior of local blocks"


@pytest.mark.parametrize("kind", ["position", "pose"])
def test_the_gradient_of_a_local_prior_is_right_far_from_its_mean(rng, kind):
    """Free poses, each with its own covariance over shifts and turns, half a radian off."""
    p = made(platform(), [observations(kind, 3, 1e-3, TRACKER)], rng, 3, free=[])
    size = p.families[0].size
    p = p.with_local_prior(covariance=[covariance(rng, size, 0.2) for _ in range(p.blocks)])
    p = p.with_weights(np.zeros((1, p.configurations)))
    far = p.retract(p.start, np.zeros((1, 0)), 0.4 * rng.normal(size=(1, p.blocks, size)))

    def moved(d):
        return p.retract(far, np.zeros((1, 0)), d.reshape(1, p.blocks, size))

    zero = np.zeros(p.blocks * size)
    check_jacobian(lambda d: p.normal(moved(d)).cost, lambda d: p.normal(moved(d)).gl.reshape(1, -1), zero)
    whole = p.families[0].prior.rows(p.values_of(0, far))
    np.testing.assert_allclose(p.normal(far).al, np.swapaxes(whole[1], -1, -2) @ whole[1], atol=1e-9)
    np.testing.assert_allclose(p.linearize(far).hold, whole[1][0])
    assert least_squares(p, far).cost[0] < 1e-12


# --- in the decision --------------------------------------------------------------------------------------------------------


def hidden(rng, **more):
    """The data see b1 + b2 + b3 and b2 - b3 well, and nothing else: one of the three is dropped."""
    u, v = np.linalg.qr(rng.normal(size=(40, 2)))[0].T
    a = 1e5 * np.column_stack([u, u + v, u - v])
    return plain_problem(linear(a, np.zeros(40)), np.zeros(3), expected=[1e-2] * 3, **more)


def test_what_a_shared_prior_knows_together_keeps_what_hides_behind_it(rng):
    """b2 + b3 is known, each of them not: so b1 is seen, and nothing is dropped that the three know together."""
    p = hidden(rng)
    assert len(analyse(p, np.zeros(3)).dropped) == 1
    c = 1e-6 * np.array([[1.0, -1.0], [-1.0, 1.0]]) + 1e-10 * np.eye(2)
    assert analyse(together(p, ("b2", "b3"), c), np.zeros(3)).dropped == ()


def test_a_prior_keeps_what_it_holds_and_what_hides_behind_it(rng):
    """b1 cannot be told from b2 + b3, whose priors say more of it than was expected; narrow or as expected, they hold."""
    p = hidden(rng)
    for sigma in (1e-2, 1e-3, 1e-5):
        held = p.with_table(p.table.with_priors({"b2": sigma, "b3": sigma}))
        assert set(analyse(held, np.zeros(3)).basis) >= {"b2", "b3"}
    assert analyse(p.with_table(p.table.with_priors({"b2": 1e-4, "b3": 1e-4})), np.zeros(3)).dropped == ()


@pytest.mark.parametrize("names", [("b1",), ("b2", "b3"), ("b1", "b2", "b3")])
def test_a_prior_that_says_nothing_changes_nothing(rng, names):
    p = hidden(rng)
    before = analyse(p, np.zeros(3))
    wide = p.with_table(p.table.with_priors(dict.fromkeys(names, 1.01 * WIDE * TYPICAL["1"])))
    after = analyse(wide, np.zeros(3))
    assert after.dropped == before.dropped and after.rank == before.rank == 2
    np.testing.assert_allclose(after.share, before.share)
    # Up to there it is what somebody says of that parameter, and holds it.
    said = analyse(p.with_table(p.table.with_priors(dict.fromkeys(names, WIDE * TYPICAL["1"]))), np.zeros(3))
    assert set(said.basis) >= set(names)


def test_kept_columns_are_told_from_dropped_ones_as_they_are_fitted(rng):
    """b3 looks like b1, which a prior holds, and a little like b2: what the fit does with an error of b3 is what is said."""
    u, v = np.linalg.qr(rng.normal(size=(40, 2)))[0].T
    a = np.column_stack([1e3 * u, 1e3 * v, 0.5 * u + 0.2 * v])
    p = plain_problem(linear(a, np.zeros(40)), np.zeros(3), expected=[1.0] * 3, prior=[1e-3, None, None])
    found = analyse(p, np.zeros(3))
    assert found.dropped == ("b3",)
    response = total(p, found.basis, p.start).response
    partners = dict(found.combinations[0].partners)
    assert partners["b1"] == pytest.approx(response[0, 2]) and partners["b2"] == pytest.approx(response[1, 2])

"""What the data can tell: rank relative to noise, ties, combinations by name, elimination, observability, posterior."""

from __future__ import annotations

import numpy as np
import pytest
from measure.scenarios import SCENARIOS, build
from unit.plain_terms import Plain, linear, plain_problem

from robocal.estimate.choosing.choice import NAMED, OBSERVABLE, Combination, together
from robocal.estimate.elimination import block_columns, eliminate, triangle
from robocal.estimate.identifiability import analyse, observability
from robocal.remarks.code import Code


def seen_to(share, n=3):
    """A problem whose last parameter is seen to `share` times its expected error of 0.01 (in sigma), the others
    well."""
    a = np.eye(n) * 1e4
    a[n - 1, n - 1] = share / 0.01
    return plain_problem(linear(a, np.zeros(n)), np.zeros(n), expected=[0.01] * n)


@pytest.mark.parametrize(
    ("share", "kept"), [(1e-3, False), (0.9 * OBSERVABLE, False), (1.1 * OBSERVABLE, True), (10.0, True)]
)
def test_what_is_seen_is_relative_to_noise(share, kept):
    found = analyse(seen_to(share), np.zeros(3))
    assert ("b3" in found.basis) is kept and ("b3" in found.dropped) is not kept
    assert found.rank == 2 + kept and found.structural_rank == 3
    assert found.singular_values[-1] == pytest.approx(share) and found.names == ("b1", "b2", "b3")


def test_noise_divides_and_priors_and_always_keep():
    p = seen_to(10.0)
    assert analyse(p, np.zeros(3), noise=20.0).dropped == ("b3",)
    stated = p.with_table(p.table.with_priors({"b3": 0.01}))
    assert analyse(stated, np.zeros(3), noise=20.0).basis == ("b1", "b2", "b3")
    assert analyse(seen_to(3.0), np.zeros(3), seen=4.0).dropped == ("b3",)


def test_a_better_guess_makes_the_same_data_say_less():
    tight = seen_to(10.0)
    tight = tight.with_table(
        tight.table.__class__(tuple(r.__class__(**{**r.__dict__, "expected": 1e-4}) for r in tight.table.rows))
    )
    assert analyse(tight, np.zeros(3)).dropped == ("b1", "b2", "b3") or analyse(tight, np.zeros(3)).rank < 3


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_equal_columns_go_to_the_first(rng, order):
    column, other = rng.normal(size=(2, 20))
    a = 1e3 * np.column_stack([column, column, other])[:, order]
    found = analyse(plain_problem(linear(a, np.zeros(20)), np.zeros(3), expected=[1.0] * 3), np.zeros(3))
    twins = [i for i in range(3) if order[i] != 2]
    assert found.dropped == (f"b{twins[1] + 1}",)
    (combination,) = found.combinations
    assert combination.partners == ((f"b{twins[0] + 1}", pytest.approx(1.0)),)
    assert combination.remark.sentence == f"b{twins[1] + 1} cannot be separated from b{twins[0] + 1}"


def preferring(a, preferences):
    made = plain_problem(linear(a, np.zeros(len(a))), np.zeros(a.shape[1]), expected=[1.0] * a.shape[1])
    return made.with_table(made.table.with_preferences(preferences))


@pytest.mark.parametrize("wanted", ["b1", "b2", "b3"])
def test_of_columns_that_say_the_same_the_preferred_one_is_kept(rng, wanted):
    """However strong the others are: what one says in 30 sigma, the other may say in 3000."""
    column, other = rng.normal(size=(2, 40))
    a = np.column_stack([column * 1e3, column * 30, column * 1e2, other * 1e3])
    assert analyse(preferring(a, {}), np.zeros(4)).basis == ("b1", "b4")
    found = analyse(preferring(a, {wanted: 1}), np.zeros(4))
    assert found.basis == (wanted, "b4")
    assert {c.partners[0][0] for c in found.combinations} == {wanted}


def test_a_preference_never_costs_what_was_seen(rng):
    """b2 is told from b1 in 0.5 sigma, and b1 from b2 in 25: kept is b1 alone, for b2 alone would lose what was seen."""
    u, v = np.linalg.qr(rng.normal(size=(40, 2)))[0].T
    a = np.column_stack([100 * (0.97 * u + 0.25 * v), 2 * u])
    for preferences in ({}, {"b2": 5}):
        assert analyse(preferring(a, preferences), np.zeros(2)).basis == ("b1",)
    # Nor does it take in what is not seen at all.
    nothing = np.column_stack([100 * u, 0.5 * u])
    assert analyse(preferring(nothing, {"b2": 5}), np.zeros(2)).basis == ("b1",)


@pytest.mark.parametrize("seed", range(20))
def test_preferences_change_no_rank_and_leave_nothing_seen_out(seed):
    """Random dependent columns with random preferences: as many are kept, and each one left out is explained by them to
    within one sigma."""
    rng = np.random.default_rng(seed)
    a = 50 * rng.normal(size=(60, 6)) @ rng.normal(size=(6, 12)) + 0.01 * rng.normal(size=(60, 12))
    plain = analyse(preferring(a, {}), np.zeros(12))
    found = analyse(preferring(a, {f"b{i + 1}": int(v) for i, v in enumerate(rng.integers(-2, 3, 12))}), np.zeros(12))
    assert len(found.basis) == len(plain.basis) and found.rank == plain.rank
    kept = [int(n[1:]) - 1 for n in found.basis]
    q = np.linalg.qr(a[:, kept])[0]
    assert np.linalg.norm(a - q @ (q.T @ a), axis=0).max() <= OBSERVABLE


def test_combinations_give_the_right_numbers(rng):
    """b4 = 2 b1 - 3 b2 in effect, in SI, whatever the expected errors are."""
    a = 1e4 * rng.normal(size=(30, 3))
    a = np.column_stack([a, 2 * a[:, 0] - 3 * a[:, 1], np.zeros(30)])
    p = plain_problem(linear(a, np.zeros(30)), np.zeros(5), expected=[0.1, 0.05, 1.0, 0.01, 1.0])
    found = analyse(p, np.zeros(5))
    assert found.dropped == ("b4", "b5") and found.rank == 3 == found.structural_rank
    by = {c.name: c for c in found.combinations}
    assert dict(by["b4"].partners) == {"b1": pytest.approx(2), "b2": pytest.approx(-3)}
    assert by["b5"].partners == () and by["b5"].remark.code is Code.NO_EFFECT
    # Most visible first.
    effect = [abs(f) * np.linalg.norm(a[:, int(n[1]) - 1]) for n, f in by["b4"].partners]
    assert effect == sorted(effect, reverse=True)


def test_many_partners_are_counted(rng):
    a = 1e4 * rng.normal(size=(30, 8))
    a = np.column_stack([a, a.sum(axis=1)])
    found = analyse(plain_problem(linear(a, np.zeros(30)), np.zeros(9), expected=[1.0] * 8 + [0.1]), np.zeros(9))
    assert found.dropped == ("b9",) and len(found.combinations[0].partners) == 8
    assert found.combinations[0].remark.sentence.endswith("and 2 more")


def test_fewer_rows_than_parameters(rng):
    found = analyse(plain_problem(linear(1e4 * rng.normal(size=(2, 5)), np.zeros(2)), np.zeros(5)), np.zeros(5))
    assert found.rank == 2 and len(found.basis) == 2 and len(found.dropped) == 3


def test_nothing_free():
    found = analyse(seen_to(1.0).with_free(()), np.zeros(3))
    assert found.rank == 0 and found.basis == () and found.condition == float("inf") and found.indices["O1"] == 0
    assert found.posterior.shape == (0, 0)


def test_observability_is_the_textbooks(rng):
    values = np.sort(rng.uniform(0.1, 5, 4))[::-1]
    o = observability(values, 25)
    assert o["O1"] == pytest.approx(np.prod(values) ** (1 / 4) / 5)
    assert o["O2"] == pytest.approx(values.min() / values.max()) and o["O3"] == pytest.approx(values.min())
    assert o["O4"] == pytest.approx(values.min() ** 2 / values.max())
    assert o["O5"] == pytest.approx(1 / (1 / values).sum())
    assert set(observability(np.array([1.0, 0.0]), 5).values()) == {0.0}
    a = rng.normal(size=(12, 3)) * 1e3
    p = plain_problem(linear(a, np.zeros(12)), np.zeros(3), expected=[0.1, 0.2, 0.3])
    found = analyse(p, np.zeros(3))
    direct = np.linalg.svd(a * [0.1, 0.2, 0.3], compute_uv=False)
    assert found.indices == {k: pytest.approx(v) for k, v in observability(direct, 12).items()}
    assert found.condition == pytest.approx(direct[0] / direct[-1])


def test_posterior_is_expected_error_updated_by_data(rng):
    a, s = rng.normal(size=(12, 4)), np.array([0.5, 1.0, 2.0, 0.1])
    a[:, 3] = 0
    found = analyse(plain_problem(linear(a, np.zeros(12)), np.zeros(4), expected=list(s)), np.zeros(4))
    np.testing.assert_allclose(found.posterior, np.linalg.inv(a.T @ a + np.diag(1 / s**2)), atol=1e-12)
    np.testing.assert_allclose(found.share, 1 - np.diag(found.posterior) / s**2, atol=1e-12)
    assert found.share[3] == pytest.approx(0, abs=1e-12)


def test_posterior_stays_positive_for_noise_free_data(rng):
    """sigma = 1e-12 m against metres: squaring the singular values would leave negative variances."""
    a = rng.normal(size=(20, 4))
    a[:, 3] = a[:, :3].sum(axis=1)
    found = analyse(plain_problem(linear(a, np.zeros(20), sigma=1e-12), np.zeros(4), expected=[1.0] * 4), np.zeros(4))
    variance = np.diag(found.posterior)
    assert (variance > 0).all() and (found.share >= 0).all() and (found.share <= 1).all()
    # Only the direction (1, 1, 1, -1) / 2 is unknown: a quarter of the expected variance each.
    np.testing.assert_allclose(variance, 0.25, rtol=1e-6)


def test_triangle_in_chunks_keeps_the_squares(rng):
    j = rng.normal(size=(500, 7))
    for chunk in (3, 50, 499, 20_000):
        r = triangle(j, chunk)
        assert r.shape == (7, 7) and np.allclose(np.tril(r, -1), 0)
        np.testing.assert_allclose(r.T @ r, j.T @ j, atol=1e-11)
    wide = triangle(j[:3])
    assert wide.shape == (7, 7)
    np.testing.assert_allclose(wide.T @ wide, j[:3].T @ j[:3], atol=1e-12)
    assert triangle(np.zeros((0, 2))).shape == (2, 2)


# --- local blocks -----------------------------------------------------------------------------------------------------------


def schur(p, lin):
    """Information of the shared columns with the local ones profiled out, by pseudo-inverse."""
    local = [np.where((lin.local == b)[:, None], lin.jl, 0.0) for b in range(p.sizes[0][0])]
    own = np.hstack([*local, lin.jm, np.zeros((len(lin.r), 0))])
    return lin.j.T @ lin.j - lin.j.T @ own @ np.linalg.pinv(own.T @ own, rcond=1e-12) @ own.T @ lin.j


@pytest.mark.parametrize("name", [n for n in SCENARIOS if "eliminated" in n or "free poses" in n])
def test_eliminate_equals_the_dense_schur_complement(name):
    p = build(name)
    lin = p.linearize(p.start)
    reduced = eliminate(lin)
    expected = schur(p, lin)
    np.testing.assert_allclose(
        reduced.T @ reduced, expected, atol=1e-8 * max(np.abs(lin.j.T @ lin.j).max(initial=0), 1)
    )


def blocks_of(rng, ranks, each=8, size=6):
    """One block per entry of `ranks`, whose columns span only that many directions, and rows without a block."""
    count = len(ranks)
    m = count * each + 3
    local = np.concatenate([np.repeat(np.arange(count), each), [-1, -1, -1]])
    block = np.zeros((m, 1, size))
    for b, rank in enumerate(ranks):
        block[local == b, 0] = rng.normal(size=(each, rank)) @ rng.normal(size=(rank, size))
    a = rng.normal(size=(m, 1, 4))
    term = Plain(lambda x: a @ x, lambda x: a, (m, 1), local=local, block=block, configuration=np.maximum(local, 0))
    return plain_problem(term, np.zeros(4), blocks=count, block_size=size)


@pytest.mark.parametrize("ranks", [(6, 6, 6), (6, 3, 1), (2, 2), (5,)])
def test_a_block_takes_away_only_its_own_rank(rng, ranks):
    """A pose seen through one point has rank 3: it must not eat six rows."""
    p = blocks_of(rng, ranks)
    lin = p.linearize(p.start)
    assert block_columns(lin) == sum(ranks)
    reduced = eliminate(lin)
    np.testing.assert_allclose(reduced.T @ reduced, schur(p, lin), atol=1e-8)
    assert len(reduced) == len(lin.r) - sum(ranks)


def test_blocks_with_fewer_rows_than_columns(rng):
    p = blocks_of(rng, (3, 4), each=4)
    lin = p.linearize(p.start)
    assert block_columns(lin) == 7
    np.testing.assert_allclose(eliminate(lin).T @ eliminate(lin), schur(p, lin), atol=1e-8)


def test_without_blocks_nothing_is_eliminated(rng):
    p = plain_problem(linear(rng.normal(size=(5, 2)), np.zeros(5)), np.zeros(2))
    lin = p.linearize(p.start)
    assert eliminate(lin) is lin.j and block_columns(lin) == 0


def test_partners_of_the_same_part_are_named_together():
    """A map that shifts against the anchors: two names, not ninety."""
    markers = [(f"m{i}.x", 1.0 + 0.01 * (i % 2)) for i in range(1, 85)]
    cables = [(f"c{i}.ax", 1.0) for i in range(2, 9)]
    assert together([*markers, *cables]) == (("x of m1 to m84 (84)", "ax of c2 to c8 (7)"), 0)
    said = Combination("c1.ax", (*markers, *cables)).remark.sentence
    assert "x of m1 to m84 (84), ax of c2 to c8 (7)" in said and "more" not in said


def test_partners_are_named_one_by_one_where_they_are_few_or_differ():
    few = [(f"j{i}.d", 1.0) for i in range(NAMED)]
    assert together(few) == (tuple(n for n, _ in few), 0)
    apart = [(f"j{i}.d", 2.0**i) for i in range(9)]
    assert together(apart) == (tuple(n for n, _ in apart[:NAMED]), 3)
    mixed = [*apart[:5], *((f"m{i}.y", -1.0) for i in range(10)), ("gain", 1.0)]
    assert together(mixed) == ((*(n for n, _ in apart[:5]), "y of m0 to m9 (10)"), 1)
    assert sum(together([(f"m{i}.{s}", 1.0) for s in "abcdefghij" for i in range(5)])[1:]) == 4 * 5

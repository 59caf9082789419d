"""The choice of measurements: criteria against their definitions, choices against trying everything."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from robocal.errors import ModelError
from robocal.estimate.criteria import CRITERIA, criterion_of, information
from robocal.estimate.identifiability import observability
from robocal.estimate.selection import Pool

NAMES = tuple(CRITERIA)


def case(seed=0, m=40, d=2, n=6, t=15):
    """Candidates (m, d, n), tests (t, 3, n) and what is known before, unequal in all directions."""
    rng = np.random.default_rng(seed)
    mix = rng.normal(size=(n, n)) * np.logspace(-0.5, 1.0, n)
    return rng.normal(size=(m, d, n)) @ mix, rng.normal(size=(t, 3, n)) @ mix, np.eye(n)


def total(blocks, known, chosen):
    return known + information(blocks[list(chosen)]).sum(axis=0)


def by_definition(name, m, tests):
    """A criterion as the books write it."""
    values = np.sqrt(np.linalg.eigvalsh(m)[::-1])
    indices = observability(values, 1)
    cov = np.linalg.inv(m)
    variance = [np.trace(t @ cov @ t.T) for t in tests]
    return {
        "I": -np.mean(variance),
        "G": -np.max(variance),
        "D": np.log(np.linalg.det(m)),
        "O1": 2 * len(m) * np.log(indices["O1"]),
        "A": -np.trace(cov),
        "E": np.linalg.eigvalsh(m)[0],
        **{k: indices[k] for k in ("O2", "O3", "O4", "O5")},
    }[name]


@pytest.mark.parametrize("name", NAMES)
def test_a_criterion_is_what_its_definition_says(name):
    blocks, tests, known = case()
    m = total(blocks, known, range(8))
    assert np.isclose(criterion_of(name, 6, tests).value(m), by_definition(name, m, tests), rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_bound_holds_and_is_the_value_where_it_says_so(name, sign):
    blocks, tests, known = case(1)
    criterion = criterion_of(name, 6, tests)
    m = total(blocks, known, range(12))
    some = blocks[:12] if sign < 0 else blocks[12:]
    value = np.array([by_definition(name, m + sign * b.T @ b, tests) for b in some])
    bound = criterion.bound(m, some, sign)
    assert (bound >= value - 1e-9 * np.abs(value)).all()
    if criterion.tight:
        np.testing.assert_allclose(bound, value, rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_greedy_takes_the_best_candidate_every_time(name):
    blocks, tests, known = case(2)
    found = Pool(blocks, criterion_of(name, 6, tests), known).greedy(6)
    chosen: list[int] = []
    for taken in found:
        left = [i for i in range(len(blocks)) if i not in chosen]
        values = [by_definition(name, total(blocks, known, [*chosen, i]), tests) for i in left]
        best, mine = max(values), values[left.index(taken)]
        assert mine >= best - 1e-9 * abs(best)
        chosen.append(taken)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(5))
def test_exchange_is_never_worse_than_the_greedy_start(name, seed):
    blocks, tests, known = case(10 + seed)
    found = Pool(blocks, criterion_of(name, 6, tests), known).select(8)
    start = by_definition(name, total(blocks, known, found.start), tests)
    end = by_definition(name, total(blocks, known, found.chosen), tests)
    assert end >= start and len(set(found.chosen.tolist())) == 8
    assert np.isclose(found.value, end, rtol=1e-9) and np.isclose(found.start_value, start, rtol=1e-9)
    # And no single swap is better.
    for member in found.chosen:
        rest = [i for i in found.chosen if i != member]
        others = [i for i in range(len(blocks)) if i not in found.chosen]
        best = max(by_definition(name, total(blocks, known, [*rest, i]), tests) for i in others)
        assert best <= end + 1e-8 * abs(end)


def test_exchange_mends_a_bad_start():
    blocks, tests, known = case(3)
    criterion = criterion_of("I", 6, tests)
    worst = np.argsort(np.linalg.norm(blocks, axis=(1, 2)))[:8].tolist()
    mended, exchanges = Pool(blocks, criterion, known).exchange(worst)
    before, after = (float(criterion.value(total(blocks, known, c))) for c in (worst, mended))
    chosen = Pool(blocks, criterion, known).select(8)
    assert exchanges > 0 and after > 0.5 * before and after >= 1.02 * chosen.value


@pytest.mark.parametrize("name", ["I", "D", "A"])
def test_nothing_exceeds_the_limit(name):
    blocks, tests, known = case(4, m=12)
    criterion = criterion_of(name, 6, tests)
    best = max(float(criterion.value(total(blocks, known, c))) for c in combinations(range(12), 5))
    found, top = Pool(blocks, criterion, known).select(5), Pool(blocks, criterion, known).limit(5, rounds=400)
    assert top is not None and found.value <= best + 1e-9 * abs(best) <= top + 2e-9 * abs(best)
    # The limit means something: it lies near what can be had.
    assert top - best < 0.3 * abs(best)


def test_what_was_measured_before_is_not_measured_again():
    blocks, tests, known = case(5)
    blocks = blocks.copy()
    blocks[:20, :, 3:] = 0.0
    blocks[20:, :, :3] = 0.0
    first_half = known + 100.0 * information(blocks[:20]).sum(axis=0)
    found = Pool(blocks, criterion_of("D", 6), first_half).select(6)
    assert (found.chosen >= 20).all()


def test_only_allowed_candidates_are_taken():
    blocks, tests, known = case(6)
    found = Pool(blocks, criterion_of("G", 6, tests), known, np.isin(np.arange(len(blocks)), range(10, 18))).select(5)
    assert set(found.chosen.tolist()) <= set(range(10, 18))
    everything = Pool(
        blocks, criterion_of("G", 6, tests), known, np.isin(np.arange(len(blocks)), range(10, 18))
    ).select(8)
    assert sorted(everything.chosen.tolist()) == list(range(10, 18))


def test_what_cannot_be_chosen_is_said():
    blocks, _, known = case()
    with pytest.raises(ModelError, match="O4"):
        criterion_of("o4", 6)
    with pytest.raises(ModelError, match="test poses"):
        criterion_of("I", 6)
    with pytest.raises(ModelError, match="fewer candidates"):
        Pool(blocks, criterion_of("D", 6), known).select(41)
    assert Pool(blocks, criterion_of("E", 6), known).limit(5) is None

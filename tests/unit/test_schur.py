"""Normal equations of two families of blocks, solved as a whole, block by block, and as a band."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.estimate.schur import system
from robocal.estimate.terms import Normal

SIZES = ((30, 6), (24, 3))
FREE = 4


def chain(rng, reach=2):
    """Blocks along a line: each of the first family meets the few of the second beside it; A (N, N), g (N,) dense and as Normal."""
    (many, size), (more, wide) = SIZES
    pairs = np.array([(i, j) for i in range(many) for j in range(more) if abs(i * more / many - j) <= reach])
    pairs = rng.permutation(pairs)
    base, n = many * size, many * size + more * wide + FREE
    rows = []
    for i, j in pairs:
        j_row = np.zeros((4, n))
        j_row[:, size * i : size * (i + 1)] = rng.normal(size=(4, size))
        j_row[:, base + wide * j : base + wide * (j + 1)] = rng.normal(size=(4, wide))
        j_row[:, n - FREE :] = rng.normal(size=(4, FREE))
        rows.append(j_row)
    j = np.vstack(rows)
    a, g = j.T @ j + np.eye(n), rng.normal(size=n)
    at = [slice(size * i, size * (i + 1)) for i in range(many)]
    bt = [slice(base + wide * i, base + wide * (i + 1)) for i in range(more)]
    free = slice(n - FREE, n)
    normal = Normal(
        np.ones(1), g[None, free], np.tril(a[free, free])[None],
        np.stack([g[s] for s in at])[None], np.stack([a[s, s] for s in at])[None], np.stack([a[free, s] for s in at])[None],
        np.stack([g[s] for s in bt])[None], np.stack([a[s, s] for s in bt])[None], np.stack([a[free, s] for s in bt])[None],
        np.stack([a[at[i], bt[k]] for i, k in pairs])[None],
    )  # fmt: skip
    return a, g, normal, pairs


def solved(made, normal, held, lam=0.3):
    """The step of everything, (N,), blocks of the first family, of the second, free columns."""
    damp, local = np.ones(FREE), tuple(np.ones(s) for s in SIZES)
    step, steps = np.zeros(FREE), tuple(np.zeros(s) for s in SIZES)
    assert made.solve(normal, 0, lam, damp, local, held, step, steps)
    return np.concatenate([steps[0].ravel(), steps[1].ravel(), step])


@pytest.mark.parametrize("out", [0, 1])
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("banded", [False, True])
def test_the_step_is_that_of_the_whole_matrix(monkeypatch, out, hold, banded):
    a, g, normal, pairs = chain(np.random.default_rng(out))
    monkeypatch.setattr(system, "MANY", 1 if banded else 10**6)
    monkeypatch.setattr(system, "NARROW", 0.7)
    made = system.System(out, FREE, SIZES, pairs)
    assert bool(made.band) == banded
    held = np.array([hold, False, False, hold])
    whole = a + 0.3 * np.eye(len(a))
    free = np.concatenate([np.ones(len(a) - FREE, dtype=bool), ~held])
    expected = np.zeros(len(a))
    expected[free] = -np.linalg.solve(whole[np.ix_(free, free)], g[free])
    for _ in range(2):  # the work space is used again
        np.testing.assert_allclose(solved(made, normal, held), expected, atol=1e-12)


def test_a_matrix_that_is_not_positive_is_refused(monkeypatch):
    monkeypatch.setattr(system, "MANY", 1)
    monkeypatch.setattr(system, "NARROW", 0.7)
    _, _, normal, pairs = chain(np.random.default_rng(3))
    for out in (0, 1):
        made = system.System(out, FREE, SIZES, pairs)
        for name in ("am" if out == 0 else "al", "a"):
            wrong = Normal(**{**normal.__dict__, name: -getattr(normal, name)})
            zero = np.zeros(FREE), tuple(np.zeros(s) for s in SIZES)
            assert not made.solve(
                wrong, 0, 0.0, zero[0], zero[1], np.zeros(FREE, dtype=bool), np.zeros(FREE), tuple(np.zeros(s) for s in SIZES)
            )  # fmt: skip


def test_blocks_that_are_all_seen_together_are_no_band(monkeypatch):
    monkeypatch.setattr(system, "MANY", 1)
    pairs = np.array([(i, j) for i in range(30) for j in range(24)])
    assert system.System(0, FREE, SIZES, pairs).band == 0

"""Free columns that no row sees two groups of: which these are, and steps that are those of the whole matrix."""

from __future__ import annotations

import numpy as np
import pytest
from cables.thesis_rig import specification, thesis_rig

from robocal.estimate.independent_columns import independent_groups
from robocal.estimate.schur.arrowhead import Arrowhead, _pairs, system_of
from robocal.estimate.schur.system import structure

EYE = [f"eye.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")]


@pytest.fixture
def rig(shared_data):
    return thesis_rig(specification(shared_data), 3, poses=14, grid=(5, 4))


def markers(p):
    """The columns of every marker that is seen and has six of its own, (m, 6)."""
    seen = set(np.concatenate([t.columns for t in p.bound_terms]).tolist())
    names = {n.rpartition(".")[0] for n in p.free if n.rpartition(".")[2] == "rx"} - {"eye"}
    every = ([p.free.index(f"{m}.{s}") for s in ("x", "y", "z", "rx", "ry", "rz")] for m in names)
    return sorted(columns for columns in every if seen.issuperset(columns))


def test_markers_of_a_map_are_the_groups(rig):
    assert sorted(map(sorted, rig.problem.independent.tolist())) == markers(rig.problem)


def test_what_a_prior_joins_or_a_bound_stops_is_no_group_of_its_own():
    class Term:
        def __init__(self, *columns):
            self.columns = np.array(columns)

    terms = [Term(0, 1, 2), Term(0, 3, 4), Term(0, 5, 6)]
    free = np.full(7, -np.inf), np.full(7, np.inf)
    assert independent_groups(terms, free, np.zeros((7, 7))).tolist() == [[1, 2], [3, 4], [5, 6]]
    root = np.eye(7)
    root[1, 3] = 0.5
    assert len(independent_groups(terms, free, root)) < 3
    low = np.where(np.arange(7) == 6, 0.0, -np.inf)
    assert independent_groups(terms, (low, free[1]), np.zeros((7, 7))).tolist() == [[1, 2], [3, 4]]


@pytest.mark.parametrize("posed", [True, False])
@pytest.mark.parametrize("hold", [False, True])
def test_the_step_is_that_of_the_whole_matrix(rig, posed, hold):
    p = rig.problem if posed else rig.problem.with_fixed_blocks(0)
    normal, n = p.normal(p.start), p.n
    held = np.zeros(n, dtype=np.bool_)
    held[p.free.index("eye.x")] = hold
    damp, local = np.linspace(1, 2, n), tuple(np.full(s, 1.5) for s in p.sizes)
    steps = []
    for made in (Arrowhead(n, p.independent, p.sizes[0], _pairs(p, p.independent)), structure(n, p.sizes, p.pairs)):
        step, blocks = np.zeros(n), tuple(np.zeros(s) for s in p.sizes)
        assert made.solve(normal, 0, 1e-3, damp, local, held, step, blocks)
        steps.append(np.concatenate([step, blocks[0].ravel()]))
    assert posed or isinstance(system_of(p), Arrowhead)
    np.testing.assert_allclose(*steps, rtol=1e-6, atol=1e-9 * np.abs(steps[1]).max())
    assert not hold or steps[0][p.free.index("eye.x")] == 0

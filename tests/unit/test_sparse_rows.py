"""Rows that lie together touch few columns: products that leave the rest out are those of all columns."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.estimate.sparse_rows import ROWS, blocks_of, product


@pytest.mark.parametrize("own", [0, 6])
def test_products_are_those_of_all_columns(own):
    rng = np.random.default_rng(own)
    j = rng.normal(size=(5 * ROWS + 7, 40))
    for k in range(6 if own else 0):  # markers one after the other, six columns each
        j[k * ROWS : (k + 1) * ROWS, 4:][:, np.arange(36) // 6 != k] = 0.0
    seen = 0
    for at, felt in blocks_of(j):
        assert not np.delete(j[at], np.arange(40)[felt], axis=1).any()
        assert isinstance(felt, slice) == (own == 0)
        seen += len(j[at])
    assert seen == len(j)
    w = rng.normal(size=(40, 3))
    np.testing.assert_allclose(product(j, w), j @ w, rtol=1e-12, atol=1e-12)

"""Advice is obeyed as it is printed, and what comes out is better."""

from __future__ import annotations

import advice_arms  # noqa: F401 - fills the table
import pytest
from advice import OBEYED, is_better, spoken


@pytest.mark.parametrize("code", OBEYED)
def test_obeyed_it_ends_better(code, tmp_path):
    first, then = OBEYED[code](tmp_path)
    assert spoken(first, code), first.said
    assert is_better(first, then, code), (first.status, then.status, then.said)

"""A print in another unit whose size is free: a factor that the size takes up, and that no printer makes."""

from __future__ import annotations

from dataclasses import replace

import pytest
from field_world import rig

from robocal.fit.options import Options
from robocal.prove.identify import identify


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "meant"), [(10.0, "mm read as cm"), (0.1, "cm read as mm")])
def test_a_free_size_does_not_hide_a_wrong_unit(factor, meant):
    """0.15 m is stated 1.5, or 0.015: images fit whatever the size, cables say which."""
    model, _, data = rig(level=False, count=26)
    lengths, seen = data.observations
    seen = replace(seen, extra={**seen.extra, "point": seen.extra["point"] * factor})
    found = identify(model, replace(data, observations=(lengths, seen)), Options(leave_one_out=False))
    said = [r for r in found.verdict.reasons if r.code == "target-unit"]
    assert found.verdict.status == "refused" and [r.numbers["factor"] for r in said] == [factor]
    assert meant in str(said[0]) and said[0].numbers["left"].value < 0.5

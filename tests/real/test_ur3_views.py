"""A real UR3 before four cameras: labels that count from either end, two joint rows exchanged, six images of other moments."""

from __future__ import annotations

import pytest
from cli.runs import robocal
from real.ur3_cell import write_cell

pytestmark = pytest.mark.slow


def test_half_turns_are_named_in_all_four_cameras(shared_data, tmp_path):
    told = robocal("check", *write_cell(tmp_path, shared_data / "ur3-cameras"), "--json").document
    (one,) = [r for r in told["remarks"] if r["code"] == "target-turned"]
    assert one["numbers"]["instruments"] == ["eye0", "eye1", "eye2", "eye3"] and 60 < one["numbers"]["count"] < 100
    assert "`half_turns: undo`" in one["advice"]


def test_fourteen_views_are_named_and_two_joint_rows_exchanged(shared_data, tmp_path):
    told = robocal(
        "identify", *write_cell(tmp_path, shared_data / "ur3-cameras", labels="undone"), "--hold-out", 0.2, "--json"
    ).document
    views = [o for o in told["outliers"] if o["rows"] > 1]
    by_camera = {c: sorted(int(o["configuration"][1:]) for o in views if o["group"] == f"eye{c}") for c in range(4)}
    assert by_camera == {0: [24, 25], 1: [24, 25], 2: [24, 25], 3: [8, 13, 14, 24, 25, 30, 32, 37]}
    assert all(o["set_aside"] and o["rows"] == 63 for o in views) and len(told["outliers"]) - len(views) < 10
    (one,) = [r for r in told["remarks"] if r["code"] == "views-exchanged"]
    assert (one["numbers"]["view"], one["numbers"]["partner"], one["numbers"]["every"]) == ("p24", "p25", 4)

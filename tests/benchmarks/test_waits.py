"""What a user waits for: every folder that a command reads is made, a table is cut by its columns, medians stand beside one another."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def waits(monkeypatch):
    """The section, a neighbour of others and no part of a package."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return importlib.import_module("waits")


def test_what_commands_read_is_made(waits):
    read = [word for words in waits.WAITS.values() for word in words.split() if "/" in word]
    assert {word.split("/")[0] for word in read} <= {*waits.MADE, *waits.CORNERS}
    assert {word.split("/")[0] for word in read if word.endswith("/RUN")} <= set(waits.RUNS)
    assert {word for word in read if word.endswith(("poses.csv", "program.csv"))} == set(waits.CUT)


def test_a_cut_table_has_its_columns_and_an_id(waits, tmp_path):
    (tmp_path / "data.csv").write_text("# made\nconfiguration,j1 [deg],x [mm],sx [mm]\np1,1,2,3\np2,4,5,6\n")
    waits.cut(tmp_path / "data.csv", tmp_path / "cut.csv", ("configuration", "x"))
    assert (tmp_path / "cut.csv").read_text() == "id,x [mm]\np1,2\np2,5\n"


def test_a_row_has_medians_and_what_this_state_takes_of_the_other(waits):
    now = [waits.Cost(cpu, 100.0) for cpu in (1.0, 3.0, 2.0)]
    row = waits.summarise("check", {"new": now, "before": [waits.Cost(4.0, 200.0)]})
    assert (row["cpu_s"], row["before_cpu_s"], row["cpu_s_over_before"], row["peak_MB_over_before"]) == (
        2.0,
        4.0,
        0.5,
        0.5,
    )
    alone = waits.summarise("check", {"new": now, "before": []})
    assert alone["before_cpu_s"] is None and alone["cpu_s_over_before"] is None

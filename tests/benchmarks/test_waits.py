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
    assert {word.split("/")[0] for word in read} <= {*waits.MADE, *waits.CORNERS, "ur10", "study"}
    assert {word.split("/")[0] for word in read if word.endswith("/RUN")} <= set(waits.RUNS)
    assert {word for word in read if word.endswith(("poses.csv", "program.csv"))} == set(waits.CUT)


def test_a_cut_table_has_its_columns_and_an_id(waits, tmp_path):
    (tmp_path / "data.csv").write_text("# made\nconfiguration,j1 [deg],x [mm],sx [mm]\np1,1,2,3\np2,4,5,6\n")
    waits.cut(tmp_path / "data.csv", tmp_path / "cut.csv", ("configuration", "x"))
    assert (tmp_path / "cut.csv").read_text() == "id,x [mm]\np1,2\np2,5\n"


def lines(row, state, *cpu, first=0):
    return [
        {"row": row, "state": state, "turn": k, "cpu": c, "wall": c, "memory": 100 * c}
        for k, c in enumerate(cpu, first)
    ]


def test_a_row_has_medians_and_what_this_state_takes_of_the_other(waits):
    told = lines("check", "new", 9.0, 1.0, 3.0, 2.0) + lines("check", "before", 9.0, 4.0, 4.0, 4.0)
    row = waits.summarise("check", told, 3)
    assert (row["cpu_s"], row["before_cpu_s"], row["cpu_s_over_before"], row["peak_MB_over_before"]) == (
        2.0,
        4.0,
        0.5,
        0.5,
    )
    assert "said" not in row
    alone = waits.summarise("check", lines("check", "new", 9.0, 1.0), 3)
    assert alone["before_cpu_s"] is None and alone["cpu_s_over_before"] is None
    assert alone["said"] == "1 of 3 rounds"


def test_what_a_state_did_not_finish_is_said(waits):
    told = [*lines("check", "new", 1.0, 1.0), {"row": "check", "state": "before", "turn": 0, "cpu": None}]
    assert waits.summarise("check", told, 1)["said"] == "not finished by: before"


def test_what_takes_long_counts_from_its_only_round(waits):
    row = waits.summarise("check", lines("check", "before", 500.0), 5)
    assert row["before_cpu_s"] == 500.0 and "said" not in row


def test_every_line_that_is_asked_is_of_rows_that_are_measured(waits):
    names = [*waits.IMPORTS, *waits.WAITS, *waits.FIRST, *waits.CALLS, *waits.ONCE]
    two = {"cpu_s": 2.0, "wall_s": 2.0, "peak_MB": 2.0} | {"before_cpu_s": 4.0, "before_wall_s": 4.0}
    rows = [{"what": n} | two | {"over_pyceres": 0.5, "differ": 0, "minutes": 5.0} for n in names]
    rows[0] |= {"cpu_s": 1.0, "before_cpu_s": 1.0}  # imports
    assert all(
        line["measured"] is not None
        for line in waits.wait_asked.judged(rows)
        if "beyond imports" not in line["asked of"]
    )
    missing = waits.wait_asked.judged([{"what": n, "said": "why"} for n in names])
    assert {line["measured"] for line in missing} == {None} and "why" in {line[""] for line in missing}


def test_a_run_goes_on_where_it_was_stopped_and_never_with_other_sources(waits, tmp_path):
    source = tmp_path / "src"
    source.mkdir()
    (source / "a.py").write_text("1\n")
    state = waits.State("new", source, tmp_path)
    log = waits.Log(tmp_path, [state])
    log.add({"row": "check", "turn": 1})
    with log.path.open("a") as torn:
        torn.write('{"row": "che')
    waits.Log(tmp_path, [state]).add({"row": "check", "turn": 2})
    assert [x["turn"] for x in waits.Log(tmp_path, [state]).of("check")] == [1, 2]
    (source / "a.py").write_text("2\n")
    with pytest.raises(RuntimeError, match="other sources"):
        waits.Log(tmp_path, [state])


def test_when_the_time_is_over_nothing_begins(waits, tmp_path):
    late = waits.State("new", tmp_path, tmp_path, until=0.0)
    with pytest.raises(waits.Late):
        late.run("--version")


def test_of_a_command_only_its_imports_are_counted(waits, tmp_path):
    cost = waits.State("new", waits.OWN, tmp_path).imports("--version")
    assert 0.0 < cost.cpu < waits.State("new", waits.OWN, tmp_path).run("--version").cpu + 1.0


def test_why_data_could_not_be_made_is_said(waits, tmp_path, monkeypatch):
    source = tmp_path / "src"
    (source / "robocal").mkdir(parents=True)
    (source / "robocal" / "__init__.py").touch()
    (source / "robocal" / "__main__.py").write_text("import sys; sys.exit('no room on the disk')\n")
    state = waits.State("new", source, tmp_path / "data")
    with pytest.raises(RuntimeError, match=r"simulate irb-120 -n 80: exit status 1: no room on the disk"):
        waits.prepare({"few"}, state)
    monkeypatch.chdir(tmp_path)
    told = []
    monkeypatch.setattr(waits, "measure", lambda names, states, *rest: told.extend(states) or [])
    waits.section(against="src:packages", words=["version"], out=Path("out"))
    assert told[1].source == source and told[1].packages == (str(tmp_path / "packages"),)
    assert told[0].data == tmp_path / "out" / "data"

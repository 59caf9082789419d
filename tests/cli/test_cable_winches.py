"""Tensions from motor currents: what a calibration gains, a torque constant that is wrong, and what is wrong with files."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
import winch_currents as rig

sys.path.pop(0)


@pytest.fixture(scope="module")
def run():
    return rig.draw(1)


@pytest.mark.slow
def test_anchors_and_friction_are_found_without_load_cells(run, tmp_path):
    truth, nominal, table, numbers = run
    found, read = rig.fit(tmp_path, nominal, table)
    assert found.verdict.status == "improved"
    by = {p.name: p for p in found.parameters}
    assert all(abs(by[n].identified - v) < 4 * by[n].sigma for n, v in numbers.items())
    assert all(abs(g.chi2 / g.dof - 1) < 0.35 for g in found.groups)
    off = [found.corrected.table[n].value - truth.table[n].value for n in truth.table.free]
    assert 1e3 * np.sqrt(np.mean(np.square(off))) < 6


@pytest.mark.slow
def test_a_wrong_torque_constant_is_named(tmp_path):
    _, nominal, table, _ = rig.draw(1, 0.2)
    found, _ = rig.fit(tmp_path, nominal, table, kt="free: false")
    told = [str(r) for r in (*found.warnings, *found.verdict.remarks)]
    assert any("winches.kt" in t for t in told), told
    # obeyed: free, it is found
    found, _ = rig.fit(tmp_path, nominal, table, kt="free: true")
    assert found.verdict.status == "improved"
    assert not any("winches.kt" in str(r) for r in (*found.warnings, *found.verdict.remarks))


WRONG = {
    "no speeds": ("winches.yaml", "speed:", "# speed:", "friction without a direction"),
    "no unit of the radius": ("winches.yaml", "unit: mm}\n  torque", "unit: A}\n  torque", "a length is needed"),
    "seven motors": ("winches.yaml", "i6, i7]", "i6]", "wrong number of columns"),
    "speeds of seven": ("winches.yaml", "v6, v7]", "v6]", "wrong number of columns"),
    "a constant of zero": ("winches.yaml", "value: 0.561", "value: 0", "a torque constant is above 0"),
    "no winch": ("winches.yaml", "gear: 4.0", "gears: 4.0", "unknown key"),
    "currents of some rows": (
        "winches.yaml",
        "file: run.csv",
        "file: other.csv",
        "a length without a current beside it",
    ),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_files_are_refused_by_name(run, tmp_path, what):
    file, old, new, said = WRONG[what]
    _, nominal, table, _ = run
    rig.write(tmp_path, nominal, table, "prior: 0.056", "tension: currents\n")
    lines = table.splitlines(keepends=True)
    (tmp_path / "other.csv").write_text("".join(lines[:40]))
    text = (tmp_path / file).read_text()
    assert old in text
    (tmp_path / file).write_text(text.replace(old, new))
    ran = robocal("identify", *(str(tmp_path / f) for f in ("robot.yaml", "lengths.yaml", "pose.yaml", "winches.yaml")))
    assert ran.status == 2 and said in " ".join(ran.err.split()), ran.err
    assert "Traceback" not in ran.err


def test_currents_without_a_file_of_them(run, tmp_path):
    _, nominal, table, _ = run
    rig.write(tmp_path, nominal, table, "prior: 0.056", "tension: currents\n")
    ran = robocal("identify", *(str(tmp_path / f) for f in ("robot.yaml", "lengths.yaml", "pose.yaml")))
    assert ran.status == 2 and "no currents stand beside these lengths" in ran.err

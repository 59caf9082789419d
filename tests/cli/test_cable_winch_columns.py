"""Currents of winches in wrong columns, rows, units and signs: each is named before anything is fitted."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.diagnose.check_registry import Context
from robocal.diagnose.joint_friction import unseen_friction
from robocal.errors import FormatError
from robocal.session.inputs import read_inputs

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
import winch_currents as rig

sys.path.pop(0)


@pytest.fixture(scope="module", params=[1, 4])
def run(request):
    return rig.draw(request.param)


def currents_of(table):
    head, *rows = table.splitlines()
    first = head.split(",").index("i0")
    return head, [row.split(",") for row in rows], slice(first, first + 8)


def with_currents(table, change):
    head, rows, part = currents_of(table)
    read = change(np.array([[float(c) for c in row[part]] for row in rows]))
    for row, values in zip(rows, read, strict=True):
        row[part] = [f"{v:.6f}" for v in values]
    return "\n".join([head, *(",".join(r) for r in rows)]) + "\n"


def column(at, value):
    def change(i):
        i[:, at] = value(i[:, at])
        return i

    return change


def gross(i):
    i[7, 2] += 500
    return i


def exchanged(one, other):
    def change(i):
        i[:, [one, other]] = i[:, [other, one]]
        return i

    return change


# obeys: currents-exchanged
# obeys: current-turned
# obeys: current-unlike
# obeys: currents-shifted
# obeys: current-row
# obeys: currents-unbalanced
# obeys: winch-gain
COLUMNS = {
    "far cables": (exchanged(2, 5), "the currents of c3 and c6 are exchanged"),
    "near cables": (exchanged(0, 1), "the currents of c1 and c2 are exchanged"),
    "a sensor that stands": (column(3, np.ones_like), "the current of c4 is none of the tension of this cable"),
    "one in mA": (column(2, lambda v: 1e3 * v), "the current of c3 is none of the tension of this cable"),
    "one sign": (column(2, np.negative), "the current of c3 counts the other way"),
    "all alike": (np.ones_like, "no winches with these currents hold the platform"),
    "noise": (lambda i: np.random.default_rng(0).normal(3, 1, i.shape), "no winches with these currents"),
    "rows": (lambda i: np.roll(i, 1, axis=0), "the currents stand 1 row too low"),
    "a row": (gross, "the current of c3 in row 9 is 5"),
    "all in mA": (lambda i: 1e3 * i, "an ampere pulls 0.001"),
}
STATED = {
    "mA": ("unit: A, sigma: 0.02", "unit: mA, sigma: 20", "a unit is a thousand times off"),
    "no gear": ("gear: 4.0", "gear: 1.0", "winches.kt of 2."),
    "a diameter": ("radius: {value: 104.0", "radius: {value: 208.0", "a diameter for a radius"),
    "a radius in m": ("value: 104.0, unit: mm", "value: 104.0, unit: m", "a unit is a thousand times off"),
}


def refused(folder, files):
    ran = robocal("identify", str(folder / "robot.yaml"), *map(str, files))
    assert ran.status == 2 and "Traceback" not in ran.err, ran.err
    return " ".join(ran.err.split())


def test_right_currents_are_read(run, tmp_path):
    _, nominal, table, _ = run
    rig.write(tmp_path, nominal, table, "prior: 0.056", "tension: currents\n")
    read_inputs(tmp_path / "robot.yaml", [tmp_path / f"{n}.yaml" for n in ("lengths", "pose", "winches")])


@pytest.mark.parametrize("what", COLUMNS)
def test_wrong_columns_and_rows_are_named(run, tmp_path, what):
    change, said = COLUMNS[what]
    _, nominal, table, _ = run
    files = rig.write(tmp_path, nominal, with_currents(table, change), "prior: 0.056", "tension: currents\n")
    told = refused(tmp_path, files)
    assert said in told and "run.csv" in told


@pytest.mark.parametrize("kt", ["prior: 0.056", "free: false"])
@pytest.mark.parametrize("what", STATED)
def test_what_is_wrongly_stated_of_winches_is_named(run, tmp_path, what, kt):
    old, new, said = STATED[what]
    _, nominal, table, _ = run
    files = rig.write(tmp_path, nominal, table, kt, "tension: currents\n")
    text = files[-1].read_text()
    assert old in text
    files[-1].write_text(text.replace(old, new))
    told = refused(tmp_path, files)
    assert said in told and "winches.kt" in told


def test_a_constant_that_nobody_knows_may_be_anything(run, tmp_path):
    _, nominal, table, _ = run
    files = rig.write(tmp_path, nominal, with_currents(table, lambda i: 3 * i), "free: true", "tension: currents\n")
    read_inputs(tmp_path / "robot.yaml", files)
    files = rig.write(tmp_path, nominal, with_currents(table, lambda i: 3 * i), "free: false", "tension: currents\n")
    with pytest.raises(FormatError, match="an ampere pulls 0.3"):
        read_inputs(tmp_path / "robot.yaml", files)


@pytest.mark.parametrize("still", [range(8), [2], []])
def test_winches_that_stood_still_show_no_friction(run, tmp_path, still):
    _, nominal, table, _ = run
    head, *rows = table.splitlines()
    at = [head.split(",").index(f"v{i}") for i in still]
    cells = [row.split(",") for row in rows]
    for row in cells:
        for i in at:
            row[i] = "0"
    files = rig.write(
        tmp_path, nominal, "\n".join([head, *map(",".join, cells)]) + "\n", "prior: 0.056", "tension: currents\n"
    )
    read = read_inputs(tmp_path / "robot.yaml", files)
    findings = list(unseen_friction.run(Context(read.opened.file.machine, read.data)))
    assert [f.numbers["joints"] for f in findings] == ([tuple(f"c{i + 1}" for i in still)] if still else [])


def test_numbers_of_winches_have_their_units():
    from robocal.files.cable.cable_model import CableUnits
    from robocal.files.display import display_unit

    assert [CableUnits().of(u).name for u in ("N m/A", "N m", "N m s/rad", "1", "")] == [
        "N m/A",
        "N m",
        "N m s/rad",
        "1",
        "1",
    ]
    assert display_unit("N m").name in ("Nm", "N m") and display_unit("m").name == "mm" and display_unit("").name == "1"


def test_winches_that_all_moved_one_way_have_a_torque_constant(tmp_path, run):
    """Friction is then a constant of each, and little of the weight is left to k: rows in newtons made it half, and refused right currents."""
    _, nominal, table, numbers = run
    kt, coulomb = numbers["winches.kt"], np.array([numbers[f"winches.c{i + 1}.coulomb"] for i in range(8)])
    head, rows, part = currents_of(table)
    speeds = slice(part.stop, part.stop + 8)
    for row in rows:
        current, speed = (np.array(row[p], float) for p in (part, speeds))
        row[part] = [f"{v:.6f}" for v in current + coulomb * (np.sign(speed) - 1) / kt]
        row[speeds] = [f"{abs(v):.6f}" for v in speed]
    data = rig.write(
        tmp_path, nominal, "\n".join([head, *(",".join(r) for r in rows)]) + "\n", "prior: 0.056", "tension: currents\n"
    )
    assert read_inputs(tmp_path / "robot.yaml", data).data.observations

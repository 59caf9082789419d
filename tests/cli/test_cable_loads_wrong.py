"""Loads of a cable that contradict the robot's file, each other, or what any cable does; tensions of a list that no cable bears."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal
from cli.test_cable_straightness import ROBOT, elongations

from robocal.errors import FormatError
from robocal.session.cable.load_fits import fit_loads

CABLES = [f"c{i + 1}" for i in range(8)]
HEAD = "x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]"


def sags(seed=0, noise=0.3, count=12):
    rng = np.random.default_rng(seed)
    t = np.linspace(4, 20, count)
    y = 1e3 * 0.122 * 4.925**2 / (8 * t) + rng.normal(0, noise, count)
    return "tension [N],sag [mm],span [mm]\n" + "".join(f"{a:.1f},{b:.2f},4925\n" for a, b in zip(t, y, strict=True))


def off(text, row, by):
    lines = text.splitlines()
    cells = lines[row].split(",")
    lines[row] = ",".join([cells[0], f"{float(cells[1]) + by:.4f}", cells[2]])
    return "\n".join(lines) + "\n"


def standing(text):
    """A gauge that shows the same whatever hangs there."""
    head, *rows = text.splitlines()
    return "\n".join([head, *(f"{r.split(',')[0]},{37 + 0.1 * (i % 3)},4925" for i, r in enumerate(rows))]) + "\n"


def shuffled(text):
    """Every tension beside the sag of another load."""
    head, *rows = text.splitlines()
    tensions = np.random.default_rng(1).permutation([r.partition(",")[0] for r in rows])
    return "\n".join([head, *(f"{t},{r.partition(',')[2]}" for t, r in zip(tensions, rows, strict=True))]) + "\n"


def one_tension(text):
    head, *rows = text.splitlines()
    return "\n".join([head, *(f"10,{r.partition(',')[2]}" for r in rows)]) + "\n"


def loads(folder, text, elasticity=2.5e-5):
    (folder / "loads.csv").write_text(text)
    return fit_loads([folder / "loads.csv"], 0.122, elasticity)


def codes(remarks):
    return {r.code for r in remarks}


# obeys: loads-unlike
# obeys: loads-copied
# obeys: loads-unexplained
# obeys: loads-scatter
WRONG = {
    "kN, elongation": (elongations, lambda t: t.replace("[N]", "[kN]"), "loads-unlike"),
    "kN, sag": (sags, lambda t: t.replace("[N]", "[kN]"), "loads-unlike"),
    "m for mm": (elongations, lambda t: t.replace("length [mm]", "length [m]"), "loads-unlike"),
    "um for mm": (sags, lambda t: t.replace("sag [mm]", "sag [um]"), "loads-unlike"),
    "twice": (sags, lambda t: t + t.split("\n", 1)[1], "loads-copied"),
    "a gauge that stands": (sags, standing, "loads-unexplained"),
    "shuffled": (sags, shuffled, "loads-scatter"),
    "one tension for all": (sags, one_tension, "loads-scatter"),
}


@pytest.mark.parametrize("what", WRONG)
def test_loads_that_contradict_are_not_trusted(tmp_path, what):
    make, change, code = WRONG[what]
    made = loads(tmp_path, change(make()))
    assert codes(made.refused) == {code}
    made = loads(tmp_path, make())  # as the advice says
    assert not made.refused and not made.notes


def test_status_3_says_which_unit_may_be_wrong(tmp_path):
    (tmp_path / "loads.csv").write_text(elongations().replace("[N]", "[kN]"))
    ran = robocal("cable", "straightness", ROBOT, "--loads", tmp_path / "loads.csv")
    told = " ".join(ran.out.split())
    assert (
        ran.status == 3
        and "times as much" in told
        and "robot's file 2.5e-05" in told
        and "tension, elongation, length" in told
    )


# obeys: loads-row
@pytest.mark.parametrize(("make", "row", "by"), [(elongations, 10, 5.0), (elongations, 3, -0.4), (sags, 5, 30.0)])
def test_one_gross_load_is_named(tmp_path, make, row, by):
    made = loads(tmp_path, off(make(), row, by))
    (said,) = made.notes
    assert said.code == "loads-row" and dict(said.items)["row"] == row + 1
    assert not loads(tmp_path, make()).notes


def test_right_loads_name_few_rows(tmp_path):
    named = [len(loads(tmp_path, make(seed=s)).notes) for s in range(20) for make in (sags, elongations)]
    assert sum(named) <= 3  # of 40 tables one in a hundred names a row, and 5 % leave the file's number out


# obeys: loads-other
def test_another_rope_than_the_file_has_is_said(tmp_path):
    made = loads(tmp_path, elongations(), elasticity=2e-5)
    (said,) = made.notes
    assert said.code == "loads-other" and not made.refused
    assert not loads(tmp_path, elongations(), elasticity=dict(said.items)["found"].value).notes


@pytest.mark.parametrize("rows", [["10,37,4925"], ["10,37,4925"] * 5])
def test_one_reading_tells_no_error(tmp_path, rows):
    with pytest.raises(FormatError, match="too few loads to tell their error") as told:
        loads(tmp_path, "tension [N],sag [mm],span [mm]\n" + "\n".join(rows) + "\n")
    assert "places" not in str(told.value) and "joint" not in str(told.value)


def listed(folder, heads, *rows):
    (folder / "poses.csv").write_text(f"{HEAD},{','.join(heads)}\n" + "".join(f"0,0,1.8,0,0,0,{r}\n" for r in rows))
    return robocal("cable", "straightness", ROBOT, "--poses", folder / "poses.csv")


TWENTY = ",".join(["20"] * 8)


@pytest.mark.parametrize("name", ["{}.tension [N]", "{} [N]", "t{n} [N]", "t{n} [kN]"])
def test_tensions_of_a_list_by_their_units(tmp_path, name):
    heads = [name.format(c, n=i + 1) for i, c in enumerate(CABLES)]
    row = TWENTY.replace("20", "0.02") if "kN" in name else TWENTY
    ran = listed(tmp_path, heads, row)
    assert ran.status == 0 and "tensions 20.00 to 20.00 N" in ran.out


@pytest.mark.parametrize(
    ("heads", "said"),
    [
        ([f"t{i + 1} [N]" for i in range(7)], "a tension of every cable is needed"),
        ([f"t{i + 1} [N]" for i in range(9)], "a tension of no cable"),
        ([*(f"{c} [N]" for c in CABLES[:7]), "c8 [mm]"], "a tension of every cable is needed"),
        ([f"t{i + 1} [mm]" for i in range(8)], "columns that are not read"),
        ([*(f"{c}.tension [N]" for c in CABLES[:7]), "c8.tension [mm]"], "a force is needed"),
    ],
)
def test_tensions_of_other_cables_are_named(tmp_path, heads, said):
    ran = listed(tmp_path, heads, ",".join(["20"] * len(heads)))
    assert said in " ".join((ran.out + ran.err).split()) and "Traceback" not in ran.err


# obeys: cable-hangs-slack
# obeys: cable-too-light
@pytest.mark.parametrize(("old", "new"), [("value: 0.000122", "value: 1.22e-7"), ("value: 2.5e-5", "value: 2.5e-8")])
def test_cables_of_no_material_are_told(tmp_path, old, new):
    text = Path(ROBOT).read_text()
    for status, written in ((3, text.replace(old, new)), (0, text)):
        (tmp_path / "robot.yaml").write_text(written)
        ran = robocal("cable", "straightness", tmp_path / "robot.yaml", "--json")
        assert ran.status == status and ("cable-too-light" in ran.out) == (status == 3)


# obeys: tensions-beyond
@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        ("0", "N", "t5.csv: the tension"),
        ("0.01", "N", "does not carry its weight"),
        ("20", "kN", "the robot's file allows 20 to 125 N"),
    ],
)
def test_a_tension_that_no_cable_bears(tmp_path, value, unit, said):
    heads = [f"t{i + 1} [{unit}]" for i in range(8)]
    wrong = [value] * 8 if unit == "kN" else [*["20"] * 4, value, *["20"] * 3]
    ran = listed(tmp_path, heads, ",".join(wrong), TWENTY if unit == "N" else ",".join(wrong))
    expected = said.replace("t5.csv", "poses.csv:2").replace("the tension", "the tension of c5")
    assert ran.status == 3 and expected in " ".join(ran.out.split())
    assert listed(tmp_path, [f"t{i + 1} [N]" for i in range(8)], TWENTY).status == 0


def test_files_are_named_as_they_were_given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("loads.csv").write_text("tension [N],sag [mm]\n10,37\n")
    ran = robocal("cable", "straightness", ROBOT, "--loads", "loads.csv")
    assert ran.status == 2 and "error: loads.csv, key span" in " ".join(ran.err.split())


# obeys: tensions-beyond
# obeys: stretch-beyond
# obeys: span-unlike
@pytest.mark.parametrize(
    ("wrong", "right", "code", "status"),
    [
        (("--tension", "0.03"), ("--tension", "30"), "tensions-beyond", 3),  # kN
        (("--tension", "30000"), ("--tension", "30"), "tensions-beyond", 3),  # mN
        (("--tension", "30000"), ("--tension", "30"), "stretch-beyond", 3),
        (("--at", "100000"), ("--at", "100"), "tensions-beyond", 3),
        (("--span", "4.925"), ("--span", "4925"), "span-unlike", 3),  # m
        (("--span", "4925000"), ("--span", "4925"), "span-unlike", 3),
    ],
)
def test_options_in_another_unit_are_named(wrong, right, code, status):
    ran = robocal("cable", "straightness", ROBOT, *wrong, "--json")
    assert ran.status == status and code in {r["code"] for r in json.loads(ran.out)["remarks"]}
    ran = robocal("cable", "straightness", ROBOT, *right, "--json")
    assert ran.status == 0 and code not in {r["code"] for r in json.loads(ran.out)["remarks"]}


def test_an_elasticity_that_no_rope_has_is_told(tmp_path):
    (tmp_path / "robot.yaml").write_text(Path(ROBOT).read_text().replace("value: 2.5e-5", "value: 25"))
    ran = robocal("cable", "straightness", tmp_path / "robot.yaml")
    assert ran.status == 3 and "a rope breaks before" in " ".join(ran.out.split())

"""Currents of winches that a run has identified, in place of load cells: lists whose tensions follow from them."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cli.runs import robocal

from robocal.session.cable.winch_run import RunWinches

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))
import winch_currents as rig

sys.path.pop(0)

CABLES = [f"c{i + 1}" for i in range(8)]


def columns(*stems):
    return [f"{s}{i}" for s in stems for i in range(8)]


def listed(folder, table, name, *, of="lengths", speeds=True, change=lambda v: v):
    """Rows of a recorded table as a list of lengths or poses with currents beside them."""
    head, *rows = table.splitlines()
    at = {h: i for i, h in enumerate(head.split(","))}
    taken = columns("l") if of == "lengths" else ["x", "y", "z", "rx", "ry", "rz"]
    heads = (
        [f"{c} [mm]" for c in CABLES] if of == "lengths" else [f"{n} [{'deg' if 'r' in n else 'mm'}]" for n in taken]
    )
    taken, heads = [*taken, *columns("i")], [*heads, *(f"{c}.current [A]" for c in CABLES)]
    if speeds:
        taken, heads = [*taken, *columns("v")], [*heads, *(f"{c}.speed [mm/s]" for c in CABLES)]
    values = np.array([[float(r.split(",")[at[n]]) for n in taken] for r in rows])
    values = change(values)
    text = "\n".join([",".join(heads), *(",".join(f"{v:.6f}" for v in row) for row in values)]) + "\n"
    (folder / name).write_text(text)
    return folder / name


def test_tensions_of_a_run(rng):
    m = len(CABLES)
    names = {"w.kt": (0.5, None), "w.ratio": (40.0, None)}
    names |= {f"w.{c}.{s}": (0.0, v) for c in CABLES for s, v in (("coulomb", 0.1), ("viscous", 0.01))}
    names["w.ratio"] = (0.04, None)  # 1/mm
    units = {"kt": "N m/A", "ratio": "1/mm", "coulomb": "N m", "viscous": "N m s/rad"}
    rows = [
        SimpleNamespace(name=n, nominal=a, identified=b, unit=units[n.rpartition(".")[2]])
        for n, (a, b) in names.items()
    ]
    run = SimpleNamespace(result=SimpleNamespace(parameters=rows))
    found = RunWinches.of(run, SimpleNamespace(cables=CABLES))
    current, speed = rng.uniform(1, 5, (3, m)), rng.choice([-0.01, 0.0, 0.01], (3, m))
    expected = 40.0 * (0.5 * current + 0.1 * np.sign(speed) + 0.01 * 40.0 * speed)
    np.testing.assert_allclose(found.tension(current, speed), expected)
    assert RunWinches.of(None, SimpleNamespace(cables=CABLES)) is None


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    folder = tmp_path_factory.mktemp("winches")
    truth, nominal, table, _ = rig.draw(1)
    files = rig.write(folder, nominal, table, "prior: 0.056", "tension: currents\n")
    assert robocal("identify", folder / "robot.yaml", *files, "-o", folder / "run").status == 0
    return folder, truth, table


@pytest.mark.slow
def test_poses_from_lengths_and_currents(identified):
    folder, _, table = identified
    ran = robocal("cable", "forward", folder / "run", listed(folder, table, "list.csv"), "--json")
    assert ran.status == 0 and "tensions follow from the currents" in ran.err
    found = {c["name"]: c["values"] for c in json.loads(ran.out)["poses"]["columns"]}
    head, *rows = table.splitlines()
    at = [head.split(",").index(n) for n in "xyz"]
    seen = np.array([[float(r.split(",")[i]) for i in at] for r in rows])
    off = 1e3 * np.column_stack([found[n] for n in "xyz"]) - seen
    assert np.sqrt(np.mean(off**2)) < 0.5  # mm; the instrument alone errs by 0.2, without tensions it is 1.8


@pytest.mark.slow
def test_other_lists_with_currents(identified):
    folder, truth, table = identified
    poses = listed(folder, table, "poses.csv", of="poses")
    own = folder / "run" / "calibrated.yaml"
    for verb in (["inverse", own, poses], ["forward", own, folder / "list.csv"]):
        if verb[0] == "forward":
            listed(folder, table, "list.csv")
        ran = robocal("cable", *verb, "--json")
        assert ran.status == 0 and "tensions follow from the currents" in ran.err
    sags = folder / "sag.csv"
    sags.write_text("tension [N],sag [mm],span [mm]\n10,37,4925\n15,24.6,4925\n20,18.6,4925\n")
    ran = robocal("cable", "straightness", folder / "run", "--poses", poses, "--loads", sags)
    assert ran.status == 0 and "tensions follow from the currents" in " ".join(ran.out.split())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"speeds": False}, "friction without a direction"),
        ({"change": lambda v: v * np.array([1.0] * 8 + [-1.0] * 8 + [1.0] * 8)}, "a cable cannot push"),
        ({"change": lambda v: np.where(np.arange(24) == 9, np.nan, v)}, "not a finite number"),
    ],
)
def test_wrong_currents_of_a_list(identified, more, said):
    folder, _, table = identified
    ran = robocal("cable", "forward", folder / "run", listed(folder, table, "wrong.csv", **more))
    assert ran.status == 2 and said in " ".join(ran.err.split()) and "Traceback" not in ran.err


def test_winches_that_nobody_knows(tmp_path):
    _, nominal, table, _ = rig.draw(1)
    rig.write(tmp_path, nominal, table, "prior: 0.056", "")
    rows = listed(tmp_path, table, "list.csv")
    ran = robocal("cable", "forward", tmp_path / "robot.yaml", rows)
    assert ran.status == 2 and "currents of winches that nobody knows" in ran.err
    text = rows.read_text()
    rows.write_text(text.replace("c3.current [A]", "c3.curent [A]"))
    ran = robocal("cable", "forward", tmp_path / "robot.yaml", rows)
    assert ran.status == 2 and "c3.current" in ran.err
    rows.write_text(text.replace("c3.current [A]", "c3.current [N]"))
    ran = robocal("cable", "forward", tmp_path / "robot.yaml", rows)
    assert ran.status == 2 and "another quantity" in ran.err

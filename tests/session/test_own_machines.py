"""A turntable and a motor of the tests' own go through the verbs like any machine, and no source file knows of them."""

from __future__ import annotations

import json

import pytest
from cli.runs import robocal
from session.own_machines import Motor, files_of, register_all, turntable

from robocal.errors import ModelError
from robocal.files.units import Units
from robocal.files.yamlio import load
from robocal.session.inputs import register_machine

MACHINES = {"motor": (Motor(), "data.csv", "fresh.csv"), "turntable": (turntable(), "data.yaml", "fresh.yaml")}


@pytest.fixture(autouse=True)
def known():
    register_all()


@pytest.mark.parametrize("kind", MACHINES)
def test_check_simulate_identify_validate(kind, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "500")  # no path is broken
    machine, data, fresh = MACHINES[kind]
    own = tmp_path / "own.yaml"
    own.write_text(files_of(machine, machine, "", Units(), kind)["robot.yaml"])
    alone = robocal("check", own, "--json")
    assert alone.status == 0 and json.loads(alone.out)["free"] == list(machine.table.free)
    sim = tmp_path / "sim"
    asked = ("simulate", own, "-n", 60, "--fresh", 30, "--set", f"{machine.table.free[0]}=1.004", "-o", sim)
    made = robocal(*asked)
    assert made.status == 0 and f"identify {sim}/robot.yaml {sim}/{data}" in " ".join(made.out.split()), made.err
    seen = robocal("check", sim / "robot.yaml", sim / data, "--json")
    assert seen.status == 0 and json.loads(seen.out)["identifiability"]["rank"] == len(machine.table.free), seen.err
    found = robocal("identify", sim / "robot.yaml", sim / data, "-o", sim / "run", "--json")
    result = json.loads(found.out)
    assert found.status == 0 and result["verdict"]["status"] == "improved", found.err
    truth, unit = load(sim / "truth.yaml").data["parameters"], 0
    for p in result["parameters"]:
        if p["status"] == "identified" and p["name"] in truth:
            unit += 1
            assert abs(p["identified"] - float(truth[p["name"]]["value"])) < 4.5 * p["sigma"], p
    assert unit == len(machine.table.free)
    judged = robocal("validate", sim / "run", sim / fresh, "--against", sim / "robot.yaml", "--json")
    said = json.loads(judged.out)
    what = said["errors"] if kind == "turntable" else said["angle"]
    assert what["this"]["mean"] < 0.3 * what["against"]["mean"]
    assert judged.status == (0 if kind == "turntable" else 3), said[
        "reasons"
    ]  # of angles alone `validate` trusts no figure
    again = robocal("validate", sim / "run", sim / data, "--json")
    assert again.status == 3 and any("fitted" in r for r in json.loads(again.out)["reasons"])


@pytest.mark.parametrize("kind", MACHINES)
def test_what_such_a_machine_lacks_is_said(kind, tmp_path):
    machine, *_ = MACHINES[kind]
    own = tmp_path / "own.yaml"
    own.write_text(files_of(machine, machine, "", Units(), kind)["robot.yaml"])
    for words in (("plan", own), ("export", own, "--format", "dh"), ("identify", own, own, "--layer")):
        said = robocal(*words)
        assert said.status == 2 and f"{kind}" in said.err and "arm" in said.err, said.err


def test_a_kind_of_machine_is_registered_once():
    with pytest.raises(ModelError, match="registered"):
        register_machine("cable", lambda name, base, tip: None)

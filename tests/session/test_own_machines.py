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


def calibrated(folder, own, kind, seed, many=60, **values):
    """The run folder of a simulated machine whose free parameters are as given, nominal otherwise."""
    machine, data, _ = MACHINES[kind]
    there = {n: machine.table[n].value for n in machine.table.free} | values
    units = {n: Units().of(machine.table[n].unit) for n in there}
    words = [w for n, v in there.items() for w in ("--set", f"{n}={units[n].from_si(v)}")]
    made = robocal("simulate", own, "-n", many, "--seed", seed, *words, "-o", folder)
    assert made.status == 0, made.err
    found = robocal("identify", folder / "robot.yaml", folder / data, "-o", folder / "run")
    assert found.status == 0, found.err
    return folder / "run"


@pytest.mark.parametrize(("kind", "changed", "value"), [("motor", "motor.sine", 0.01), ("turntable", "plate.x", 0.201)])
def test_drift_names_what_changed(kind, changed, value, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "500")
    machine, joints = MACHINES[kind][0], kind == "turntable"
    own = tmp_path / "own.yaml"
    own.write_text(files_of(machine, machine, "", Units(), kind)["robot.yaml"])
    start = {machine.table.free[0]: 1.004}
    first, again = (calibrated(tmp_path / f"sim{seed}", own, kind, seed, **start) for seed in (1, 2))
    worn = calibrated(tmp_path / "sim3", own, kind, 3, **start, **{changed: value})

    same = robocal("drift", first, again, "--json")
    document = json.loads(same.out)
    assert same.status == 0 and document["joint_test"]["p_value"] > 1e-3, same.err
    assert document["joint_test"]["rank"] == len(machine.table.free)
    assert document["verdict"]["status"] == ("unchanged" if joints else "possible")
    if not joints:
        assert document["verdict"]["reasons"][0].startswith("nothing changed by more than chance")

    moved = robocal("drift", first, worn, "-o", tmp_path / "out")
    assert moved.status == 0 and "DRIFTED" in moved.out and f"the change shows in {changed}" in moved.out, moved.err
    document = json.loads((tmp_path / "out" / "drift.json").read_text())
    assert document["verdict"]["status"] == "drifted" and (document["change"] is not None) == joints
    top = min(document["changes"], key=lambda c: c["p_of_all"])
    assert top["name"] == changed == document["single_causes"][0]["name"]
    step = Units().of(machine.table[changed].unit).from_si(value - machine.table[changed].value)
    assert abs(top["change"] - step) < 4.5 * top["sigma"]

    for words in [("--new-tool",), *([] if joints else [("--matters", "1mm")])]:
        said = robocal("drift", first, again, *words)
        assert said.status == 2 and words[0] in said.err and f"nothing, for a {kind}" in said.err, said.err
    beside = robocal("drift", worn, tmp_path / "sim3" / "truth.yaml", "--json")
    assert beside.status == 0 and json.loads(beside.out)["verdict"]["consistent"], beside.err


# obeys: no-change-found
def test_more_measurements_find_a_smaller_change(tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text(files_of(Motor(), Motor(), "", Units(), "motor")["robot.yaml"])
    for many, said in ((12, "nothing changed by more than chance"), (3000, "the change shows in motor.sine")):
        pair = [
            calibrated(tmp_path / f"{many}-{k}", own, "motor", k, many=many, **{"motor.gain": 1.004, "motor.sine": s})
            for k, s in ((1, 0.0), (2, 1e-4))
        ]
        assert said in robocal("drift", *pair).said


def test_machines_of_two_kinds_are_not_compared(tmp_path):
    runs = []
    for kind, (machine, *_) in MACHINES.items():
        own = tmp_path / f"{kind}.yaml"
        own.write_text(files_of(machine, machine, "", Units(), kind)["robot.yaml"])
        runs.append(calibrated(tmp_path / kind, own, kind, 1, **{machine.table.free[0]: 1.004}))
    said = robocal("drift", *runs)
    assert said.status == 2 and "different robots" in said.err


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

"""Every kind of measurement through the command line: simulated, checked, identified; and whatever is broken is said."""

from __future__ import annotations

import random

import numpy as np
import pytest
from cli.mutations import SLIPS as ANY
from cli.runs import ROBOT, files, robocal
from cli.test_mutations import true_error
from files.kind_samples import KINDS

from robocal.files.robot import read_robot

# What is wrong with the true arm, in mm and deg.
WRONG = ("j2.d=41.2", "j3.d=248.9", "j2.theta=-89.7", "j3.theta=0.4", "j3.alpha=20.3")


def simulated(folder, kind, poses=40):
    """A folder with robot, data and truth."""
    folder.mkdir(exist_ok=True)
    (folder / "arm.yaml").write_text(ROBOT, encoding="utf-8")
    settings = [word for setting in WRONG for word in ("--set", setting)]
    quiet = ("--length-error", 0, "--angle-error", 0)
    made = robocal(
        "simulate", folder / "arm.yaml", "--kind", kind, "-n", poses, "-o", folder / "sim", *quiet, *settings
    )
    assert made.status == 0, made.err
    return folder / "sim"


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", KINDS)
def test_simulate_and_identify(tmp_path, kind):
    """The errors fall where nobody looked, and the model comes nearer to the truth."""
    sim = simulated(tmp_path, kind)
    assert robocal("check", sim / "robot.yaml", sim / "data.yaml", "--json").status == 0
    ran = robocal("identify", sim / "robot.yaml", sim / "data.yaml", "--json")
    assert ran.status == 0, ran.out
    found = ran.document
    left = found["residuals"]
    # What is held out hangs on the places: a tip in a socket stands at few, and a fifth of few is likely to prove too little.
    how = next(h for h in ("held_out", "k_fold", "leave_one_out") if left[h])
    assert found["verdict"]["status"] == "improved" and left[how]["mean"] < 0.7 * left[f"{how}_before"]["mean"]
    nominal, truth = read_robot(sim / "robot.yaml").chain, read_robot(sim / "truth.yaml").chain
    unit = read_robot(sim / "robot.yaml").unit_of
    values = {
        p["name"]: unit(p["name"]).to_si(p["identified"]) for p in found["parameters"] if p["name"] in nominal.table
    }
    before, after = true_error(nominal, truth), true_error(nominal.with_values(values), truth)
    assert before > 1.0 and after < 0.25 * before


@pytest.mark.sampled(1)
@pytest.mark.parametrize("kind", KINDS)
def test_a_template_of_every_kind_passes_the_check(tmp_path, kind):
    assert robocal("new", "rv-2aj", "--kind", kind, "-o", tmp_path).status == 0
    assert files(tmp_path) == {"robot.yaml", "data.yaml", "measurements.csv"}
    ran = robocal("check", tmp_path / "robot.yaml", tmp_path / "data.yaml", "--json")
    assert ran.status == 0, ran.err
    document = ran.document
    # The example rows are the nominal robot's own: it fits them.
    misfit = document["baseline_error"] and document["baseline_error"]["mean"]
    assert {i["kind"] for i in document["instruments"]} == {kind} and (misfit is None or misfit < 0.01)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_of_every_kind(tmp_path, kind):
    """One damage after the other: one message or a result, never a traceback, and nothing half-written."""
    sim = simulated(tmp_path, kind, poses=8)
    texts = {name: (sim / name).read_text(encoding="utf-8") for name in ("data.yaml", "data.csv")}
    rng = random.Random(kind)
    ends = {0: 0, 2: 0, 3: 0}
    for _ in range(14):
        name = rng.choice(("data.yaml", "data.yaml", "data.csv"))
        broken = rng.choice(ANY)(rng, texts[name])
        (sim / name).write_bytes(broken.encode("utf-8", "surrogateescape"))
        ran = robocal("check", sim / "robot.yaml", sim / "data.yaml", "--json")
        assert "Traceback" not in ran.err and ran.status in ends, f"{name}\n{broken}\n{ran.err}"
        ends[ran.status] += 1
        if ran.status == 2:
            ran.assert_refused()
        (sim / name).write_text(texts[name], encoding="utf-8")
    assert ends[2] > 1, ends


def test_degrees_for_radians_without_positions(tmp_path):
    """Contacts have no positions to look at; the misfit tells all the same."""
    sim = simulated(tmp_path, "point")
    text = (sim / "data.csv").read_text(encoding="utf-8")
    head, names, *rows = text.splitlines()
    places = [i for i, n in enumerate(names.split(",")) if "[deg]" in n]
    out = []
    for row in rows:
        cells = row.split(",")
        for i in places:
            cells[i] = repr(float(np.radians(float(cells[i]))))
        out.append(",".join(cells))
    (sim / "data.csv").write_text("\n".join([head, names, *out]) + "\n", encoding="utf-8")
    robocal("check", sim / "robot.yaml", sim / "data.yaml").assert_refused("joints", "rad", "deg")


@pytest.mark.parametrize("kind", ["point", "distance"])
def test_places_are_held_and_freed_by_name(tmp_path, kind):
    sim = simulated(tmp_path, kind)
    name = {"point": "a", "distance": "socket"}[kind]
    ran = robocal("identify", sim / "robot.yaml", sim / "data.yaml", "--fix", name, "--json")
    assert ran.status in (0, 3)
    status = {p["name"]: p["status"] for p in ran.document["parameters"]}
    assert {status.get(f"{name}.{s}", "fixed") for s in "xyz"} == {"fixed"}


def test_contacts_follow_from_the_arm(tmp_path):
    sim = simulated(tmp_path, "position", poses=4)
    robocal(
        "simulate", sim / "robot.yaml", "--kind", "point", "--at", sim / "data.yaml", "-o", tmp_path / "x"
    ).assert_refused("--at")
    robocal("simulate", sim / "robot.yaml", "--kind", "pont", "-o", tmp_path / "x").assert_refused(
        "did you mean 'point'"
    )
    assert not files(tmp_path / "x")


def test_two_kinds_in_one_identification(tmp_path):
    """Sockets and a bar of one robot: each with its own place and sigma, chi2 per group."""
    one, two = (simulated(tmp_path / kind, kind) for kind in ("point", "distance"))
    ran = robocal("identify", one / "robot.yaml", one / "data.yaml", two / "data.yaml", "--json")
    assert ran.status == 0, ran.err
    groups = {g["name"]: g for g in ran.document["fit"]["groups"]}
    assert set(groups) == {"a", "b", "a-b", "bar"}
    assert all(0.4 < g["chi2"] / g["dof"] < 1.8 for g in groups.values() if g["n"] > 10)

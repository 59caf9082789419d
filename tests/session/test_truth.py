"""drift RUN truth.yaml: errors of identified parameters by group, in their standard deviations; for arms and cable robots."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from called import drift, identify, simulate
from cli.runs import robocal

from robocal.apply.truth import CHANCE, compare_truth
from robocal.errors import FileError, ModelError
from robocal.estimate.uncertainty import Total
from robocal.files.robot import read_robot, render_robot
from robocal.geometry import so3
from robocal.parameters import Parameter, ParameterTable, frame_parameters
from robocal.remarks.code import Code


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A simulated arm, and a run of it."""
    folder = tmp_path_factory.mktemp("truth")
    simulate("rv-2aj", folder / "sim", poses=60, seed=3)
    choices = {"leave_one_out": False}
    identify(str(folder / "sim" / "robot.yaml"), [str(folder / "sim" / "data.yaml")], choices, output=folder / "run")
    return folder


def codes(found):
    return {r.code for r in found.reasons}


def test_errors_of_a_simulated_arm_are_as_large_as_their_sigmas_say(place):
    found = drift(place / "run", place / "sim" / "truth.yaml")
    whole = found.errors.total
    assert not found.errors.named and codes(found) == {Code.TRUTH_MET}
    assert whole.p_value > CHANCE and whole.within >= 0.8 * whole.n and whole.rank == whole.n > 10
    names = [g.group for g in found.groups]
    assert names[:3] == ["all", "lengths", "angles"] and {"j2", "j3", "tool"} <= set(names)
    by_name = {g.group: g for g in found.groups}
    assert by_name["lengths"].n + by_name["angles"].n == whole.n == sum(by_name[g].n for g in names[3:])
    # By hand: what result.json calls identified less what truth.yaml says, in mm.
    truth = read_robot(place / "sim" / "truth.yaml").chain.table
    result = json.loads((place / "run" / "result.json").read_text())
    identified = {p["name"]: p for p in result["parameters"] if p["status"] in ("identified", "prior")}
    lengths = [p for p in found.parameters if p.unit == "mm"]
    for p in lengths:
        assert p.error == pytest.approx(identified[p.name]["identified"] - 1e3 * truth[p.name].value, abs=1e-9)
        assert p.sigma == pytest.approx(identified[p.name]["sigma"]) and p.sigmas == pytest.approx(p.error / p.sigma)
    (size,) = by_name["lengths"].sizes
    assert size.unit == "mm" and size.rms == pytest.approx(np.sqrt(np.mean([p.error**2 for p in lengths])))
    assert size.largest == pytest.approx(max(abs(p.error) for p in lengths))


def test_a_parameter_that_is_ten_sigmas_off_is_named(place, tmp_path):
    sound = drift(place / "run", place / "sim" / "truth.yaml")
    p = next(p for p in sound.parameters if p.name == "j3.d")
    robot = read_robot(place / "sim" / "truth.yaml")
    moved = tmp_path / "truth.yaml"
    value = robot.chain.table["j3.d"].value + 10e-3 * p.sigma
    moved.write_text(render_robot(robot, {"j3.d": value})[0])
    found = drift(place / "run", moved)
    assert found.errors.named == ("j3.d",) and codes(found) == {Code.TRUTH_MISSED, Code.TRUTH_MISSED_BY}
    assert next(q for q in found.parameters if q.name == "j3.d").sigmas == pytest.approx(p.sigmas - 10, abs=1e-3)
    by_name = {g.group: g for g in found.groups}
    assert by_name["j3"].p_value < 1e-6 and by_name["tool"].p_value > CHANCE
    ran = robocal("drift", place / "run", moved)
    assert ran.status == 0 and "j3.d" in ran.out


def test_document_page_and_status(place, tmp_path):
    ran = robocal("drift", place / "run", place / "sim" / "truth.yaml", "-o", tmp_path / "out", "--json")
    found = json.loads(ran.out)
    assert ran.status == 0 and found["verdict"]["consistent"] is True and found["far"] == []
    written = json.loads((tmp_path / "out" / "drift.json").read_text())
    assert written["groups"] == found["groups"] and written["parameters"] == found["parameters"]
    read = [Path(i["file"]).name for i in found["provenance"]["inputs"]]
    assert read[0] == "calibrated.yaml" and read[-2:] == ["covariance.json", "truth.yaml"]
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Errors by group" in page and "j3.d" in page
    again = robocal("drift", place / "run", place / "sim" / "truth.yaml", "-o", tmp_path / "out")
    assert again.status == 2 and "--force" in again.remarks


def test_a_robot_in_a_urdf_has_its_truth_too_and_what_was_held_at_other_values_is_named(tmp_path):
    """The fixed joint behind the flange has errors in the simulation, and no run frees it: the tool carries them."""
    assert robocal("export", "ur10", "--format", "urdf", "-o", tmp_path / "robot.urdf").status == 0
    simulate(str(tmp_path / "robot.urdf"), tmp_path / "sim", poses=50, seed=1)
    choices = {"leave_one_out": False}
    identify(
        str(tmp_path / "sim" / "robot.urdf"), [str(tmp_path / "sim" / "data.yaml")], choices, output=tmp_path / "run"
    )
    found = drift(tmp_path / "run", tmp_path / "sim" / "truth.urdf")
    (held,) = [r for r in found.remarks if r.code is Code.TRUTH_HELD]
    assert {n.partition(".")[0] for n in held.numbers["names"]} == {"tool_fixed"}
    assert {n.partition(".")[0] for n in found.errors.named} == {"tool"}
    by_name = {g.group: g for g in found.groups}
    assert all(by_name[f"j{i}"].p_value > CHANCE for i in range(2, 7)) and by_name["tool"].p_value < 1e-6


@pytest.mark.parametrize(
    ("options", "words"),
    [({"new_tool": True}, "two runs"), ({"matters": "1mm"}, "two runs"), ({"history": "h.csv"}, "two runs")],
)
def test_what_is_of_two_runs_is_refused_beside_a_truth(place, options, words):
    with pytest.raises(ModelError, match=words):
        drift(place / "run", place / "sim" / "truth.yaml", **options)


def test_what_is_no_truth_of_this_run_is_refused(place, tmp_path):
    with pytest.raises(FileError, match="no truth"):
        drift(place / "run", place / "run" / "calibrated.yaml")
    simulate("panda", tmp_path / "other", poses=5)
    with pytest.raises(ModelError, match="another robot"):
        drift(place / "run", tmp_path / "other" / "truth.yaml")
    with pytest.raises(FileError, match="not a run folder"):
        drift(place / "sim", place / "sim" / "truth.yaml")


def test_the_chance_is_what_it_says():
    """Errors drawn from the covariance: in one of twenty comparisons a parameter is named, chi2 is that of so many degrees of freedom,
    and a rotation vector counts as a turn."""
    rng = np.random.default_rng(0)
    rows = (*(Parameter(f"j{i}.d", 0.1 * i) for i in range(6)), *frame_parameters("tool", (0.1, 0, 0, 2.0, 0.5, -1.0)))
    truth = ParameterTable(rows)
    names, root = truth.names, np.triu(rng.normal(size=(12, 12))) * 1e-4 + 1e-4 * np.eye(12)
    total = Total(names, root @ root.T, np.zeros((12, 12)), np.full(12, 1e-3))
    named, chi2 = 0, []
    for _ in range(1000):
        e = root @ rng.normal(size=12)
        values = truth.values
        values[:9] += e[:9]
        values[9:] = so3.log(so3.exp(e[9:]) @ so3.exp(truth.values[9:]))
        found = compare_truth(truth.with_values(values), truth, total, names)
        np.testing.assert_allclose([p.error for p in found.parameters], e, atol=1e-12)
        named, chi2 = named + bool(found.named), [*chi2, found.total.chi2]
    assert named < 1000 * (CHANCE + 3 * np.sqrt(CHANCE / 1000))
    assert np.mean(chi2) == pytest.approx(12, abs=4 * np.sqrt(24 / 1000)) and found.total.rank == 12

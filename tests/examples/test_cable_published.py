"""The published cable robots: what the README says of their workspaces, linear programs for random cells, and the data that the
files were written from."""

from __future__ import annotations

import json
import re
import shlex

import numpy as np
import pytest
from cables.rigs import slacks
from cli.runs import robocal
from examples.test_cable_examples import EXAMPLES, commands, readme

from robocal.cables.statics import gravity_wrench, structure
from robocal.files.cable.cable_robot import read_cable

FOLDER = EXAMPLES / "cable-published"
NAMES = ("ipanema-1", "ipanema-2", "ipanema-3", "cogiro")


def said(name):
    """The numbers of a row of the README's table."""
    row = re.search(rf"^\| {name} \|(.*)\|$", readme("cable-published"), re.MULTILINE)[1]
    return [float(cell.replace("%", "")) for cell in row.split("|")]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_workspace(name, tmp_path, monkeypatch, rng):
    monkeypatch.chdir(tmp_path)
    (command,) = (c for c in commands("cable-published") if c.endswith(f"-o {name}"))
    words = shlex.split(command.replace("examples/", f"{EXAMPLES.as_posix()}/"))[1:]
    ran = robocal(*words)
    assert ran.status == 0 and "warning" not in ran.err
    found = json.loads((tmp_path / name / "workspace.json").read_text())
    grid, rays, best = found["grid"], found["rays"], found["best"]
    mass, volume, exact, difference, margin, acceleration = said(name)
    assert found["demand"]["masses"]["value"] == [mass] and (grid["cells"], rays["count"]) == ([41, 41, 41], 4000)
    # The two ways agree within 2 %, and the README says how well.
    assert abs(rays["difference"]) < 0.02 and rays["seen_share"] > 0.99
    assert grid["size"]["value"] == pytest.approx(volume, rel=5e-4) and rays["size"]["value"] == pytest.approx(
        exact, rel=5e-4
    )
    assert 100 * rays["difference"] == pytest.approx(difference, abs=0.01)
    assert best["margin"]["value"] == pytest.approx(margin, rel=1e-3)
    assert best["acceleration"]["value"] == pytest.approx(acceleration, rel=2e-3)
    assert found["reaches_box"] == ["z-"] and found["home"]["held"] == (name != "cogiro")
    cells_agree_with_a_linear_program(FOLDER / f"{name}.yaml", tmp_path / name / "workspace.csv", rng)


def cells_agree_with_a_linear_program(robot, table, rng, count=100):
    file = read_cable(robot).robot
    lines = table.read_text().splitlines()[1:]
    rows = np.array([lines[i].split(",")[:4] for i in rng.permutation(len(lines))[:count]], float)
    pose = np.tile(np.eye(4), (count, 1, 1))
    pose[:, :3, 3] = rows[:, :3]
    w, load = structure(pose, file.a, file.b), gravity_wrench(pose, file.mass, file.com)
    truth = slacks(w, load, file.limits)
    sure = np.abs(truth) > 1e-6
    assert ((truth < 0) == (rows[:, 3] == 1))[sure].all() and sure.sum() > 0.95 * count
    assert 0.2 < rows[:, 3].mean() < 0.8


@pytest.mark.slow
def test_more_is_asked_of_cogiro(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = commands("cable-published")[-1].replace("examples/", f"{EXAMPLES.as_posix()}/")
    found = robocal(*shlex.split(command)[1:], "--cells", 15, "--rays", 1500, "--json").document
    text = re.search(r"up to 5 degrees to any side,\s+has (\d+) m³", readme("cable-published"))
    assert found["demand"]["masses"]["value"] == pytest.approx([91.058, 391.058])
    assert len(found["demand"]["orientations"]["value"]) == 17
    assert found["rays"]["size"]["value"] == pytest.approx(float(text[1]), rel=0.02)


@pytest.mark.parametrize("name", NAMES)
def test_files_hold_the_data_that_they_were_written_from(name, shared_data):
    place = shared_data / "cable-robots" / f"{name.replace('-', '_')}.yaml"
    if not place.is_file():
        pytest.skip(f"{place.name} is not here")
    ours, theirs = read_cable(FOLDER / f"{name}.yaml"), read_cable(place)
    for what in ("a", "b", "zeros", "limits", "com"):
        assert np.array_equal(getattr(ours.robot, what), getattr(theirs.robot, what)), what
    assert ours.robot.mass == theirs.robot.mass and ours.warnings == ()


@pytest.mark.parametrize("name", NAMES)
def test_every_value_has_a_source(name):
    robot = read_cable(FOLDER / f"{name}.yaml").robot
    names = [f"{c}.{what}" for c in robot.cables for what in ("a", "b", "tension")] + ["mass", "com", ""]
    assert all(robot.sources.get(n) for n in names)
    assumed = {f"{c}.tension" for c in robot.cables} if name != "cogiro" else set()
    assert set(robot.assumed) == assumed

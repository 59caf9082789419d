"""UR10, series C, as somebody would have recorded it who knocked the target (or the tracker) halfway: named, refused, and
mended as the advice says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.files.robot import read_robot
from robocal.geometry import se3

EXAMPLE = Path(__file__).parents[2] / "examples" / "ur10-tracker"
HALF = 1386  # of 2773 rows
STEP = 5.0  # mm


def knocked(shared_data, folder, axis, cause):
    """The file with the second half off by STEP along an axis of tool or tracker; returns its first row that is off."""
    source = shared_data / "ur10-laser-tracker" / "Series_C" / "measurements_random_poses.csv"
    lines = source.read_bytes().decode("utf-8-sig").replace("\r\n", "\n").rstrip("\n").split("\n")
    names = lines[0].split(";")
    column = {n: i for i, n in enumerate(names)}
    robot = read_robot(EXAMPLE / "robot.yaml").chain
    place = [column[f"measurement_{a}"] for a in "xyz"]
    turn = [column[f"measurement_r{a}"] for a in "xyz"]
    rows = [line.split(";") for line in lines[1:]]

    def number(row, at):
        return float(rows[row][at].replace(",", "."))

    euler = np.deg2rad([[number(i, c) for c in turn] for i in range(len(rows))])
    measured = (
        se3.so3.exp(euler[:, :1] * [1, 0, 0])
        @ se3.so3.exp(euler[:, 1:2] * [0, 1, 0])
        @ se3.so3.exp(euler[:, 2:] * [0, 0, 1])
    )
    for i in range(HALF, len(rows)):
        away = STEP * np.eye(3)["xyz".index(axis)]
        away = measured[i] @ away if cause == "target" else away
        for c, d in zip(place, away, strict=True):
            rows[i][c] = repr(number(i, c) + float(d)).replace(".", ",")
    assert robot.name
    (folder / "tracker.csv").write_text("\n".join([lines[0], *(";".join(r) for r in rows)]) + "\n")
    text = (EXAMPLE / "data.yaml").read_text().replace("measurements_random_poses.csv", "tracker.csv")
    (folder / "data.yaml").write_text(text)
    return HALF + 2


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "cause"), [("x", "target"), ("z", "target"), ("x", "instrument")])
def test_a_knock_is_named_and_refused(shared_data, tmp_path, monkeypatch, axis, cause):
    first = knocked(shared_data, tmp_path, axis, cause)
    monkeypatch.chdir(tmp_path)
    robot = str(EXAMPLE / "robot.yaml")
    seen = json.loads(robocal("check", robot, "data.yaml", "--json").out)
    (said,) = [r for r in seen["remarks"] if r["code"] == "segment"]
    ran = robocal("identify", robot, "data.yaml", "-o", "run", "--json")
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert ran.status == 3 and result["verdict"]["status"] == "refused"
    for remark in (said, result["verdict"]["remarks"][0]):
        numbers = remark["numbers"]
        print(f"\n{remark['sentence']}\n{remark['advice']}")
        assert abs(numbers["first"] - first) <= 10 and numbers["last"] == 2774 and numbers["moved"] == cause
        assert numbers["shift"]["value"] == pytest.approx(STEP, rel=0.05)


@pytest.mark.slow
def test_the_advice_mends_it(shared_data, tmp_path, monkeypatch):
    """Two data files over one table, each without the other's rows, the second with a target of its own: the gain is within
    15 % of the clean file's."""
    first = knocked(shared_data, tmp_path, "z", "target")
    text = (tmp_path / "data.yaml").read_text()
    (tmp_path / "before.yaml").write_text(text + f"exclude: {first}-2774\n")
    (tmp_path / "after.yaml").write_text(text + f"exclude: 2-{first - 1}\ntargets: {{moved: {{}}}}\n")
    clean = text.replace("tracker.csv", str(shared_data / "ur10-laser-tracker/Series_C/measurements_random_poses.csv"))
    (tmp_path / "clean.yaml").write_text(clean)
    monkeypatch.chdir(tmp_path)
    gains = []
    for name, data in (("mended", ["before.yaml", "after.yaml"]), ("clean", ["clean.yaml"])):
        ran = robocal("identify", str(EXAMPLE / "robot.yaml"), *data, "-o", name)
        result = json.loads((tmp_path / name / "result.json").read_text())
        assert ran.status == 0 and result["verdict"]["status"] == "improved", ran.err
        gains.append(result["residuals"]["held_out_before"]["mean"] - result["residuals"]["held_out"]["mean"])
        left = result["provenance"]["left_out"]
        assert [len(part["rows"]) for part in left] == ([1387, 1386] if name == "mended" else [])
    print(f"\ngain {gains[0]:.4f} mm mended, {gains[1]:.4f} mm clean")
    assert gains[0] == pytest.approx(gains[1], rel=0.15)

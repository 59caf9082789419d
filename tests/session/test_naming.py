"""A stranger's wrong file is named before anything is fitted, with the line to write; and with that line it is right."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from cli.runs import files, robocal, small

from robocal.geometry import se3
from robocal.remarks.code import Code
from robocal.session.inputs import open_arm, read_inputs

DATA = {  # what is wrong, written into data.yaml; what is said of it
    "swapped columns": (
        "joints: {columns: [j1, j3, j2]",
        "columns of j2 and j3 are exchanged",
        "joints: {columns: [j1, j2, j3]}",
    ),
    "mirrored": ("position: {columns: [y, x, z]", "axes are mirrored", "position: {columns: ["),
    "one axis mirrored": ("position: {sign: [1, 1, -1], columns: [x, y, z]", "axes are mirrored", "sign: ["),
}
ROBOT = {
    "sign": ("r: 30,", "r: 30, gain: -1,", "j3 counts the other way", "gain: 1 for j3"),
    "zero": (
        "alpha: 20, d: 250, theta: 0",
        "alpha: 20, d: 250, theta: 90",
        "zero of j3 is off by -90 deg",
        "theta: 0 for j3",
    ),
    "first sign": ("name: j1, alpha: 0", "name: j1, gain: -1, alpha: 0", "j1 counts the other way", "gain: 1 for j1"),
}


def data_text(texts: dict[str, str], wrong: str) -> str:
    key = wrong.partition(":")[0]
    return re.sub(rf"{key}: {{columns: \[[^\]]*\]", wrong, texts["data.yaml"])


def refused(folder: Path, *words: str) -> None:
    before = files(folder)
    robocal("check", folder / "robot.yaml", folder / "data.yaml").assert_refused(*words)
    robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", folder / "run").assert_refused(*words)
    assert files(folder) == before


@pytest.mark.parametrize("name", DATA)
def test_a_wrong_data_file(name: str, tmp_path: Path) -> None:
    texts = small(tmp_path)
    wrong, words, line = DATA[name]
    text = data_text(texts, wrong)
    assert text != texts["data.yaml"]
    (tmp_path / "data.yaml").write_text(text, encoding="utf-8")
    refused(tmp_path, words, line)


@pytest.mark.parametrize("name", ROBOT)
def test_a_wrong_robot_file(name: str, tmp_path: Path) -> None:
    texts = small(tmp_path)
    old, new, words, line = ROBOT[name]
    assert old in texts["robot.yaml"]
    (tmp_path / "robot.yaml").write_text(texts["robot.yaml"].replace(old, new, 1), encoding="utf-8")
    refused(tmp_path, words, line)


def test_a_column_in_metres_and_a_row_that_slipped(tmp_path: Path) -> None:
    texts = small(tmp_path)
    rows = [line.split(",") for line in texts["data.csv"].splitlines()[1:]]
    head = [re.sub(r" \[.*", "", h) for h in rows[0]]
    y = head.index("y")
    joints = [head.index(j) for j in ("j1", "j2", "j3")]
    metres = [r[:y] + [repr(float(r[y]) / 1e3)] + r[y + 1 :] for r in rows[1:]]
    (tmp_path / "data.csv").write_text("\n".join(",".join(r) for r in (rows[0], *metres)) + "\n", encoding="utf-8")
    refused(tmp_path, "the values of y are in m", "y [m] in the header")
    slipped = [list(r) for r in rows[1:]]
    for here, there in zip(slipped, rows[2:] + rows[1:2], strict=True):
        for j in joints:
            here[j] = there[j]
    (tmp_path / "data.csv").write_text("\n".join(",".join(r) for r in (rows[0], *slipped)) + "\n", encoding="utf-8")
    refused(tmp_path, "1 row below its joint values", "joint columns moved down by 1 row")


def test_what_is_right_is_left_alone(tmp_path: Path) -> None:
    small(tmp_path)
    assert robocal("check", tmp_path / "robot.yaml", tmp_path / "data.yaml").status == 0


@pytest.mark.parametrize(("moved", "status"), [(0.0, 0), (5.0, 0), (60.0, 2)])
def test_a_target_that_was_put_on_anew(moved: float, status: int, tmp_path: Path) -> None:
    """Two halves of one campaign; the second with the target elsewhere on the tool."""
    texts = small(tmp_path, poses=60)
    _, head, *rows = texts["data.csv"].splitlines()
    arm = open_arm(tmp_path / "truth.yaml").chain
    reading = read_inputs(tmp_path / "truth.yaml", [tmp_path / "data.yaml"]).reading
    q = reading.dataset.configurations.joints
    frame = (0.9, -0.6, 0.4, 0.02, -0.03, 2.1)
    assert q is not None
    way = se3.from_vector(list(frame))[:3, :3] @ arm.pose(q)[:, :3, :3] @ [moved * 1e-3, 0, 0]
    names = [re.sub(r" \[.*", "", h) for h in head.split(",")]
    at = [names.index(n) for n in "xyz"]
    halves = [r.split(",") for r in rows]
    for row, step in zip(halves[30:], way[30:], strict=True):
        for i, s in zip(at, step, strict=True):
            row[i] = repr(float(row[i]) + 1e3 * float(s))
    for k, part in enumerate((halves[:30], halves[30:])):
        (tmp_path / f"part{k}.csv").write_text("\n".join([head, *(",".join(r) for r in part)]) + "\n", encoding="utf-8")
        text = texts["data.yaml"].replace("data.csv", f"part{k}.csv")
        if "targets:" not in text:
            text += "targets: {ball: {}}\n"
        (tmp_path / f"part{k}.yaml").write_text(text, encoding="utf-8")
    ran = robocal("check", tmp_path / "robot.yaml", tmp_path / "part0.yaml", tmp_path / "part1.yaml", "--json")
    assert ran.status == status, (ran.out, ran.err)
    if status == 0:
        assert (str(Code.REMOUNTED) in ran.out) == (moved > 0)
    else:
        assert "a separate target" in ran.err + ran.out

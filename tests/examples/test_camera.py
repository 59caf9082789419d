"""The example of a camera: its commands run as they stand there, and corners lie where its script drew them."""

from __future__ import annotations

import re
import shlex
import sys

import numpy as np
import pytest
from cli.runs import robocal
from examples.test_cable_examples import BLOCK, EXAMPLES, readme

from robocal.arms.chain import Chain
from robocal.files.csvtext import csv_text
from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot
from robocal.vision.camera import image_of

pytest.importorskip("cv2")
PAGE = EXAMPLES.parent / "docs" / "camera.md"


def script():
    """The script of the example."""
    file = EXAMPLES / "camera" / "make.py"
    space = {"__name__": "make", "__file__": str(file)}
    exec(compile(file.read_text(encoding="utf-8"), str(file), "exec"), space)
    return space


@pytest.mark.slow
def test_the_commands_end_as_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made, said = script(), " ".join(readme("camera").split())
    (tmp_path / "camera").mkdir()
    for line in (line for block in BLOCK.findall(readme("camera")) for line in block.splitlines()):
        if line.startswith("python "):
            assert shlex.split(line)[1:] == ["examples/camera/make.py", "camera"]
            made["draw"](tmp_path / "camera")
        else:
            ran = robocal(*shlex.split(line)[1:], *(["--json"] if "detect" in line else []))
            assert ran.status == 0, ran.err
    told, poses = ran.document, made["poses"]()
    columns = {c["name"]: np.array(c["values"]) for c in told["corners"]["columns"]}
    view = np.array([int(v.removeprefix("view")) - 1 for v in columns["view"]])
    points = np.column_stack([columns[f"point_{a}"] for a in "xyz"]).astype(float) / 1e3
    true = image_of(np.einsum("kij,kj->ki", poses[view, :3, :3], points) + poses[view, :3, 3], made["LENS"])
    off = np.column_stack([columns["u"], columns["v"]]) - true
    found = re.search(r"(\d+) corners of (\d+) markers, in (\d+) % of the image. They are ([\d.]+) px", said)
    assert len(view) == pytest.approx(int(found[1]), abs=8) and 4 * int(found[2]) == int(found[1])
    assert 100 * told["coverage"] == pytest.approx(int(found[3]), abs=3)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(float(found[4]), abs=0.01)
    reduced = off / np.column_stack([columns["su"], columns["sv"]])
    assert 0.5 < np.sqrt(np.mean(reduced**2)) < 1.5  # the standard deviations say so
    identify(tmp_path, columns)


def identify(place, columns):
    """The data file of the page reads the table, when joint values were added."""
    robot = read_robot(EXAMPLES / "hand-eye" / "robot.yaml").chain
    assert isinstance(robot, Chain)
    units = dict.fromkeys(("u", "v", "su", "sv", "blur"), " [px]") | dict.fromkeys(
        ("point_x", "point_y", "point_z"), " [mm]"
    )
    names = [n + units.get(n, "") for n in columns]
    rows = [list(row) for row in zip(*columns.values(), strict=True)]
    joints = {
        v: list(q)
        for v, q in zip(dict.fromkeys(columns["view"]), np.random.default_rng(0).uniform(-60, 60, (12, 6)), strict=True)
    }
    text = csv_text((*names, *(f"j{i} [deg]" for i in range(1, 7))), [[*r, *joints[r[0]]] for r in rows])
    (place / "corners.csv").write_text(text)
    (yaml,) = re.findall(r"^```yaml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    (place / "data.yaml").write_text(yaml)
    read = read_dataset(place / "data.yaml", robot)
    (pixels,) = read.dataset.observations
    assert not any(u.columns for u in read.unread)
    assert pixels.kind == "pixels" and len(pixels.value) == len(rows)


def test_the_page_has_every_remark_of_images():
    from robocal.remarks.english.vision_remarks import VisionRemarks

    names = [n for n in vars(VisionRemarks) if n.isupper()]
    page = PAGE.read_text(encoding="utf-8")
    assert [n for n in names if f"`{n.lower().replace('_', '-')}`" not in page] == []


@pytest.mark.slow
def test_the_script_runs_as_it_stands(tmp_path):
    """In a process of its own, as the page has it; without a sheet it ends with a sentence."""
    import subprocess

    ran = subprocess.run(
        [sys.executable, EXAMPLES / "camera" / "make.py", tmp_path], capture_output=True, text=True, check=False
    )
    assert ran.returncode != 0 and "sheet.yaml" in ran.stderr

"""The example of a commissioning, made small: its commands end as its README says. From drawn images, one seed, in the slow tests."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from examples.test_examples import commands
from examples.test_examples import place as place
from ruamel.yaml import YAML

from robocal.cli.main import main

SMALL = {
    "lists": 1,
    "markers": {"grid": [5, 4], "floor": [2.4, 2.0]},
    "poses": {"calibration": 25, "verification": 6, "x": [-0.7, 0.7], "y": [-0.5, 0.5], "z": [0.9, 1.6]},
}
COARSE = {"camera": {"resolution": [640, 512], "fx": 450.0, "fy": 450.45, "cx": 322.0, "cy": 254.0}}


def shrink(folder: Path, **more: dict) -> None:
    """Fewer poses and markers."""
    file = folder / "examples" / "commissioning" / "rig.yaml"
    said = YAML(typ="safe").load(file.read_text(encoding="utf-8"))
    for key, values in (SMALL | more).items():
        said[key] = {**said[key], **values} if isinstance(values, dict) else values
    with file.open("w", encoding="utf-8") as out:
        YAML(typ="safe").dump(said, out)


def run(command: str, capsys, *more: str) -> tuple[int, dict]:
    capsys.readouterr()
    status = main([*shlex.split(command)[1:], *more, "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.slow
def test_the_commands(place, capsys):
    shrink(place)
    first, again, verify = commands("commissioning")
    status, told = run(first, capsys)
    assert status == 0 and not told["remarks"]
    columns = {c["name"]: c["values"][0] for c in told["lists"]["columns"]}
    # 2 mm of noise in a length is 2 mm of the robot's pose; the tape measure was 50 mm off
    assert columns["verdict"] == "improved" and columns["position_marker"] < 10 and 0.3 < columns["normalised"] < 2
    status, told = run(again, capsys)
    assert status in (0, 3) and told["verdict"]["status"] in ("improved", "not_improved")
    status, told = run(verify, capsys)
    assert status == 0 and set(told["sources"]) == {"robot", "camera"}


@pytest.mark.slow
def test_from_drawn_images(place, capsys):
    """The same from images of half the resolution, whose corners are looked for."""
    pytest.importorskip("cv2")
    shrink(place, **COARSE)
    _, told = run(commands("commissioning")[0], capsys, "--images", "-n", "12")
    assert [r["code"] for r in told["remarks"] if r["code"] != "rig-not-improved"] == []
    columns = {c["name"]: c["values"][0] for c in told["lists"]["columns"]}
    assert columns["position_marker"] < 12 and columns["camera_position"] < 15 and 0.3 < columns["normalised"] < 2
    assert len(list((place / "rig" / "A" / "images").glob("*.png"))) == 12
    page = (place / "rig" / "report.html").read_text(encoding="utf-8")
    assert all(f"figure-3-{k}" in page for k in (22, 23, 24, 25)) and "Where the poses are" in page

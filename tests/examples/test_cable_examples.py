"""Every command of a cable example's README runs as it stands there, in order, and ends as the README says."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
from cli.runs import robocal

EXAMPLES = Path(__file__).parents[2] / "examples"
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
# Exit status of every command of an example, in order.
STATUS = {
    "cable-planar": (0, 0, 0, 3),
}


ELSEWHERE = {"cable-published"}  # examples with a test file of their own


def readme(folder):
    return (EXAMPLES / folder / "README.md").read_text(encoding="utf-8")


def commands(folder):
    lines = [line for block in BLOCK.findall(readme(folder)) for line in block.splitlines()]
    return [line for line in lines if line.startswith("robocal ")]


@pytest.fixture
def place(tmp_path, monkeypatch):
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("folder", STATUS)
def test_commands(place, folder):
    for command, status in zip(commands(folder), STATUS[folder], strict=True):
        ran = robocal(*shlex.split(command)[1:])
        assert ran.status == status, (command, ran.err)


def test_every_cable_example_is_tried():
    assert {p.name for p in EXAMPLES.glob("cable-*")} == set(STATUS) | ELSEWHERE


def test_planar_says_what_was_measured(place):
    said = " ".join(readme("cable-planar").split())
    first, inverse, forward, more = commands("cable-planar")
    assert robocal(*shlex.split(first)[1:]).status == 0
    found = json.loads((place / "planar" / "tension.json").read_text())
    margins = {p["name"]: p["margin_N"] for p in found["poses"]}
    least = min(margins.values())
    tensions = [p["tension_N"] for p in found["poses"]]
    assert found["feasible"] == 30 and f"The least margin is {least:.1f} N, at A2 and C7" in said
    assert {n for n, v in margins.items() if v < least + 1e-6} == {"A2", "C7"}
    assert f"up to {max(max(t) for t in tensions):.1f} N" in said
    assert [t[2] for t in tensions] == pytest.approx([10.0] * 30)
    robocal(*shlex.split(inverse)[1:])
    back = robocal(*shlex.split(forward)[1:], "--json").document["poses"]
    for pose, again in zip(found["poses"], back, strict=True):
        for row, other in zip(pose["T_base_platform"], again["T_base_platform"], strict=True):
            assert row == pytest.approx(other, abs=1e-8)
    heavy = robocal(*shlex.split(more)[1:], "--json").document["poses"]
    short = {p["name"]: sum(v * v for v in p["missing"]) ** 0.5 for p in heavy if not p["feasible"]}
    assert f"{len(short)} of the 30 targets cannot be held" in said
    most = max(short.values())
    assert {n for n, v in short.items() if v > most - 1e-6} == {"A2", "C7"} and f"({most:.1f} N)" in said

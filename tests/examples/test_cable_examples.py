"""Every command of a cable example's README runs as it stands there, in order, and ends as the README says."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal
from listings import rows_of

EXAMPLES = Path(__file__).parents[2] / "examples"
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
# Exit status of every command of an example, in order.
STATUS = {
    "cable-calibration": (0, 0, 0, 0, 0, 0, 0),
    "cable-camera": (0, 0),
    "cable-kinds": (0,) * 10,
    "cable-laval": (0, 0, 3, 0, 0, 0, 0, 0),
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


@pytest.mark.slow
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
    each = np.array([p["tension"] for p in rows_of(found["poses"])])
    assert np.allclose([c["mean"] for c in rows_of(found["tensions"])], each.mean(axis=0)), "every number of the page"
    margins = {p["id"]: p["margin"] for p in rows_of(found["poses"])}
    least = min(margins.values())
    tensions = [p["tension"] for p in rows_of(found["poses"])]
    assert found["feasible"] == 30 and f"The least margin is {least:.1f} N, at A2 and C7" in said
    assert {n for n, v in margins.items() if v < least + 1e-6} == {"A2", "C7"}
    assert f"up to {max(max(t) for t in tensions):.1f} N" in said
    assert [t[2] for t in tensions] == pytest.approx([10.0] * 30)
    robocal(*shlex.split(inverse)[1:])
    back = rows_of(robocal(*shlex.split(forward)[1:], "--json").document["poses"])
    for pose, again in zip(rows_of(found["poses"]), back, strict=True):
        for row, other in zip(pose["T_base_platform"], again["T_base_platform"], strict=True):
            assert row == pytest.approx(other, abs=1e-8)
    heavy = rows_of(robocal(*shlex.split(more)[1:], "--json").document["poses"])
    short = {p["id"]: sum(v * v for v in p["missing"]) ** 0.5 for p in heavy if not p["feasible"]}
    assert f"{len(short)} of the 30 targets cannot be held" in said
    most = max(short.values())
    assert {n for n, v in short.items() if v > most - 1e-6} == {"A2", "C7"} and f"({most:.1f} N)" in said


@pytest.mark.slow
def test_laval_says_what_was_measured(place):
    said = " ".join(readme("cable-laval").split())
    first, _, _, large, small, *_ = commands("cable-laval")
    found = robocal(*shlex.split(first)[1:-2], "--json").document
    stopped = {limit: 100 * count / 2000 for limit, count in found["stopped_by"].items()}
    assert f"two cables that would touch | {stopped['cable-cable']:.0f} %" in said
    assert f"the tension limits | {stopped['statics']:.0f} %" in said
    # Of 2000 so few that a rounding elsewhere may move one of them.
    assert stopped["box"] == pytest.approx(0.3, abs=0.1) and found["reached"] * 100 == pytest.approx(stopped["box"])
    rms = found["choice"]["expected_rms"]
    for name, what in (("frame anchors a", "a"), ("initial lengths rho_0", "l0"), ("platform's position", "position")):
        told = [float(v.split()[0]) for v in re.search(rf"\| {name} \| (.*?) \|(?= \|| The)", said)[1].split(" | ")]
        assert told == pytest.approx([1e3 * rms[who][what] for who in ("chosen", "random", "all")], rel=0.04)
    assert f"pass {1e3 * found['start']['gap']['value'] + 4.8:.1f} mm apart" in said and found["start"]["nearest"] == [
        "c3",
        "c7",
    ]
    assert all(19.999 <= t <= 125.001 for pose in rows_of(found["poses"]) for t in pose["tension"])
    shares = [robocal(*shlex.split(c)[1:-2], "--json").document["stopped_by"] for c in (large, small)]
    assert f"{100 * shares[0]['statics'] / 300:.0f} % of the poses near the boundary" in said
    assert shares[1]["box"] == 300


@pytest.mark.slow
def test_calibrations_say_what_was_found(place):
    """The numbers of the README."""
    ran = [robocal(*shlex.split(c)[1:]) for c in commands("cable-calibration")]
    assert all(r.status == 0 for r in ran)
    said = " ".join(readme("cable-calibration").split())
    for run, words in (
        ("camera", r"from ([\d.]+) to ([\d.]+) mm\. ```sh robocal identify \S+ \S+ \S+ -o camera"),
        ("alone", r"from ([\d.]+) to ([\d.]+) mm: the shape"),
    ):
        left = json.loads((place / run / "result.json").read_text())["residuals"]
        before, after = (float(v) for v in re.search(words, said).groups())
        assert left["held_out_before"]["mean"] == pytest.approx(before, abs=0.06)
        assert left["held_out"]["mean"] == pytest.approx(after, abs=0.06)
    drift = " ".join(ran[-2].out.split())
    across, along = re.search(r"named, ([\d.]+) mm across its line of sight and ([\d.]+) mm along", said).groups()
    found = re.search(r"anchor of c6 moved: ([\d.]+) mm across its line of sight, ([\d.]+) ±", drift)
    assert float(found[1]) == pytest.approx(float(across), abs=0.06) and float(found[2]) == pytest.approx(
        float(along), abs=0.06
    )


def test_calibration_data_are_what_the_script_makes():
    script = EXAMPLES / "cable-calibration" / "make.py"
    namespace = {"__name__": "make", "__file__": str(script)}
    exec(compile(script.read_text(), "make.py", "exec"), namespace)
    for name, text in namespace["texts"]().items():
        assert (EXAMPLES / "cable-calibration" / name).read_text() == text, name

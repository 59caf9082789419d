"""ISO 9283 from files: thirty simulated cycles, single visits, what is said and what is written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import ROBOT, files, robocal
from simulated import simulation_files, true_chain

from robocal.files.robot import parse_robot
from robocal.files.text import Source
from robocal.session.simulated_robot import Errors, Instrument, measure

SCATTER = 3e-5


def cycles(folder: Path, *, places: int = 5, visits: int = 30, kind: str = "pose", extra: str = "") -> None:
    """robot.yaml, truth.yaml, data.csv and data.yaml: a program of a few places, run again and again."""
    robot = parse_robot(Source(Path("robot.yaml"), ROBOT, "0" * 64))
    rng = np.random.default_rng(8)
    truth = true_chain(robot.chain, Errors(5e-4, 1e-3), rng)
    low, high = robot.chain.limits.T
    at = np.radians(np.round(np.degrees(rng.uniform(0.6 * low, 0.6 * high, (places, 3))), 3))
    data = measure(truth, np.tile(at, (visits, 1)), Instrument(kind, SCATTER, SCATTER, None), rng)
    for name, text in simulation_files(robot, truth, data, "for tests").items():
        if extra and name == "data.csv":
            head, title, *rows = text.splitlines()
            rows = [f"{row},{1 + i // places % 3}" for i, row in enumerate(rows)]
            text = "\n".join([head, f"{title},{extra}", *rows]) + "\n"
        if extra and name == "data.yaml":
            text = text.replace(
                "configuration: {id: configuration", f"configuration: {{{extra}: {extra}, id: configuration"
            )
        (folder / name).write_text(text, encoding="utf-8")


def flowing(text: str) -> str:
    """The words in order, however wide the terminal is."""
    return " ".join(text.split())


def test_thirty_cycles(tmp_path: Path) -> None:
    cycles(tmp_path)
    names = [tmp_path / n for n in ("truth.yaml", "data.yaml")]
    ran = robocal("validate", *names, "--against", tmp_path / "robot.yaml", "--distances", "all", "-o", tmp_path / "v")
    assert ran.status == 0 and files(tmp_path / "v") == {"validation.json", "validation.html"}, ran.err
    for word in ("AP [mm]", "RP [mm]", "AP_a [deg]", "RP_c [deg]", "AD [mm]", "RD [mm]", "does not change it"):
        assert word in ran.out, word
    assert "vAP: not computable: " in flowing(ran.out) and "no column direction" in flowing(ran.out)
    iso = json.loads((tmp_path / "v" / "validation.json").read_text(encoding="utf-8"))["iso_9283"]
    assert iso["places"] == iso["repeated"] == 5 and iso["visits"] == [30, 30]
    this, against = iso["pose"]["summary"]["this"], iso["pose"]["summary"]["against"]
    # The truth misses by the barycentre's scatter alone, the nominal robot by its errors; repeatability is one.
    assert this["AP"]["mean"] < 3e3 * SCATTER / np.sqrt(30) < 0.3 < against["AP"]["mean"]
    assert this["RP"] == pytest.approx(against["RP"])
    assert this["RP"]["mean"] == pytest.approx(1e3 * SCATTER * 3.6, rel=0.15)
    assert this["RP_a"]["mean"] == pytest.approx(np.degrees(3 * SCATTER), rel=0.25)
    far = iso["distance"]
    assert far["number"] == 10 and {r["n"] for r in far["rows"]} == {30}
    assert far["summary"]["this"]["AD"]["mean"] < 0.02 < 0.1 < far["summary"]["against"]["AD"]["mean"]
    assert far["summary"]["this"]["RD"]["mean"] == pytest.approx(3e3 * SCATTER * np.sqrt(2), rel=0.2)
    page = (tmp_path / "v" / "validation.html").read_text(encoding="utf-8")
    assert "ISO 9283" in page and "pose repeatability" in page and "http-equiv" in page
    assert page.count("<script>") == page.count("'sha256-") == 1, "what opens the fold is the only script"
    assert page.count("<tr>") > 20 and "does not change it" in page


def test_single_visits(tmp_path: Path) -> None:
    cycles(tmp_path, places=12, visits=1, kind="position")
    ran = robocal("validate", tmp_path / "truth.yaml", tmp_path / "data.yaml")
    assert ran.status == 0
    for word in ("RP: not computable: every place was visited once", "AD [mm]", "the next one"):
        assert word in flowing(ran.out), word
    document = robocal("validate", tmp_path / "truth.yaml", tmp_path / "data.yaml", "--json").document["iso_9283"]
    assert document["pose"] is None and document["distance"]["number"] == 11
    assert {"AP", "RP", "RD", "vAP", "AP_abc, RP_abc"} == set(document["not_computable"])


def test_a_tool_that_the_file_does_not_know_is_said_to_be_in_the_errors(tmp_path: Path) -> None:
    robocal("new", "ur10", "-o", tmp_path)
    data, robot = tmp_path / "data.yaml", tmp_path / "robot.yaml"
    assert "tool.z of this robot are 0 and were not fitted" in flowing(robocal("validate", robot, data).out)
    text = robot.read_text(encoding="utf-8").replace("tool: {xyz: [0, 0, 0]", "tool: {xyz: [0, 0, 72]")
    robot.write_text(text, encoding="utf-8")
    assert "were not fitted" not in flowing(robocal("validate", robot, data).out)


def test_few_cycles_from_three_directions(tmp_path: Path) -> None:
    cycles(tmp_path, places=4, visits=9, extra="direction")
    document = robocal("validate", tmp_path / "truth.yaml", tmp_path / "data.yaml", "--json").document["iso_9283"]
    assert document["visits"] == [9, 9] and any("asks for 30" in n for n in document["notes"])
    rows = document["pose"]["rows"]
    assert {r["directions"] for r in rows} == {3} and all(0 < r["vAP"] < 5e3 * SCATTER for r in rows)


def test_distances_are_chosen_by_name(tmp_path: Path) -> None:
    cycles(tmp_path, places=6, visits=1, kind="position")
    names = tmp_path / "truth.yaml", tmp_path / "data.yaml"
    robocal("validate", *names, "--distances", "consecutiv").assert_refused("--distances", "consecutive")
    robocal("validate", *names, "--distances", "group").assert_refused("--distances", "no group")
    text = (tmp_path / "data.csv").read_text(encoding="utf-8").splitlines()
    text = [text[0], text[1] + ",cube [1]", *(f"{row},{i // 3}" for i, row in enumerate(text[2:]))]
    (tmp_path / "data.csv").write_text("\n".join(text) + "\n", encoding="utf-8")
    yaml = (tmp_path / "data.yaml").read_text(encoding="utf-8")
    (tmp_path / "data.yaml").write_text(
        yaml.replace("{id: configuration", "{cube: cube, id: configuration"), encoding="utf-8"
    )
    document = robocal("validate", *names, "--distances", "cube", "--json").document["iso_9283"]
    assert document["distance"]["number"] == 6 and "cube" in document["distance"]["pairs"]

"""Rigs that are put together wrongly are stopped before any long motion, and what is wrong is named; put right, they go."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from robocal.cli.main import main
from robocal.files.cable.rig_spec import read_cable_rig
from robocal.remarks.code import Code
from robocal.session.commissioning.rig_checks import check_rig
from robocal.session.commissioning.rig_motion import RigMotion, power_up
from robocal.session.commissioning.rig_world import draw_world

RIG = Path(__file__).parents[2] / "examples" / "commissioning" / "rig.yaml"


def rig_file(folder: Path, **parts: dict) -> Path:
    """The rig of the example with other numbers."""
    said = YAML(typ="safe").load(RIG.read_text(encoding="utf-8"))
    for key, values in parts.items():
        said[key] = {**said.get(key, {}), **values} if isinstance(values, dict) else values
    place = folder / "rig.yaml"
    with place.open("w", encoding="utf-8") as file:
        YAML(typ="safe").dump(said, file)
    return place


def look(folder: Path, seed: int = 0, **parts: dict) -> tuple[object, RigMotion]:
    """What is found at power-up."""
    rng = np.random.default_rng(seed)
    motion, _ = power_up(draw_world(read_cable_rig(rig_file(folder, **parts)), rng), rng)
    return check_rig(motion, rng), motion


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("known_by", ["tape", "beacons"])
def test_a_good_rig_goes(tmp_path, seed, known_by):
    found, motion = look(tmp_path, seed, anchors={"known_by": known_by})
    assert found is None and motion.moved > 10
    assert motion.least > 10 and motion.most < 140


WRONG = [
    ({"cables": 7}, Code.RIG_DRIVES, {"drives": 7, "cables": 8}),
    ({"swapped": [2, 5]}, Code.RIG_EXCHANGED, {"cables": ("c2", "c5")}),
    ({"swapped": [1, 2]}, Code.RIG_EXCHANGED, {"cables": ("c1", "c2")}),
    ({"swapped": [5, 8]}, Code.RIG_EXCHANGED, {"cables": ("c5", "c8")}),
    ({"reversed": 3}, Code.RIG_REVERSED, {"cable": "c3"}),
    ({"reversed": 7}, Code.RIG_REVERSED, {"cable": "c7"}),
    ({"half_count": 4}, Code.RIG_ENCODER, {"cable": "c4", "gain": 0.5}),
    ({"half_count": 8}, Code.RIG_ENCODER, {"cable": "c8", "gain": 0.5}),
    ({"mass_factor": 2.0}, Code.RIG_WEIGHT, {"said": 100.0}),
]


# obeys: rig-drives
# obeys: rig-exchanged
# obeys: rig-reversed
# obeys: rig-encoder
# obeys: rig-weight
@pytest.mark.parametrize(("wrong", "code", "numbers"), WRONG)
def test_what_is_wrong_is_named(tmp_path, wrong, code, numbers):
    """`test_a_good_rig_goes` is the same rig once that is put right."""
    found, motion = look(tmp_path, wrong=wrong)
    assert found.code == code
    assert {k: found.numbers[k] for k in numbers} == numbers
    moved = np.linalg.norm(motion.now[:3, 3] - motion.home[:3, 3])
    assert moved < 0.5  # m: no motion was a long one


# obeys: rig-slack
@pytest.mark.parametrize("cable", [1, 6])
def test_a_slack_cable(tmp_path, cable):
    """One cable is 80 mm too long: the platform tilts until another hangs, and that is the one that is named."""
    found, motion = look(tmp_path, wrong={"slack": cable})
    assert found.code == Code.RIG_SLACK and motion.moved == 0
    slack = motion.driven.motion.tension[motion.world.spec.cables.index(found.numbers["cable"])]
    assert slack < 6


def test_of_diagonal_drives_both_pairs_are_named(tmp_path):
    """A rig that is the same from all four corners cannot tell one diagonal from the other."""
    found, _ = look(tmp_path, wrong={"swapped": [1, 3]})
    assert found.code == Code.RIG_EXCHANGED
    assert {found.numbers["cables"], found.numbers["also"]} == {("c1", "c3"), ("c5", "c7")}


# obeys: rig-lengths-disagree
def test_two_mistakes_at_once_have_no_name(tmp_path):
    found, _ = look(tmp_path, seed=2, wrong={"half_count": 2, "swapped": [1, 2]})
    assert found.code == Code.RIG_LENGTHS_DISAGREE


# obeys: rig-infeasible
def test_limits_that_hold_nothing(tmp_path):
    assert look(tmp_path, tensions={"limits_N": [70.0, 75.0], "preferred_N": 72.0})[0].code == Code.RIG_INFEASIBLE


# obeys: rig-stopped
def test_a_drive_that_does_not_turn(tmp_path):
    found, motion = look(tmp_path, drives={"viscous_N_m_s": 0.05})
    assert found.code == Code.RIG_STOPPED and motion.moved < 12


# obeys: rig-limits-left
def test_the_verb(tmp_path, capsys):
    """A wrong rig: status 3, and no data. A small one is moved, calibrated, verified, and its tensions are told."""
    out = tmp_path / "out"
    small = {"markers": {"grid": [5, 4], "floor": [2.2, 1.8]}, "lists": 1,
             "poses": {"x": [-0.7, 0.7], "y": [-0.5, 0.5], "z": [0.9, 1.6], "verification": 4}}  # fmt: skip
    wrong = rig_file(tmp_path, **small, wrong={"reversed": 2})
    assert main(["cable", "rig", str(wrong), "-o", str(out), "--json"]) == 3
    told = json.loads(capsys.readouterr().out)
    assert told["lists"] is None and told["remarks"][0]["code"] == "rig-reversed" and not (out / "A").exists()
    narrow = {"tensions": {"pose_kept_if_within_N": [40.0, 80.0]}}
    for more, codes in ((narrow, ["rig-limits-left"]), ({}, [])):
        main(
            ["cable", "rig", str(rig_file(tmp_path, **small, **more)), "-o", str(out), "-n", "12", "--json", "--force"]
        )
        told = json.loads(capsys.readouterr().out)
        assert [r["code"] for r in told["remarks"] if r["code"] != "rig-not-improved"] == codes
    columns = {c["name"]: c["values"] for c in told["lists"]["columns"]}
    assert columns["position_marker"][0] < 12 and columns["normalised"][0] < 2.5
    assert {p.name for p in (out / "A").iterdir()} >= {
        "robot.yaml",
        "lengths.yaml",
        "pixels.yaml",
        "run",
        "reference.csv",
    }
    # what was recorded is what other verbs read
    assert (
        main(["verify", str(out / "A/reference.csv"), str(out / "A/robot.csv"), str(out / "A/camera.csv"), "--json"])
        == 0
    )
    assert main(["check", str(out / "A/robot.yaml"), str(out / "A/lengths.yaml"), str(out / "A/pixels.yaml")]) == 0


POINT = [[0.0, 0.0, 0.0] for _ in range(8)]
REFUSED = [
    ({"poses": {"verification": 1}}, ["poses.verification", "2"]),
    ({"tensions": {"preferred_N": 500.0}}, ["tensions.preferred_N", "between 25 and 125"]),
    ({"tensions": {"limits_N": [125.0, 25.0]}}, ["tensions.limits_N", "the lower first"]),
    ({"marker_seen_if": {"angle_from_axis_below": 200.0}}, ["marker_seen_if.angle_from_axis_below", "90"]),
    ({"drives": {"coulomb_N_m": 1e3}}, ["drives.coulomb_N_m", "less than the cables pull"]),
    ({"drives": {"drum_radius": 1e-9}}, ["drives.coulomb_N_m"]),
    ({"platform_anchors": POINT}, ["platform_anchors", "one point or line"]),
    ({"weight_N": float("nan")}, ["weight_N"]),
    ({"drive": {"gear": 4}}, ["drive", "unknown key"]),
    ({"camera": {"cx": "640 +- 8"}}, ["camera.cx", "640 + N(0, 8)"]),
    ({"wrong": {"reversed": 9}}, ["wrong.reversed", "1 to 8"]),
    ({"poses": {"x": [1.5, -1.5]}}, ["poses.x", "the lower number first"]),
]


@pytest.mark.parametrize(("parts", "words"), REFUSED)
def test_a_file_that_is_wrong_is_refused_by_its_own_name(tmp_path, capsys, parts, words):
    """Nothing has moved, and nothing is written."""
    place = rig_file(tmp_path, **parts)
    assert main(["cable", "rig", str(place), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in (str(place), *words)), said
    assert not (tmp_path / "out").exists()


def test_a_camera_that_looks_away_is_named_with_the_file(tmp_path, capsys):
    small = {"calibration": 4, "verification": 2}
    place = rig_file(tmp_path, poses=small, camera_in_platform_nominal={"rotation": "diag(1, 1, 1)"}, lists=1)
    assert main(["cable", "rig", str(place), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in (str(place), "markers", "shows no marker", "looks at them")), said


def test_more_markers_than_the_family_has(tmp_path, capsys):
    pytest.importorskip("cv2")
    place = rig_file(tmp_path, markers={"grid": [30, 20]})
    assert main(["cable", "rig", str(place), "-o", str(tmp_path / "out"), "--images"]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in (str(place), "markers.grid", "600 markers", "586")), said

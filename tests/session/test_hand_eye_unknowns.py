"""`vision hand-eye` with a delay between two clocks and a target of unknown size: both are found with what they may be off by."""

# obeys: clocks-apart

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_stream import stream
from hand_eye_world import codes, hand_eye, off_by

from robocal.files.robot_poses import read_robot_poses
from robocal.session.vision.hand_eye_unknowns import path_of


def unknowns(told):
    """Found and sigma of each row."""
    columns = {c["name"]: c["values"] for c in told["unknowns"]["columns"]}
    return list(zip(columns["found"], columns["sigma"], strict=True))


@pytest.mark.parametrize(("delay", "inhand"), [(0.04, True), (-0.1, False)])
def test_a_delay_is_named_and_found(tmp_path, delay, inhand):
    """Without it the verdict says that clocks differ; with --free-delay it is found to a millisecond, and the camera with it."""
    made, words = stream(tmp_path, delay=delay, inhand=inhand)
    told, status = hand_eye(*words)
    (said,) = [r for r in told["verdict"]["remarks"] if r["code"] == "clocks-apart"]
    assert status == 3 and "--free-delay" in said["advice"]
    assert said["numbers"]["delay"]["value"] == pytest.approx(delay, abs=0.015)
    told, status = hand_eye(*words, "--free-delay")
    assert status == 0 and "clocks-apart" not in codes(told), told["verdict"]
    ((found, sigma),) = unknowns(told)
    assert abs(found - 1e3 * delay) < 4 * sigma < 4
    assert np.abs(off_by(told, made)).max() < 4
    assert told["error"]["rms"] < 1


def test_poses_of_a_log_are_taken_between_its_records(tmp_path):
    """Clocks that agree: the hand moves on from one record to the next, and the nearest would be a millimetre off."""
    made, words = stream(tmp_path, views=20)
    told, status = hand_eye(*words)
    assert status == 0 and told["unknowns"] is None
    assert told["error"]["rms"] < 0.6 and np.abs(off_by(told, made)).max() < 4


@pytest.mark.parametrize(("size", "delay", "inhand"), [(1.02, 0.0, True), (0.97, 0.05, False)])
def test_a_size_is_found(tmp_path, size, delay, inhand):
    made, words = stream(tmp_path, size=size, delay=delay, inhand=inhand)
    told, status = hand_eye(*words, "--free-size", *(["--free-delay"] if delay else []))
    assert status == 0 and "target-size-contradicted" not in codes(told), told["verdict"]
    found, sigma = unknowns(told)[-1]
    assert abs(found - size) < 4 * sigma < 0.01
    assert np.abs(off_by(told, made)).max() < 4


def test_the_truth_lies_within_what_sigma_says(tmp_path):
    """Delay, size and both frames of five cells, 70 numbers: most lie within 1.96 sigma."""
    inside = []
    for seed in range(5):
        size, delay = 1 + 0.01 * (seed % 5 - 2), 0.03 * (seed % 3 - 1)
        made, words = stream(tmp_path, 40 + seed, size=size, delay=delay, inhand=bool(seed % 2), error=0.4, views=20)
        told, _ = hand_eye(*words, "--free-delay", "--free-size", "--folds", 5)
        (late, late_sigma), (large, large_sigma) = unknowns(told)
        z = [(late - 1e3 * delay) / late_sigma, (large - size) / large_sigma, *off_by(told, made).ravel()]
        inside.append(np.abs(z) < 1.96)
    assert 0.8 < np.mean(inside) <= 1


def test_a_delay_needs_a_path(tmp_path):
    _, words = stream(tmp_path)
    lines = (tmp_path / "log.csv").read_text().splitlines()
    (tmp_path / "few.csv").write_text("\n".join([lines[0], *lines[1::40]]) + "\n")
    few = [words[0], str(tmp_path / "few.csv"), *words[2:]]
    (tmp_path / "thirty.csv").write_text("\n".join(lines[:31]) + "\n")
    order = [words[0], str(tmp_path / "thirty.csv"), *words[2:6], "--pair", "order"]
    for more, said in ((few, "at stops"), (order, "--pair time")):
        ran = robocal("vision", "hand-eye", *more, "--free-delay")
        assert ran.status == 2 and said in ran.err, ran.err
    assert path_of(read_robot_poses(tmp_path / "few.csv"), False) is None
    path = path_of(read_robot_poses(tmp_path / "log.csv"), True)
    assert path is not None and len(path.time) == len(lines) - 1

"""Robot files and files of lengths with kinds of cable: what is wrong is named, with key and row; what is written back is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cables.kinds import DRUMS, MOVING, PLANAR, RAILS, opened

from robocal.errors import FormatError
from robocal.files.cable.write import describe_cable, render_cable

RAIL = "rail: {direction: [0, 0.3, -1], carriage: 0.4, gain: 1.1}"


@pytest.mark.parametrize(
    ("text", "old", "new", "key", "says"),
    [
        (
            PLANAR,
            "k: {frame: A3, platform: P}",
            "k: {frame: A9, platform: P}",
            "segments.k.frame",
            "no such frame anchor",
        ),
        (PLANAR, "k: {frame: A3, platform: P}", "k: {frame: A3}", "segments.k", "runs between two points"),
        (PLANAR, "k: {frame: A3, platform: P}", "k: {frame: [A3, A3]}", "segments.k", "needs two ends"),
        (
            PLANAR,
            "k: {frame: A3, platform: P}",
            "k: {frame: [A1, A3], pulley: {radius: 0.1, axis: [0, 0, 1]}}",
            "segments.k.pulley",
            "has no pulley",
        ),
        (PLANAR, "k: 2", "k: 0", "cables[1].segments.k", "not how often"),
        (PLANAR, "k: 2", "k: 1.5", "cables[1].segments.k", "not how often"),
        (PLANAR, "k: 2", "q: 2", "cables[1].segments.q", "no such segment"),
        (PLANAR, "k: 2", "m: 2", "cables[1].segments", ""),
        (PLANAR, ", k: 2", "", "segments.k", "no cable runs along"),
        (PLANAR, "{m: 1, k: 2}", "{}", "cables[1].segments", "without a segment"),
        (PLANAR, "{m: 1, k: 2}, zero", "{m: 1, k: 2}, frame: A1, zero", "cables[1].frame", "has its ends there"),
        (PLANAR, "  h: {frame", "  M1: {frame", "segments", ""),
        (
            PLANAR,
            "every_cable: {",
            "every_cable: {pulley: {radius: 0.1, axis: [0, 0, 1]}, ",
            "every_cable.pulley",
            "pulleys of their own",
        ),
        (MOVING, "s5: 3, s3: 1, s4: 2, s2: -1", "s3: 1, s4: 2", "", ""),
        (RAILS, "direction: [0, 0.3, -1]", "direction: [0, 0, 0]", "cables[2].rail.direction", "needs a direction"),
        (RAILS, "gain: 1.1", "gain: 0", "cables[2].rail.gain", "does not move its anchor"),
        (RAILS, "carriage: 0.4, ", "", "cables[2].rail.carriage", "missing"),
        (DRUMS, "build_up: 0.03", "build_up: .nan", "every_cable.build_up", "finite"),
    ],
)
def test_what_is_wrong_is_named(text, old, new, key, says):
    assert old in text
    with pytest.raises(FormatError) as caught:
        opened(text.replace(old, new, 1))
    told = str(caught.value)
    assert key in told and says in told and "robot.yaml" in told, told


def test_a_segment_frees_its_ends_whoever_has_their_anchors_first():
    robot = opened(PLANAR.replace("free: [ax, az, l0]", "free: [k, M1.l0]")).robot
    assert set(robot.table.free) == {"k.ax", "k.ay", "k.az", "m.bx", "m.by", "m.bz", "M1.l0"}


@pytest.mark.parametrize("text", [PLANAR, MOVING, RAILS, DRUMS])
def test_numbers_written_back_are_read(text):
    file = opened(text)
    rng = np.random.default_rng(1)
    values = {
        n: file.robot.table[n].value + 0.01 * rng.normal()
        for n in file.robot.table.names
        if not n.endswith((".by", ".ay"))
    }
    written, lost = render_cable(file, values)
    back = opened(written).robot.table
    left = [n for n in values if n not in lost and abs(back[n].value - values[n]) > 1e-12]
    assert not left and not lost


@pytest.mark.parametrize("text", [RAILS, DRUMS])
def test_a_robot_written_anew_is_the_same(text):
    robot = opened(text).robot
    again = opened(describe_cable(robot)).robot
    assert np.abs(again.ends - robot.ends).max() < 1e-15 and np.abs(again.gain - robot.gain).max() == 0
    assert np.abs(again.build_up - robot.build_up).max() == 0
    assert robot.rails is None or np.abs(again.rails - robot.rails).max() < 1e-15


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("carriage: {columns: [s], cables: [c1], unit: m}", "no anchor of this cable is on a rail"),
        ("carriage: {columns: [s], cables: [c9], unit: m}", "no anchor of this cable is on a rail"),
        ("carriage: {columns: [s, s], cables: [c3], unit: m}", "wrong number of cables"),
        ("carriage: {columns: [q], cables: [c3], unit: m}", "there is no such column"),
        ("carriage: {columns: [s], cables: [c3], unit: deg}", "unit"),
        (
            "carriage: {columns: [s], cables: [c3], unit: m}\ntension: {columns: [c1, c2, c3, c4, c5, c6, c7, c8], unit: N}",
            "tensions beside",
        ),
    ],
)
def test_carriages_that_are_none_are_named(tmp_path: Path, key, says):
    from robocal.session.inputs import read_inputs

    (tmp_path / "robot.yaml").write_text(RAILS)
    rows = "".join(f"p{i},{','.join(f'{1 + 0.1 * i * j:.3f}' for j in range(1, 9))},0.{i}\n" for i in range(1, 6))
    (tmp_path / "run.csv").write_text(f"id,{','.join(f'c{i}' for i in range(1, 9))},s\n{rows}")
    names = ", ".join(f"c{i}" for i in range(1, 9))
    head = "robocal: 1\nkind: lengths\nfile: run.csv\nconfiguration: {id: id}\n"
    (tmp_path / "lengths.yaml").write_text(f"{head}lengths: {{columns: [{names}], unit: m}}\n{key}\n")
    with pytest.raises(FormatError) as caught:
        read_inputs(tmp_path / "robot.yaml", [tmp_path / "lengths.yaml"])
    assert says in str(caught.value), str(caught.value)

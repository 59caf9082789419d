"""robot.yaml in and out: every convention round-trips, every fault is named, comments stay."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocal.arms.conventions import CONVENTIONS, chain
from robocal.errors import FileError, FormatError, ModelError
from robocal.files.robot import describe, open_robot, parse_robot, read_robot, render_robot
from robocal.files.text import Source
from robocal.files.units import UNITS, Units
from robocal.files.writing import write_text

DEG = math.pi / 180
TEXT = """\
robocal: 1                      # schema
name: Mitsubishi RV-2AJ
kind: arm                       # arm | cable
units: {length: mm, angle: deg}
convention: khalil-hayati
joints:
  - {name: j1, type: revolute, alpha: 0, d: 0, theta: 0, r: 300, limits: [-150, 150]}   # the first
  - {name: j2, alpha: -90, theta: -90}
  - name: j3   # in block style
    d: 250     # printed
base: {free: false}             # the robot's own base
tool: {xyz: [0, 0, 72], free: true}
calibrate: {free: [beta, alpha, d, theta, r], fixed: [j2.beta], prior: {length: 1.0, angle: 0.1, j3.d: 2}, bounds: {j1.r: [290, 310]}}
source: a printed table
"""


def robot(text=TEXT):
    return parse_robot(Source(Path("robot.yaml"), text, ""))


def test_the_example_of_the_manual():
    r = robot()
    t = r.chain.table
    assert (
        r.name == "Mitsubishi RV-2AJ"
        and r.chain.joint_names == ("j1", "j2", "j3")
        and r.chain.source == "a printed table"
    )
    assert (
        t["j1.r"].value == pytest.approx(0.3)
        and t["j2.alpha"].value == pytest.approx(-90 * DEG)
        and t["tool.z"].value == 0.072
    )
    np.testing.assert_allclose(r.chain.limits[0], [-150 * DEG, 150 * DEG])
    assert np.isinf(r.chain.limits[1]).all()
    geometry = {f"j{i}.{s}" for i in (1, 2, 3) for s in ("beta", "alpha", "d", "theta", "r")} - {"j2.beta"}
    assert set(t.free) == geometry | {f"tool.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")}
    assert t["j1.r"].prior == pytest.approx(1e-3) and t["j1.alpha"].prior == pytest.approx(0.1 * DEG)
    assert t["j3.d"].prior == pytest.approx(2e-3) and t["tool.x"].prior is None and t["j1.gain"].prior is None
    assert (t["j1.r"].lower, t["j1.r"].upper) == pytest.approx((0.29, 0.31))
    assert (
        "tool.x" in r.chain.table.free
        and r.unit_of("j1.r").name == "mm"
        and r.unit_of("j1.gain").name == "1"
        and r.warnings == ()
    )


def test_defaults_when_silent():
    short = "robocal: 1\nname: a\nunits: {length: m, angle: rad}\nconvention: dh\njoints: [{a: 1}, {type: prismatic, limits: [0, 0.5]}]\n"
    r = robot(short)
    assert set(r.chain.table.free) == set(r.chain.usual) and not any(
        "gain" in n or "base" in n for n in r.chain.table.free
    )
    assert tuple(r.chain.limits[1]) == (0.0, 0.5) and "tool.x" in r.chain.table.free
    assert not any(n.startswith("tool.") for n in robot(short + "tool: {free: false}").chain.table.free)
    assert [n for n in robot(short + "tool: {free: [x, rz]}").chain.table.free if "tool" in n] == ["tool.x", "tool.rz"]
    assert {"base.x", "base.rz"} <= set(robot(short + "base: {free: true}").chain.table.free)
    assert "j1.gain" in robot(short + "calibrate: {free: [gain]}").chain.table.free
    # A bare symbol speaks of joints; only a full name or an owner reaches a frame.
    offsets = short.replace("dh", "offsets").replace("a: 1", "x: 1")
    assert not any(n.startswith("base.") for n in robot(offsets + "calibrate: {free: [x]}").chain.table.free)
    assert "base.x" in robot(offsets + "calibrate: {free: [x, base.x]}").chain.table.free


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("units: {length: mm, angle: deg}\n", "", ["key units", "missing"]),
        ("length: mm", "length: mmm", ["row 4", "units.length", "unknown unit", "'mmm'", "did you mean 'mm'"]),
        ("length: mm", "length: deg", ["row 4", "units.length", "a length", "'deg'", "mm"]),
        ("length: mm", "length: 3", ["row 4", "units.length", "found 3"]),
        ("length: mm, ", "", ["row 4", "units.length", "missing"]),
        (
            "khalil-hayati",
            "khalil-hayatti",
            ["row 5", "key convention", "unknown convention", "did you mean 'khalil-hayati'", "dh"],
        ),
        ("calibrate:", "calibrte:", ["row 13", "key calibrte", "unknown key", "did you mean 'calibrate'"]),
        ("alpha: 0", "alpa: 0", ["row 7", "joints[0].alpa", "did you mean 'alpha'"]),
        ("d: 250 ", "dd: 250 ", ["row 10", "joints[2].dd", "unknown key"]),
        ("theta: 0", "theta: x", ["row 7", "joints[0].theta", "'x'", "a finite number in deg"]),
        ("theta: 0", "theta: .nan", ["row 7", "joints[0].theta", "nan"]),
        ("theta: 0", "theta: .inf", ["joints[0].theta", "inf"]),
        ("theta: 0", "theta: true", ["joints[0].theta", "True"]),
        ("theta: 0", "theta: [1]", ["joints[0].theta", "[1]"]),
        ("r: 300", "r: 1.0e+400", ["joints[0].r"]),
        ("[0, 0, 72]", "[0, 0]", ["row 12", "tool.xyz", "3 numbers"]),
        ("[0, 0, 72]", "[0, 0, a]", ["row 12", "tool.xyz[2]", "'a'"]),
        ("[0, 0, 72]", "[0, 0, .inf]", ["row 12", "tool.xyz[2]"]),
        ("[0, 0, 72]", "[0, 0, 72], rpy: [0, 0, 0], rotation_vector: [0, 0, 0]", ["key tool", "twice"]),
        (
            "fixed: [j2.beta]",
            "fixed: [j2.betta]",
            ["row 13", "calibrate.fixed[0]", "'j2.betta'", "did you mean 'j2.beta'"],
        ),
        ("free: true", "fre: true", ["tool.fre", "did you mean 'free'"]),
        ("free: true", "free: maybe", ["tool.free", "'maybe'", "true, false"]),
        ("kind: arm", "kind: cable", ["row 3", "key kind", "this is a cable robot"]),
        ("kind: arm", "kind: arn", ["row 3", "key kind", "did you mean 'arm'"]),
        ("robocal: 1", "robocal: 2", ["row 1", "key robocal", "schema", "found 2"]),
        ("robocal: 1 ", "", ["key robocal", "missing"]),
        ("length: 1.0", "length: -1", ["calibrate.prior.length", "above 0"]),
        ("length: 1.0", "lenth: 1", ["calibrate.prior.lenth"]),
        ("[290, 310]", "[310, 290]", ["calibrate.bounds.j1.r", "[lower, upper]"]),
        ("[-150, 150]", "[150, -150]", ["row 7", "joints[0].limits", "wrong order"]),
        ("[-150, 150]", "150", ["joints[0].limits", "2 numbers"]),
        ("type: revolute", "type: revolut", ["row 7", "unknown joint type", "did you mean 'revolute'"]),
        ("name: j1", "name: 1", ["joints[0].name", "not a text"]),
        ("name: j1", "name: tool", ["row 7", "not a joint name"]),
        ("name: j2", "name: j1", ["row 8", "used twice"]),
        ("  - {name: j2, alpha: -90, theta: -90}", "  - 3", ["row 8", "joints[1]", "not a mapping"]),
        ("name: Mitsubishi RV-2AJ", "name:", ["row 2", "key name", "empty"]),
        ("tool:", "tool: 3 #", ["key tool", "not a mapping"]),
    ],
)
def test_faults_are_named(old, new, words):
    assert old in TEXT
    with pytest.raises(FormatError) as info:
        robot(TEXT.replace(old, new, 1))
    for word in ["robot.yaml", *words]:
        assert word in str(info.value)


def test_no_joints_and_a_missing_required_key():
    head = "robocal: 1\nname: a\nunits: {length: m, angle: rad}\nconvention: poe\n"
    with pytest.raises(FormatError, match="a robot needs a joint"):
        robot(head + "joints: []")
    with pytest.raises(FormatError, match=r"row 5, key joints\[0\]\.v: a key is missing"):
        robot(head + "joints: [{w: [0, 0, 1]}]")
    with pytest.raises(FormatError, match=r"robot\.yaml, row 5, key j1\.w: not a unit vector"):
        robot(head + "joints: [{v: [0, 0, 0], w: [0, 0, 2]}]")


def test_doubtful_units_are_a_warning():
    assert "units.length" in robot(TEXT.replace("length: mm", "length: m")).warnings[0].advice
    assert "units.angle" in robot(TEXT.replace("angle: deg", "angle: rad")).warnings[0].advice


def test_writing_changes_numbers_only(tmp_path):
    place = tmp_path / "calibrated.yaml"
    values = {"j1.r": 0.301, "j2.beta": 1 * DEG, "j3.d": 0.25, "j3.gain": 1.01, "tool.x": 0.001, "tool.rz": 1 * DEG}
    text, left = render_robot(robot(), values)
    write_text(place, text)
    assert left == ()
    header, _, body = place.read_text().partition("\n")
    expected = (
        TEXT.replace("r: 300", "r: 301")
        .replace("theta: -90}", "theta: -90, beta: 1}")
        .replace("# printed\n", "# printed\n    gain: 1.01\n")
        .replace("[0, 0, 72], free: true}", "[1, 0, 72], free: true, rotation_vector: [0, 0, 1]}")
    )
    assert body == expected and header.startswith("# Calibrated by robocal") and "robot.yaml" in header
    again = read_robot(place)
    for name, value in values.items():
        assert again.chain.table[name].value == pytest.approx(value, abs=1e-15)
    # Written once more there is still one header.
    assert render_robot(again, {"j1.r": 0.302})[0].count("# Calibrated") == 1
    with pytest.raises(ModelError, match=r"did you mean 'j1\.r'"):
        render_robot(again, {"j1.rr": 0.302})


def test_a_frame_keeps_its_words():
    r = robot(TEXT.replace("free: true}", "rpy: [10, 20, 30]}"))
    text, _ = render_robot(r, {"tool.rx": r.chain.table["tool.rx"].value + 0.01})
    moved = parse_robot(Source(Path("x"), text, ""))
    assert "rpy:" in text and "rotation_vector" not in text
    assert moved.chain.table["tool.rx"].value == pytest.approx(r.chain.table["tool.rx"].value + 0.01)


def test_open_robot_prefers_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("panda").write_text(TEXT)
    assert open_robot("panda").name == "Mitsubishi RV-2AJ"
    with pytest.raises(FileError, match="no such file"):
        open_robot("nothing.yaml")


# --- every valid robot round-trips ----------------------------------------------------------------------------------

NUMBERS = st.floats(-3, 3).map(lambda v: round(v, 6))
VECTORS = st.lists(NUMBERS, min_size=3, max_size=3)
DIRECTIONS = VECTORS.filter(lambda v: np.linalg.norm(v) > 0.1 and v[2] > 0.05)
STEPS = st.lists(
    st.fixed_dictionaries({"axis": st.sampled_from(["tx", "ty", "tz", "rx", "ry", "rz"]), "value": NUMBERS}),
    min_size=0,
    max_size=3,
)


@st.composite
def arms(draw, convention):
    rule = CONVENTIONS[convention]
    rows = []
    for i in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["revolute", "prismatic"]))
        row = {"name": f"j{i + 1}", "type": kind}
        for key in rule.keys:
            if not key.required and draw(st.booleans()):
                continue
            if kind == "prismatic" and key.name.startswith("shift"):
                continue
            strategy = {"direction": DIRECTIONS, "point": VECTORS, "moment": VECTORS, "angles": VECTORS}.get(
                key.quantity, NUMBERS
            )
            row[key.name] = draw(strategy) if key.quantity != "steps" else draw_steps(draw, kind)
        if draw(st.booleans()):
            row["gain"] = 1.0 + draw(NUMBERS) / 10
        if draw(st.booleans()):
            row["limits"] = sorted([draw(NUMBERS), draw(NUMBERS)])
        if convention == "poe":  # its vectors have length one and fit together
            axis = np.array(draw(DIRECTIONS))
            axis /= np.linalg.norm(axis)
            point = np.array(draw(VECTORS))
            row["v"], row["w"] = (np.cross(point, axis), axis) if kind == "revolute" else (axis, np.zeros(3))
            row["v"], row["w"] = row["v"].tolist(), row["w"].tolist()
        rows.append(row)
    vectors = [draw(VECTORS) + [v / 2 for v in draw(VECTORS)] for _ in range(3)]
    home = vectors[2] if rule.home and draw(st.booleans()) else None
    return chain("an arm: [#1]", convention, rows, base=vectors[0], tool=vectors[1], home=home)


def draw_steps(draw, kind):
    steps = draw(STEPS)
    for i, step in enumerate(steps):
        if draw(st.booleans()):
            step["symbol"] = f"s{i}"
    driven = {
        "axis": ("r" if kind == "revolute" else "t") + draw(st.sampled_from("xyz")),
        "value": draw(NUMBERS),
        "driven": 1,
    }
    return [*steps, driven]


def same_poses(a, b):
    q = np.random.default_rng(3).uniform(-1, 1, (5, len(a.joints)))
    np.testing.assert_allclose(a.pose(q), b.pose(q), atol=1e-12)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("convention", CONVENTIONS)
@settings(max_examples=15)
@given(data=st.data())
def test_any_robot_round_trips(convention, data):
    arm = data.draw(arms(convention))
    units = data.draw(st.sampled_from([Units(), Units(UNITS["m"], UNITS["rad"]), Units(UNITS["inch"], UNITS["mrad"])]))
    text = describe(arm, units, comment="made by a test")
    read = parse_robot(Source(Path("r.yaml"), text, ""))
    same_poses(read.chain, arm)
    np.testing.assert_allclose(read.chain.limits, arm.limits, atol=1e-12)
    assert read.name == arm.name and read.chain.table.names == arm.table.names
    # Any change of any parameter is written and read back.
    names = data.draw(st.lists(st.sampled_from(arm.table.names), max_size=4, unique=True))
    values = {n: arm.table[n].value + data.draw(st.sampled_from([0.0, 1e-6, 0.01, -0.2])) for n in names}
    changed, left_out = render_robot(read, values)
    assert left_out == ()
    same_poses(parse_robot(Source(Path("r.yaml"), changed, "")).chain, arm.with_values(values))
    # Nothing but the header differs when nothing changes.
    assert render_robot(read, {n: p.value for n, p in zip(read.chain.table.names, read.chain.table.rows, strict=True)})[
        0
    ].endswith(text)
    assert replace(read.chain, name="x").convention == convention

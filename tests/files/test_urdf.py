"""URDF: the right chain, the right complaint, and every byte outside the changed attributes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocal.errors import FormatError
from robocal.files.robot import open_robot, read_robot, render_robot
from robocal.files.text import Source
from robocal.files.urdf import edit_urdf, read_urdf
from robocal.files.writing import write_text
from robocal.geometry import se3, so3

TEXT = """<?xml version="1.0"?>
<!-- \u00fc comment -->
<robot name="two" xmlns:xacro="http://x">
  <link name="world"/><link name="a"/>
  <link name="b"/>
  <link name="c"/><link name="f1"/><link name="f2"/>
  <joint name="w" type="fixed"><parent link="world"/><child link="a"/><origin xyz="0 0 .1" rpy="0 0 1"/></joint>
  <joint name="j1" type="revolute">
    <origin   xyz = "0 0 0.5"
       note='rpy="9 9 9" &amp; >'/>
    <parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-1" upper="1.5" effort="1" velocity="1"/>
  </joint>
  <joint name="tool" type="prismatic">
    <parent link="b"/><child link="c"/>
  </joint>
  <joint name="m" type="continuous"><parent link="c"/><child link="f1"/></joint>
  <joint name="n" type="prismatic"><parent link="c"/><child link="f2"/><mimic joint="m"/></joint>
  <gazebo><joint name="zz" type="q"/></gazebo>
</robot>
"""


def read(text=TEXT, **options):
    return read_urdf(Source(Path("arm.urdf"), text, ""), **options)


def test_the_chain_is_the_product_of_origins_and_motions():
    arm = read(tip="c").chain
    q = np.array([[0.3, 0.2]])
    w = se3.compose(so3.exp([0, 0, 1.0]), [0, 0, 0.1])
    j1 = se3.compose(so3.exp([0, 0.3, 0]), [0, 0, 0.5])
    j2 = se3.compose(np.eye(3), [0.2, 0, 0])
    np.testing.assert_allclose(arm.pose(q)[0], w @ j1 @ j2, atol=1e-15)
    assert (
        arm.joint_names == ("j1", "tool_joint") and tuple(arm.limits[0]) == (-1.0, 1.5) and arm.table.free[0] == "j1.x"
    )
    assert not any(n.startswith("w.") for n in arm.table.free) and "tool.x" in arm.table.free


def test_default_is_the_longest_chain():
    made = read()
    assert (made.root, made.tip, made.chain.joint_names) == ("world", "f1", ("j1", "tool_joint", "m"))
    assert read(base="b").chain.joint_names == ("tool_joint", "m")
    two = TEXT.replace('<mimic joint="m"/>', "")
    assert "f1" in read(two).warnings[0].sentence and read(two, tip="f2").chain.joint_names[-1] == "n"


@pytest.mark.parametrize(
    ("old", "new", "options", "words"),
    [
        ('<link name="b"/>', "", {}, ["row 11", "joint j1 child", "no such link", "'b'"]),
        ('<child link="c"/>\n', '<child link="a"/>\n', {}, ["row 13", "two parents", "loop", "w and tool"]),
        ('<parent link="world"/>', '<parent link="c"/>', {}, ["form a loop"]),
        ('<link name="b"/>', '<link name="b"/><link name="q"/>', {}, ["row 5", "more than one root", "world, q"]),
        ('name="two"', 'name="${q}"', {}, ["row 3", "xacro arm.xacro > arm.urdf"]),
        ("<gazebo>", "<xacro:macro/><gazebo>", {}, ["row 18", "xacro"]),
        ("", "", {"tip": "f2"}, ["row 17", "joint n", "mimic", "'m'"]),
        ("", "", {"tip": "f3"}, ["key tip", "no such link", "did you mean 'f1'"]),
        ("", "", {"base": "worl"}, ["key base", "did you mean 'world'"]),
        ("", "", {"tip": "a", "base": "b"}, ["key base", "not connected"]),
        ("", "", {"tip": "a"}, ["no joint moves"]),
        ('"0 1 0"', '"0 1"', {}, ["row 11", "joint j1 axis xyz", "'0 1'", "3 finite numbers"]),
        ('"0 1 0"', '"0 0 0"', {}, ["row 11", "no direction"]),
        ('"0 1 0"', '"0 x 0"', {}, ["row 11", "'0 x 0'"]),
        ('"0 0 0.5"', '"0 nan 0.5"', {}, ["row 9", "joint j1 origin xyz", "nan"]),
        ('lower="-1"', 'lower="9"', {}, ["joint j1 limit", "wrong order"]),
        ('"revolute"', '"revolut"', {}, ["row 8", "joint j1 type", "did you mean 'revolute'"]),
        ('"revolute"', '"planar"', {"tip": "c"}, ["row 8", "cannot contain", "planar"]),
        ('name="m"', 'name="j1"', {}, ["row 16", "joint name is used twice"]),
        ('name="f2"', 'name="f1"', {}, ["link name is used twice"]),
        ('<parent link="b"/>', "", {}, ["row 13", "no parent"]),
        ('<parent link="b"/>', "<parent/>", {}, ["row 14", "<parent> has no link"]),
        ('<?xml version="1.0"?>', '<!DOCTYPE x [<!ENTITY a "b"><!ENTITY c "&a;&a;">]>', {}, ["row 1", "DOCTYPE"]),
        ("</robot>", "", {}, ["not valid XML"]),
        ("<robot ", "<!-- ", {}, ["not valid XML"]),
    ],
)
def test_faults_are_named(old, new, options, words):
    assert old in TEXT
    with pytest.raises(FormatError) as info:
        read(TEXT.replace(old, new, 1) if old else TEXT, **options)
    for word in ["arm.urdf", *words]:
        assert word in str(info.value)


def test_other_xml_and_no_links():
    with pytest.raises(FormatError, match="not a URDF"):
        read("<sdf/>")
    with pytest.raises(FormatError, match="no links"):
        read("<robot/>")


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_only_changed_attributes_differ(newline):
    text = TEXT.replace("\n", newline)
    arm = read(text, tip="c").chain
    values = {"j1.x": 0.25, "j1.rx": 0.125, "tool_joint.ry": 0.5, "tool.x": 3.0, "j1.gain": 1.1}
    made, left_out = edit_urdf(text, arm, values)
    expected = (
        text.replace('"0 0 0.5"', '"0.25 0 0.5"')
        .replace("&amp; >'/>", '&amp; >\' rpy="0.125 0 0"/>')
        .replace('type="prismatic">' + newline, f'type="prismatic">{newline}    <origin rpy="0 0.5 0"/>{newline}', 1)
    )
    assert made == expected and left_out == ("tool.x", "j1.gain")
    del values["tool.x"], values["j1.gain"]
    q = [[0.3, 0.2]]
    np.testing.assert_allclose(read(made, tip="c").chain.pose(q), arm.with_values(values).pose(q), atol=1e-15)


def test_bytes_are_equal_when_nothing_changes(tmp_path):
    for mark in (b"", b"\xef\xbb\xbf"):
        place, out = tmp_path / "arm.urdf", tmp_path / "out.urdf"
        place.write_bytes(mark + TEXT.encode())
        robot = open_robot(place)
        assert robot.format == "urdf" and robot.units.length.name == "m" and robot.tip == "f1"
        table = robot.chain.table
        text, left = render_robot(robot, {p.name: p.value for p in table.rows})
        write_text(out, text)
        assert left == () and out.read_bytes() == place.read_bytes()


def test_a_urdf_is_known_by_its_content(tmp_path):
    place = tmp_path / "arm.txt"
    place.write_text(TEXT)
    assert read_robot(place, tip="c").tip == "c"


@settings(max_examples=50)
@given(
    st.lists(st.tuples(st.integers(0, 5), st.floats(-3, 3)), min_size=1, max_size=6),
    st.sampled_from(["j1", "tool_joint", "m"]),
)
def test_any_change_is_read_back(changes, owner):
    arm = read().chain
    names = [f"{owner}.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")]
    values = {names[i]: v for i, v in changes}
    made, _ = edit_urdf(TEXT, arm, values)
    q = np.random.default_rng(0).uniform(-1, 1, (3, 3))
    np.testing.assert_allclose(read(made).chain.pose(q), arm.with_values(values).pose(q), atol=1e-12)
    assert render_robot is not None

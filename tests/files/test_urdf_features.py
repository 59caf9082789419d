"""What URDF files of the field have beside the plainest form: quaternions, declarations after a comment, letters of Latin-1, joints
that follow others, trees that hang on joints without an axis, other units."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal

from robocal.errors import FormatError
from robocal.files.robot import read_robot, render_robot
from robocal.files.writing import write_text
from robocal.geometry import se3, so3


def joint(name, parent, child, *, kind="revolute", origin='xyz="0.1 0 0.3" rpy="0 0 0"', more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin {origin}/>'
        f'<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/>{more}</joint>'
    )


def urdf(*joints, head='<?xml version="1.0"?>\n', links="abcdefgh"):
    return head + '<robot name="r">' + "".join(f'<link name="{n}"/>' for n in links) + "".join(joints) + "</robot>\n"


def chain_of(*origins):
    """Joints a to b, b to c, ... with these origins."""
    return [joint(f"j{i + 1}", "abcdefgh"[i], "abcdefgh"[i + 1], origin=o) for i, o in enumerate(origins)]


def read(folder, text, **options):
    (folder / "arm.urdf").write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_robot(folder / "arm.urdf", **options)


@pytest.mark.parametrize("turn", [(0.3, -0.2, 0.9), (np.pi, 0.0, 0.0), (0.0, 0.0, -2.0)])
def test_a_quaternion_is_the_rotation_that_it_says(tmp_path, turn):
    turn = np.array(turn)
    angle = np.linalg.norm(turn)
    w, v = np.cos(angle / 2), np.sin(angle / 2) * turn / angle
    quat = " ".join(f"{x:.17g}" for x in (*v, w))
    text = urdf(*chain_of('xyz="0 0 0.2"', f'xyz="0.4 0 0.1" quat_xyzw="{quat}"', 'xyz="0.2 0 0"'), links="abcd")
    robot = read(tmp_path, text)
    assert robot.warnings == ()
    first, last = se3.compose(np.eye(3), [0, 0, 0.2]), se3.compose(np.eye(3), [0.2, 0, 0])
    expected = first @ se3.compose(so3.exp(turn), [0.4, 0, 0.1]) @ last
    np.testing.assert_allclose(robot.chain.pose(np.zeros((1, 3)))[0], expected, atol=1e-12)
    # What is identified goes back into the same attribute, and nothing else changes.
    name = "j2.rx"
    back, _ = render_robot(robot, {name: robot.chain.table[name].value + 0.01})
    (tmp_path / "arm.urdf").write_text(back)
    again = read_robot(tmp_path / "arm.urdf")
    moved = robot.chain.with_values({name: robot.chain.table[name].value + 0.01})
    np.testing.assert_allclose(again.chain.pose(np.full((1, 3), 0.3)), moved.pose(np.full((1, 3), 0.3)), atol=1e-12)
    assert "rpy" not in back and back.replace(back.split('quat_xyzw="')[1].split('"')[0], quat) == text


@pytest.mark.parametrize(
    ("origin", "words"),
    [
        ('xyz="0 0 0" rpy="0 0 1" quat_xyzw="0 0 0 1"', "two rotations"),
        ('xyz="0 0 0" quat_xyzw="0 0 0.5 0.5"', "length 1"),
        ('xyz="0 0 0" quat_xyzw="0 0 1"', "4 finite numbers"),
    ],
)
def test_a_quaternion_that_is_none_is_refused(tmp_path, origin, words):
    with pytest.raises(FormatError, match=words):
        read(tmp_path, urdf(*chain_of(origin, 'xyz="0 0 1"'), links="abc"))


@pytest.mark.parametrize(
    "head",
    [
        "<!-- a -->\n<?xml version='1.0'?>\n",
        "\n\n<?xml version='1.0'?>",
        "<!--a--> <!--b-->\n<?xml version='1.0' encoding='utf-8'?>",
    ],
)
def test_a_declaration_may_come_late(tmp_path, head):
    text = urdf(*chain_of('xyz="0 0 0.2"', 'xyz="0.4 0 0.1"'), head=head, links="abc")
    robot = read(tmp_path, text)
    assert render_robot(robot, {})[0] == text
    assert render_robot(robot, {"j2.x": 0.5})[0] == text.replace("0.4 0 0.1", "0.5 0 0.1")


@pytest.mark.parametrize("encoding", ["ISO-8859-1", "latin-1", "windows-1252"])
def test_letters_of_one_byte_stay_as_they_are(tmp_path, encoding):
    text = urdf(
        *chain_of('xyz="0 0 0.2"', 'xyz="0.4 0 0.1"'),
        head=f'<?xml version="1.0" encoding="{encoding}"?>\n<!-- modèle étalonné -->\n',
        links="abc",
    )
    data = text.encode("cp1252")
    robot = read(tmp_path, data)
    write_text(tmp_path / "out.urdf", render_robot(robot, {"j2.x": 0.5})[0])
    assert (tmp_path / "out.urdf").read_bytes() == data.replace(b"0.4 0 0.1", b"0.5 0 0.1")


def test_another_encoding_is_still_named(tmp_path):
    with pytest.raises(Exception, match="UTF-8"):
        read(tmp_path, b'<?xml version="1.0" encoding="EBCDIC-CP-US"?>\n<!-- \xe8 --><robot/>')


def test_an_arm_is_not_cut_short_at_a_joint_that_follows_another(tmp_path):
    mimic = joint("m", "c", "d", more='<mimic joint="j1" multiplier="-1"/>')
    arm = [
        *chain_of('xyz="0 0 0.2"', 'xyz="0.4 0 0.1"'),
        mimic,
        *(joint(f"k{i}", "def"[i], "efg"[i]) for i in range(3)),
    ]
    with pytest.raises(FormatError, match=r"\(mimic\) cannot be part of an arm.*--tip c"):
        read(tmp_path, urdf(*arm, links="abcdefg"))
    assert read(tmp_path, urdf(*arm, links="abcdefg"), tip="c").chain.joint_names == ("j1", "j2")


def test_a_gripper_of_joints_that_follow_one_says_where_the_arm_ends(tmp_path):
    """Its first joint moves by itself, and what hangs behind it follows: the arm ends ahead of that joint."""
    arm = chain_of('xyz="0 0 0.2"', 'xyz="0.4 0 0.1"', 'xyz="0 0 0.1"')
    follows = '<mimic joint="knuckle" multiplier="-1"/>'
    fingers = [
        joint("knuckle", "d", "e"),
        joint("pad", "e", "f", more=follows),
        joint("other", "d", "g", more=follows),
        joint("other_pad", "g", "h", more=follows),
    ]
    text = urdf(*arm, *fingers)
    with pytest.raises(FormatError, match="--tip d, if both move a gripper"):
        read(tmp_path, text)
    assert read(tmp_path, text, tip="d").chain.joint_names == ("j1", "j2", "j3")


def test_a_finger_that_follows_the_other_cuts_nothing(tmp_path):
    arm = chain_of('xyz="0 0 0.2"', 'xyz="0.4 0 0.1"', 'xyz="0 0 0.1"')
    fingers = [
        joint("f1", "d", "e", kind="prismatic"),
        joint("f2", "d", "f", kind="prismatic", more='<mimic joint="f1"/>'),
    ]
    robot = read(tmp_path, urdf(*arm, *fingers, links="abcdef"))
    assert robot.tip == "e" and [w.code for w in robot.warnings] == ["tip-chosen"]  # with --tip in its advice


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_tree_on_a_joint_without_an_axis_says_the_base(tmp_path, kind):
    loose = f'<joint name="loose" type="{kind}"><parent link="a"/><child link="b"/></joint>'
    arm = [loose, joint("j1", "b", "c"), joint("j2", "c", "d")]
    with pytest.raises(FormatError, match="--base b"):
        read(tmp_path, urdf(*arm, links="abcd"))
    assert read(tmp_path, urdf(*arm, links="abcd"), base="b").chain.joint_names == ("j1", "j2")


def test_other_units_are_named(tmp_path):
    arm = chain_of('xyz="0 0 412" rpy="0 0 0"', 'xyz="55 0 0" rpy="-90 0 0"', 'xyz="380 0 0" rpy="90 0 0"')
    robot = read(tmp_path, urdf(*arm, links="abcd"))
    assert [w.code for w in robot.warnings] == ["urdf-size", "urdf-turn"]
    assert "1000" in robot.warnings[0].advice and "1.5708" in robot.warnings[1].advice


def test_a_robot_in_millimetres_is_the_cause_and_not_its_readings(tmp_path):
    """The readings of an arm whose URDF is in mm are called mm, as they are."""
    turns = [(0, 0, 0), (-1.5708, 0, 0), (0, 0, 0), (-1.5708, 0, 0), (1.5708, 0, 0), (-1.5708, 0, 0)]
    places = [(0, 0, 0.4), (0.07, 0, 0), (0.36, 0, 0), (0.05, 0.33, 0), (0, 0, 0), (0, 0, 0.09)]

    def text(unit):
        rows = zip(turns, places, strict=True)
        return urdf(
            *chain_of(
                *(f'xyz="{" ".join(repr(v * unit) for v in p)}" rpy="{" ".join(map(repr, t))}"' for t, p in rows)
            ),
            links="abcdefg",
        )

    (tmp_path / "arm.urdf").write_text(text(1.0))
    (tmp_path / "mm.urdf").write_text(text(1000.0))
    q = np.random.default_rng(5).uniform(-1.5, 1.5, (60, 6))
    p = read_robot(tmp_path / "arm.urdf").chain.pose(q)[:, :3, 3] * 1e3 + np.array([900.0, -400.0, 250.0])
    rows = [",".join(f"{v:.6f}" for v in (*np.degrees(a), *b)) for a, b in zip(q, p, strict=True)]
    head = ",".join([*(f"j{i} [deg]" for i in range(1, 7)), "x [mm]", "y [mm]", "z [mm]"])
    (tmp_path / "data.csv").write_text("\n".join([head, *rows]) + "\n")
    ran = robocal("identify", tmp_path / "mm.urdf", tmp_path / "data.csv", "--json")
    assert ran.status == 2 and "mm.urdf" in ran.said and "probably in mm" in ran.said


@pytest.mark.parametrize(("low", "high", "said"), [(-170, 170, 1), (0, 90, 1), (-6.29, 6.29, 0), (-12.6, 12.6, 0), (-1e3, 1e3, 0), (-1e16, 1e16, 0)])  # fmt: skip
def test_limits_in_degrees_are_named(tmp_path, low, high, said):
    """Two turns to either side there are, and limits that mean none."""
    text = urdf(*chain_of('xyz="0 0 0.3"', 'xyz="0.3 0 0"'), links="abc").replace('lower="-2"', f'lower="{low}"', 1)
    robot = read(tmp_path, text.replace('upper="2"', f'upper="{high}"', 1))
    assert [w.code for w in robot.warnings] == ["urdf-limits"] * said


def test_one_joint_is_one(tmp_path):
    read(tmp_path, urdf(*chain_of('xyz="0 0 0.3"'), links="ab"))
    assert "1 joint: j1" in robocal("check", tmp_path / "arm.urdf").said

"""Cable robots in files: what is read, what is refused and how, what is written back, and what comes from elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cables.cable_robots import PUBLISHED, published

from robocal.errors import FileError, FormatError, ModelError
from robocal.files.cable.cable_robot import parse_cable, read_cable
from robocal.files.cable.write import describe_cable, render_cable
from robocal.files.text import Source

ROBOT = """\
robocal: 1
name: four posts              # planar, upright
kind: cable
units: {length: mm, angle: deg, force: kN, mass: g}
degrees: 1R2T
frame_anchors:
  left foot: [-2000, 0, 0]
  right foot: [2000, 0, 0]
  right head: {value: [2, 0, 3], unit: m, source: tape measure}
  left head: [-2000, 0, 3000]
platform_anchors:
  - [-200, 0, -100]
  - [200, 0, -100]
  - {value: [200, 0, 100], assumed: true}
  - [-200, 0, 100]
cables:
  - {name: c1, zero: 500}     # the first of each
  - {name: c2, tension: [0.02, 0.2]}
  - {name: c3, pulley: {radius: 50, axis: [0, 0, 2]}}
  - {name: slow one, frame: left head, platform: 4, zero: 12.5}
every_cable: {tension: [0.01, 0.1], elasticity: {value: 0.0025, unit: "%/N", assumed: true}, density: 0.000122e-3, diameter: 4.8}
platform: {mass: {value: 5000, assumed: true}, centre_of_mass: [0, 0, 10], inertia: [[1.0e+9, 0, 0], [0, 1.0e+9, 0], [0, 0, 1.0e+9]]}
calibrate: {free: [ax, az, c1]}
source: a drawing
"""


def made(text: str):
    return parse_cable(Source(Path("robot.yaml"), text, "0"))


def test_what_is_read():
    robot = made(ROBOT).robot
    assert robot.name == "four posts" and robot.cables == ("c1", "c2", "c3", "slow one")
    np.testing.assert_allclose(robot.a, [[-2, 0, 0], [2, 0, 0], [2, 0, 3], [-2, 0, 3]])
    np.testing.assert_allclose(robot.b[:, 0], [-0.2, 0.2, 0.2, -0.2])
    np.testing.assert_allclose(robot.zeros, [0.5, 0, 0, 0.0125])
    np.testing.assert_allclose(robot.limits, [[10, 100], [20, 200], [10, 100], [10, 100]])
    np.testing.assert_allclose(robot.elasticity, 2.5e-5)
    np.testing.assert_allclose(robot.density, 0.122)
    np.testing.assert_allclose(robot.diameter, 0.0048)
    np.testing.assert_allclose(robot.inertia, np.eye(3))
    np.testing.assert_allclose(robot.com, [0, 0, 0.01])
    assert robot.mass == 5 and robot.axes == (0, 2, 4)
    np.testing.assert_allclose(robot.pulleys.radius, [0, 0, 0.05, 0])
    np.testing.assert_allclose(robot.pulleys.axis[2], [0, 0, 1])
    assert robot.sources == {"": "a drawing", "c3.a": "tape measure"}
    assert set(robot.assumed) == {"c3.b", "mass", *(f"{c}.elasticity" for c in robot.cables)}
    assert {"c2.ax", "c3.az", "c1.bx"} <= set(robot.table.free) and "c2.bx" not in robot.table.free


def test_a_description_reads_back():
    one = made(ROBOT)
    other = made(describe_cable(one.robot, one.units))
    for what in ("numbers", "limits", "elasticity", "density", "diameter", "inertia", "com", "mass"):
        np.testing.assert_allclose(getattr(other.robot, what), getattr(one.robot, what), rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(other.robot.pulleys.radius, one.robot.pulleys.radius)
    assert dict(other.robot.sources) == dict(one.robot.sources) and set(other.robot.assumed) == set(one.robot.assumed)
    assert other.robot.table.free == one.robot.table.free and other.robot.degrees == "1R2T"


def test_writing_back_changes_numbers_only(tmp_path):
    file = made(ROBOT)
    text, left = render_cable(file, {"c3.ax": 2.001, "c2.l0": 0.25, "slow one.bz": 0.11})
    assert left == () and text.startswith("# Calibrated by robocal") and "3 numbers changed" in text.splitlines()[0]
    expected = ROBOT.replace("[2, 0, 3]", "[2.001, 0, 3]").replace("[0.02, 0.2]}", "[0.02, 0.2], zero: 250}")
    assert text.partition("\n")[2] == expected.replace("[-200, 0, 100]", "[-200, 0, 110]")
    assert made(text).robot.table["c3.ax"].value == 2.001


def test_what_the_file_cannot_hold_is_said():
    lists = ROBOT[: ROBOT.index("cables:")]
    text, left = render_cable(made(lists), {"c1.ax": -2.1, "c1.l0": 0.3})
    assert left == () and text.endswith("cables:\n  - {zero: 300}\n" + 3 * "  - {zero: 0}\n")
    assert made(text).robot.table["c1.l0"].value == 0.3 and made(text).robot.table["c1.ax"].value == -2.1
    braces = ", ".join(
        f"{key}: {getattr(made(lists).robot, which).tolist()}"
        for key, which in (("frame_anchors", "a"), ("platform_anchors", "b"))
    )
    braces = f"{{robocal: 1, kind: cable, name: between braces, units: {{length: m}}, degrees: 1R2T, {braces}}}"
    _, left = render_cable(made(braces), {"c1.l0": 0.3})
    assert left == ("c1.l0",)
    shared = ROBOT.replace("name: c2,", "name: c2, frame: left foot,")
    # Cables that share an anchor share its parameters: it is one number, and moves for both.
    text, _ = render_cable(made(shared), {"c1.ax": -2.1})
    robot = made(text).robot
    assert "c2.ax" not in robot.table and robot.row("c2.ax") == "c1.ax" and (robot.a[:2, 0] == -2.1).all()
    assert (made(describe_cable(robot)).robot.a == robot.a).all() and made(
        describe_cable(robot)
    ).robot.shared == robot.shared
    assert "c1 and c2 leave the frame at the same point" in made(shared).warnings[0].sentence


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("  left head: [-2000, 0, 3000]\n", "", ["row 19", "cables[3].frame", "no such frame anchor", "'left head'"]),
        ("  - [-200, 0, 100]\n", "", ["row 19", "cables[3].platform", "no such platform anchor", "found 4"]),
        ("frame: left head, platform: 4, ", "", None),
        ("frame: left head", "frame: left haed", ["cables[3].frame", "did you mean 'left head'"]),
        ("[0.02, 0.2]", "[0.2, 0.02]", ["row 18", "cables[1].tension", "crossed", "[200.0, 20.0]"]),
        ("[0.01, 0.1]", "[0.1, 0.1]", ["row 21", "every_cable.tension", "crossed"]),
        ("[0.01, 0.1]", "[-0.01, 0.1]", ["every_cable.tension", "cannot push"]),
        ("[0.01, 0.1]", "[-0.01, 0]", ["every_cable.tension", "always slack"]),
        ("{name: c2, ", "{name: c2, frame: left foot, platform: 1, ", ["row 18", "cables c1 and c2 are the same"]),
        ("mass: {value: 5000,", "mass: {value: 0,", ["row 22", "platform.mass", "has a mass"]),
        ("[[1.0e+9, 0, 0]", "[[9.0e+9, 0, 0]", ["platform.inertia", "no body has this inertia"]),
        ("[0, 0, 2]", "[0, 0, 0]", ["cables[2].pulley.axis", "direction"]),
        ("radius: 50", "radius: -50", ["cables[2].pulley", "negative radius"]),
        ("diameter: 4.8", "diameter: -4.8", ["every_cable.diameter", "negative diameter"]),
        ("diameter: 4.8", "diametre: 4.8", ["every_cable.diametre", "did you mean 'diameter'"]),
        ("unit: m,", "unit: kg,", ["right head.unit", "another quantity"]),
        ('"%/N"', '"%/kg"', ["every_cable.elasticity.unit"]),
        ("assumed: true}, density", "assumed: maybe}, density", ["every_cable.elasticity.assumed", "true or false"]),
        ("{value: 5000, assumed", "{valeu: 5000, assumed", ["platform.mass.valeu", "did you mean 'value'"]),
        ("[-2000, 0, 0]", "[-2000, 0]", ["row 7", "frame_anchors.left foot", "3 numbers"]),
        ("[-2000, 0, 0]", "[-2000, 0, .nan]", ["frame_anchors.left foot[2]", "finite"]),
        ("degrees: 1R2T", "degrees: 3R2T", ["row 5", "degrees", "'3R2T'"]),
        ("kind: cable", "kind: cabel", ["row 3", "kind", "did you mean 'cable'"]),
        ("name: c2", "name: c1", ["cables[1].name", "twice"]),
        ("name: c2", "name: fx", ["row 18", "cables[1].name", "not a usable name for a cable", "'fx'"]),
        ("name: c2", "name: 'c[2]'", ["row 18", "cables[1].name", "not a usable name for a cable", "brackets"]),
        ("robocal: 1\n", "", ["key robocal: a key is missing"]),
        ("free: [ax,", "free: [aax,", ["calibrate.free[0]", "did you mean 'ax'"]),
        ("c1]}", "c1], prior: {ax: 0}}", ["calibrate.prior.ax", "above 0"]),
        ("c1]}", "c1], prior: {aax: 30}}", ["calibrate.prior.aax", "did you mean 'ax'"]),
        ("c1]}", "c1], prior: {c3: 30}}", ["calibrate.prior.c3", "several units"]),
        ("c1]}", "c1], prior: {c1.ax: 30, c1.ay: 20}, correlation: [[1, 0.5]]}", ["calibrate.correlation", "as in prior"]),
        ("c1]}", "c1], prior: {c1.ax: 30, c1.ay: 20}, correlation: [[1, 2], [2, 1]]}", ["calibrate.correlation", "definite"]),
        ("c1]}", "c1], prior: {ax: 30}, correlation: [[1]]}", ["calibrate.correlation", "priors of single names"]),
        ("c1]}", "c1], correlation: [[1]]}", ["calibrate.correlation", "as in prior"]),
        ("length: mm", "length: mmm", ["units.length", "did you mean 'mm'"]),
        ("every_cable: {tension: [0.01, 0.1], ", "every_cable: {", ["tension is given for some cables only", "none for c1"]),
    ],
)  # fmt: skip
def test_bad_files_get_one_clear_message(old, new, words):
    assert ROBOT.count(old) == 1
    text = ROBOT.replace(old, new)
    if words is None:
        assert made(text).robot.b[3, 0] == -0.2  # the fourth of each, unless stated
        return
    with pytest.raises(FormatError) as caught:
        made(text)
    for word in ("robot.yaml", *words):
        assert word in str(caught.value), str(caught.value)


def test_how_far_off_a_tape_measure_is():
    table = made(ROBOT.replace("c1]}", "c1], prior: {c2.ax: 5, ax: 30, az: {value: 1, unit: cm}}}")).robot.table
    assert [table[n].prior for n in ("c1.ax", "c2.ax", "c2.az", "c2.ay")] == [0.03, 0.005, 0.01, None]


def test_how_far_off_anchors_are_together():
    table = made(
        ROBOT.replace("c1]}", "c1], prior: {c2.ax: 5, c1.ay: 20}, correlation: [[1, -0.5], [-0.5, 1]]}")
    ).robot.table
    (shared,) = table.together
    assert shared.names == ("c2.ax", "c1.ay") and [table[n].prior for n in shared.names] == [0.005, 0.02]
    np.testing.assert_allclose(shared.covariance, [[25e-6, -50e-6], [-50e-6, 400e-6]], rtol=1e-12)
    assert "c2.ax" in table.free


EIGHT = """\
robocal: 1
name: eight
kind: cable
units: {length: m}
frame_anchors: [[1, 1, 2], [-1, 1, 2], [-1, -1, 2], [1, -1, 2], [1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]
platform_anchors: [[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0.2], [-0.1, 0.1, 0.2], [-0.1, -0.1, 0.2], [0.1, -0.1, 0.2]]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[[1, 1, 2], ", "[", ["row 5", "frame_anchors", "7 frame anchors, 8 platform anchors"]),
        (EIGHT[EIGHT.index("platform_anchors") :], "platform_anchors: [" + ", ".join(["[0, 0, 0]"] * 8) + "]\n",
         ["row 6", "platform_anchors", "cannot hold the platform", "3 directions held"]),
    ],
)  # fmt: skip
def test_bad_geometry(old, new, words):
    with pytest.raises(FormatError) as caught:
        made(EIGHT.replace(old, new))
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_eight_cables_and_seven_anchors():
    text = EIGHT.replace("[[1, 1, 2], ", "[") + "cables: [" + ", ".join(f"{{name: k{i}}}" for i in range(8)) + "]\n"
    with pytest.raises(FormatError, match="7 frame anchors for 8 cables"):
        made(text)


def test_what_is_needed_and_not_known():
    robot = made(EIGHT).robot
    for what in ("mass", "limits", "elasticity", "density"):
        with pytest.raises(ModelError, match=f"the {what} of eight is not known"):
            robot.need(what)


def test_an_arm_is_no_cable_robot():
    with pytest.raises(FormatError, match="this is an arm"):
        made("robocal: 1\nname: a\nkind: arm\nunits: {length: mm, angle: deg}\nconvention: dh\njoints: []\n")


# --- from elsewhere ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_robots(name, shared_data):
    file = read_cable(shared_data / "cable-robots" / f"{name}.yaml")
    np.testing.assert_array_equal(file.robot.numbers, published(name).numbers)
    assert file.warnings == () and file.robot.mass > 0 and file.robot.limits.shape == (8, 2) and file.robot.sources[""]
    again = made(describe_cable(file.robot, file.units)).robot
    np.testing.assert_array_equal(again.numbers, file.robot.numbers)
    np.testing.assert_array_equal(again.limits, file.robot.limits)
    assert set(again.assumed) == set(file.robot.assumed)
    assumed = {"mass", *(f"c{i}.b" for i in range(1, 9))} if name == "laval" else set()
    assert set(file.robot.assumed) == assumed


def test_a_rig_without_frame_anchors_is_no_robot(shared_data):
    with pytest.raises(FormatError, match=r"frame_anchors_nominal.*did you mean 'frame_anchors'"):
        read_cable(shared_data / "cable-robots" / "thesis-rig.yaml")


CABLE = """<cable_ideal name="{name}" attachment_reference="{reference}">
<properties><force_min>0.5</force_min><force_max>100</force_max></properties>
<attachments><attachment><link>0</link><location>{a}</location></attachment>
<attachment><link>1</link><location>{b}</location></attachment></attachments></cable_ideal>
"""
BODIES = """<?xml version="1.0" encoding="utf-8"?>
<links><link_rigid num="1" name="p"><joint type="PLANAR_XZ" />
<physical><mass>2.5</mass><com_location>0 0 0.25</com_location><end_location>0 0 0</end_location>
<inertia ref="com"><Ixx>2</Ixx><Iyy>2</Iyy><Izz>1</Izz><Ixy>0.1</Ixy><Ixz>0</Ixz><Iyz>0</Iyz></inertia></physical>
<parent><num>0</num><location>0 0 0</location></parent></link_rigid></links>
"""


def caspr(folder, reference="joint", bodies=BODIES, change=("", ""), order=(0, 1, 2)):
    ends = [("-1 0 0", "-.1 0 0"), ("1 0 0", "0.1 0 0"), ("1 0 2", "1.0e-1 0 0.1"), ("-1 0 2", "-0.1 0 0.1")]
    ends = [[" ".join(end.split()[k] for k in order) for end in both] for both in ends]
    rows = "".join(CABLE.format(name=f"cable {i}", reference=reference, a=a, b=b) for i, (a, b) in enumerate(ends))
    head = '<?xml version="1.0"?>\n<!DOCTYPE cables [\n<!ATTLIST cable_set id ID #REQUIRED>\n]>\n'
    text = f'{head}<cables default_cable_set="used"><cable_set id="spare"></cable_set><cable_set id="used">{rows}</cable_set></cables>'
    assert change[0] in text
    (folder / "flat_cables.xml").write_text(text.replace(*change) if change[0] else text)
    if bodies:
        (folder / "flat_bodies.xml").write_text(bodies)
    return folder / "flat_cables.xml"


def test_caspr(tmp_path):
    file = read_cable(caspr(tmp_path))
    robot = file.robot
    assert (robot.name, robot.degrees, robot.plane, robot.mass) == ("flat", "1R2T", "xz", 2.5)
    np.testing.assert_array_equal(robot.a[2], [1, 0, 2])
    np.testing.assert_array_equal(robot.b[2], [0.1, 0, 0.1])
    np.testing.assert_array_equal(robot.limits, [[0.5, 100]] * 4)
    np.testing.assert_array_equal(robot.com, [0, 0, 0.25])
    assert robot.inertia[0, 1] == 0.1 and "flat_bodies.xml" in robot.sources[""]
    about = read_cable(caspr(tmp_path, "com")).robot
    np.testing.assert_allclose(about.b, robot.b + [0, 0, 0.25])
    again = made(describe_cable(robot)).robot
    np.testing.assert_array_equal(again.numbers, robot.numbers)
    older = BODIES.replace('<joint type="PLANAR_XZ" />', "<joint_type>SPATIAL_EULER_XYZ</joint_type>")
    few = read_cable(caspr(tmp_path, bodies=older))
    assert few.robot.degrees == "3R3T" and "4 cables do not determine 6 degrees of freedom" in few.warnings[0].sentence


def test_caspr_since_2017(tmp_path):
    """Bodies one level down, a document type in another file, comments, a planar model with one moment of inertia."""
    head = '<!DOCTYPE bodies_system SYSTEM "../../templates/bodies.dtd">\n<!-- <link_rigid num="1"/> --><bodies_system>'
    bodies = BODIES.replace("<links>", head + "<links>").replace("</links>", "</links></bodies_system>")
    bodies = bodies.replace("<Ixx>2</Ixx>", "<Ixx>0</Ixx>").replace("<Izz>1</Izz>", "<Izz>0</Izz>")
    file = read_cable(caspr(tmp_path, bodies=bodies))
    assert (
        file.robot.inertia is None
        and "inertia (row 5 of flat_bodies.xml) is impossible for a rigid body" in file.warnings[0].sentence
    )
    for joint, axes in (("PLANAR_XZ", (0, 2, 4)), ("PLANAR_YZ", (1, 2, 3)), ("PLANAR_XY", (0, 1, 5)), ("P_XZ", (0, 2))):
        order = {"PLANAR_YZ": (1, 0, 2), "PLANAR_XY": (0, 2, 1)}.get(joint, (0, 1, 2))
        made = read_cable(caspr(tmp_path, bodies=BODIES.replace("PLANAR_XZ", joint), order=order)).robot
        assert made.axes == axes and made.inertia is not None


def test_caspr_cables_that_stretch_and_pulleys(tmp_path):
    place = caspr(tmp_path)
    text = place.read_text()
    spring = "<K>13000</K><diameter>0.004</diameter><force_min>"
    place.write_text(text.replace("cable_ideal", "cable_linear_spring").replace("<force_min>", spring))
    robot = read_cable(place).robot
    np.testing.assert_allclose(robot.elasticity, 1 / 13000)
    np.testing.assert_allclose(robot.diameter, 0.004)
    one = text.partition("</cable_ideal>")
    place.write_text(one[0].replace("cable_ideal", "cable_linear_spring").replace("<force_min>", spring)
                     + "</cable_linear_spring>" + one[2])  # fmt: skip
    file = read_cable(place)
    assert file.robot.elasticity is None and "elasticity is stated for some cables only" in " ".join(
        map(str, file.warnings)
    )
    eyelet = "<attachment><link>0</link><location>1 0 2</location></attachment>"
    assert eyelet in text
    wheel = (
        "<base_rotating_pulley><fixed_location>1 0 2</fixed_location><pulley_radius>0.05</pulley_radius>"
        "<cable_entry_vector>0 0 2</cable_entry_vector></base_rotating_pulley>"
    )
    place.write_text(text.replace(eyelet, wheel))
    pulleys = read_cable(place).robot.pulleys
    np.testing.assert_array_equal(pulleys.radius, [0, 0, 0.05, 0])
    np.testing.assert_array_equal(pulleys.axis[2], [0, 0, 1])
    place.write_text(text.replace(eyelet, wheel.replace("0 0 2</cable", "0 0 0</cable")))
    with pytest.raises(FormatError, match=r"<cable_entry_vector>: a direction must not be zero"):
        read_cable(place)
    place.write_text(text.replace(eyelet, wheel.replace("base_rot", "screw_base_rot")))
    with pytest.raises(
        FormatError, match=r"runs from the base straight to the body; found '<screw_base_rotating_pulley>"
    ):
        read_cable(place)


def test_caspr_of_old(tmp_path):
    """One cable set that is not called the default; attachments without a reference, where it makes no difference."""
    place = caspr(tmp_path, bodies=BODIES.replace("0 0 0.25", "0 0 0"))
    text = place.read_text().replace(' default_cable_set="used"', "").replace('<cable_set id="spare"></cable_set>', "")
    place.write_text(text.replace(' attachment_reference="joint"', ""))
    np.testing.assert_array_equal(read_cable(place).robot.b[2], [0.1, 0, 0.1])
    (tmp_path / "flat_bodies.xml").write_text(BODIES)
    with pytest.raises(FormatError, match=r"row 5.*reference point of the attachments is not specified"):
        read_cable(place)


@pytest.mark.parametrize(
    ("change", "bodies", "words"),
    [
        (("<location>1 0 2", "<location>1 0 x"), BODIES, ["row 15", "<location>", "'1 0 x'", "3 finite numbers"]),
        (('default_cable_set="used"', 'default_cable_set="usd"'), BODIES, ["default cable set", "spare, used"]),
        (("<!ATTLIST", '<!ENTITY a "b"><!ATTLIST'), BODIES, ["entity is not accepted"]),
        (("</cables>", ""), BODIES, ["not valid XML"]),
        (("<force_max>100", "<force_max>0.1"), BODIES, ["crossed"]),
        (("", ""), BODIES.replace("PLANAR_XZ", "REVOLUTE_XY"), ["flat_bodies.xml", "'REVOLUTE_XY'", "PLANAR_XY"]),
        (("", ""), BODIES.replace("<mass>2.5</mass>", ""), ["<physical> has no <mass>"]),
        (("", ""), "<cables></cables>", ["flat_bodies.xml", "not the expected file"]),
        (
            ("", ""),
            BODIES.replace("PLANAR_XZ", "S_EULER_XYZ"),
            ["'S_EULER_XYZ'", "not that of a cable robot's platform"],
        ),
        (("", ""), BODIES.replace("</links>", '<link_rigid num="2"></link_rigid></links>'), ["arms", "2 <link_rigid>"]),
        (
            ("", ""),
            BODIES.replace("<location>0 0 0", "<location>0 .2 0"),
            ["plane of its frame anchors", "0.2 m beside"],
        ),
        (("<link>1<", "<link>2<"), BODIES, ["row 5", "links [0, 2]"]),
        (("cable_ideal", "muscle_hill_type"), BODIES, ["row 5", "<muscle_hill_type>", "this kind of actuator"]),
        (("cable_ideal", "cable_passive_linear_spring"), BODIES, ["row 5", "nobody drives this one"]),
        (
            (
                "<attachment><link>0</link>",
                "<attachment><link>0</link><location>0 0 0</location></attachment><attachment><link>0</link>",
            ),
            BODIES,
            ["row 5", "straight to the body", "<attachment>, <attachment>, <attachment>"],
        ),
    ],
)
def test_bad_caspr(tmp_path, change, bodies, words):
    place = caspr(tmp_path, bodies=bodies, change=change)
    with pytest.raises(FormatError) as caught:
        read_cable(place)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_caspr_without_its_bodies(tmp_path):
    with pytest.raises(FileError, match="flat_bodies.xml"):
        read_cable(caspr(tmp_path, bodies=None))

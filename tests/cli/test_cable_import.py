"""`import`: models of CASPR, written by hand in every form that is accepted, become robot.yaml with the same lengths; whatever
cannot be one is refused by file, element and key, and nothing is written."""

from __future__ import annotations

import itertools
import math
import random
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from cli.runs import files, robocal

import robocal as rc
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import DEGREES
from robocal.files.cable.cable_robot import read_cable
from robocal.remarks.code import Code

Vector = tuple[float, float, float]

# --- models by hand ---------------------------------------------------------------------------------------------------------

EIGHT = [
    ((-2.0, 1.5, 0.0), (-0.1, 0.125, -0.05)), ((2.0, 1.5, 0.0), (0.1, 0.125, -0.05)),
    ((2.0, -1.5, 0.0), (0.1, -0.125, -0.05)), ((-2.0, -1.5, 0.0), (-0.1, -0.125, -0.05)),
    ((-2.0, 1.5, 3.0), (-0.15, 0.05, 0.0625)), ((2.0, 1.5, 3.0), (0.15, 0.05, 0.0625)),
    ((2.0, -1.5, 3.0), (0.15, -0.05, 0.0625)), ((-2.0, -1.5, 3.0), (-0.15, -0.05, 0.0625)),
]  # fmt: skip
FLAT = [
    ((-1.0, -0.9), (-0.1, 0.05)),
    ((1.0, -0.9), (0.1, 0.05)),
    ((1.0, 0.9), (0.12, -0.05)),
    ((-1.0, 0.9), (-0.12, -0.05)),
]
CROSSED = [(a, b) for (a, _), (_, b) in zip(EIGHT, EIGHT[4:] + EIGHT[:4], strict=True)]


def words(point: Vector, sign: str = " ") -> str:
    return sign.join(f"{v:.17g}" for v in point)


def eyelet(point: Vector, body: int = 0) -> str:
    return f"<attachment><link>{body}</link><location>{words(point)}</location></attachment>"


def wheel(point: Vector, radius: float, axis: Vector) -> str:
    return (
        f"<base_rotating_pulley><fixed_location>{words(point)}</fixed_location><pulley_radius>{radius}</pulley_radius>\n"
        f"<cable_entry_vector>{words(axis)}</cable_entry_vector></base_rotating_pulley>"
    )


def cable(
    base: str, b: Vector, *, n: int, kind: str = "cable_ideal", reference: str | None = "joint", more: str = ""
) -> str:
    said = "" if reference is None else f' attachment_reference="{reference}"'
    return (
        f'<{kind} name="cable {n}"{said}>\n<properties>{more}<force_min>{n}</force_min><force_max>{100 + n}</force_max></properties>\n'
        f"<attachments>{base}\n{eyelet(b, 1)}</attachments>\n</{kind}>\n"
    )


def cables(ends: list[tuple[Vector, Vector]], **facts: object) -> str:
    return "".join(cable(eyelet(a), b, n=i, **facts) for i, (a, b) in enumerate(ends, start=1))  # type: ignore[arg-type]


def sets(default: str | None = "used", **of: str) -> str:
    head = "<cables>" if default is None else f'<cables default_cable_set="{default}">'
    return head + "".join(f'\n<cable_set id="{name}">\n{rows}</cable_set>' for name, rows in of.items()) + "\n</cables>"


PHYSICAL = """<physical><mass>8.5</mass><com_location>{com}</com_location><end_location>0 0 0</end_location>
<inertia ref="com"><Ixx>0.5</Ixx><Iyy>0.625</Iyy><Izz>0.75</Izz><Ixy>0.03125</Ixy><Ixz>0</Ixz><Iyz>0</Iyz></inertia></physical>"""
PARENT = "<parent><num>0</num><location>0 0 0</location></parent>"


def body(joint: str = '<joint type="SPATIAL_EULER_XYZ"/>', com: Vector = (0.0, 0.0, 0.0), parent: str = PARENT) -> str:
    inside = "\n".join((joint, PHYSICAL.format(com=words(com)), parent))
    return f'<link_rigid num="1" name="platform">\n{inside}\n</link_rigid>'


def links(of: str) -> str:
    return f"<links>\n{of}\n</links>"


@dataclass
class Model:
    """The texts of a model, and what was meant: anchors of the cables, wheels (radius, axis) of some, axes of the twist."""

    cables: str
    bodies: str
    ends: list[tuple[Vector, Vector]]
    axes: tuple[int, ...] = DEGREES["3R3T"]["xz"]
    wheels: dict[int, tuple[float, Vector]] = field(default_factory=dict)
    wanted: str | None = None

    def write(self, folder: Path, name: str = "model") -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}_bodies.xml").write_text(self.bodies, encoding="utf-8")
        (folder / f"{name}_cables.xml").write_text(self.cables, encoding="utf-8")
        return folder / f"{name}_cables.xml"


def spatial(of: str | None = None, bodies: str | None = None, ends: list | None = None, **facts: object) -> Model:
    ends = ends or EIGHT
    return Model(of or sets(used=cables(ends)), bodies or links(body()), ends, **facts)  # type: ignore[arg-type]


def planar(joint: str, beside: float = 0.0, parent: str | None = None) -> Model:
    """A planar robot in the plane and with the degrees that its joint says."""
    across = ({*"XYZ"} - {*joint[-2:]}).pop()

    def put(point: tuple[float, float], off: float) -> Vector:
        values = iter(point)
        return tuple(off if axis == across else next(values) for axis in "XYZ")  # type: ignore[return-value]

    ends = [(put(a, beside), put(b, 0.0) if joint[:2] != "P_" else (0.0, 0.0, 0.0)) for a, b in FLAT]
    axes = DEGREES["2T" if joint.startswith("P_") else "1R2T"][joint[-2:].lower()]
    parent = parent or f"<parent><num>0</num><location>{words(put((0.25, 0.5), beside))}</location></parent>"
    return Model(sets(used=cables(ends)), links(body(f'<joint type="{joint}"/>', parent=parent)), ends, axes)


def over_pulleys(bare: tuple[int, ...] = ()) -> Model:
    """Cables that come up to a wheel of the base from below or from above; those that are bare go through an eyelet."""
    wheels = {i: (0.05 + 0.01 * i, (0.1 * i - 0.2, 0.25, 2.0 if a[2] > 1 else -2.0)) for i, (a, _) in enumerate(EIGHT)}
    wheels = {i: w for i, w in wheels.items() if i not in bare}
    bases = [wheel(a, *wheels[i]) if i in wheels else eyelet(a) for i, (a, _) in enumerate(EIGHT)]
    rows = "".join(cable(base, b, n=i) for i, (base, (_, b)) in enumerate(zip(bases, EIGHT, strict=True), start=1))
    return spatial(sets(used=rows), wheels=wheels)


POINT = [(a, (0.0, 0.0, 0.0)) for a, _ in EIGHT]
COM = (0.015625, -0.03125, 0.25)
ABOUT = [(a, tuple(x + c for x, c in zip(b, COM, strict=True))) for a, b in EIGHT]
HEAD = '<?xml version="1.0" encoding="utf-8"?>\n'
INTERNAL = HEAD + "<!DOCTYPE cables [\n<!ATTLIST cable_set id ID #REQUIRED>\n]>\n"
EXTERNAL = HEAD + '<!DOCTYPE {0} SYSTEM "../../../templates/{0}.dtd">\n<!-- <{0}> --> '
SPRING = {"kind": "cable_linear_spring", "more": "<K>20000</K><diameter>0.004</diameter>"}
STIFF = cables(EIGHT[:4], **SPRING) + "".join(cable(eyelet(a), b, n=i) for i, (a, b) in enumerate(EIGHT[4:], start=5))
FORMS = {
    "spatial": spatial(),
    **{j: spatial(bodies=links(body(f'<joint type="{j}"/>'))) for j in ("SPATIAL", "SPATIAL_EULER_XYZ", "SPATIAL_QUATERNION")},
    **{f"{kind}_{plane}": planar(f"{kind}_{plane}") for kind in ("PLANAR", "P") for plane in ("XY", "XZ", "YZ")},
    "a point": Model(
        sets(used=cables(POINT)), links(body('<joint type="T_XYZ"/>')), POINT,
        DEGREES["3T"]["xz"],
    ),
    "a plane of its own": planar("PLANAR_XZ", beside=0.75),
    "joint in words, of old": spatial(bodies=links(body("<joint_type> SPATIAL </joint_type>"))),
    "bodies one level down": spatial(bodies=f"<bodies_system>{links(body())}<operational_spaces/></bodies_system>"),
    "document type inside": spatial(INTERNAL + sets(used=cables(EIGHT))),
    "document type in another file": spatial(
        EXTERNAL.format("cables") + sets(used=cables(EIGHT)), EXTERNAL.format("links") + links(body())
    ),
    "measured from the joint": spatial(bodies=links(body(com=COM))),
    "measured from the centre of mass": spatial(
        sets(used=cables(EIGHT, reference="com")), links(body(com=COM)), ABOUT
    ),
    "from where it makes no difference": spatial(sets(used=cables(EIGHT, reference=None))),
    "the only set": spatial(sets(None, only=cables(EIGHT))),
    "the default of two sets": spatial(sets(spare=cables(CROSSED), used=cables(EIGHT))),
    "another set than the default": spatial(sets(used=cables(EIGHT), spare=cables(CROSSED)), ends=CROSSED, wanted="spare"),
    "a set where none is the default": spatial(sets(None, one=cables(EIGHT), other=cables(CROSSED)), ends=CROSSED, wanted="other"),
    "a set that is not read is no cable robot": spatial(sets(used=cables(EIGHT), arm="<muscle_hill_type/>")),
    "springs": spatial(sets(used=cables(EIGHT, **SPRING))),
    "springs among ideal cables": spatial(sets(used=STIFF)),
    "pulleys": over_pulleys(),
    "pulleys and eyelets": over_pulleys(bare=(0, 3, 6)),
    "inertia about what is not said": spatial(bodies=links(body()).replace(' ref="com"', "")),
    "inertia about the CoM": spatial(bodies=links(body()).replace(' ref="com"', ' ref="CoM"')),
    "a plane's one moment": Model(
        planar("PLANAR_XZ").cables,
        planar("PLANAR_XZ").bodies.replace("<Ixx>0.5", "<Ixx>0").replace("<Izz>0.75", "<Izz>0"),
        planar("PLANAR_XZ").ends,
        DEGREES["1R2T"]["xz"],
    ),
    "without a parent": spatial(bodies=links(body(parent=""))),
    "counted from elsewhere": spatial(bodies=links(body(parent=PARENT.replace("0 0 0", "0.5 -0.25 1")))),
    "numbers between commas": spatial(sets(used=cables(EIGHT)).replace("<location>-2 1.5 0<", "<location> -2.0, 1.5,\n0e0 <")),
}  # fmt: skip


# --- lengths by a formula of their own --------------------------------------------------------------------------------------


def turned(turn: list[float], b: Vector) -> np.ndarray:
    """A point after a rotation by a vector: the quaternion's sandwich, q b q*."""
    angle = math.hypot(*turn)
    w = math.cos(angle / 2)
    v = np.array(turn) * (math.sin(angle / 2) / angle if angle else 0.5)
    return np.array(b) + 2 * w * np.cross(v, b) + 2 * np.cross(v, np.cross(v, b))


def over(a: np.ndarray, end: np.ndarray, radius: float, axis: Vector) -> float:
    """The length over a wheel of the base, by its centre and the point where the cable leaves: those of CASPR's
    BaseRotatingPulleyAttachment, with the arc by both of its legs."""
    n = np.array(axis) / math.hypot(*axis)
    out = (end - a) - n * (n @ (end - a))
    out /= math.hypot(*out)
    centre = a + radius * out
    to = end - centre
    share = radius / math.hypot(*to)
    leaves = centre + share**2 * to + share * math.sqrt(1 - share**2) * ((to @ out) * n - (to @ n) * out)
    spoke = (leaves - centre) / radius
    return radius * math.atan2(spoke @ n, -(spoke @ out)) + math.hypot(*(end - leaves))


def expected(model: Model, position: list[float], turn: list[float]) -> list[float]:
    out = []
    for i, (a, b) in enumerate(model.ends):
        end = np.array(position) + turned(turn, b)
        if i in model.wheels:
            out.append(over(np.array(a), end, *model.wheels[i]))
        else:
            out.append(math.hypot(*(end - np.array(a))))
    return out


def poses(model: Model, count: int = 60) -> list[tuple[list[float], list[float]]]:
    """Random poses with the degrees of the model, inside its frame."""
    rng = random.Random(7)
    low, high = (np.array([f(a[i] for a, _ in model.ends) for i in range(3)]) for f in (min, max))
    out = []
    for _ in range(count):
        at = [
            float(m + 0.3 * (h - l) * rng.uniform(-1, 1)) for m, l, h in zip((low + high) / 2, low, high, strict=True)
        ]
        out.append((at, [rng.uniform(-0.6, 0.6) if i + 3 in model.axes else 0.0 for i in range(3)]))
    return out


def matrix(position: list[float], turn: list[float]) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3] = np.array([turned(turn, e) for e in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]).T
    out[:3, 3] = position
    return out


# --- every form -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_a_form_of_caspr_keeps_its_lengths(tmp_path: Path, form: str) -> None:
    model = FORMS[form]
    source, made = model.write(tmp_path), tmp_path / "robot.yaml"
    ran = robocal("import", source, "-o", made, *(["--cables", model.wanted] if model.wanted else []))
    assert ran.status == 0, ran.err
    where = poses(model)
    want = np.array([expected(model, *pose) for pose in where])
    robot = read_cable(made).robot
    at = np.array([matrix(*pose) for pose in where])
    lengths, _ = inverse(robot, at)
    assert np.abs(lengths - want).max() < 1e-12
    assert robot.axes == model.axes
    for i, cable in enumerate(robot.cables):
        np.testing.assert_array_equal(robot.limits[i], [i + 1, 101 + i], cable)
    assert robot.mass == 8.5 and (robot.inertia is None) == (form == "a plane's one moment")
    if model.wanted is None:
        # And the model itself, read by every other verb, is the same robot.
        itself = read_cable(source).robot
        assert np.abs(inverse(itself, at)[0] - lengths).max() < 1e-12
        np.testing.assert_allclose(
            robot.numbers, itself.numbers, rtol=1e-15, atol=0
        )  # seventeenth digits are not written
        for what in ("limits", "com", "inertia", "elasticity", "diameter"):
            one, other = getattr(itself, what), getattr(robot, what)
            assert (one is None) == (other is None)
            assert one is None or np.array_equal(one, other), what
        assert (itself.name, itself.degrees, itself.plane, dict(itself.sources)) == (
            robot.name, robot.degrees, robot.plane, dict(robot.sources)
        )  # fmt: skip


def test_springs_stretch_and_what_only_some_say_is_told(tmp_path: Path) -> None:
    source = FORMS["springs"].write(tmp_path)
    assert robocal("import", source, "-o", tmp_path / "robot.yaml").status == 0
    robot = read_cable(tmp_path / "robot.yaml").robot
    np.testing.assert_allclose(robot.elasticity, 1 / 20000, rtol=1e-15)
    np.testing.assert_array_equal(robot.diameter, 0.004)
    at, turn = [0.1, 0.2, 1.4], [0.1, 0.0, -0.2]
    stretched, _ = inverse(robot, matrix(at, turn)[None], np.full((1, 8), 50.0))
    want = np.array(expected(FORMS["springs"], at, turn)) / (1 + 50 / 20000)
    assert np.abs(stretched - want).max() < 1e-12
    ran = robocal("import", FORMS["springs among ideal cables"].write(tmp_path / "some"), "--json")
    assert [r["numbers"]["what"] for r in ran.document["remarks"] if r["code"] == Code.SAID_OF_SOME] == [
        "elasticity",
        "diameter",
    ]


# --- what robot.yaml cannot hold --------------------------------------------------------------------------------------------


def test_what_no_robot_yaml_holds_is_named(tmp_path: Path) -> None:
    bodies = links(
        body('<joint type="SPATIAL" q_min="-1 -1" q_initial="0 0"/>', parent=PARENT.replace("0 0 0", "0.5 0 1"))
    )
    bodies = bodies.replace("<links>", '<links display_range="-8 8" view_angle="1 2">')
    model = spatial(sets(used=cables(EIGHT, more="<force_error>1</force_error>"), spare=cables(CROSSED)), bodies)
    ran = robocal("import", model.write(tmp_path), "-o", tmp_path / "robot.yaml")
    assert ran.status == 0
    for word in (
        "only used is read, not spare", "--cables SET", "from 0.5, 0, 1 m", "name of <cable_ideal>", "display_range of <links>",
        "view_angle of <links>", "name of <link_rigid>", "q_min of <joint>", "q_initial of <joint>", "<end_location>", "<force_error>",
    ):  # fmt: skip
        assert word in ran.said, word
    assert "c1 (cable 1), c2 (cable 2)" in ran.said and "cable set used" in ran.said
    said = robocal("import", tmp_path / "model_cables.xml", "--json").document
    assert (said["cable_set"], said["other_sets"], said["names"]["c8"]) == ("used", ["spare"], "cable 8")
    assert said["text"] == (tmp_path / "robot.yaml").read_text() and said["written"] is None
    assert [Path(i["file"]).name for i in said["provenance"]["inputs"]] == ["model_cables.xml", "model_bodies.xml"]
    codes = {r["code"] for r in said["remarks"]}
    assert {Code.CABLE_SETS_ASIDE, Code.COUNTED_FROM_ELSEWHERE, Code.NO_KEY_FOR, Code.ELEMENTS_UNREAD} <= codes


def test_nothing_is_said_where_nothing_is_lost(tmp_path: Path) -> None:
    model = spatial(
        sets(used=cables(EIGHT)).replace(' name="', ' num="'), links(body()).replace(' name="platform"', "")
    )
    model.bodies = model.bodies.replace("<end_location>0 0 0</end_location>", "")
    ran = robocal("import", model.write(tmp_path))
    assert (ran.status, ran.remarks) == (0, "")
    (tmp_path / "robot.yaml").write_text(ran.out)
    assert read_cable(tmp_path / "robot.yaml").warnings == ()


def test_nothing_that_is_there_is_replaced(tmp_path: Path) -> None:
    source = spatial().write(tmp_path)
    before = {f: (tmp_path / f).read_bytes() for f in files(tmp_path)}
    beside = tmp_path / "model_bodies.xml"
    robocal("import", source, "-o", beside).assert_refused(str(beside), "exists")
    for output in (source, beside):
        robocal("import", source, "-o", output, "--force").assert_refused("--output", "one of the inputs")
    assert {f: (tmp_path / f).read_bytes() for f in files(tmp_path)} == before
    (tmp_path / "robot.yaml").write_text("mine")
    robocal("import", source, "-o", tmp_path / "robot.yaml").assert_refused("robot.yaml", "--force")
    assert (tmp_path / "robot.yaml").read_text() == "mine"
    assert robocal("import", source, "-o", tmp_path / "robot.yaml", "--force").status == 0
    assert (tmp_path / "robot.yaml").read_text() == robocal("import", source).out


def test_from_python(tmp_path: Path) -> None:
    source = FORMS["another set than the default"].write(tmp_path)
    found = rc.import_model(source, cables="spare", output=tmp_path / "robot.yaml")
    assert found.written == (tmp_path / "robot.yaml",) and found.document["cable_set"] == "spare"
    assert "spare" in repr(found) and found.text == (tmp_path / "robot.yaml").read_text()
    with pytest.raises(rc.InputError, match="did you mean 'spare'"):
        rc.import_model(source, cables="spar")


# --- every refusal ----------------------------------------------------------------------------------------------------------

CABLES, BODIES = "model_cables.xml", "model_bodies.xml"
ROWS = cables(EIGHT)
FIRST = eyelet(EIGHT[0][0])
SECOND_BODY = f'{body()}\n<link_rigid num="2"></link_rigid>'
# What is replaced in the cables of the spatial model, by what; and what the refusal says.
OF_CABLES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "no XML at all": (sets(used=ROWS), "robocal: 1\nkind: cable\n", ("not XML", "X_cables.xml")),
    "broken XML": ("</cables>", "", ("not valid XML", "row")),
    "a URDF": (sets(used=ROWS), '<robot name="arm"/>', ("<robot>", "URDF of an arm")),
    "another file of CASPR": (sets(used=ROWS), "<trajectories/>", ("<trajectories>", "expected <cables>")),
    "bodies for cables": (sets(used=ROWS), links(body()), ("<links>", "expected <cables>")),
    "an entity that is declared": ("<cables ", '<!DOCTYPE cables [<!ENTITY a "b">]><cables ', ("entity",)),
    "an entity that is used": ("<force_max>101<", "<force_max>&most;<", ("row 4", "undefined entity")),
    "an entity of another file": ("<cables ", '<!DOCTYPE cables SYSTEM "most.dtd"><cables about="&most;" ', ("entity", "&most;")),
    "text between elements": ("<properties>", "<properties>1", ("<properties>", "text between elements")),
    "a control character": ('name="cable 1"', 'name="cable&#10;1"', ("<cable_ideal>", "control character")),
    "no set": (sets(used=ROWS), "<cables/>", ("<cables>", "default cable set")),
    "no default among two": (sets(used=ROWS), sets(None, one=ROWS, two=ROWS), ("<cables>", "default cable set", "one, two")),
    "a default that is not there": ('default_cable_set="used"', 'default_cable_set="usde"', ("<cables>", "'usde'", "did you mean 'used'")),
    "two sets of one name": (sets(used=ROWS), sets(used=ROWS).replace("</cables>", f'<cable_set id="used">{ROWS}</cable_set></cables>'), ("used, used",)),
    "an empty set": (ROWS, "", ("<cables>", "no cables")),
    "a muscle": ("cable_ideal", "muscle_hill_type", ("<muscle_hill_type>", "this kind of actuator")),
    "a spring of variable stiffness": ("cable_ideal", "cable_vsd_flexure_linear", ("<cable_vsd_flexure_linear>", "<cable_linear_spring>")),
    "a cable that nobody drives": ("cable_ideal", "cable_passive_linear_spring", ("<cable_passive_linear_spring>", "nobody drives")),
    "no attachments": ("attachments", "fastenings", ("<cable_ideal>", "no <attachments>")),
    "an attachment at an intermediate body": (FIRST, FIRST + FIRST, ("<cable_ideal>", "straight to the body", "<attachment>, <attachment>, <attachment>")),
    "one attachment": (FIRST, "", ("<cable_ideal>", "straight to the body")),
    "a winch that moves along a screw": (FIRST, wheel(EIGHT[0][0], 0.1, (0, 0, 1)).replace("base_rot", "screw_base_rot"), ("<screw_base_rotating_pulley>",)),
    "a pulley on the platform": (eyelet(EIGHT[0][1], 1), wheel(EIGHT[0][1], 0.1, (0, 0, 1)), ("<cable_ideal>", "<base_rotating_pulley>")),
    "a cable of the base alone": (eyelet(EIGHT[0][1], 1), eyelet(EIGHT[0][1], 0), ("<cable_ideal>", "links [0, 0]")),
    "another body": (eyelet(EIGHT[0][1], 1), eyelet(EIGHT[0][1], 2), ("<cable_ideal>", "links [0, 2]")),
    "another reference": ('reference="joint"', 'reference="base"', ("<cable_ideal>", "'base'", "joint, com")),
    "no location": ("location>", "place>", ("<attachment>", "no <location>")),
    "two locations": ("</location>", "</location><location>0 0 0</location>", ("<location>", "more than one <location>")),
    "no number": ("<location>-2 1.5 0<", "<location>-2 1.5 O<", ("<location>", "-2 1.5 O", "3 finite numbers")),
    "two numbers": ("<location>-2 1.5 0<", "<location>-2 1.5<", ("<location>", "3 finite numbers")),
    "an infinite number": ("<force_max>101<", "<force_max>inf<", ("<force_max>", "1 finite numbers")),
    "an element in a number": ("<force_max>101<", "<force_max><b>101</b><", ("<force_max>", "<b> inside")),
    "no limits": ("force_min>", "least>", ("<properties>", "no <force_min>")),
    "crossed limits": ("<force_max>101<", "<force_max>0.5<", ("<properties>", "crossed")),
    "a cable that pushes": ("<force_min>1<", "<force_min>-1<", ("<properties>", "cannot push")),
    "a cable that is always slack": ("<force_max>101<", "<force_max>0<", ("<properties>", "always slack")),
    "a spring without stiffness": (sets(used=ROWS), sets(used=cables(EIGHT, **SPRING)).replace("<K>20000", "<K>0", 1), ("<K>", "stiffness")),
    "a spring that does not say it": (sets(used=ROWS), sets(used=cables(EIGHT, kind="cable_linear_spring")), ("<properties>", "no <K>")),
    "a negative diameter": (sets(used=ROWS), sets(used=cables(EIGHT, more="<diameter>-1</diameter>")), ("<diameter>", "negative diameter")),
    "a spring without any": (sets(used=ROWS), sets(used=cables(EIGHT, **SPRING)).replace("<K>20000", "<K>1e-320", 1), ("<cable_linear_spring>", "elasticity is no number")),
    "an anchor out of this world": ("<location>-2 1.5 0<", "<location>-2e300 1.5 0<", ("<cable_ideal>", "that far away", "within")),
    "elements without end": (
        sets(used=ROWS),
        sets(used=ROWS).replace("<properties>", f"{'<a>' * 5000}{'</a>' * 5000}<properties>", 1).replace("<force_max>101", "<force_max>0.5"),
        ("<properties>", "crossed"),
    ),
    "a pulley without direction": (FIRST, wheel(EIGHT[0][0], 0.1, (0, 0, 0)), ("<cable_entry_vector>", "must not be zero")),
    "a pulley without radius": (FIRST, wheel(EIGHT[0][0], 0.1, (0, 0, 1)).replace("pulley_radius", "size"), ("<base_rotating_pulley>", "<pulley_radius>")),
    "a pulley of negative radius": (FIRST, wheel(EIGHT[0][0], -0.1, (0, 0, 1)), ("<pulley_radius>", "negative radius")),
    "two cables": (ROWS, cables(EIGHT[:2]), ("<cable_set>", "3 to 12 cables")),
    "thirteen cables": (ROWS, cables((EIGHT + CROSSED)[:13]), ("<cable_set>", "3 to 12 cables")),
    "one cable twice": (ROWS, ROWS + cable(FIRST, EIGHT[0][1], n=9), ("<cable_ideal>", "are the same")),
    "a platform of one point": (ROWS, cables([(a, (0.0, 0.0, 0.0)) for a, _ in EIGHT]), ("<cable_set>", "cannot hold the platform")),
}  # fmt: skip
OF_BODIES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "broken XML": ("</links>", "", ("not valid XML",)),
    "cables for bodies": (links(body()), "<cables/>", ("<cables>", "expected <links>")),
    "no links one level down": (links(body()), "<bodies_system/>", ("<bodies_system>", "no <links>")),
    "no body": (links(body()), "<links/>", ("<links>", "none", "one <link_rigid>")),
    "two bodies": (body(), SECOND_BODY, ("<links>", "2 <link_rigid>", "chains of bodies")),
    "a body that bends": ("link_rigid", "link_flexible", ("<links>", "<link_flexible>")),
    **{
        f"joint {j}": ("SPATIAL_EULER_XYZ", j, ("<link_rigid>", f"'{j}'", "PLANAR_XZ"))
        for j in ("R_X", "U_XY", "S_EULER_XYZ", "T_XY", "P_X", "SPATIAL_XYZ")
    },
    "no joint": ('<joint type="SPATIAL_EULER_XYZ"/>', "", ("<link_rigid>", "no <joint_type>")),
    "a joint of no type": (' type="SPATIAL_EULER_XYZ"', "", ("<link_rigid>", "joint")),
    "two joints": ('<joint type="SPATIAL_EULER_XYZ"/>', '<joint type="SPATIAL"/><joint type="SPATIAL"/>', ("<joint>", "more than one")),
    "nothing physical": ("physical>", "body>", ("<link_rigid>", "no <physical>")),
    "no mass": ("<mass>8.5</mass>", "", ("<physical>", "no <mass>")),
    "a mass of zero": ("<mass>8.5", "<mass>0", ("<mass>", "has a mass")),
    "no centre of mass": ("com_location>", "com>", ("<physical>", "no <com_location>")),
    "no inertia": ("inertia", "moments", ("<physical>", "no <inertia>")),
    "half an inertia": ("<Iyz>0</Iyz>", "", ("<inertia>", "no <Iyz>")),
    "inertia about another point": ('ref="com"', 'ref="joint"', ("<inertia>", "'joint'", "expected com")),
    "inertia of no body": ("<Ixx>0.5", "<Ixx>5", ("<inertia>", "no body has this inertia")),
    "a parent body": ("<num>0<", "<num>1<", ("<num>", "hangs on the base")),
    "a parent without a place": ("<location>0 0 0</location>", "", ("<parent>", "no <location>")),
}  # fmt: skip


def refused(folder: Path, model: Model, *said: str, options: tuple[str, ...] = ()) -> None:
    """The model is refused with these words, and nothing is written, with or without JSON."""
    source, out = model.write(folder), folder / "made" / "robot.yaml"
    before = files(folder)
    ran = robocal("import", source, *options, "-o", out)
    ran.assert_refused(*said)
    assert robocal("import", source, *options, "-o", out, "--json").document["error"]
    assert files(folder) == before


@pytest.mark.parametrize("what", OF_CABLES)
def test_cables_that_are_refused(tmp_path: Path, what: str) -> None:
    old, new, said = OF_CABLES[what]
    text = sets(used=ROWS)
    assert old in text
    refused(tmp_path, spatial(text.replace(old, new)), CABLES, *said)


@pytest.mark.parametrize("what", OF_BODIES)
def test_bodies_that_are_refused(tmp_path: Path, what: str) -> None:
    old, new, said = OF_BODIES[what]
    text = links(body())
    assert old in text
    refused(tmp_path, spatial(bodies=text.replace(old, new)), BODIES, *said)


def test_a_set_that_is_not_there(tmp_path: Path) -> None:
    model = spatial(sets(used=ROWS, spare=ROWS))
    said = (CABLES, "<cables>", "cable set of this name", "'usedd'", "used, spare", "did you mean 'used'")
    refused(tmp_path, model, *said, options=("--cables", "usedd"))
    refused(tmp_path, model, "'quite another'", "used, spare", options=("--cables", "quite another"))
    twice = spatial(sets(None, a=ROWS, b=ROWS).replace('"b"', '"a"'))
    refused(tmp_path, twice, "cable set of this name", "a, a", options=("--cables", "a"))


def test_attachments_measured_from_nobody_knows_where(tmp_path: Path) -> None:
    model = spatial(sets(used=cables(EIGHT, reference=None)), links(body(com=COM)))
    refused(tmp_path, model, CABLES, "<cable_ideal>", "reference point", "joint, com")


def test_a_planar_body_beside_its_anchors(tmp_path: Path) -> None:
    for joint, axis in itertools.product(("PLANAR", "P"), "XYZ"):
        plane = "".join(sorted({*"XYZ"} - {axis}))
        model = planar(f"{joint}_{plane}", beside=0.25, parent=PARENT)
        refused(
            tmp_path,
            model,
            CABLES,
            "<cables>",
            "plane of its frame anchors",
            f"the {axis.lower()} of <parent><location>",
        )


def test_files_that_are_not_where_they_belong(tmp_path: Path) -> None:
    source = spatial().write(tmp_path)
    out = tmp_path / "robot.yaml"
    robocal("import", tmp_path / "nothing_cables.xml", "-o", out).assert_refused("nothing_cables.xml")
    robocal("import", tmp_path, "-o", out).assert_refused(str(tmp_path), "a folder")
    robocal("import", tmp_path / BODIES, "-o", out).assert_refused(BODIES, "<links>", "expected <cables>")
    other = source.rename(tmp_path / "model.xml")
    robocal("import", other, "-o", out).assert_refused("model.xml", "a file X_cables.xml")
    other.rename(source)
    (tmp_path / BODIES).unlink()
    robocal("import", source, "-o", out).assert_refused(BODIES, "not beside that of the cables")
    assert not out.exists()

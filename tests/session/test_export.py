"""Round trips: what is exported and read again predicts the same poses, for every convention, in every form that holds a
whole model; near-parallel axes stay in the arm; a URDF keeps every byte that says something else."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from arms.arm_samples import NAMES, joint_values, rows
from called import export
from cli.runs import ROBOT, robocal
from files.test_urdf import TEXT
from ruamel.yaml import YAML
from simulated import true_chain

from robocal.arms import catalog
from robocal.arms.chain import Chain
from robocal.arms.conventions import chain
from robocal.arms.denavit import to_denavit
from robocal.arms.joints import with_eccentricity
from robocal.errors import InputError, ModelError
from robocal.files.robot import describe, open_robot, render_robot
from robocal.files.urdf_into import urdf_into, urdf_text
from robocal.remarks.remark import Remark
from robocal.session.simulated_robot import Errors, sample_joints

TIGHT = 1e-9  # m, and as large for the entries of rotations


def calibrated(folder: Path, convention: str, types: str, rng: np.random.Generator) -> Chain:
    """Writes the robot.yaml of a generic arm with every geometric parameter changed, as a calibration leaves it."""
    given = rows(convention, types, rng)
    for row in given:
        row.pop("gain", None)
    places = {"base": (0.1, -0.2, 0.3, 0.1, -0.2, 0.4), "tool": (0.05, 0.02, 0.11, -0.3, 0.2, 0.1)}
    made = chain("sample", convention, given, **places)
    (folder / "robot.yaml").write_text(describe(made), encoding="utf-8")
    robot = open_robot(folder / "robot.yaml")
    moved = {n: robot.chain.table[n].value + rng.normal(0, 1e-2) for n in robot.chain.geometric}
    text, left_out = render_robot(robot, moved)
    assert not left_out
    (folder / "calibrated.yaml").write_text(text, encoding="utf-8")
    return robot.chain.with_values(moved)


def difference(a: Chain, b: Chain, q: np.ndarray) -> float:
    return float(np.abs(a.pose(q) - b.pose(q)).max())


@pytest.mark.parametrize("form", ["yaml", "urdf", "dh"])
@pytest.mark.parametrize("types", ["RRRRRR", "RPRRPR"])
@pytest.mark.parametrize("convention", NAMES)
def test_every_convention_comes_back(convention: str, types: str, form: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(len(convention) + len(types))
    arm = calibrated(tmp_path, convention, types, rng)
    target = tmp_path / ("out.urdf" if form == "urdf" else "out.yaml")
    made = export(str(tmp_path / "calibrated.yaml"), form=form, output=target)
    assert made.written == (target,)
    back = open_robot(target).chain
    assert back.joint_names == arm.joint_names
    q = joint_values(types, rng, 50)
    assert difference(back, arm, q) <= TIGHT
    # And once more: a form of a form.
    again = tmp_path / "again.urdf"
    export(str(target), form="urdf", output=again)
    assert difference(open_robot(again).chain, arm, q) <= TIGHT


@pytest.mark.parametrize("name", catalog.names())
def test_every_catalogue_arm_as_a_table(name: str, rng: np.random.Generator) -> None:
    arm = true_chain(catalog.get(name), Errors(), rng)
    table = to_denavit(arm)
    assert table.convention == "dh-hayati" and table.joint_names == arm.joint_names
    np.testing.assert_array_equal(table.limits, arm.limits)
    assert difference(table, arm, sample_joints(arm, 50, rng)) <= 1e-12
    lengths = [abs(p.value) for p in table.table.rows if p.unit == "m"]
    assert max(lengths) < 3 * max(abs(p.value) for p in arm.table.rows if p.unit == "m")


def near_parallel(angle: float) -> Chain:
    """Axes 2, 3 and 4 parallel but for an angle, written without beta as a classic fit leaves it: their common normals
    lie wherever they lie."""

    def row(**values: float) -> dict[str, object]:
        return {"limits": (-2.5, 2.5), **values}

    # With alpha = angle the axes meet a / angle away along the first of them; d brings the next frame back.
    far = 0.4 / angle
    return chain(
        "almost parallel",
        "dh",
        [
            row(d=0.13, alpha=np.pi / 2),
            row(theta=np.pi / 2, d=far, alpha=angle),
            row(theta=-np.pi / 2, d=-far, a=-0.57, alpha=-angle),
            row(d=0.16, alpha=np.pi / 2),
            row(d=0.11, alpha=-np.pi / 2),
            row(d=0.09),
        ],
    )


@pytest.mark.parametrize("angle", [1e-3, 1e-5])
def test_near_parallel_axes_stay_in_the_arm(angle: float, tmp_path: Path) -> None:
    arm = near_parallel(angle)
    assert max(abs(p.value) for p in arm.table.rows) > 100.0
    q = sample_joints(arm, 50, np.random.default_rng(0))
    assert np.abs(arm.pose(q)[:, :3, 3]).max() < 2.0
    text, _ = urdf_text(arm)
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    back = open_robot(tmp_path / "arm.urdf").chain
    table = to_denavit(arm)
    for made in (back, table):
        # The arm's own numbers have lost what 40 km of link lose in rounding.
        assert difference(made, arm, q) <= TIGHT
        assert max(abs(p.value) for p in made.table.rows if p.unit == "m") < 1.0


# --- into a URDF that is there --------------------------------------------------------------------------------------


def ros_urdf(arm: Chain, newline: str = "\n") -> str:
    """A URDF as people keep them: meshes, comments, a gripper beside the chain."""
    text, _ = urdf_text(arm)
    mesh = '>\n    <visual><geometry><mesh filename="a&amp;b.stl"/></geometry></visual>\n  </link>'
    text = re.sub(r'(<link name="[^"]*_link")/>', rf"\1{mesh}", text)
    grip = '<joint name="grip" type="fixed"><parent link="base_link"/><child link="finger"/></joint>'
    text = text.replace("</robot>", f'  <!-- ä gripper -->\n  <link name="finger"/>\n  {grip}\n</robot>')
    return text.replace("\n", newline)


def attributes_of(text: str) -> Sequence[str]:
    return re.findall(r'(?:xyz|rpy)="[^"]*"', text)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("name", ["ur10", "panda", "rv-2aj", "irb-120"])
def test_into_a_urdf(name: str, newline: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    nominal = catalog.get(name)
    arm = true_chain(nominal, Errors(), rng)
    before = ros_urdf(nominal, newline)
    (tmp_path / "robot.urdf").write_bytes(before.encode())
    text, notes = urdf_into(arm, str(tmp_path / "robot.urdf"), tip="tool")
    assert not notes
    (tmp_path / "out.urdf").write_bytes(text.encode())
    back = open_robot(tmp_path / "out.urdf", tip="tool").chain
    q = sample_joints(arm, 50, rng)
    assert difference(back, arm, q) <= TIGHT
    # Nothing but origins changed, and no origin went far.
    blank = re.compile(r'(<origin )(?:xyz="[^"]*"|rpy="[^"]*"|\s)*')
    assert blank.sub(r"\1", text) == blank.sub(r"\1", before) and text != before
    a, b = (
        np.array([[float(v) for v in t.split('"')[1].split()] for t in attributes_of(x) if t.startswith("xyz")])
        for x in (before, text)
    )
    assert np.abs(a - b).max() < 0.02


def test_into_a_urdf_that_is_right_already_changes_nothing(tmp_path: Path) -> None:
    arm = catalog.get("ur10")
    text = ros_urdf(arm)
    (tmp_path / "robot.urdf").write_text(text, encoding="utf-8")
    same, notes = urdf_into(
        open_robot(tmp_path / "robot.urdf", tip="tool").chain, str(tmp_path / "robot.urdf"), tip="tool"
    )
    assert same == text and not notes


def test_into_a_urdf_with_turned_frames_and_missing_origins(tmp_path: Path) -> None:
    """Its last axis ends the arm: a model whose tool lies on that axis can still be held exactly."""
    (tmp_path / "robot.urdf").write_text(TEXT, encoding="utf-8")
    rng = np.random.default_rng(4)
    arm = open_robot(tmp_path / "robot.urdf", tip="f1").chain
    names = [n for n in arm.table.names if n.partition(".")[0] in ("j1", "tool_joint", "m") and n[-2:] != "in"]
    moved = arm.with_values({n: arm.table[n].value + rng.normal(0, 5e-3) for n in names if "offset" not in n})
    text, notes = urdf_into(moved, str(tmp_path / "robot.urdf"), tip="f1")
    assert not notes and TEXT.count("\n") < text.count("\n") and "note='rpy=\"9 9 9\" &amp; >'" in text
    (tmp_path / "out.urdf").write_text(text, encoding="utf-8")
    back = open_robot(tmp_path / "out.urdf", tip="f1").chain
    q = rng.uniform(-1, 1, (50, 3))
    assert difference(back, moved, q) <= TIGHT and difference(arm, moved, q) > 1e-3


def test_without_a_fixed_joint_the_tool_is_said_to_be_lost(tmp_path: Path) -> None:
    arm = catalog.get("irb-120")
    (tmp_path / "robot.urdf").write_text(ros_urdf(arm), encoding="utf-8")
    tip = f"{arm.joint_names[-1]}_link"
    moved = arm.with_values({"tool.x": 0.03})
    text, notes = urdf_into(moved, str(tmp_path / "robot.urdf"), tip=tip)
    assert len(notes) == 1 and "30 mm" in notes[0].sentence
    (tmp_path / "out.urdf").write_text(text, encoding="utf-8")
    back = open_robot(tmp_path / "out.urdf", tip=tip).chain
    q = sample_joints(arm, 20, np.random.default_rng(0))
    gap = np.linalg.norm(back.pose(q)[:, :3, 3] - moved.pose(q)[:, :3, 3], axis=1)
    np.testing.assert_allclose(gap, 0.03, atol=1e-9)


def test_another_robots_urdf_is_refused(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(ros_urdf(catalog.get("irb-120")), encoding="utf-8")
    for name, words in (("ur10", "lies elsewhere"), ("panda", "other joints")):
        with pytest.raises(InputError, match=words):
            urdf_into(catalog.get(name), str(tmp_path / "robot.urdf"), tip="tool")
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    with pytest.raises(InputError, match="not a URDF"):
        urdf_into(open_robot(tmp_path / "robot.yaml").chain, str(tmp_path / "robot.yaml"))
    robocal("export", "ur10", "--into", tmp_path / "robot.urdf").assert_refused("--into", "--format urdf")


# --- what a form cannot hold ----------------------------------------------------------------------------------------


def test_gains_and_what_lies_beyond_geometry_are_refused() -> None:
    arm = catalog.get("ur10")
    with pytest.raises(ModelError, match="gain"):
        urdf_text(arm.with_values({"j2.gain": 1.001}))
    assert to_denavit(arm.with_values({"j2.gain": 1.001})).table["j2.gain"].value == pytest.approx(1.001)
    # A joint that counts backwards is an axis that points the other way.
    urdf_text(arm.with_values({"j2.gain": -1.0}))
    bent = with_eccentricity(arm, ("j2",))
    urdf_text(bent)
    bent = bent.with_values({next(n for n in bent.table.names if n not in arm.table): 1e-4})
    for refuse in (urdf_text, to_denavit):
        with pytest.raises(ModelError, match="geometry alone"):
            refuse(bent)


def test_tables_and_offsets_say_what_lies_beyond_geometry(tmp_path: Path) -> None:
    def notes(values: str, form: str) -> tuple[Remark, ...]:
        text = f"{ROBOT}groups:\n  eccentricity: {{joints: [j1], harmonics: [1]{values}}}\n"
        (tmp_path / "robot.yaml").write_text(text.replace("theta: -90, r: 0", "theta: -89.9, r: 0"), encoding="utf-8")
        (tmp_path / "nominal.yaml").write_text(text, encoding="utf-8")
        return export(str(tmp_path / "robot.yaml"), form=form, nominal=tmp_path / "nominal.yaml").result.notes

    for form in ("csv", "markdown", "offsets", "ros", "xacro"):
        assert not notes("", form)
        (said,) = notes(", values: {j1.cos1: 0.01}", form)
        assert said.numbers["groups"] == ("eccentricity",) and "--format yaml" in said.advice


# --- joint offsets --------------------------------------------------------------------------------------------------


def test_offsets_for_ros(tmp_path: Path) -> None:
    from xml.etree import ElementTree

    (tmp_path / "nominal.yaml").write_text(ROBOT, encoding="utf-8")
    text = ROBOT.replace("theta: -90, r: 0", "theta: -89.9, r: 0")
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    words = ("export", tmp_path / "robot.yaml", "--nominal", tmp_path / "nominal.yaml", "--format")
    want = {"j1": 0.0, "j2": np.radians(0.1), "j3": 0.0}
    ran = robocal(*words, "ros")
    assert ran.status == 0, ran.err
    found = YAML(typ="safe").load(ran.out)["/**"]["ros__parameters"]["joint_offsets"]
    assert found == pytest.approx(want, abs=1e-15) and all(isinstance(v, float) for v in found.values())
    root = ElementTree.fromstring(robocal(*words, "xacro").out)
    assert {p.attrib["name"]: float(p.attrib["value"]) for p in root} == pytest.approx(
        {f"{k}_offset": v for k, v in want.items()}, abs=1e-15
    )
    table = [line for line in robocal(*words, "offsets").out.splitlines() if not line.startswith("#")]
    joint, offset, _, unit = table[2].split(",")
    assert (joint, unit) == ("j2", "deg") and float(offset) == pytest.approx(0.1, abs=1e-12)

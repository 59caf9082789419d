"""Points in the image plane of a probe, in files: an arm that holds it, a phantom of points, and what is wrong with a file."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from probe_world import BEADS, IMAGE, PHANTOM, PIXEL, arm_over_phantom, draw, files_of

from robocal.geometry import se3


def parameters(document):
    return {p["name"]: p["identified"] for p in document["parameters"]}


def is_image(found, tolerance):
    vector = np.array([found[f"image.{s}"] for s in ("x", "y", "z", "rx", "ry", "rz")])
    vector[:3] *= 1e-3
    vector[3:] = np.radians(vector[3:])
    away = se3.inverse(se3.from_vector(IMAGE)) @ se3.from_vector(vector)
    assert np.linalg.norm(away[:3, 3]) < tolerance and np.abs(away[:3, :3] - np.eye(3)).max() < 10 * tolerance
    assert np.allclose([found["image.su"], found["image.sv"]], np.array(PIXEL) * 1e3, rtol=0.01)


def test_an_arm_that_holds_the_probe(tmp_path):
    """Joint values in place of tracked poses; nothing of the arm is free."""
    robot, data = arm_over_phantom(tmp_path)
    ran = robocal("identify", robot, data, "--json")
    assert ran.status == 0 and ran.document["verdict"]["status"] == "located"
    is_image(parameters(ran.document), 5e-4)


def test_a_phantom_of_points(tmp_path):
    robot, data = files_of(tmp_path, draw(2, wires=False), points=BEADS)
    ran = robocal("identify", robot, data, "--json")
    assert ran.status == 0 and ran.document["verdict"]["status"] == "located"
    is_image(parameters(ran.document), 5e-4)


WRONG = [
    (("wire: wire\n", "wire: wires\n"), ["wires", "wire"]),
    (("  G1:", "  G2:"), ["unknown wire", "G1", "data.csv"]),
    (("front: [30, 0, 20], back: [30, 40, 20]", "front: [30, 0, 20], back: [30, 0, 20]"), ["one point", "wires.G1"]),
    (("targets:", "target: wire\ntargets:"), ["unknown target"]),
    (("pixel: [0.08, 0.074]", "pixel: [0.08, -0.074]"), ["size of a pixel"]),
    (("position: {columns: [x, y, z], unit: mm}\norientation: {columns: [rx, ry, rz], form: rotation_vector, unit: deg}\n", ""), ["poses are known", "orientation"]),
    (("prior: {length: 0.3, angle: 0.2}", "prior: {length: 0, angle: 0.2}"), ["prior.length"]),
    (("units: {length: mm, angle: deg}\n", ""), ["units"]),
    (("wire: wire\n", "scale: {sigma: 0.5 %}\nwire: wire\n"), ["scale", "the phantom's list gives it"]),
    (("wire: wire\n", "scale: {free: true}\nwire: wire\n"), ["scale"]),
    (("phantom: {mount: base,", "phantom: {mount: tool,"), ["targets.phantom.mount", "both instrument and target"]),
    (("prior: {length: 0.3,", "free: false, prior: {length: 0.3,"), ["targets.phantom.prior", "fixed"]),
]  # fmt: skip


@pytest.mark.parametrize(("edit", "said"), WRONG)
def test_what_is_wrong_with_a_file_is_named(tmp_path, edit, said):
    robot, data = files_of(tmp_path, draw(2))
    text = data.read_text()
    assert edit[0] in text
    data.write_text(text.replace(*edit))
    ran = robocal("check", robot, data)
    assert ran.status == 2, ran.said
    assert all(word in ran.said for word in said), ran.said


def test_a_table_that_is_given_twice_is_refused(tmp_path):
    robot, data = files_of(tmp_path, draw(2))
    (tmp_path / "copy.csv").write_text((tmp_path / "data.csv").read_text())
    (tmp_path / "copy.yaml").write_text(data.read_text().replace("data.csv", "copy.csv"))
    ran = robocal("identify", robot, data, tmp_path / "copy.yaml")
    assert ran.status == 2 and "the same measurements are given twice" in ran.said


def test_one_id_with_two_poses_is_refused(tmp_path):
    robot, data = files_of(tmp_path, draw(2))
    table = tmp_path / "data.csv"
    lines = table.read_text().splitlines()
    lines[2] = ",".join([*lines[2].split(",")[:4], "0", *lines[2].split(",")[5:]])
    table.write_text("\n".join(lines) + "\n")
    ran = robocal("check", robot, data)
    assert ran.status == 2 and "another pose than in row 2" in ran.said and "data.csv" in ran.said


def test_a_rig_whose_poses_are_free_takes_none(tmp_path):
    robot, data = files_of(tmp_path, draw(2))
    robot.write_text(robot.read_text().replace("poses: known\n", ""))
    ran = robocal("check", robot, data)
    assert ran.status == 2 and "poses: known" in ran.said


PLUS = [
    (("PlusConfiguration", "Other"), 1, ["another file of PLUS"]),
    (('From="Phantom" To="Reference"', 'From="Phantom" To="Table"'), 1, ["a transform is missing"]),
    (('WireName="A"', 'WireName="B"'), 0, ["no wire", "B"]),
    (('Matrix="0.08 0 0 0 0 0.07', 'Matrix="-0.08 0 0 0 0 0.07'), 0, ["left-handed"]),
    (('Value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"', 'Value="1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1"'), 0, ["not a pose"]),
    (('Position="10 20 0"', 'Position="10 20"'), 0, ["3 finite numbers"]),
    (('Status="OK"', 'Status="Failed"'), 0, ["no image"]),
    (("<ProbeCalibrationResult>", "no xml"), 0, ["not XML"]),
]  # fmt: skip
RESULT = """<ProbeCalibrationResult><CalibrationResults><Transform From="Image" To="Probe" Matrix="0.08 0 0 0 0 0.07 0 0 0 0 0.07 0 0 0 0 1"/>
</CalibrationResults><ErrorReport><CalibrationData><Frame Index="0" SegmentationStatus="OK"><SegmentedPoints>
<Point WireName="A" Position="10 20 0"/></SegmentedPoints><TrackedFrame>
<CustomFrameField Name="ProbeToTrackerTransform" Value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>
<CustomFrameField Name="ReferenceToTrackerTransform" Value="1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1"/>
</TrackedFrame></Frame></CalibrationData></ErrorReport></ProbeCalibrationResult>"""
CONFIG = """<PlusConfiguration><Transform From="Phantom" To="Reference" Matrix="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>
<Wire Name="A" EndPointFront="0 0 0" EndPointBack="0 40 0"/></PlusConfiguration>"""


@pytest.mark.parametrize(("edit", "which", "said"), PLUS)
def test_what_is_wrong_with_files_of_plus_is_named(tmp_path, edit, which, said):
    texts = [RESULT, CONFIG]
    assert edit[0] in texts[which]
    texts[which] = texts[which].replace(*edit)
    (tmp_path / "res.xml").write_text(texts[0])
    (tmp_path / "conf.xml").write_text(texts[1])
    ran = robocal("vision", "probe", tmp_path / "res.xml", tmp_path / "conf.xml", "-o", tmp_path / "out")
    assert ran.status == 2 and not (tmp_path / "out").exists(), ran.said
    assert all(word in ran.said for word in said) and ("res.xml", "conf.xml")[which] in ran.said, ran.said


def test_files_of_plus_are_read(tmp_path):
    (tmp_path / "res.xml").write_text(RESULT)
    (tmp_path / "conf.xml").write_text(CONFIG)
    ran = robocal("vision", "probe", tmp_path / "res.xml", tmp_path / "conf.xml", "-o", tmp_path / "out", "--json")
    assert ran.status == 0 and ran.document["points"] == 1
    again = robocal("vision", "probe", tmp_path / "res.xml", tmp_path / "conf.xml", "-o", tmp_path / "out")
    assert again.status == 2 and "exist" in again.said
    assert se3.from_vector(PHANTOM).shape == (4, 4)
    assert robocal("check", tmp_path / "out" / "robot.yaml", tmp_path / "out" / "calibration.yaml").status == 0


def test_a_rig_whose_poses_nobody_states_is_not_located(tmp_path):
    """Every image may stand anywhere: nothing tells where it is on the probe, and no mistake of the phantom is made up for it."""
    robot, data = files_of(tmp_path, draw(2))
    robot.write_text(robot.read_text().replace("poses: known\n", ""))
    text = data.read_text()
    data.write_text("".join(x for x in text.splitlines(True) if not x.startswith(("position", "orientation"))))
    ran = robocal("identify", robot, data)
    assert ran.status == 3 and "of the phantom of" not in ran.said, ran.said


def test_what_carries_a_phantom_follows_from_what_carries_the_probe(tmp_path):
    """A probe in hand sees what stands still, said or not; one that stands still sees nothing of a phantom that does."""
    robot, data = files_of(tmp_path, draw(2))
    text = data.read_text()
    data.write_text(text.replace("phantom: {mount: base,", "phantom: {"))
    assert "phantom in base" in robocal("identify", robot, data).out
    data.write_text(text.replace("name: image, mount: tool", "name: image, mount: base"))
    ran = robocal("identify", robot, data, "--json")
    assert ran.status == 3 and "phantom-unit" not in ran.said

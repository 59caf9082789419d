"""Cameras bolted to each other, without a robot: one body with several lenses, through the files and the commands of any machine."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from cli.runs import robocal
from scipy.spatial.transform import Rotation
from view_worlds import LENS, eyes, rig

from robocal.geometry import se3, so3
from robocal.measure.pixels import SCALE
from robocal.remarks.code import Code
from robocal.session.inputs import read_inputs

ROBOT = "robocal: 1\nkind: rig\nname: stereo head\nunits: {length: mm, angle: deg}\n"
DATA = """robocal: 1
kind: pixels
file: cam{k}.csv
units: {{length: mm, angle: deg}}
pixels: {{columns: [u, v], sigma: 0.2}}
points: {{columns: [x, y, z], unit: mm}}
camera: {{name: lens{k}, {lens}}}
frame: {{name: {name}, mount: base, free: {free}}}
targets: {{board: {{mount: tool, free: false}}}}
configuration: {{id: id}}
"""
SYMBOLS = "fx fy cx cy k1 k2 p1 p2 k3".split()
NAMES = ("left", "right")


def write_pair(folder, rng, *, turned=None, more="", lens=LENS):
    """The files of a stereo pair before a board that somebody moves, and T_left_right; `turned` are views that each camera has turned."""
    _, _, data = rig(rng, 30, 2)
    (folder / "robot.yaml").write_text(ROBOT)
    for k, o in enumerate(data.observations):
        points = np.array(o.extra["point"])
        if turned is not None:
            mine = turned[k][o.configuration]
            points[mine] = np.array([0.16, 0.12, 0.0]) - points[mine]
        with (folder / f"cam{k}.csv").open("w", newline="") as file:
            out = csv.writer(file)
            out.writerow(["id", "u", "v", "x", "y", "z"])
            out.writerows([f"p{c}", *uv, *p * 1e3] for c, uv, p in zip(o.configuration, o.value, points, strict=True))
        words = ", ".join(f"{n}: {v}" for n, v in zip(SYMBOLS, lens, strict=True))
        text = DATA.format(k=k, lens=words, name=NAMES[k], free=str(k > 0).lower())
        (folder / f"cam{k}.yaml").write_text(text + more)
    return (folder / "robot.yaml", folder / "cam0.yaml", folder / "cam1.yaml")


def true_pair():
    """T_left_right of the world that `write_pair` draws."""
    left, right = eyes(se3.from_vector(np.array([0, 0, 1.5, 0, 0, 0])), 2)
    return se3.inverse(left) @ right


def test_a_stereo_pair_is_one_body(tmp_path, rng):
    files = write_pair(tmp_path, rng)
    seen = robocal("check", *files)
    assert (
        seen.status == 0 and "to be fitted: right.x, right.y" in seen.said and "nothing of the robot" not in seen.said
    )
    ran = robocal("identify", *files, "-o", tmp_path / "run", "--json")
    assert ran.status == 0 and ran.document["verdict"]["status"] == "located"
    # Lenses are right, and nobody doubts them: what is asked of them is asked where the poses were left.
    assert not [r for r in ran.document["remarks"] if r["code"] == Code.NUMBER_DOUBTED]
    (found,) = [f["pose"] for f in ran.document["frames"] if f["pose"]["child"] == "right"]
    true = true_pair()
    place, sigma = np.array(found["position"]["xyz"]) * 1e-3, np.array(found["position"]["sigma"]) * 1e-3
    assert (np.abs(place - true[:3, 3]) < 4 * sigma).all()
    # Both see one board: what its print may be off by lengthens the way from one camera to the other, and nothing else.
    assert np.allclose(sigma, SCALE * np.abs(place), rtol=0.1, atol=2e-4)
    turn = Rotation.from_quat(found["quaternion_xyzw"]).as_matrix()
    assert np.linalg.norm(so3.log(turn.T @ true[:3, :3])) < 1e-3
    assert (tmp_path / "run" / "calibrated.yaml").read_text() == ROBOT
    again = robocal("identify", tmp_path / "run", *files[1:], "--json")
    assert again.status == 0


def test_half_turns_of_a_pair_are_undone(tmp_path, rng):
    """The second camera has most of its views turned against the first; the first says which way the board is."""
    turned = [rng.random(30) < share for share in (0.0, 0.7)]
    files = write_pair(tmp_path, rng, turned=turned, more="half_turns: undo\n")
    inputs = read_inputs(files[0], files[1:])
    (told,) = [dict(r.items) for r in inputs.warnings if r.code == Code.HALF_TURNS_UNDONE]
    assert told["count"] == int(turned[1].sum()) and told["total"] == 60
    ran = robocal("identify", *files, "--json")
    assert ran.status == 0 and ran.document["verdict"]["status"] == "located"


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("units:", "joints: []\nunits:"), "unknown key"),
        (("name: stereo head\n", ""), "a key is missing"),
        (("angle: deg", "angle: mm"), "angle"),
    ],
)
def test_what_is_wrong_with_a_rig_is_named(edit, said, tmp_path):
    own = tmp_path / "robot.yaml"
    own.write_text(ROBOT.replace(*edit))
    ran = robocal("check", own)
    assert ran.status == 2 and said in ran.said and "robot.yaml" in ran.said


def test_half_turns_of_a_target_that_has_none_are_refused(tmp_path, rng):
    files = write_pair(tmp_path, rng, more="half_turns: undo\n")
    table = tmp_path / "cam0.csv"
    rows = table.read_text().splitlines(True)
    table.write_text("".join(r for r in rows if not r.rstrip().endswith(",0.0,0.0,0.0")))
    ran = robocal("check", *files)
    assert (
        ran.status == 2 and "no half turns to undo" in ran.said and "cam0.yaml" in ran.said and "half_turns" in ran.said
    )


def test_what_a_rig_lacks_is_said_in_its_own_words(tmp_path, rng):
    """One camera alone has nothing to find; and a rig has no pulleys that could explain what is left."""
    robot, left, right = write_pair(tmp_path, rng)
    alone = robocal("identify", robot, left)
    assert alone.status == 2 and "frame.free" in alone.said and "calibrate" not in alone.said
    table = tmp_path / "cam1.csv"
    head, *rows = table.read_text().splitlines(True)
    table.write_text(
        head + "".join(row.replace(row.split(",")[0], f"p{(int(row[1 : row.index(',')]) + 1) % 30}", 1) for row in rows)
    )
    shifted = robocal("identify", robot, left, right, "--verbose")
    assert shifted.status == 3 and "1 view below their configurations" in shifted.said
    assert "pulleys" not in shifted.said and "images of different moments" in shifted.said

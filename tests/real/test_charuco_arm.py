"""A real ChArUco board on an arm before a camera that stands: from images to a hand-eye calibration in three commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_world import codes, hand_eye
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

cv2 = pytest.importorskip("cv2")
pytestmark = pytest.mark.slow
BOARD = ("--charuco", "5x7", "--dictionary", "6x6_250", "--square", "36.195", "--size", "18.256")
LENS = (
    "robocal: 1\nkind: lens\nmodel: brown\nimage: [1600, 1200]\n"
    "numbers: {fx: 1352.02747, fy: 1356.14287, cx: 789.67065, cy: 627.2995, k1: 0, k2: 0, p1: 0, p2: 0, k3: 0}\n"
)


@pytest.fixture(scope="module")
def cell(shared_data, tmp_path_factory):
    source = shared_data / "charuco-arm"
    if not (source / "poses").is_dir():
        pytest.skip("the images of charuco-arm are not here")
    folder = tmp_path_factory.mktemp("charuco")
    (folder / "given.yaml").write_text(LENS)
    words = [str(source / "poses"), "--lens", str(folder / "given.yaml"), "--camera", "fixed"]
    ran = robocal(
        "vision", "hand-eye", str(source / "images"), *words, "--free-lens", *BOARD, "-o", str(folder), "--force"
    )
    assert ran.status == 0, ran.said
    return folder, [str(folder / "corners.csv"), *words]


def test_the_lens_as_it_is_given(cell):
    """Refused, for it has no distortion: what to do is said, and the views alone give another focal length."""
    told, status = hand_eye(*cell[1])
    assert status == 3
    assert told["corners"]["rms"] < 3.7
    assert "lens-contradicted" in codes(told)
    assert all("--free-lens" in r["advice"] for r in told["verdict"]["remarks"] if r["code"] == "lens-contradicted")


def test_the_lens_is_found_too(cell):
    """From images in one command: located, half the error on views that were left out; the given centre is contradicted, by the views alone
    along x; the frames are where their owner guessed. The corners that it wrote give the same."""
    told = json.loads((cell[0] / "hand_eye.json").read_text())
    assert told["verdict"]["status"] == "located" and told["how"] == "leave-one-out"
    again, status = hand_eye(*cell[1], "--free-lens")
    assert status == 0 and again["error"]["rms"] == pytest.approx(told["error"]["rms"], rel=1e-3)
    assert told["corners"]["rms"] < 1.8 and told["error"]["rms"] < 4.0
    (said,) = [r for r in told["remarks"] if r["code"] == "lens-contradicted"]
    assert {"cx", "k1", "k2", "p1"} <= {n.split()[0] for n in said["numbers"]["names"]}
    camera = np.array(told["frames"][0]["xyz"])
    assert np.linalg.norm(camera - 1e3 * np.array([-0.019646, 1.27843, 0.283965])) < 40
    pairs = {c["name"]: c["values"] for c in told["pairs"]["columns"]}
    assert pairs["view"] == pairs["pose"] and len(pairs["view"]) == 16


@pytest.mark.parametrize(("more", "most"), [((), 3.8), (("--free-lens",), 1.8)])
def test_four_rounds_of_every_fourth_view(cell, more, most):
    """Of the 15 views with corners of squares every fourth is left out together: their corners, px, both axes together.
    With the lens fixed 3.76 is reached, where the least squares of all corners reach 3.85. The 3.7 that was asked for is theirs on the 290
    corners of OpenCV's detector; there robocal has 3.70, and 3.72 from its own corners: `python scripts/charuco_arm.py`."""
    folder, words = cell
    lines = [line.split(",") for line in (folder / "corners.csv").read_text().splitlines()]
    board = [line for line in lines if line[1] in ("marker", "board")]
    usable = sorted({line[0] for line in board[1:]}, key=int)
    assert len(usable) == 15
    square, count = 0.0, 0
    for fold in range(4):
        held = set(usable[fold::4])
        told, _ = hand_eye(
            *words, *more, "--exclude", ",".join(sorted(held | {str(i) for i in range(16)} - set(usable)))
        )
        errors = reproject(told, board, held, words[1], lens_of(told))
        square, count = square + float(np.sum(errors**2)), count + len(errors)
    assert np.sqrt(square / count) < most
    assert np.sqrt(square / count / 2) < most / 1.4


def lens_of(told):
    """fx, fy, cx, cy, k1, k2, p1, p2 as they were found, or given."""
    numbers = dict(zip(("fx", "fy", "cx", "cy"), (1352.02747, 1356.14287, 789.67065, 627.2995), strict=True))
    if told["lens"] is not None:
        names, found = (next(c["values"] for c in told["lens"]["columns"] if c["name"] == n) for n in ("name", "found"))
        numbers |= dict(zip(names, found, strict=True))
    return numbers


def reproject(told, lines, held, poses, lens):
    """Errors (n, 2) of corners of the views that are held out, by OpenCV and formulas of the tests' own."""
    head = {name.split(" [")[0].strip('"'): i for i, name in enumerate(lines[0])}
    camera, board = (np.array(f["matrix"]) for f in told["frames"])
    matrix = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
    bend = np.array([lens.get(k, 0.0) for k in ("k1", "k2", "p1", "p2")])
    out = []
    for view in held:
        rows = np.array(
            [
                [float(r[head[n]]) for n in ("u", "v", "point_x", "point_y", "point_z")]
                for r in lines[1:]
                if r[head["view"]] == view
            ]
        )
        p = YAML(typ="safe").load((Path(poses) / f"{view}.yaml").read_text())
        flange = np.eye(4)
        flange[:3, :3] = Rotation.from_quat([p["qx"], p["qy"], p["qz"], p["qw"]]).as_matrix()
        flange[:3, 3] = 1e3 * np.array([p["x"], p["y"], p["z"]])
        seen = np.linalg.inv(camera) @ flange @ board
        uv, _ = cv2.projectPoints(
            np.ascontiguousarray(rows[:, 2:]), cv2.Rodrigues(seen[:3, :3])[0], seen[:3, 3], matrix, bend
        )
        out.append(uv[:, 0] - rows[:, :2])
    return np.concatenate(out)

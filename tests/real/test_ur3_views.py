"""A real UR3 before four cameras: labels that count from either end, two joint rows exchanged, six images of other moments."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from cli.runs import robocal

from robocal.geometry import so3

pytestmark = pytest.mark.slow
GRID = np.array([(c % 9 * 0.02, c // 9 * 0.02, 0.0) for c in range(63)])
JOINT = "  - {{name: j{}, type: revolute, theta: {}, d: {}, a: {}, alpha: {}, limits: [-363, 363]}}"
ROBOT = """robocal: 1
name: UR3
kind: arm
units: {{length: mm, angle: deg}}
convention: dh
joints:
{}
calibrate: {{free: [theta, d, a, alpha]}}
"""
DATA = """robocal: 1
kind: pixels
file: cam{k}.csv
units: {{length: mm, angle: deg}}
joints: {{columns: [j1, j2, j3, j4, j5, j6], unit: deg}}
pixels: {{columns: [u, v], sigma: 0.3}}
points: {{columns: [x, y, z], unit: mm}}
camera: {{name: lens{k}, {lens}}}
frame: {{name: eye{k}, free: true, mount: base, xyz: {place}, rotation_vector: {turn}}}
targets:
  board: {{free: true, mount: tool, xyz: {board}, rotation_vector: {board_turn}}}
configuration: {{id: id}}
"""


def written(folder, source, undo):
    """Robot and data files; `undo` labels each view from the end that the author's own transforms say. The words for `robocal`."""

    def read(name):
        return json.loads((source / name).read_text())

    def frame(t):
        t = np.array(t)
        return (t[:3, 3] * 1e3).round(3).tolist(), np.degrees(so3.log(t[:3, :3])).round(4).tolist()

    dh = [
        [j[n] for n in ("theta_offset", "d", "a", "alpha")] for j in read("robot_model_dh_nominal_ur3a.json")["joints"]
    ]
    unit = (180 / np.pi, 1e3, 1e3, 180 / np.pi)
    rows = [JOINT.format(i + 1, *(v * u for v, u in zip(j, unit, strict=True))) for i, j in enumerate(dh)]
    (folder / "robot.yaml").write_text(ROBOT.format("\n".join(rows)))
    poses = read("dataset_ur3a_joint_images_40poses.json")["poses"]
    joints = np.array([[p["joint_angles_deg"][f"joint_{i}"] for i in range(1, 7)] for p in poses])
    board = np.array(read("tf_ee_to_cb.json")["transformation_matrix_T_EE_CB_4x4"])
    for k in range(4):
        eye = np.array(read("tf_base_to_camera.json")["T_base_to_camera"][f"cam{k + 1}"]["T_4x4"])
        told = read(f"intrinsics_cam{k + 1}.json")
        m, f = told["intrinsics_K"], 2 / 3  # the images are two thirds of those of the lens
        lens = [m["fx"] * f, m["fy"] * f, (m["cx"] + 0.5) * f - 0.5, (m["cy"] + 0.5) * f - 0.5]
        lens += told["distortion"]["coefficients"]
        seen: dict[int, list[tuple[float, float]]] = {}
        for row in list(csv.reader((source / f"corners_cam{k + 1}.csv").read_text().splitlines()))[1:]:
            seen.setdefault(int(row[0]) - 1, []).append((float(row[2]), float(row[3])))
        with (folder / f"cam{k}.csv").open("w", newline="") as file:
            out = csv.writer(file)
            out.writerow(["id", *(f"j{i}" for i in range(1, 7)), "u", "v", "x", "y", "z"])
            for i, corners in sorted(seen.items()):
                there = np.linalg.inv(eye) @ forward(dh, np.radians(joints[i])) @ board @ np.c_[GRID, np.ones(63)].T
                near = lens[2:4] + (lens[0] * there[:2] / there[2]).T
                turned = np.linalg.norm(near - corners) > np.linalg.norm(near - corners[::-1])
                for point, uv in zip(GRID, corners[::-1] if undo and turned else corners, strict=True):
                    out.writerow([f"p{i}", *joints[i], *uv, *point * 1e3])
        names = "fx fy cx cy k1 k2 p1 p2 k3".split()
        (place, turn), (at, board_turn) = frame(eye), frame(board)
        words = ", ".join(f"{n}: {v}" for n, v in zip(names, lens, strict=True))
        (folder / f"cam{k}.yaml").write_text(
            DATA.format(k=k, lens=words, place=place, turn=turn, board=at, board_turn=board_turn)
        )
    return folder / "robot.yaml", *(folder / f"cam{k}.yaml" for k in range(4))


def forward(dh, q):
    """T_base_tool of a table."""
    t = np.eye(4)
    for (theta, d, a, alpha), x in zip(dh, q, strict=True):
        c, s, ca, sa = np.cos(theta + x), np.sin(theta + x), np.cos(alpha), np.sin(alpha)
        t = t @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    return t


def test_half_turns_are_named_in_all_four_cameras(shared_data, tmp_path):
    told = robocal("check", *written(tmp_path, shared_data / "ur3-cameras", False), "--json").document
    (one,) = [r for r in told["remarks"] if r["code"] == "target-turned"]
    assert one["numbers"]["instruments"] == ["eye0", "eye1", "eye2", "eye3"] and 60 < one["numbers"]["count"] < 100


def test_fourteen_views_are_named_and_two_joint_rows_exchanged(shared_data, tmp_path):
    told = robocal("identify", *written(tmp_path, shared_data / "ur3-cameras", True), "--json").document
    views = [o for o in told["outliers"] if o["rows"] > 1]
    by_camera = {c: sorted(int(o["configuration"][1:]) for o in views if o["group"] == f"eye{c}") for c in range(4)}
    assert by_camera == {0: [24, 25], 1: [24, 25], 2: [24, 25], 3: [8, 13, 14, 24, 25, 30, 32, 37]}
    assert all(o["set_aside"] and o["rows"] == 63 for o in views) and len(told["outliers"]) - len(views) < 10
    (one,) = [r for r in told["remarks"] if r["code"] == "views-exchanged"]
    assert (one["numbers"]["view"], one["numbers"]["partner"], one["numbers"]["every"]) == ("p24", "p25", 4)

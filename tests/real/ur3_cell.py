"""The files of a real UR3 before four cameras, as its author recorded them, or after what robocal says of them was obeyed.

Labels count from either end in half of the views, two joint rows are exchanged, six images of camera 4 are of other moments, and the lenses
are given for 1920 x 1080 where the images have 1280 x 720.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from robocal.geometry import so3

GRID = np.array([(c % 9 * 0.02, c // 9 * 0.02, 0.0) for c in range(63)])
EXCHANGED = (24, 25)
FOREIGN = {3: (8, 13, 14, 30, 32, 37)}  # of camera 4, counted from 0
IMAGE = (1280, 720)
SYMBOLS = "fx fy cx cy k1 k2 p1 p2 k3".split()
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
configuration: {{id: id, group: fold}}
"""
LENS = """image_width: {width}
image_height: {height}
camera_matrix: {{rows: 3, cols: 3, data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: {k}}}
"""


def write_cell(
    folder: Path,
    source: Path,
    *,
    labels: str = "recorded",
    exchange: bool = False,
    leave_out: Mapping[int, Iterable[int]] | None = None,
    lens: str | None = None,
    more: str = "",
) -> tuple[Path, ...]:
    """Robot and data files; the words for `robocal`.

    labels: as "recorded", or "undone" by the author's own transforms. exchange: the joint rows 25 and 26 change places. lens: what is
    written of a lens file beside its name; None for numbers that are scaled already. more: further lines of every data file.
    """

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
    if exchange:
        joints[list(EXCHANGED)] = joints[list(EXCHANGED[::-1])]
    board = np.array(read("tf_ee_to_cb.json")["transformation_matrix_T_EE_CB_4x4"])
    (at, board_turn) = frame(board)
    for k in range(4):
        eye = np.array(read("tf_base_to_camera.json")["T_base_to_camera"][f"cam{k + 1}"]["T_4x4"])
        told = read(f"intrinsics_cam{k + 1}.json")
        m, f = told["intrinsics_K"], 2 / 3  # the images are two thirds of those of the lens
        numbers = [m["fx"] * f, m["fy"] * f, (m["cx"] + 0.5) * f - 0.5, (m["cy"] + 0.5) * f - 0.5]
        numbers += told["distortion"]["coefficients"]
        seen: dict[int, list[tuple[float, float]]] = {}
        for row in list(csv.reader((source / f"corners_cam{k + 1}.csv").read_text().splitlines()))[1:]:
            seen.setdefault(int(row[0]) - 1, []).append((float(row[2]), float(row[3])))
        with (folder / f"cam{k}.csv").open("w", newline="") as file:
            out = csv.writer(file)
            out.writerow(["id", *(f"j{i}" for i in range(1, 7)), "u", "v", "x", "y", "z", "fold"])
            for i, corners in sorted(seen.items()):
                if i in (leave_out or {}).get(k, ()):
                    continue
                there = np.linalg.inv(eye) @ forward(dh, np.radians(joints[i])) @ board @ np.c_[GRID, np.ones(63)].T
                near = numbers[2:4] + (numbers[0] * there[:2] / there[2]).T
                turned = np.linalg.norm(near - corners) > np.linalg.norm(near - corners[::-1])
                ends = corners[::-1] if labels == "undone" and turned else corners
                for point, uv in zip(GRID, ends, strict=True):
                    out.writerow([f"p{i}", *joints[i], *uv, *point * 1e3, f"f{i % 4}"])
        if lens is not None:
            size = told["image_size_wh"]
            pinhole = {n: m[n] for n in SYMBOLS[:4]}
            (folder / f"lens{k}.yaml").write_text(LENS.format(**size, **pinhole, k=numbers[4:]))
        words = ", ".join(f"{n}: {v}" for n, v in zip(SYMBOLS, numbers, strict=True))
        words = words if lens is None else f"file: lens{k}.yaml{lens}"
        place, turn = frame(eye)
        text = DATA.format(k=k, lens=words, place=place, turn=turn, board=at, board_turn=board_turn)
        (folder / f"cam{k}.yaml").write_text(text + more)
    return folder / "robot.yaml", *(folder / f"cam{k}.yaml" for k in range(4))


def forward(dh, q):
    """T_base_tool of a table."""
    t = np.eye(4)
    for (theta, d, a, alpha), x in zip(dh, q, strict=True):
        c, s, ca, sa = np.cos(theta + x), np.sin(theta + x), np.cos(alpha), np.sin(alpha)
        t = t @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    return t

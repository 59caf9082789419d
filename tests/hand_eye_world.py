"""A camera, a board and a robot by formulas of the tests' own: corners, poses as makers write them, and the truth."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from cli.runs import robocal
from lens_world import BOARD, LENS, SIZE, board_rows, see, write
from scipy.spatial.transform import Rotation

IMAGE = "{}x{}".format(*SIZE)


def rigid(turn, place):
    t = np.eye(4)
    t[:3, :3], t[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), place
    return t


HAND = rigid([0.03, -0.02, 1.55], [0.045, -0.03, 0.06])  # camera in flange
TABLE = rigid([0.01, -0.02, 0.4], [0.42, -0.08, 0.015])  # board in base
STAND = rigid([-2.2, 0.1, 0.2], [0.4, 0.9, 0.7])  # camera in base
HELD = rigid([0.02, 0.1, -0.7], [0.01, 0.02, 0.12])  # board in flange


@dataclass
class World:
    """Poses of the robot as it tells them (n, 4, 4), pixels (n, k, 2), and which frames are true."""

    told: Any
    pixels: Any
    seen: Any  # T_camera_board
    inhand: bool

    @property
    def camera(self):
        return HAND if self.inhand else STAND

    @property
    def board(self):
        return TABLE if self.inhand else HELD


def world(seed=1, count=16, inhand=True, error=0.3, tilt=0.6, axis=None, lens=LENS):
    """Views with the board before the camera, turned by up to `tilt` rad about all axes or about one; the robot stands off by `error` mm
    and mrad."""
    rng = np.random.default_rng(seed)
    told, pixels, seen = [], [], []
    while len(told) < count:
        w = (
            rng.uniform(-1, 1, 3) * (tilt, tilt, 2 * tilt)
            if axis is None
            else rng.uniform(-tilt, tilt) * np.array(axis)
        )
        y = rigid([0, 0, 0], [*rng.uniform(-0.05, 0.05, 2), rng.uniform(0.42, 0.6)])
        y[:3, :3] = Rotation.from_rotvec(w).as_matrix() @ np.diag([1.0, -1, -1])
        uv = see(BOARD @ y[:3, :3].T + y[:3, 3], lens)
        if not ((uv > 5).all() and (uv < np.array(SIZE) - 6).all()):
            continue
        flange = TABLE @ np.linalg.inv(HAND @ y) if inhand else STAND @ y @ np.linalg.inv(HELD)
        off = rigid(1e-3 * error * rng.normal(size=3), 1e-3 * error * rng.normal(size=3))
        there = np.array(flange)
        there[:3, :3] = off[:3, :3] @ flange[:3, :3]
        there[:3, 3] += off[:3, 3]
        told.append(there)
        pixels.append(uv)
        seen.append(y)
    return World(np.array(told), np.array(pixels), np.array(seen), inhand)


def corners(folder, made, noise=0.1, seed=2, name="corners.csv", pixels=None):
    rng = np.random.default_rng(seed)
    return write(folder / name, board_rows(made.pixels if pixels is None else pixels, noise, rng))


def lens_file(folder, lens=LENS, name="lens.yaml"):
    place = folder / name
    numbers = ", ".join(f"{k}: {v}" for k, v in lens.items())
    place.write_text(f"robocal: 1\nkind: lens\nmodel: brown\nimage: [{SIZE[0]}, {SIZE[1]}]\nnumbers: {{{numbers}}}\n")
    return str(place)


FORMS = {
    "quaternion": (("qx", "qy", "qz", "qw"), lambda r: r.as_quat(), 1.0),
    "ur": (("rx", "ry", "rz"), lambda r: r.as_rotvec(), 1.0),
    "kuka": (("A", "B", "C"), lambda r: r.as_euler("ZYX"), 180 / np.pi),
    "abb": (("q1", "q2", "q3", "q4"), lambda r: r.as_quat()[:, [3, 0, 1, 2]], 1.0),
    "fanuc": (("W", "P", "R"), lambda r: r.as_euler("xyz"), 180 / np.pi),
}


def poses(folder, told, form="quaternion", names=None, name="poses.csv", units=True, length=1e3, heads=None):
    """A CSV of poses (n, 4, 4) in one of FORMS; lengths in mm."""
    turn, numbers, scale = FORMS[form]
    unit = {1e3: " [mm]", 1.0: " [m]"}[length] if units else ""
    angle = {"ur": " [rad]", "kuka": " [deg]", "fanuc": " [deg]"}.get(form, "") if units else ""
    head = [
        *([] if names is None else ["image"]),
        *(f"{a}{unit}" for a in "xyz"),
        *(f"{t}{angle}" for t in heads or turn),
    ]
    values = np.hstack([told[:, :3, 3] * length, numbers(Rotation.from_matrix(told[:, :3, :3])) * scale])
    with (folder / name).open("w", newline="") as stream:
        out = csv.writer(stream)
        out.writerow(head)
        for i, row in enumerate(values.tolist()):
            out.writerow([*([] if names is None else [names[i]]), *(f"{v:.9g}" for v in row)])
    return str(folder / name)


def named(made, end=".png"):
    return [f"images/v{i + 1}{end}" for i in range(len(made.told))]


def hand_eye(*words):
    """The document of a run, and its status."""
    ran = robocal("vision", "hand-eye", *map(str, words), "--json")
    assert ran.status in (0, 3), ran.err
    return json.loads(ran.out), ran.status


def codes(document):
    return {r["code"] for r in (*document["remarks"], *document["verdict"]["remarks"])}


def off_by(document, made):
    """What camera and board are off by, in sigma, (2, 6)."""
    out = []
    for part, truth in zip(document["frames"], (made.camera, made.board), strict=True):
        found = np.array(part["matrix"])
        found[:3, 3] *= 1e-3
        turn = Rotation.from_matrix(found[:3, :3] @ truth[:3, :3].T).as_rotvec()
        sigma = np.sqrt(np.diag(part["covariance"]))
        sigma[:3] *= 1e-3
        out.append(np.concatenate([found[:3, 3] - truth[:3, 3], turn]) / sigma)
    return np.array(out)

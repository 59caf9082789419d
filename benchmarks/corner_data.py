"""Corners of markers before a camera, simulated, as files that every state of the project reads: python corner_data.py KIND FOLDER

cable     a platform on eight cables looks down at 36 markers: lens, camera, markers, anchors and zeros free; 48 poses, 1 000 corners
cable-map the same with 81 markers: 40 views, 10 000 corners
arm-map   a camera in the hand of an arm before as many
cameras   four cameras beside an arm that carries a board: 40 poses, 9 500 corners
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from robocal.cables.geometry import cable_robot
from robocal.files.cable.write import describe_cable
from robocal.files.robot import open_robot
from robocal.geometry import se3
from robocal.measure.reach import reach
from robocal.vision.camera import project

LENS = np.array([900.0, 901.0, 640.0, 480.0, -0.18, 0.09, 5e-4, -4e-4, 0.0])
SYMBOLS = "fx fy cx cy k1 k2 p1 p2 k3".split()
IMAGE, RIM, NOISE = (1280, 960), 8.0, 0.3  # px
SQUARE = np.array([[-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0], [-0.5, -0.5, 0]])
ANCHORS = np.array(
    [(x, y, z) for z in (2.95, 0.15) for x, y in ((2.45, 1.95), (-2.45, 1.95), (-2.45, -1.95), (2.45, -1.95))]
)
LOW = np.array([(0.1, -0.1, -0.3), (-0.1, -0.1, -0.3), (-0.1, 0.1, -0.3), (0.1, 0.1, -0.3)])
PLATFORM = np.concatenate([LOW, (LOW * [1, 1, -1])[[2, 3, 0, 1]]])
POSTURE = np.radians([0.0, 10.0, 10.0, 0.0, 60.0, 0.0])


def numbers(values) -> str:
    return "[" + ", ".join(f"{v:.7g}" for v in values) + "]"


def place(t) -> str:
    v = se3.to_vector(t)
    return f"xyz: {numbers(1e3 * v[:3])}, rotation_vector: {numbers(np.degrees(v[3:]))}"


def moved(rng, count, shift, turn) -> np.ndarray:
    """Small motions, (count, 4, 4)."""
    return se3.from_vector(np.concatenate([rng.normal(0, shift, (count, 3)), rng.normal(0, turn, (count, 3))], axis=1))


def look(rng, inside, points) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (m, 4, 2) of points (4, 3) of targets T_camera_target (m, 4, 4), and which are seen whole."""
    there = np.einsum("mij,cj->mci", inside[:, :3, :3], points) + inside[:, None, :3, 3]
    uv = project(there, LENS)[0]
    seen = (there[..., 2] > 0.1) & (uv > RIM).all(axis=-1) & (uv < np.array(IMAGE) - RIM).all(axis=-1)
    return uv + rng.normal(0, NOISE, uv.shape), seen.all(axis=1)


def grid(side, pitch) -> np.ndarray:
    """A square of places, T (side^2, 4, 4), that in the middle first."""
    at = (np.arange(side) - (side - 1) / 2) * pitch
    xyz = np.stack(np.meshgrid(at, at, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    xyz = xyz[np.argsort(np.hypot(*xyz.T[:2]), kind="stable")]
    return se3.from_vector(np.concatenate([xyz, np.zeros((len(xyz), 3))], axis=1))


def write_map(folder, rng, camera, eye, markers, size, joints=None) -> int:
    """A camera at T_base_camera (k, 4, 4) before markers T_base_marker (m, 4, 4); the first one is known. Returns how many corners."""
    rows = []
    for i, at in enumerate(camera):
        uv, seen = look(rng, se3.inverse(at) @ markers, size * SQUARE)
        own = [] if joints is None else [f"{v:.9g}" for v in np.degrees(joints[i])]
        rows += [
            [f"p{i}", *own, f"m{m}", str(c), f"{u:.4f}", f"{v:.4f}"]
            for m in np.flatnonzero(seen)
            for c, (u, v) in enumerate(uv[m])
        ]
    names = [] if joints is None else [f"j{j + 1}" for j in range(joints.shape[1])]
    lines = [",".join(["id", *names, "marker", "corner", "u", "v"]), *map(",".join, rows)]
    (folder / "camera.csv").write_text("\n".join(lines) + "\n")
    shown = sorted({r[-4] for r in rows} - {"m0"}, key=lambda n: int(n[1:]))
    targets = [
        f"  m0: {{mount: base, {place(markers[0])}, free: false}}",
        *(f"  {n}: {{mount: base, free: true}}" for n in shown),
    ]
    told = "" if joints is None else f"joints: {{columns: [{', '.join(names)}], unit: deg}}\n"
    lens = ", ".join(f"{s}: {v:.8g}" for s, v in zip(SYMBOLS, LENS, strict=True))
    (folder / "camera.yaml").write_text(
        "robocal: 1\nkind: pixels\nfile: camera.csv\nunits: {length: mm, angle: deg}\n"
        f"{told}pixels: {{columns: [u, v], sigma: {NOISE}}}\n"
        f"corners: {{column: corner, size: {1e3 * size:g}}}\ncamera: {{name: lens, {lens}, free: true}}\n"
        f"frame: {{name: eye, mount: tool, {place(eye)}, free: true}}\ntarget: marker\ntargets:\n" + "\n".join(targets)
        + "\nconfiguration: {id: id}\n"
    )  # fmt: skip
    return len(rows)


def cable(folder, rng, poses, side, pitch, size) -> int:
    """A platform above a floor with markers."""
    nominal = cable_robot("cables", ANCHORS, PLATFORM, free=("ax", "ay", "az", "l0"))
    (folder / "robot.yaml").write_text(describe_cable(nominal))
    xyz = np.column_stack([rng.uniform(-0.6, 0.6, (poses, 2)), rng.uniform(1.3, 1.8, poses)])
    at = se3.from_vector(
        np.concatenate([xyz, rng.normal(0, 0.12, (poses, 2)), rng.uniform(-0.5, 0.5, (poses, 1))], axis=1)
    )
    anchors = ANCHORS + rng.normal(0, 0.01, ANCHORS.shape)
    there = np.einsum("kij,cj->kci", at[:, :3, :3], PLATFORM) + at[:, None, :3, 3]
    read = np.linalg.norm(there - anchors, axis=2) + rng.normal(0, 0.005, 8) + rng.normal(0, 0.002, (poses, 8))
    names = ",".join(nominal.cables)
    lines = [f"p{i}," + ",".join(f"{1e3 * v:.5f}" for v in row) for i, row in enumerate(read)]
    (folder / "lengths.csv").write_text(f"id,{names}\n" + "\n".join(lines) + "\n")
    (folder / "lengths.yaml").write_text(
        f"robocal: 1\nkind: lengths\nfile: lengths.csv\nunits: {{length: mm, angle: deg}}\n"
        f"lengths: {{columns: [{names}], unit: mm, sigma: 2}}\n"
        "configuration: {id: id}\n"
    )
    eye = se3.from_vector((0.02, 0.01, -0.25, np.pi, 0, 0))
    markers = grid(side, pitch) @ moved(rng, side**2, 0.004, 0.01)
    return write_map(folder, rng, at @ eye @ moved(rng, 1, 0.002, 0.005), eye, markers, size)


def arm(rng, poses, spread) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint values (k, 6), where a built arm has its flange (k, 4, 4), and where it has it in the middle (4, 4)."""
    model = open_robot("irb-120").chain
    free = [n for n in model.usual if not n.startswith("tool.")]
    off = {n: model.table[n].value + rng.normal(0, 3e-4 if model.table[n].unit == "m" else 1e-3) for n in free}
    truth = model.with_values(off)
    q = POSTURE + rng.uniform(-spread, spread, (poses, 6)) * [1, 1, 1, 2, 2, 2]
    return q, reach(truth, q, (), {})[0], reach(truth, POSTURE[None], (), {})[0][0]


def arm_map(folder, rng) -> int:
    """A camera in hand above 64 markers."""
    q, flange, middle = arm(rng, 40, 0.12)
    eye = se3.from_vector((0.0, 0.03, 0.08, 0.0, 0.0, 0.1))
    floor = middle @ eye @ se3.from_vector((0, 0, 0.7, np.pi, 0, 0))
    markers = floor @ grid(8, 0.054) @ moved(rng, 64, 0.002, 0.01)
    return write_map(folder, rng, flange @ eye @ moved(rng, 1, 0.002, 0.005), eye, markers, 0.04, q)


def cameras(folder, rng) -> int:
    """Four cameras before a board of 9 x 7 corners on the flange."""
    q, flange, middle = arm(rng, 40, 0.08)
    board = se3.from_vector((0.02, 0.01, 0.03, 0, 0, 0.1))
    points = np.array([(c % 9 * 0.02, c // 9 * 0.02, 0.0) for c in range(63)])
    lens = ", ".join(f"{s}: {v:.8g}" for s, v in zip(SYMBOLS, LENS, strict=True))
    total = 0
    for k in range(4):
        turn = se3.from_vector((0.08, 0.06, 0, 0.35 * np.cos(2.1 * k), 0.35 * np.sin(2.1 * k), 0.4 * k))
        eye = middle @ board @ turn @ se3.from_vector((0, 0, 0.7, np.pi, 0, 0))
        lines = ["id,j1,j2,j3,j4,j5,j6,u,v,x,y,z"]
        for i, t in enumerate(flange):
            inside = se3.inverse(eye) @ t @ board
            uv = project(points @ inside[:3, :3].T + inside[:3, 3], LENS)[0] + rng.normal(0, NOISE, (63, 2))
            if (uv > RIM).all() and (uv < np.array(IMAGE) - RIM).all():
                own = ",".join(f"{v:.9g}" for v in np.degrees(q[i]))
                lines += [
                    f"p{i},{own},{u:.4f},{v:.4f}," + ",".join(f"{1e3 * w:g}" for w in p)
                    for (u, v), p in zip(uv, points, strict=True)
                ]
        total += len(lines) - 1
        (folder / f"camera{k}.csv").write_text("\n".join(lines) + "\n")
        (folder / f"camera{k}.yaml").write_text(
            f"robocal: 1\nkind: pixels\nfile: camera{k}.csv\nunits: {{length: mm, angle: deg}}\n"
            f"joints: {{columns: [j1, j2, j3, j4, j5, j6], unit: deg}}\npixels: {{columns: [u, v], sigma: {NOISE}}}\n"
            f"points: {{columns: [x, y, z], unit: mm}}\ncamera: {{name: lens{k}, {lens}}}\n"
            f"frame: {{name: eye{k}, free: true, mount: base, {place(se3.inverse(eye))}}}\n"
            f"targets:\n  board: {{free: true, mount: tool, {place(board)}}}\nconfiguration: {{id: id}}\n"
        )
    return total


MAKE = {
    "cable": lambda folder, rng: cable(folder, rng, 48, 6, 0.7, 0.15), "arm-map": arm_map, "cameras": cameras,
    "cable-map": lambda folder, rng: cable(folder, rng, 40, 9, 0.1, 0.07),
}  # fmt: skip

if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("kind", choices=sorted(MAKE))
    words.add_argument("folder", type=Path)
    given = words.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    print(MAKE[given.kind](given.folder, np.random.default_rng(0)), "corners")

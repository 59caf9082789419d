"""Writes the files of this example: a simulated probe over an N-wire phantom."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from robocal.geometry import se3, so3
from robocal.simulation.wire_images import Probe, look_at_wires

SEED, IMAGES, NOISE = 5, 40, 0.2  # mm: of a point across its wire
NAMES = ("G1", "L1", "M1", "G3", "H3", "M3", "H5", "L5", "M5")
WIRES = np.array(
    [
        [[30, 0, 20], [30, 40, 20]], [[55, 0, 20], [35, 40, 20]], [[60, 0, 20], [60, 40, 20]],
        [[30, 0, 10], [30, 40, 10]], [[35, 0, 10], [55, 40, 10]], [[60, 0, 10], [60, 40, 10]],
        [[35, 0, 0], [35, 40, 0]], [[55, 0, 0], [40, 40, 0]], [[60, 0, 0], [60, 40, 0]],
    ], dtype=float,
)  # fmt: skip
IMAGE = (11.0, 48.0, -0.4, 0.02, -0.02, -1.56)  # mm, rad: T_probe_image
PIXEL = (0.080, 0.0745)  # mm
BELIEVED = (15.0, -25.0, -40.0, 1.2, -1.23, -1.2)  # where a stylus found the phantom
OFF = ((0.2, -0.25, 0.1), (0.002, -0.001, 0.0025))  # mm, rad: and how far it is off
LOOK = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def texts() -> dict[str, str]:
    """The files by name."""
    rng = np.random.default_rng(SEED)
    phantom = se3.displace(se3.from_vector(BELIEVED), *map(np.array, OFF))
    probe = Probe(se3.from_vector(IMAGE), PIXEL, phantom, WIRES)
    seen = [se3.compose(so3.exp(rng.normal(0, 0.25, 3)) @ LOOK, [20, rng.uniform(12, 28), 35]) for _ in range(IMAGES)]
    poses = np.array([phantom @ t @ se3.inverse(probe.image) for t in seen])
    uv = look_at_wires(probe, poses, rng.normal(0, NOISE, (IMAGES, len(WIRES), 2)))
    lines = ["frame,wire,u,v,x,y,z,rx,ry,rz"]
    for i, pose in enumerate(poses):
        vector = se3.to_vector(pose)
        place = ",".join(f"{v:.4f}" for v in (*vector[:3], *np.degrees(vector[3:])))
        lines += [f"f{i + 1:02d},{n},{u:.2f},{v:.2f},{place}" for n, (u, v) in zip(NAMES, uv[i], strict=True)]
    wires = "\n".join(
        f"  {n}: {{front: {list(map(int, a))}, back: {list(map(int, b))}}}"
        for n, (a, b) in zip(NAMES, WIRES, strict=True)
    )
    turn = ", ".join(f"{v:.4f}" for v in np.degrees(BELIEVED[3:]))
    data = f"""robocal: 1
kind: plane_points
file: data.csv
units: {{length: mm, angle: deg}}
position: {{columns: [x, y, z], unit: mm}}    # the probe on the base, by a tracker
orientation: {{columns: [rx, ry, rz], form: rotation_vector, unit: deg}}
image: {{columns: [u, v], pixel: [0.078, 0.076]}}    # what the machine states of its depth; both are found
wire: wire
wires:
{wires}
frame: {{name: image, mount: tool}}    # where the image plane is on the probe, is found
targets:
  phantom: {{mount: base, xyz: [15, -25, -40], rotation_vector: [{turn}], prior: {{length: 0.3, angle: 0.2}}}}
configuration: {{id: frame}}
source: simulated by make.py
"""
    robot = """robocal: 1
kind: rig    # no robot: a tracker states where the probe is
name: ultrasound probe
poses: known
units: {length: mm, angle: deg}
source: invented for this example
"""
    return {"robot.yaml": robot, "data.yaml": data, "data.csv": "\n".join(lines) + "\n"}


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else __file__)
    for name, text in texts().items():
        ((folder if folder.is_dir() else folder.parent) / name).write_text(text, encoding="utf-8")

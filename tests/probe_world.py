"""A simulated probe over an N-wire phantom: 20 to 40 images, drawn from what is stated of them."""

from __future__ import annotations

import numpy as np

from robocal.geometry import se3, so3
from robocal.measure.data import Frame
from robocal.measure.machine import Rig
from robocal.parameters import ParameterTable
from robocal.simulation.wire_images import Probe, look_at_wires, probe_data

RIG = Rig("probe", ParameterTable(), ())
NAMES = ("G1", "L1", "M1", "G3", "H3", "M3", "H5", "L5", "M5")
WIRES = 1e-3 * np.array(
    [
        [[30, 0, 20], [30, 40, 20]], [[55, 0, 20], [35, 40, 20]], [[60, 0, 20], [60, 40, 20]],
        [[30, 0, 10], [30, 40, 10]], [[35, 0, 10], [55, 40, 10]], [[60, 0, 10], [60, 40, 10]],
        [[35, 0, 0], [35, 40, 0]], [[55, 0, 0], [40, 40, 0]], [[60, 0, 0], [60, 40, 0]],
    ], dtype=float,
)  # fmt: skip
PHANTOM = np.array([0.015, -0.025, -0.04, 1.2, -1.23, -1.2])
IMAGE = np.array([0.011, 0.048, -0.0004, 0.02, -0.02, -1.56])
PIXEL = (8.0e-5, 7.4e-5)
PRIOR = (3e-4, np.radians(0.2))  # m, rad
SIGMA = 2e-4  # m
# x along the wires' row, y down, so that the plane crosses the wires
LOOK = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


# Beads of a phantom of points: each image is brought to one, where it shows it at these pixels.
BEADS = {"b1": (30, 5, 20), "b2": (60, 15, 10), "b3": (35, 25, 0), "b4": (55, 35, 15)}


def draw(seed=0, images=30, *, turn=0.25, sigma=SIGMA, prior=PRIOR, image=IMAGE, off=True, wires=True, place=PHANTOM):
    """Data, and the truth by the names of parameters; the phantom is off by a draw from its prior."""
    rng = np.random.default_rng(seed)
    believed = se3.from_vector(place)
    true = se3.displace(believed, rng.normal(0, prior[0], 3) * off, rng.normal(0, prior[1], 3) * off)
    probe = Probe(se3.from_vector(image), PIXEL, true, WIRES)
    poses = []
    for _ in range(images):
        seen = se3.compose(so3.exp(rng.normal(0, turn, 3)) @ LOOK, [0.02, rng.uniform(0.012, 0.028), 0.035])
        poses.append(true @ seen @ se3.inverse(probe.image))
    poses = np.array(poses)
    if not wires:
        return _beads(probe, poses, rng, sigma)
    uv = look_at_wires(probe, poses, rng.normal(0, sigma, (images, len(WIRES), 2)))
    frame = Frame("phantom", tuple(place), (True,) * 6, "base", (0.01, 0.05), prior=(*[prior[0]] * 3, *[prior[1]] * 3))
    return probe_data(probe, poses, uv, NAMES, phantom=frame), probe


def _beads(probe, poses, rng, sigma):
    """Probe poses moved so that each image plane meets a bead at a pixel; rows of (image, name, pixel), and the poses."""
    rows, beads = [], list(BEADS.items())
    for i, pose in enumerate(poses):
        name, at = beads[i % len(beads)]
        uv = rng.uniform(100, 500, 2)
        there = (pose @ probe.image)[:3, :3] @ [*(uv * PIXEL), 0] + (pose @ probe.image)[:3, 3]
        wanted = probe.phantom[:3, :3] @ (np.array(at) * 1e-3 + rng.normal(0, sigma, 3)) + probe.phantom[:3, 3]
        poses[i, :3, 3] += wanted - there
        rows.append((i, name, uv))
    return rows, poses


ROBOT = "robocal: 1\nkind: rig\nname: probe\nposes: known\nunits: {length: mm, angle: deg}\n"
DATA = """robocal: 1
kind: plane_points
file: data.csv
units: {length: mm, angle: deg}
WHERE
image: {columns: [u, v], pixel: [0.08, 0.074]}
KNOWN
frame: {name: image, mount: tool}
targets:
  phantom: {mount: base, xyz: [PLACE], rotation_vector: [TURN], prior: {length: 0.3, angle: 0.2}}
configuration: {id: frame}
"""
TRACKED = """position: {columns: [x, y, z], unit: mm}
orientation: {columns: [rx, ry, rz], form: rotation_vector, unit: deg}"""


def described(where, points=None, at=PHANTOM):
    """A data.yaml of wires or beads."""
    listed = (
        f"{n}: {{front: {a.tolist()}, back: {b.tolist()}}}"
        for n, (a, b) in zip(NAMES, np.rint(WIRES * 1e3).astype(int), strict=True)
    )
    known = "wire: wire\nwires:\n  " + "\n  ".join(listed)
    if points:
        known = "point: wire\npoints: {" + ", ".join(f"{n}: {list(p)}" for n, p in points.items()) + "}"
    place, turn = (", ".join(f"{v * 1e3:.6f}" for v in at[:3]), ", ".join(f"{v:.6f}" for v in np.degrees(at[3:])))
    return DATA.replace("WHERE", where).replace("KNOWN", known).replace("PLACE", place).replace("TURN", turn)


def files_of(folder, drawn, points=None):
    """Robot and data file of what `draw` made."""
    if points:
        rows, poses = drawn
    else:
        (obs,) = drawn[0].observations
        poses = se3.from_vector(drawn[0].configurations.starts)
        rows = [
            (c, NAMES[int(n)], uv)
            for c, n, uv in zip(obs.configuration, obs.extra["named"], obs.extra["image"], strict=True)
        ]
    lines = ["frame,wire,u,v,x,y,z,rx,ry,rz"]
    for i, name, uv in rows:
        vector = se3.to_vector(poses[i])
        lines.append(
            ",".join([f"f{i}", name, *(f"{v:.6f}" for v in (*uv, *vector[:3] * 1e3, *np.degrees(vector[3:])))])
        )
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    (folder / "robot.yaml").write_text(ROBOT)
    (folder / "data.yaml").write_text(described(TRACKED, points))
    return folder / "robot.yaml", folder / "data.yaml"


def arm_over_phantom(folder):
    """A UR10 whose flange is the probe, of which nothing is free, over a phantom beside its base."""
    from robocal.arms import catalog
    from robocal.arms.inverse_kinematics import inverse_pose
    from robocal.files.robot import describe

    arm = catalog.get("ur10")
    place = np.array([0.6, 0.25, 0.3, *PHANTOM[3:]])
    data, _ = draw(4, place=place)
    reached = inverse_pose(arm, se3.from_vector(data.configurations.starts))
    assert reached.success.all()
    (obs,) = data.observations
    lines = [",".join(["frame", "wire", "u", "v", *(f"{j.name} [deg]" for j in arm.joints)])]
    for c, n, uv in zip(obs.configuration, obs.extra["named"], obs.extra["image"], strict=True):
        joints = (f"{v:.7f}" for v in np.degrees(reached.joints[c]))
        lines.append(",".join([f"f{c}", NAMES[int(n)], *(f"{v:.6f}" for v in uv), *joints]))
    (folder / "data.csv").write_text("\n".join(lines) + "\n")
    text = describe(arm, calibrate=False).replace("[0, 0, 0], free: true", "[0, 0, 0], free: false")
    (folder / "robot.yaml").write_text(text + "calibrate: {free: []}\n")
    (folder / "data.yaml").write_text(described("source: simulated", at=place))
    return folder / "robot.yaml", folder / "data.yaml"

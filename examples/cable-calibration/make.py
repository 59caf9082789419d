"""Simulates every file in this folder anew: python examples/cable-calibration/make.py

The eight-cable robot of Table D.1 with the attachments of `examples/cable-laval` and a four-cable one. Nothing here was measured.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable
from robocal.geometry import se3, so3
from robocal.measure.swivel import across, swivels

HERE = Path(__file__).parent
SAID = "# SIMULATED, not measured: examples/cable-calibration/make.py\n"
TURN = ("rx [deg]", "ry [deg]", "rz [deg]")
FREE = "calibrate: {free: [ax, ay, az, l0]}\n"
Array = NDArray[np.float64]


def table(names: tuple[str, ...], rows: Array, ids: list[str]) -> str:
    """A CSV with ids before its columns."""
    lines = [",".join([i, *(f"{v:.4f}" for v in row)]) for i, row in zip(ids, rows, strict=True)]
    return "\n".join([",".join(["id", *names]), *lines]) + "\n"


def data(kind: str, file: str, section: str) -> str:
    """The data.yaml of a table."""
    return f"{SAID}robocal: 1\nkind: {kind}\nfile: {file}\n{section}configuration: {{id: id}}\n"


def poses_text(t: Array, ids: list[str]) -> str:
    """Poses in mm and degrees."""
    v = se3.to_vector(t)
    return table(("x [mm]", "y [mm]", "z [mm]", *TURN), np.hstack([1e3 * v[:, :3], np.degrees(v[:, 3:])]), ids)


def shaken(t: Array, rng: np.random.Generator, place: float, turn: float) -> Array:
    """Poses with noise of every component (m, rad)."""
    out = t.copy()
    out[:, :3, 3] += place * rng.normal(size=(len(t), 3))
    out[:, :3, :3] = so3.exp(turn * rng.normal(size=(len(t), 3))) @ t[:, :3, :3]
    return out


def drawn(robot: CableRobot, rng: np.random.Generator, n: int, shift: float, tilt: float) -> Array:
    """Poses about the mean of the frame anchors (m, rad)."""
    turned = np.hstack([rng.uniform(-shift, shift, (n, 3)), rng.uniform(-tilt, tilt, (n, 3))])
    return se3.from_vector(turned + np.r_[robot.a.mean(axis=0), 0, 0, 0])


def eight() -> CableRobot:
    """The robot of Table D.1."""
    return read_cable(HERE.parent / "cable-laval" / "robot.yaml").robot


def off(robot: CableRobot, rng: np.random.Generator, size: float) -> CableRobot:
    """Its frame anchors and zeros as a tape measure leaves them."""
    bare = cable_robot(robot.name, robot.a, robot.b, robot.zeros)
    values = {n: robot.table[n].value + size * rng.normal() for n in bare.table.names if ".b" not in n}
    return bare.with_values(values)


def seen(
    robot: CableRobot, rng: np.random.Generator, n: int, length: float, place: float, turn: float
) -> dict[str, str]:
    """Lengths and poses of one calibration, with the noises that are stated."""
    t = drawn(robot, rng, n, 0.8, np.radians(20))
    y = inverse(robot.having(pulleys=None), t)[0] + length * rng.normal(size=(n, len(robot.cables)))
    ids = [f"p{i + 1:03}" for i in range(n)]
    columns = ", ".join(robot.cables)
    pose = f"position: {{columns: [x, y, z], sigma: {1e3 * place:g}}}\n"
    pose += f"orientation: {{columns: [rx, ry, rz], form: rotation_vector, sigma: {np.degrees(turn):g}}}\n"
    pose += "frame: {name: camera, free: false}\n"
    return {
        "lengths.csv": table(tuple(f"{c} [mm]" for c in robot.cables), 1e3 * y, ids),
        "lengths.yaml": data("lengths", "lengths.csv", f"lengths: {{columns: [{columns}], sigma: {1e3 * length:g}}}\n"),
        "poses.csv": poses_text(shaken(t, rng, place, turn), ids),
        "poses.yaml": data("pose", "poses.csv", pose),
    }


def four(rng: np.random.Generator) -> dict[str, str]:
    """Four cables, lengths, swivel angles and inclinations."""
    a = np.array([(2.5, 2, 3.2), (-2.5, 2, 3.0), (-2.5, -2, 3.1), (2.5, -2, 3.0)])
    b = np.array([(0.25, 0.2, 0.1), (-0.25, 0.2, 0.12), (-0.25, -0.2, 0.1), (0.25, -0.2, 0.15)])
    robot = cable_robot("four", a, b, [0.3, 0.4, 0.5, 0.2])
    n = 60
    shift = rng.uniform(-1, 1, (n, 3)) * [1.4, 1.1, 0.7] + [0, 0, 1.2]
    t = se3.from_vector(np.hstack([shift, np.radians(rng.uniform(-15, 15, (n, 3)))]))
    ids = [f"p{i + 1:03}" for i in range(n)]
    y = inverse(robot, t)[0] + 2e-3 * rng.normal(size=(n, 4))
    d = t[:, None, :3, 3] + np.einsum("nij,mj->nmi", t[:, :3, :3], b) - a
    angle = swivels(d, *across(np.tile([0.0, 0, 1], (4, 1))))[0] - [0.5, -1.0, 2.0, 3.0]
    angle = (angle + np.radians(0.1) * rng.normal(size=angle.shape) + np.pi) % (2 * np.pi) - np.pi
    tilt = np.arcsin(t[:, 2, :2]) + np.radians(0.05) * rng.normal(size=(n, 2))
    names = ("s1", "s2", "s3", "s4")
    return {
        "robot.yaml": SAID + describe_cable(off(robot, rng, 0.02)) + FREE,
        "lengths.csv": table(tuple(f"{c} [mm]" for c in robot.cables), 1e3 * y, ids),
        "lengths.yaml": data("lengths", "lengths.csv", "lengths: {columns: [c1, c2, c3, c4], sigma: 2}\n"),
        "swivel.csv": table(tuple(f"{s} [deg]" for s in names), np.degrees(angle), ids),
        "swivel.yaml": data("swivel", "swivel.csv", "swivel: {columns: [s1, s2, s3, s4], sigma: 0.1}\n"),
        "tilt.csv": table(("tilt_x [deg]", "tilt_y [deg]"), np.degrees(tilt), ids),
        "tilt.yaml": data("inclination", "tilt.csv", "inclination: {columns: [tilt_x, tilt_y], sigma: 0.05}\n"),
    }


def ten(robot: CableRobot, rng: np.random.Generator) -> dict[str, str]:
    """Ten poses: a tracker, a camera whose map is 1 % too large, and the robot that was calibrated with it."""
    t = drawn(robot, rng, 10, 0.6, np.radians(10))
    ids = [f"v{i + 1}" for i in range(10)]
    large = t.copy()
    large[:, :3, 3] = 1.01 * (t[:, :3, 3] - robot.a.mean(axis=0)) + robot.a.mean(axis=0)
    camera = shaken(large, rng, 2e-3, np.radians(0.2))
    return {
        "tracker.csv": poses_text(shaken(t, rng, 1e-4, np.radians(0.01)), ids),
        "camera.csv": poses_text(camera, ids),
        "robot.csv": poses_text(shaken(large, rng, 1e-3, np.radians(0.2)), ids),
    }


def texts() -> dict[str, str]:
    """Every file by its name."""
    robot = eight()
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(3).spawn(6)]
    out = {"eight/robot.yaml": SAID + describe_cable(off(robot, streams[0], 0.1)) + FREE}
    out |= {f"eight/{k}": v for k, v in seen(robot, streams[1], 100, 3e-3, 2e-3, np.radians(1.0)).items()}
    out["march/robot.yaml"] = SAID + describe_cable(off(robot, streams[2], 0.01)) + FREE
    moved = robot.with_values({"c6.ax": robot.table["c6.ax"].value + 5e-3})
    for month, one, stream in (("march", robot, streams[3]), ("june", moved, streams[4])):
        out |= {f"{month}/{k}": v for k, v in seen(one, stream, 60, 5e-4, 2e-4, np.radians(0.02)).items()}
    out |= {f"four/{k}": v for k, v in four(streams[5]).items()}
    return out | {f"ten/{k}": v for k, v in ten(robot, np.random.default_rng(11)).items()}


if __name__ == "__main__":
    for name, text in texts().items():
        place = HERE / name
        place.parent.mkdir(exist_ok=True)
        place.write_text(text, encoding="utf-8")
        print(place)

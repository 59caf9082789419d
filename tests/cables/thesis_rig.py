"""The rig of `../shared/data/cable-robots/thesis-rig.yaml`, simulated: a platform on eight cables looks down at markers on
the floor, and its poses, the markers, the anchors, the camera and where it sits are estimated together.

Markers and cables are shared columns, poses are local blocks. The frame in which errors are told is that of marker 0, which is
therefore known. What the acceptance does not need is left out: tensions (and with them elongation and which poses can be
held) and the error of the printed size. A camera's given numbers and its place are drawn from the priors that the file states.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from robocal.cables.geometry import CableRobot, cable_robot
from robocal.estimate.problem import Problem
from robocal.geometry import se3, so3
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.vision.camera import SYMBOLS, project

FREE = tuple(s for s in SYMBOLS if s != "k3")  # the file names no k3
ANCHORS = tuple(f"c{i}.a{s}" for i in range(1, 9) for s in "xyz")
TAPE = 0.03  # m, of a frame anchor's coordinate
ZERO = 0.01  # m, of a length sensor; the file does not say
SIX = (True,) * 6


@dataclass(frozen=True)
class Rig:
    """The problem from where an engineer starts, and the true values of the table and of the poses, (P + 6 poses,)."""

    problem: Problem
    data: DataSet
    robot: CableRobot
    truth: np.ndarray

    def exit_points(self, x: np.ndarray) -> float:
        """Root mean square of the errors of the frame anchors' coordinates, m."""
        rows = [self.problem.table.index[n] for n in ANCHORS]
        return float(np.sqrt(np.mean((x[0, rows] - self.truth[rows]) ** 2)))


def specification(shared: Path) -> dict:
    """The file."""
    return YAML(typ="safe").load((shared / "cable-robots" / "thesis-rig.yaml").read_text(encoding="utf-8"))


def thesis_rig(said: dict, seed: int, *, poses: int | None = None, grid: tuple[int, int] | None = None) -> Rig:
    """One draw of the rig: truth, measurements, and what the tape measure, the drawing and the calibration of the camera say.

    `poses` and `grid` make it smaller than the file says.
    """
    rng = np.random.default_rng(seed)
    nominal = np.array(said["frame_anchors_nominal"])
    platform = np.array(said["platform_anchors"])
    robot = cable_robot("thesis", nominal, platform, free=("ax", "ay", "az", "l0"))
    # How far off a tape measure is the file says, and so does whoever held it.
    robot = replace(robot, table=replace(robot.table, rows=tuple(replace(p, expected=TAPE) for p in robot.table.rows)))
    true_robot = cable_robot(
        "thesis", nominal + rng.normal(scale=TAPE, size=nominal.shape), platform, rng.normal(scale=ZERO, size=8)
    )
    eye, true_eye = _eye(said, rng)
    lens, true_lens = _lens(said, rng)
    markers = _markers(said, rng, grid or tuple(said["markers"]["grid"]))
    at = _poses(said, rng, poses or said["poses"]["calibration"])
    where = Configurations(tuple(f"p{i}" for i in range(len(at))), start=at)
    pixels = _pixels(said, at, true_eye, true_lens, markers)
    cable = np.tile(np.arange(8), len(at))
    long = Observations(
        "lengths", np.repeat(np.arange(len(at)), 8), np.zeros((len(cable), 1)), np.full((len(cable), 1), said["cable"]["length_noise"]),
        extra={"cable": cable},
    )  # fmt: skip
    recorded = synthesise(true_robot, DataSet(where, (pixels, long)), rng)
    truth = problem(true_robot, recorded).start[0]
    data = _as_known(recorded, at, eye, lens, markers, rng)
    made = problem(robot, data)
    return Rig(made.with_table(made.table.with_priors(_priors(said))), data, robot, truth)


def without_priors(made: Problem) -> Problem:
    """The same, nobody having stated anything."""
    return made.with_table(made.table.with_priors(dict.fromkeys(made.table.names)))


def with_wider_priors(made: Problem, factor: float) -> Problem:
    """The same with every stated prior wider."""
    stated = {p.name: factor * p.prior for p in made.table.rows if p.prior is not None}
    return made.with_table(made.table.with_priors(stated))


def _eye(said, rng) -> tuple[np.ndarray, np.ndarray]:
    """T_platform_camera as drawn and as it is, (6,) each."""
    t = np.diag([1.0, -1.0, -1.0, 1.0])
    t[:3, 3] = said["camera_in_platform_nominal"]["translation"]
    off = np.concatenate([rng.normal(scale=0.002, size=3), rng.normal(scale=np.deg2rad(0.3), size=3)])
    true = t.copy()
    true[:3, 3] += off[:3]
    true[:3, :3] = so3.exp(off[3:]) @ t[:3, :3]
    return se3.to_vector(t), se3.to_vector(true)


def _lens(said, rng) -> tuple[np.ndarray, np.ndarray]:
    """The camera's nine numbers as given and as they are."""
    c = said["camera"]
    width, height = c["resolution"]
    centre = np.array([width, height]) / 2 + rng.normal(scale=8.0, size=2)
    true = np.array([c["fx"], c["fy"], *centre, c["k1"], c["k2"], c["p1"], c["p2"], 0.0])
    spread = [said["prior_used"]["focal_and_centre_px"]] * 4 + [said["prior_used"]["distortion"]] * 4 + [0.0]
    return true + rng.normal(size=9) * spread, true


def _priors(said) -> dict[str, float]:
    used = said["prior_used"]
    eye = {f"eye.{s}": 0.002 for s in "xyz"} | {f"eye.r{s}": float(np.deg2rad(0.3)) for s in "xyz"}
    return eye | {f"lens.{s}": used["focal_and_centre_px" if i < 4 else "distortion"] for i, s in enumerate(FREE)}


def _markers(said, rng, grid) -> np.ndarray:
    """T_base_marker of all markers, (m, 6)."""
    m = said["markers"]
    place = [(np.arange(k) + 0.5) / k * size - size / 2 for k, size in zip(grid, m["floor"], strict=True)]
    xy = np.stack(np.meshgrid(*place, indexing="ij"), axis=-1).reshape(-1, 2)
    count = len(xy)
    t = np.zeros((count, 4, 4))
    tilt = np.concatenate([rng.normal(scale=np.deg2rad(m["tilt_sd"]), size=(count, 2)), np.zeros((count, 1))], axis=1)
    turn = np.concatenate([np.zeros((count, 2)), rng.uniform(-np.pi, np.pi, (count, 1))], axis=1)
    t[:, :3, :3] = so3.exp(tilt) @ so3.exp(turn)
    t[:, :2, 3] = xy + rng.uniform(-m["jitter"], m["jitter"], xy.shape)
    t[:, 2, 3] = rng.normal(scale=m["height_sd"], size=count)
    t[:, 3, 3] = 1
    # Which marker is number 0 the file does not say: the one that most poses see, in the middle.
    first = int(np.argmin(np.hypot(*xy.T)))
    return se3.to_vector(np.concatenate([t[[first]], np.delete(t, first, axis=0)]))


def _poses(said, rng, count) -> np.ndarray:
    """T_base_platform, (count, 6): the axis of the tilt is level."""
    p = said["poses"]
    xyz = np.column_stack([rng.uniform(*p[s], count) for s in "xyz"])
    tilt = np.deg2rad(p["tilt_max"]) * np.sqrt(rng.random(count))
    about = rng.uniform(-np.pi, np.pi, count)
    level = tilt[:, None] * np.column_stack([np.cos(about), np.sin(about), np.zeros(count)])
    yaw = np.column_stack([np.zeros((count, 2)), np.deg2rad(rng.uniform(*p["yaw"], count))])
    t = np.tile(np.eye(4), (count, 1, 1))
    t[:, :3, :3] = so3.exp(level) @ so3.exp(yaw)
    t[:, :3, 3] = xyz
    return se3.to_vector(t)


def _pixels(said, at, eye, lens, markers) -> Observations:
    """Which markers are seen from which pose; the values are synthesised later."""
    half = said["markers"]["size"] / 2
    corners = half * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    camera = np.linalg.inv(se3.from_vector(at) @ se3.from_vector(eye))
    inside = np.einsum("pij,mjk->pmik", camera, se3.from_vector(markers))
    points = np.einsum("pmij,cj->pmci", inside[..., :3, :3], corners) + inside[..., None, :3, 3]
    if_seen = said["marker_seen_if"]
    z = np.maximum(points[..., 2], 1e-3)
    steep = np.hypot(points[..., 0], points[..., 1]) / z < np.tan(np.deg2rad(if_seen["angle_from_axis_below"]))
    uv = project(np.concatenate([points[..., :2], z[..., None]], axis=-1), lens)[0]
    room = if_seen["border_px"]
    held = ((uv > room) & (uv < np.array(said["camera"]["resolution"]) - room)).all(axis=-1)
    side = np.linalg.norm(uv - np.roll(uv, 1, axis=2), axis=-1).min(axis=-1)
    seen = (steep & held & (points[..., 2] > 0.1)).all(axis=-1) & (side > if_seen["side_px_above"])
    pose, marker = (np.repeat(i, 4) for i in np.nonzero(seen))
    count = len(pose)
    targets = tuple(Frame(f"m{i}", tuple(v), SIX if i else (False,) * 6) for i, v in enumerate(markers))
    return Observations(
        "pixels", pose, np.zeros((count, 2)), np.full((count, 2), said["camera"]["corner_noise_px"]),
        Frame("eye", tuple(eye), SIX, "tool"), targets, marker,
        extra={"point": np.tile(corners, (count // 4, 1))},
        options={"camera": "lens", "intrinsics": tuple(lens), "free": FREE},
    )  # fmt: skip


def _as_known(recorded, at, eye, lens, markers, rng) -> DataSet:
    """The same measurements with what is known beforehand; poses and markers start where a first look puts them."""
    rough = np.concatenate([rng.normal(scale=0.005, size=(len(markers), 3)), rng.normal(scale=0.01, size=(len(markers), 3))], 1)  # fmt: skip
    pixels, long = recorded.observations
    first = tuple(replace(t, value=tuple(markers[i] + (rough[i] if i else 0.0))) for i, t in enumerate(pixels.targets))
    pixels = replace(
        pixels,
        frame=replace(pixels.frame, value=tuple(eye)),
        targets=first,
        options=dict(pixels.options) | {"intrinsics": tuple(lens)},
    )
    start = at + np.concatenate([rng.normal(scale=0.02, size=(len(at), 3)), rng.normal(scale=0.01, size=(len(at), 3))], 1)  # fmt: skip
    return DataSet(replace(recorded.configurations, start=start), (pixels, long))

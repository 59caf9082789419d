"""A virtual rig as it truly is, drawn from its file: anchors, drives, camera and markers, and what its builder believes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.cables.calibration.beacons import anchors_of_ranges, gauge_of, into_gauge
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.files.cable.cable_robot import parse_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.rig_spec import CableRigSpec
from robocal.files.text import Source
from robocal.files.yamlio import quote
from robocal.geometry import se3, so3
from robocal.geometry.gravity import GRAVITY
from robocal.simulation.cable_rig.marker_grid import MarkerGrid, Sight, draw_markers

__all__ = [
    "Belief",
    "RigWorld",
    "closed_tension",
    "draw_poses",
    "draw_world",
    "lengths_at",
    "read_robot",
    "robot_text",
    "start_of",
]

G = -GRAVITY[2]
DIGITS = 9


@record(eq=False)
class Belief:
    """What the builder knows: frame anchors (m, 3), standard deviation (m, 3) of their coordinates (0: the frame is fixed there), and,
    where beacons told them, the ranges (m, m) and the covariance (3 m, 3 m) that they leave."""

    anchors: Array
    sigma: Array
    ranges: Array | None = None
    covariance: Array | None = None


@record(eq=False)
class RigWorld:
    """The true robot, with zeros 0; markers T_base_marker (M, 4, 4), the edge of a print (m), camera in platform (4, 4), lens (9,) and
    the lens as calibrated (9,); what is believed of the anchors."""

    spec: CableRigSpec
    true: CableRobot
    markers: Array
    edge: float
    eye: Array
    lens: Array
    stated_lens: Array
    belief: Belief

    @property
    def beacons(self) -> bool:
        """Whether beacons told the anchors."""
        return self.belief.ranges is not None

    @property
    def sight(self) -> Sight:
        """What counts as seen."""
        s = self.spec.model.visible_if
        return Sight(np.radians(s.angle_from_axis_below), s.border_px, s.side_px_above)


def draw_world(spec: CableRigSpec, rng: np.random.Generator) -> RigWorld:
    """A rig of this kind. Raises ModelError where beacons fix no frame."""
    said = spec.model
    c, mount, m = said.camera, said.camera_in_platform_nominal, said.markers
    spread = said.anchors.sigma
    anchors = spec.frame + rng.normal(scale=spread, size=spec.frame.shape)
    floor = MarkerGrid(
        (m.grid[0], m.grid[1]), (m.area[0], m.area[1]), m.jitter, m.height_sd, float(np.radians(m.tilt_sd))
    )
    markers = draw_markers(floor, rng)
    if said.anchors.known_by == "beacons":
        move = into_gauge(anchors, spec.frame)
        anchors = anchors @ move[:3, :3].T + move[:3, 3]
        markers = move @ markers
        sigma = said.anchors.range_sigma
        apart = np.linalg.norm(anchors[:, None] - anchors[None], axis=2)
        ranges = apart + rng.normal(scale=sigma, size=apart.shape)
        found, covariance = anchors_of_ranges(ranges, spec.frame, sigma)
        belief = Belief(found, np.sqrt(np.diag(covariance)).reshape(-1, 3), ranges, covariance)
    else:
        belief = Belief(spec.frame, np.full(spec.frame.shape, spread))
    lens = spec.lens.copy()
    lens[2:4] += rng.normal(size=2) * spec.drawn
    told = lens.copy()
    told[4] += c.k1_wrong_by
    eye = spec.eye.copy()
    eye[:3, 3] += rng.normal(scale=mount.translation_sigma, size=3)
    eye[:3, :3] = so3.exp(rng.normal(scale=np.radians(mount.rotation_sigma), size=3)) @ eye[:3, :3]
    mass = said.weight_N / G * (said.wrong.mass_factor or 1.0)
    true = cable_robot(
        f"{said.name}, true", anchors, spec.platform, names=spec.cables, elasticity=np.full(len(anchors), said.cable.elongation_per_N),
        mass=mass, limits=np.tile(spec.limits, (len(anchors), 1)),
    )  # fmt: skip
    return RigWorld(
        spec, true, markers, m.size * (1 + rng.choice([-1, 1]) * m.print_scale_error), eye, lens, told, belief
    )


def robot_text(world: RigWorld, zeros: Array) -> str:
    """robot.yaml of the builder: anchors as believed with their priors, zeros (m,) in m as of power-up."""
    spec, belief = world.spec, world.belief
    said, names = spec.model, spec.cables
    how = "a tape measure" if not world.beacons else "ranges between beacons"

    def points(letter: str, rows: Array) -> str:
        return "\n".join(f"  {letter}{i + 1}: {_row(v)}" for i, v in enumerate(rows))

    cables = "\n".join(
        f"  - {{name: {n}, frame: A{i + 1}, platform: B{i + 1}, zero: {zeros[i]:.{DIGITS}f}}}"
        for i, n in enumerate(names)
    )
    if belief.covariance is not None:
        # Ranges tell all anchors together: one that is far off takes its neighbours along.
        open_ = np.flatnonzero(~gauge_of(spec.frame))
        each = [f"{names[i // 3]}.a{'xyz'[i % 3]}" for i in open_]
        s, free = np.sqrt(np.diag(belief.covariance))[open_], ", ".join(["l0", *each])
        unit = belief.covariance[np.ix_(open_, open_)] / np.outer(s, s)
        prior = ", ".join(f"{n}: {v:.{DIGITS}g}" for n, v in zip(each, s, strict=True))
        told = f"free: [{free}], prior: {{{prior}}},\n  correlation: [{_rows(unit)}]"
    else:
        prior = ", ".join(f"a{s}: {belief.sigma[0, k]:.4g}" for k, s in enumerate("xyz"))
        told = f"free: [ax, ay, az, l0], prior: {{{prior}}}"
    low, high = spec.limits
    return (
        f"robocal: 1\nname: {quote(said.name)}\nkind: cable\nunits: {{length: m, angle: deg, force: N, mass: kg}}\n"
        f"frame_anchors:\n{points('A', belief.anchors)}\nplatform_anchors:\n{points('B', spec.platform)}\ncables:\n{cables}\n"
        f"every_cable: {{tension: [{low:g}, {high:g}], elasticity: {said.cable.elongation_per_N!r}}}\n"
        f"platform: {{mass: {said.weight_N / G:.6f}, centre_of_mass: [0, 0, 0]}}\n"
        f"calibrate: {{{told}}}\nsource: {quote(f'simulated; anchors from {how}')}\n"
    )


def read_robot(world: RigWorld, zeros: Array) -> CableFile:
    """The same as a robot."""
    return parse_cable(Source(Path("robot.yaml"), robot_text(world, zeros), ""))


def closed_tension(robot: CableRobot, poses: Array, preferred: float) -> Array:
    """Tensions (k, m) in N nearest to a preferred one that hold the robot's weight at poses (k, 4, 4)."""
    w = structure_of(robot, poses)
    load = gravity_wrench(poses, float(robot.need("mass")), robot.com)
    t0 = np.full(w.shape[2], preferred)
    return np.asarray(t0 - np.einsum("kij,kj->ki", np.linalg.pinv(w), load + w @ t0))


def draw_poses(spec: CableRigSpec, robot: CableRobot, count: int, rng: np.random.Generator) -> Array:
    """Poses (count, 4, 4) in the box of the file at which the tensions of a robot stay within the controller's limits."""
    p, (least, most) = spec.model.poses, spec.limits
    out = np.empty((0, 4, 4))
    for _ in range(100):
        tilt = np.radians(p.tilt_max) * np.sqrt(rng.random(count))
        about = rng.uniform(-np.pi, np.pi, count)
        level = tilt[:, None] * np.column_stack([np.cos(about), np.sin(about), np.zeros(count)])
        yaw = np.column_stack([np.zeros((count, 2)), np.radians(rng.uniform(p.yaw[0], p.yaw[1], count))])
        t = np.tile(np.eye(4), (count, 1, 1))
        t[:, :3, 3] = np.column_stack([rng.uniform(low, high, count) for low, high in (p.x, p.y, p.z)])
        t[:, :3, :3] = so3.exp(level) @ so3.exp(yaw)
        pulls = closed_tension(robot, t, spec.model.tensions.preferred_N)
        out = np.concatenate([out, t[((pulls >= least) & (pulls <= most)).all(axis=1)]])[:count]
        if len(out) == count:
            return out
    return out


def start_of(world: RigWorld, believed: Array, rng: np.random.Generator) -> Array:
    """Where the platform truly hangs at power-up, near the pose (4, 4) that the builder says."""
    s = world.spec.model.start
    step = np.concatenate(
        [rng.normal(scale=s.position_sigma, size=3), rng.normal(scale=np.radians(s.angle_sigma), size=3)]
    )
    return se3.displace(believed, step[:3], step[3:])


def lengths_at(robot: CableRobot, pose: Array, tension: Array | None = None) -> Array:
    """What sensors show (m,) at a pose (4, 4)."""
    return np.asarray(inverse(robot, pose[None], tension)[0][0])


def _row(values: Array) -> str:
    return "[" + ", ".join(f"{v:.{DIGITS}g}" for v in values) + "]"


def _rows(values: Array) -> str:
    return ",\n    ".join(map(_row, values))

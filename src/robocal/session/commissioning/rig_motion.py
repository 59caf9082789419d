"""A virtual rig at work: power-up, the motions of a list under the controller, and what is recorded at every pose."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.prepared import Drums, Prepared
from robocal.control.pid import ControlLaw
from robocal.control.platform.platform_controller import (
    MotionLimits,
    PlatformController,
    PlatformState,
    platform_controller,
)
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.geometry import se3
from robocal.progress import Watch
from robocal.session.commissioning.rig_files import Corners, Recording
from robocal.session.commissioning.rig_world import RigWorld, closed_tension, lengths_at, read_robot, start_of
from robocal.simulation.cable_rig.marker_grid import sightings
from robocal.simulation.platform.platform_plant import plant_of
from robocal.simulation.platform.rig_run import Followed, Wiring, follow
from robocal.simulation.platform.winch_plant import Driven, Winches, WinchPlant

__all__ = ["RigMotion", "Stop", "power_up"]

LONGEST = 20.0  # s that a motion may take
SETTLE = 0.3  # s that the platform stands before anything is recorded
EVERY = 10  # periods per row of the log


@record(eq=False)
class Stop:
    """Why a run was stopped: a word of the controller, the pose on the way to which, and the cable where it is one's."""

    word: str
    at: str
    cable: str = ""


class RigMotion:
    """The rig under power: where it is, what its controller believes, and what the plant has seen of tensions.

    `believed` is the robot of the running controller, `home` (4, 4) its X_0. `least` and `most` are the tensions (N) of the plant, `moved`
    how many motions were made in how many `seconds` of the plant; `trail` (n, m) is what sensors showed during the last. `draws`: whether
    images are drawn, and corners looked for in them.
    """

    def __init__(
        self, world: RigWorld, plant: WinchPlant, wiring: Wiring, believed: CableRobot, driven: Driven
    ) -> None:
        self.world, self.plant, self.wiring, self.believed = world, plant, wiring, believed
        self.home, self.driven = believed.home, driven
        self.first = wiring.readings(driven)
        self.draws = False
        self.watch: Watch | None = None
        self.least, self.most, self.moved, self.seconds = math.inf, 0.0, 0, 0.0
        self.trail = np.zeros((0, len(world.spec.cables)))
        self._running: tuple[PlatformController, PlatformState] | None = None

    @property
    def now(self) -> Array:
        """Where the platform truly is (4, 4)."""
        return np.asarray(self.driven.motion.pose)

    @property
    def readings(self) -> Array:
        """What the length sensors show (m,) in m, from power-up."""
        d = self.world.spec.model.drives
        return np.asarray((self.wiring.readings(self.driven) - self.first) * d.drum_radius / d.gear)

    def ahead(self, pose: Array) -> Array:
        """Tensions (m,) near the preferred one that hold the believed platform at a pose."""
        return np.asarray(closed_tension(self.believed, pose[None], self.world.spec.model.tensions.preferred_N)[0])

    def allows(self, pulls: Array) -> bool:
        """Whether tensions (m,) are within the limits of the controller."""
        low, high = self.world.spec.limits
        return bool(pulls.min() >= low and pulls.max() <= high)

    def send(self, robot: CableRobot) -> None:
        """Gives the running controller another robot, whose zeros are lengths at power-up; it goes over to that at its pace, at X_0."""
        self.believed = robot
        if self._running is None:
            return
        controller, state = self._running
        d = self.world.spec.model.drives
        zeros = robot.zeros - robot.gain * self.first * d.drum_radius / d.gear
        new = controller.change(Prepared(robot, method="mid"), zeros)
        seconds = float(np.abs(new.cables - state.now).max()) / MotionLimits().shift * new.period
        run = follow(new, state, self.plant, self.driven, self.home, seconds + SETTLE, wiring=self.wiring, every=EVERY)
        self._running = new, run.state
        self._note(run)

    def go(self, target: Array, name: str) -> tuple[Array, Array] | Stop:
        """Moves to a pose (4, 4): what sensors show (m,) and the tensions (m,) of the plant there, or why it stopped."""
        if not self.allows(self.ahead(target)):
            return Stop("infeasible", name)
        if self._running is None:
            try:
                self._running = _controller(self.world, self.believed).power_up(self.home, self.first)
            except ModelError:
                return Stop("infeasible", "X_0")
        controller, state = self._running
        run = follow(
            controller, state, self.plant, self.driven, target, LONGEST, wiring=self.wiring, settle=SETTLE, every=EVERY
        )
        self._running, self.moved = (controller, run.state), self.moved + 1
        self._note(run)
        if run.state.stop or not run.state.arrived:
            cable = run.state.cable
            return Stop(run.state.stop or "late", name, "" if cable is None else self.world.spec.cables[cable])
        return self.readings, self.driven.motion.tension

    def _note(self, run: Followed) -> None:
        """Keeps where a run ended, and what it was."""
        d = self.world.spec.model.drives
        self.driven, self.seconds = run.driven, self.seconds + run.seconds
        self.trail = (run.log.angles - self.first) * d.drum_radius / d.gear
        if len(run.log.tension):
            self.least = min(self.least, float(run.log.tension.min()))
            self.most = max(self.most, float(run.log.tension.max()))

    def record_list(self, poses: Array, stem: str, rng: np.random.Generator) -> Recording | Stop:
        """X_0, X_j, X_0 through poses (k, 4, 4); at every one what sensors, drives, camera and instrument say."""
        spec, said = self.world.spec, self.world.spec.model
        k, m = len(poses), len(spec.cables)
        ids = tuple(f"{stem}{i + 1:0{len(str(k))}d}" for i in range(k))
        true, shown, tension, time = np.empty((k, 4, 4)), np.empty((k, m)), np.empty((k, m)), np.empty(k)
        for i, (name, pose) in enumerate(zip(ids, poses, strict=True)):
            there = self.go(pose, name)
            if isinstance(there, Stop):
                return there
            shown[i], tension[i], true[i], time[i] = there[0], there[1], self.now, self.seconds
            back = self.go(self.home, f"{name} to X_0")
            if isinstance(back, Stop):
                return back
        world = self.world
        corners, images = self._look(true @ world.eye, rng)
        r = said.reference
        off = np.column_stack([
            rng.normal(scale=r.position_sigma, size=(k, 3)), rng.normal(scale=np.radians(r.angle_sigma), size=(k, 3))
        ])  # fmt: skip
        clock = r.clock_offset_s + (1 + r.clock_drift) * time
        told = np.abs(tension * (1 + rng.normal(scale=said.cable.tension_known_to, size=(k, m))))
        shown += rng.normal(scale=said.cable.length_noise, size=(k, m))
        reference = se3.displace(true, off[:, :3], off[:, 3:])
        return Recording(ids, poses, true, tension, told, shown, corners, reference, clock, images)

    def _look(self, cameras: Array, rng: np.random.Generator) -> tuple[Corners, tuple[NDArray[np.uint8], ...]]:
        """The corners that cameras T_base_camera (k, 4, 4) show, projected, or found in drawn images, and these."""
        world = self.world
        if self.draws:
            from robocal.session.commissioning.rig_images import photograph

            return photograph(world, cameras, rng, self.watch)
        camera = world.spec.model.camera
        seen = sightings(cameras, world.markers, world.edge, world.lens, camera.resolution, world.sight)
        noise = camera.corner_noise_px
        return tuple((s.view, s.marker, s.corners + rng.normal(scale=noise, size=(4, 2))) for s in seen), ()


def _controller(world: RigWorld, believed: CableRobot) -> PlatformController:
    """The controller of a believed robot."""
    d = world.spec.model.drives
    drums = Drums.of(np.full(len(believed.cables), d.drum_radius), d.gear)
    most = world.spec.limits[1] * d.drum_radius / d.gear
    # A motor of this inertia follows within 6 ms, its error is gone within 100 ms.
    stiff = d.inertia_kg_m2 / FOLLOWS
    loop = ControlLaw(stiff, stiff / FORGETS, limit=EFFORT * most)
    return platform_controller(Prepared(believed, method="mid"), drums, torque_limit=TORQUE * most, loop=loop)


FOLLOWS, FORGETS = 6e-3, 0.1  # s
TORQUE, EFFORT = (
    1.5,
    0.4,
)  # of the torque that the greatest tension asks for: what motors have, and what their loops add


def wiring_of(world: RigWorld, rng: np.random.Generator) -> Wiring:
    """What the drives of this rig are wired to; encoders count from anywhere."""
    wrong, m = world.spec.model.wrong, len(world.spec.cables)
    winch, sign, scale = np.arange(m), np.ones(m), np.ones(m)
    if wrong.swapped is not None:
        i, j = (c - 1 for c in wrong.swapped)
        winch[[i, j]] = winch[[j, i]]
    if wrong.reversed is not None:
        sign[wrong.reversed - 1] = scale[wrong.reversed - 1] = -1.0
    if wrong.half_count is not None:
        scale[wrong.half_count - 1] = 0.5
    zero = rng.uniform(-np.pi, np.pi, m)
    return Wiring(scale, zero, world.spec.model.drives.counts_per_turn, winch, sign)


def power_up(world: RigWorld, rng: np.random.Generator) -> tuple[RigMotion, CableFile]:
    """The rig switched on where it hangs: encoders count from there, and the controller takes that for X_0. Also the builder's file."""
    said = world.spec.model
    bare = read_robot(world, np.zeros(len(world.spec.cables))).robot
    home = bare.home
    there = start_of(world, home, rng)
    # Whoever hangs a platform pulls until every cable is taut.
    for more in range(10):
        pulls = closed_tension(world.true, there[None], (1 + 0.25 * more) * said.tensions.preferred_N)[0]
        if pulls.min() >= world.spec.limits[0]:
            break
    first = lengths_at(world.true, there, np.maximum(pulls, 0.0))
    if said.wrong.slack is not None:
        first[said.wrong.slack - 1] += said.wrong.slack_length
    file = read_robot(world, lengths_at(bare, home))
    d = said.drives
    limit = TORQUE * world.spec.limits[1] * d.drum_radius / d.gear
    winches = Winches(
        d.drum_radius, d.inertia_kg_m2, d.gear, coulomb=d.coulomb_N_m, viscous=d.viscous_N_m_s, limit=limit
    )
    plant = WinchPlant(plant_of(world.true, damping=said.cable.damping_N_s_m), winches, first)
    still = plant.still(there)
    # The platform comes to rest with all brakes on.
    braked = replace(plant, winches=replace(winches, inertia=BRAKE))
    driven = braked.run(still, np.zeros(len(first)), REST)
    driven = replace(driven, motors=np.zeros_like(driven.motors))
    return RigMotion(world, plant, wiring_of(world, rng), file.robot, driven), file


BRAKE, REST = 1e9, 3.0  # kg m2, as a brake holds; s

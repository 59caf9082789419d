"""A virtual rig at work: power-up, the motions of a list under the controller, and what is recorded at every pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.files.cable.cablefile import CableFile
from robocal.geometry import se3
from robocal.progress import Watch
from robocal.session.cable.rig_files import Corners, Recording
from robocal.session.cable.rig_world import RigWorld, closed_tension, lengths_at, read_robot, start_of
from robocal.simulation.cable_rig.floor_markers import sightings
from robocal.simulation.cable_rig.standstill import Wiring, stand_still

__all__ = ["RigMotion", "Stop", "power_up"]

PAUSE = 10.0  # s from pose to pose, on the clock of the controller


@record(eq=False)
class Stop:
    """Why a run was stopped: a word, the pose at which, and the cable that was seen."""

    word: str
    at: str
    cable: str = ""
    value: float = float("nan")


class RigMotion:
    """The rig under power: where it is, what its controller believes, and what the plant has seen of tensions.

    `believed` is the robot of the running controller; `now` (4, 4) is where the platform is; `least` and `most` are the tensions (N) of
    the plant so far. `draws`: whether images are drawn, and corners looked for in them. `added` (6,) is what the position loop adds at rest (N and N m), `commanded` (m,) the tensions that it asks for.
    """

    def __init__(self, world: RigWorld, wiring: Wiring, believed: CableRobot, home: Array, now: Array) -> None:
        self.world, self.wiring, self.believed, self.home, self.now = world, wiring, believed, home, now
        self.draws = False
        self.watch: Watch | None = None
        self.least, self.most, self.moved = np.inf, 0.0, 0
        self.added, self.commanded = np.zeros(6), np.zeros(len(world.spec.cables))

    def ahead(self, pose: Array) -> Array:
        """Tensions (m,) that the controller feeds forward at a pose."""
        return closed_tension(self.believed, pose[None], self.world.spec.said.tensions.preferred_N)[0]

    def allows(self, pulls: Array) -> bool:
        """Whether tensions (m,) are within the limits of the controller."""
        low, high = self.world.spec.limits
        return bool(pulls.min() >= low and pulls.max() <= high)

    def go(self, target: Array, name: str) -> tuple[Array, Array] | Stop:
        """Moves to a pose (4, 4): what sensors show (m,) and the tensions (m,) of the plant there, or why it stopped."""
        pulls = self.ahead(target)
        if not self.allows(pulls):
            return Stop("infeasible", name)
        found = stand_still(self.world.true, self.wiring, self.believed, target, pulls, target)
        if not found.found:
            return Stop("slack", name, self.world.spec.cables[int(found.tension.argmin())], float(found.tension.min()))
        self.now, self.moved = found.pose, self.moved + 1
        self.added, self.commanded = found.added, found.commanded
        self.least, self.most = min(self.least, float(found.tension.min())), max(self.most, float(found.tension.max()))
        return found.shown, found.tension

    def record_list(self, poses: Array, stem: str, rng: np.random.Generator) -> Recording | Stop:
        """X_0, X_j, X_0 through poses (k, 4, 4); at every one what sensors, drives, camera and instrument say."""
        spec, said = self.world.spec, self.world.spec.said
        k, m = len(poses), len(spec.cables)
        ids = tuple(f"{stem}{i + 1:0{len(str(k))}d}" for i in range(k))
        true, shown, tension = np.empty((k, 4, 4)), np.empty((k, m)), np.empty((k, m))
        for i, (name, pose) in enumerate(zip(ids, poses, strict=True)):
            there = self.go(pose, name)
            if isinstance(there, Stop):
                return there
            shown[i], tension[i], true[i] = there[0], there[1], self.now
            back = self.go(self.home, f"{name} to X_0")
            if isinstance(back, Stop):
                return back
        world = self.world
        corners, images = self._look(true @ world.eye, rng)
        r = said.reference
        off = np.column_stack([
            rng.normal(scale=r.position_sigma, size=(k, 3)), rng.normal(scale=np.radians(r.angle_sigma), size=(k, 3))
        ])  # fmt: skip
        clock = r.clock_offset_s + (1 + r.clock_drift) * PAUSE * np.arange(k)
        return Recording(
            ids, poses, true, tension, np.abs(tension * (1 + rng.normal(scale=said.cable.tension_known_to, size=(k, m)))),
            shown + rng.normal(scale=said.cable.length_noise, size=(k, m)), corners, se3.displace(true, off[:, :3], off[:, 3:]), clock, images,
        )  # fmt: skip

    def _look(self, cameras: Array, rng: np.random.Generator) -> tuple[Corners, tuple[NDArray[np.uint8], ...]]:
        """The corners that cameras T_base_camera (k, 4, 4) show, projected, or found in drawn images, and these."""
        world = self.world
        if self.draws:
            from robocal.session.cable.rig_images import photograph

            return photograph(world, cameras, rng, self.watch)
        camera = world.spec.said.camera
        seen = sightings(cameras, world.markers, world.edge, world.lens, camera.resolution, world.sight)
        noise = camera.corner_noise_px
        return tuple((s.view, s.marker, s.corners + rng.normal(scale=noise, size=(4, 2))) for s in seen), ()


def wiring_of(world: RigWorld, first: Array) -> Wiring:
    """What the drives of this rig are wired to."""
    wrong, m = world.spec.said.wrong, len(first)
    torque, counts = np.eye(m), np.eye(m)
    if wrong.swapped is not None:
        i, j = (c - 1 for c in wrong.swapped)
        torque[[i, j]] = torque[[j, i]]
        counts[[i, j]] = counts[[j, i]]
    if wrong.reversed is not None:
        i = wrong.reversed - 1
        torque[i, i] = counts[i, i] = -1.0
    if wrong.half_count is not None:
        counts[wrong.half_count - 1, wrong.half_count - 1] = 0.5
    return Wiring(torque, counts, first)


def power_up(world: RigWorld, rng: np.random.Generator) -> tuple[RigMotion, CableFile]:
    """The rig switched on where it hangs: encoders count from there, and the controller takes that for X_0. Also the builder's file."""
    bare = read_robot(world, np.zeros(len(world.spec.cables))).robot
    home = bare.home
    there = start_of(world, home, rng)
    preferred, least = world.spec.said.tensions.preferred_N, world.spec.limits[0]
    # Whoever hangs a platform pulls until every cable is taut.
    for more in range(10):
        pulls = closed_tension(world.true, there[None], (1 + 0.25 * more) * preferred)[0]
        if pulls.min() >= least:
            break
    first = lengths_at(world.true, there, np.maximum(pulls, 0.0))
    file = read_robot(world, lengths_at(bare, home))
    return RigMotion(world, wiring_of(world, first), file.robot, home, there), file

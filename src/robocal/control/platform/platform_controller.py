"""The controller of a platform on cables: a frozen record and one compiled, pure step a period.

    controller = platform_controller(prepared, drums)                # data: what it believes of the robot, and how it moves
    controller, state = controller.power_up(pose, angles)            # encoders have no zero: the pose at power-up gives it
    state, command = controller.step(state, goal, angles)            # once a period; command.torque (m,) winds cables in, N m
    state.stop, state.pose, state.arrived                            # why it stopped ("": it runs), believed pose (4, 4), at the goal

goal (4, 4): pose of the platform; angles (m,): angles of the motors in rad as encoders show them, growing as cable runs out. `tension`
(m,) in N are sensors in the loop, not a number where there is none. `controller.change(prepared)` gives new parameters to a running
controller: the state goes on with them, and no place moves by more than `shift` in a period. `simulation.platform.rig_run.follow` is the
compiled loop of controller and plant over many periods.

    L = wound(angle) + l0      pose by two steps of Gauss and Newton      v <- trapezoid of what is left      dL = J v
    torque = K_t t(pose) - PID(dL / r - dangle) + what the motor asks for at that angle

Sources: seed document, 2.4, 3.6 and 3.7.1; docs/cables/control.md has its corrections.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.cables.polytope._kernels import FOUND
from robocal.cables.prepared import Drums, Prepared
from robocal.cables.single._kernels import held, slopes
from robocal.control.pid import ControlLaw
from robocal.control.platform import _kernels as kernels
from robocal.control.trapezoid._kernels import LOGARITHM, PROJECTION
from robocal.errors import ModelError, look_up, require

__all__ = [
    "STOPS",
    "Command",
    "MotionLimits",
    "PlatformController",
    "PlatformState",
    "SafeLimits",
    "platform_controller",
]

ROTATIONS: Mapping[str, int] = MappingProxyType({"log": LOGARITHM, "projection": PROJECTION})
SPACES: Mapping[str, int] = MappingProxyType({"pose": kernels.POSE, "joints": kernels.JOINTS})
PATHS: Mapping[str, int] = MappingProxyType({"line": kernels.LINE, "axes": kernels.AXES})
# Why a controller stopped, by the word of its state.
STOPS: Mapping[int, str] = MappingProxyType({
    kernels.RUNNING: "", kernels.UNHELD: "no-tensions", kernels.LOST: "no-pose", kernels.UNMATCHED: "lengths-disagree",
    kernels.UNFOLLOWED: "motor-does-not-follow", kernels.LOW: "cable-slack", kernels.HIGH: "cable-overloaded",
    kernels.NO_TARGET: "no-such-goal",
})  # fmt: skip


@record
class MotionLimits:
    """How a platform moves: speed and acceleration (m/s, m/s2; rad/s, rad/s2), and the gain (1/s) of the loop near the goal, at most one
    per period. It stands once within `stop` (m; `turn_stop` rad) of its goal, and goes again beyond `go`.

    rotation "log" or "projection"; space "pose" or "joints"; path "line" or, each component by itself, "axes". shift: the most that a place
    or a length moves in a period as parameters change (m). Raises ModelError for what is none.
    """

    speed: float = 0.3
    acceleration: float = 0.5
    turn_speed: float = 0.5
    turn_acceleration: float = 1.0
    gain: float = 15.0
    stop: float = 1e-4
    go: float = 5e-4
    turn_stop: float = 3e-4
    turn_go: float = 1.5e-3
    rotation: str = "log"
    space: str = "pose"
    path: str = "line"
    shift: float = 1e-5

    def __post_init__(self) -> None:
        numbers = ("speed", "acceleration", "turn_speed", "turn_acceleration", "gain", "stop", "turn_stop", "shift")
        for key in numbers:
            value = getattr(self, key)
            require(value > 0, "not above zero", key=key, found=value, expected="above 0")
        for near, far in (("stop", "go"), ("turn_stop", "turn_go")):
            value, least = getattr(self, far), getattr(self, near)
            require(least <= value < math.inf, "no hysteresis", key=far, found=value, expected=f"{near} or more")
        for key, names in (("rotation", ROTATIONS), ("space", SPACES), ("path", PATHS)):
            look_up(names, getattr(self, key), f"unknown {key}", key)


@record
class SafeLimits:
    """Where a controller stops: rms of lengths that no pose explains (m), a motor's speed beside what was asked (rad/s), and tensions of
    sensors (N), the last two for longer than `patience` (s). Raises ModelError for what is none."""

    residual: float = 0.1
    follow: float = 20.0
    least: float = 0.0
    most: float = math.inf
    patience: float = 0.1

    def __post_init__(self) -> None:
        for key in ("residual", "follow", "most", "patience"):
            value = getattr(self, key)
            require(value > 0, "not above zero", key=key, found=value, expected="above 0")


class Command(NamedTuple):
    """What the winches are told: torques (m,) of the motors in N m that wind cable in, and whether brakes close."""

    torque: Array
    brake: bool


@record(eq=False)
class PlatformState:
    """What a controller remembers from one period to the next; its properties say what it means."""

    memory: Array
    now: Array
    drum: Array

    @property
    def pose(self) -> Array:
        """Where it believes the platform to be (4, 4)."""
        return self.memory[:16].reshape(4, 4).copy()

    @property
    def twist(self) -> Array:
        """The velocity (v, w) (6,) that it asks for, m/s and rad/s in base axes."""
        return self.memory[kernels.TWIST : kernels.TWIST + 6].copy()

    @property
    def left(self) -> tuple[float, float]:
        """What is left of the way, m and rad."""
        return float(self.memory[kernels.LEFT]), float(self.memory[kernels.LEFT_TURN])

    @property
    def arrived(self) -> bool:
        """Whether it stands at its goal."""
        memory = self.memory
        return not (memory[kernels.MOVING] or memory[kernels.TURNING] or memory[kernels.CODE])

    @property
    def stop(self) -> str:
        """Why it stopped, a word of STOPS; empty while it runs."""
        return STOPS[int(self.memory[kernels.CODE])]

    @property
    def cable(self) -> int | None:
        """The cable (from 0) for which it stopped, where it is one's."""
        which = int(self.memory[kernels.WHICH])
        return which if self.stop and which >= 0 else None

    @property
    def value(self) -> float:
        """The number for which it stopped: rms (m), speed (rad/s) or tension (N)."""
        return float(self.memory[kernels.VALUE])

    @property
    def residual(self) -> float:
        """Rms of what no pose explains of the lengths, m."""
        return float(self.memory[kernels.RMS])

    @property
    def tension(self) -> Array:
        """The tensions (m,) that it holds the platform with, N."""
        return self._each(kernels.TENSION)

    @property
    def stretch(self) -> Array:
        """What cables are longer (m,) by than at power-up, by their elasticity and `tension`, m: no encoder sees it."""
        return self._each(kernels.STRAIN)

    @property
    def unseen(self) -> Array:
        """How far (6,) the stretch that is not corrected moves the platform from where it is believed to be, m and rad."""
        m = len(self.drum)
        full, slope = np.empty(m), np.empty((m, 6))
        slopes(as_kernel_array(self.pose), self.now, full, slope)
        move = np.linalg.lstsq(slope, self.stretch - self._each(kernels.MEND), rcond=None)[0]
        return np.asarray(move)

    def _each(self, index: int) -> Array:
        return np.array(self.memory[kernels.MEMORY :].reshape(kernels.EACH, -1)[index])


@record(eq=False)
class PlatformController:
    """What a controller believes of a robot and how it moves it, as kernels read it; `platform_controller` makes one."""

    law: Array
    cables: Array
    rows: Ints
    body: Array
    bounds: Array
    winches: Array
    tables: Array

    @property
    def period(self) -> float:
        """In s."""
        return float(self.law[kernels.PERIOD])

    @property
    def zeros(self) -> Array:
        """Lengths (m,) of the cables at angle 0 of their motors, m."""
        return self.cables[: len(self.winches), 6].copy()

    def with_zeros(self, zeros: ArrayLike) -> PlatformController:
        """The same with other zeros (m,)."""
        cables = self.cables.copy()
        cables[: len(self.winches), 6] = zeros
        return replace(self, cables=cables)

    def change(self, prepared: Prepared, zeros: ArrayLike | None = None) -> PlatformController:
        """The same with new parameters of the robot, for a controller that runs: its state goes on with them. zeros (m,):
        lengths at angle 0 (None: as they are). Raises ModelError for another number of cables or of freedoms."""
        known = prepared.arrays
        _check(known.bounds, self.bounds.shape, "cables")
        _check(known.rows, self.rows.shape, "degrees")
        made = replace(self, cables=known.cables.copy(), body=known.body, bounds=known.bounds)
        return made.with_zeros(self.zeros if zeros is None else zeros)

    def power_up(self, pose: ArrayLike, angles: ArrayLike) -> tuple[PlatformController, PlatformState]:
        """The controller whose zeros make encoders (m,) that show `angles` at a pose (4, 4) right, and its first state.

        Raises ModelError where no tensions within the limits hold the platform there.
        """
        at, seen, m = as_kernel_array(pose), as_kernel_array(angles), len(self.winches)
        _check(at, (4, 4), "pose")
        _check(seen, (m,), "angles")
        full, slope, tension = np.empty(m), np.empty((m, 6)), np.empty(m)
        table = self.cables.copy()
        table[:, 6] = 0.0
        slopes(at, table, full, slope)
        drum = seen / self.winches[:, 2]
        table[:m, 6] = full - drum * (self.winches[:, 0] + 0.5 * self.winches[:, 1] * drum)
        choice = self.bounds, int(self.law[kernels.METHOD]), float(self.law[kernels.POWER])
        code = held(at, np.zeros(6), table, self.rows, self.body, *choice, tension)
        require(code == FOUND, "no tensions within the limits hold the platform at this pose", key="pose", found=pose)
        memory = np.zeros(kernels.MEMORY + kernels.EACH * m)
        memory[:16], memory[kernels.WHICH] = at.ravel(), -1.0
        each = memory[kernels.MEMORY :].reshape(kernels.EACH, m)
        each[kernels.ANGLE], each[kernels.TENSION] = seen, tension
        each[kernels.FIRST] = self.winches[:, 5] * tension * full
        return replace(self, cables=table), PlatformState(memory, table.copy(), self.winches.copy())

    def step(
        self, state: PlatformState, goal: ArrayLike, angles: ArrayLike, tension: ArrayLike | None = None
    ) -> tuple[PlatformState, Command]:
        """The state one period later, and what the winches are told. Raises ModelError for arrays of another shape."""
        m = len(self.winches)
        seen, target = as_kernel_array(angles), as_kernel_array(goal)
        sensed = np.full(m, math.nan) if tension is None else as_kernel_array(tension)
        _check(target, (4, 4), "goal")
        _check(seen, (m,), "angles")
        _check(sensed, (m,), "tension")
        new = PlatformState(state.memory.copy(), state.now.copy(), state.drum.copy())
        torque = np.empty(m)
        kernels.control_step(*self.arrays, target, seen, sensed, new.now, new.drum, new.memory, torque)
        return new, Command(torque, bool(new.memory[kernels.CODE] in BRAKED))

    @property
    def arrays(self) -> tuple[Array, Array, Ints, Array, Array, Array, Array]:
        """What the kernel reads, in its order."""
        return self.law, self.cables, self.rows, self.body, self.bounds, self.winches, self.tables


BRAKED = (kernels.LOST, kernels.UNMATCHED, kernels.UNFOLLOWED)


def platform_controller(
    prepared: Prepared,
    drums: Drums,
    *,
    growth: ArrayLike = 0.0,
    torque_limit: ArrayLike = math.inf,
    motion: MotionLimits | None = None,
    loop: ControlLaw | None = None,
    safe: SafeLimits | None = None,
    tables: Array | None = None,
    speed_filter: float = 2e-3,
    correct_stretch: bool = False,
) -> PlatformController:
    """The controller of a prepared robot and its drums. growth (m,) of drums in m/rad, torque_limit (m,) of motors in N m.

    loop: gains of the velocity loop of every motor (N m s/rad and so on), its period and largest effort; tables (2, m, k + 1): what motors
    ask for over a turn as cable runs out and in, N m, the first entry again at the end. Raises ModelError for numbers that none has.
    """
    move, guard = motion or MotionLimits(), safe or SafeLimits()
    law = loop or ControlLaw(0.05, 0.5, 0.0, limit=0.2)
    known = prepared.arrays
    m = known.bounds.shape[1]
    columns = [drums.radius, growth, drums.gear, drums.gain, torque_limit, known.elasticity]
    winches = np.column_stack([np.broadcast_to(np.asarray(c, float), m) for c in columns])
    curves = np.zeros((2, m, 1)) if tables is None else np.asarray(tables, float)
    _check(curves, (2, m, curves.shape[-1]), "tables")
    numbers = np.zeros(kernels.LAW)
    for key, value in {
        kernels.PERIOD: law.period, kernels.SPEED: move.speed, kernels.ACCELERATION: move.acceleration,
        kernels.TURN_SPEED: move.turn_speed, kernels.TURN_ACCELERATION: move.turn_acceleration, kernels.LOOP: move.gain,
        kernels.STOP: move.stop, kernels.GO: move.go, kernels.TURN_STOP: move.turn_stop, kernels.TURN_GO: move.turn_go,
        kernels.ROTATION: ROTATIONS[move.rotation], kernels.SPACE: SPACES[move.space], kernels.PATH: PATHS[move.path],
        kernels.KP: law.kp, kernels.KI: law.ki, kernels.KD: law.kd, kernels.FILTER: law.filter_time, kernels.EFFORT: law.limit,
        kernels.SPEED_FILTER: speed_filter, kernels.METHOD: known.method, kernels.POWER: known.power, kernels.SHIFT: move.shift,
        kernels.RESIDUAL: guard.residual, kernels.FOLLOW: guard.follow, kernels.LEAST: guard.least, kernels.MOST: guard.most,
        kernels.PATIENCE: guard.patience, kernels.STRETCH: float(correct_stretch), kernels.BLEND: SLOW,
    }.items():  # fmt: skip
        numbers[key] = value
    return PlatformController(
        as_kernel_array(numbers), known.cables.copy(), known.rows, known.body, known.bounds, as_kernel_array(winches),
        as_kernel_array(curves),
    )  # fmt: skip


SLOW = 0.1  # tolerance: rad/s of a motor; slower than this its direction is not sure, and tables of both are blended


def _check(array: Array | Ints, shape: tuple[int, ...], key: str) -> None:
    """Raises ModelError for an array of another shape, of which a kernel would read beyond the end."""
    if array.shape != shape:
        raise ModelError("an array of another shape", key=key, found=array.shape, expected=shape)

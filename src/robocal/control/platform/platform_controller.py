"""The controller of a platform on cables: a frozen record and one compiled, pure step a period.

    controller = platform_controller(prepared, drums)                # data: what it believes of the robot, and how it moves
    controller, state = controller.power_up(pose, angles)            # encoders have no zero: the pose at power-up gives it
    state, command = controller.step(state, goal, angles)            # once a period; command.torque (m,) winds cables in, N m
    state.stop, state.pose, state.arrived                            # why it stopped ("": it runs), believed pose (4, 4), at the goal

goal (4, 4): pose of the platform; angles (m,): angles of the motors in rad as encoders show them, growing as cable runs out. `tension`
(m,) in N are sensors in the loop, not a number where there is none: what only strains the platform is regulated towards them, and they stop
it. `controller.change(prepared)` gives new parameters to a running controller: the state goes on with them, and no place moves by more
than `shift` in a period. `simulation.platform.rig_run.follow` is the compiled loop of controller and plant over many periods.

    L = wound(angle) + l0      pose by two steps of Gauss and Newton      v <- trapezoid of what is left      dL = J v
    torque = K_t (t(pose) + trim) - PID(dL / r - dangle) + what the motor asks for at that angle

Sources: seed document, 2.4, 3.6 and 3.7.1; docs/cables/control.md has its corrections.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.cables.polytope._kernels import FOUND
from robocal.cables.prepared import Drums, Prepared, PreparedArrays
from robocal.cables.single._kernels import held, rigid, slopes
from robocal.control.layout import _kernels as layout
from robocal.control.pid import ControlLaw
from robocal.control.platform._kernels import control_step
from robocal.control.platform.platform_limits import PATHS, ROTATIONS, SPACES, MotionLimits, SafeLimits
from robocal.control.platform.platform_state import STOPS, PlatformState
from robocal.errors import ModelError, require

__all__ = [
    "STOPS", "Command", "MotionLimits", "PlatformController", "PlatformState", "SafeLimits", "platform_controller",
]  # fmt: skip

BRAKED = (layout.LOST, layout.UNMATCHED, layout.UNFOLLOWED)
SLOW = 0.1  # tolerance: rad/s of a motor; slower than this its direction is not sure, and tables of both are blended
LAYS = slice(11, 14)  # of a segment: how it lies on others


class Command(NamedTuple):
    """What the winches are told: torques (m,) of the motors in N m that wind cable in, and whether brakes close."""

    torque: Array
    brake: bool


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
    drums: Drums
    growth: Array
    safe: SafeLimits

    @property
    def period(self) -> float:
        """In s."""
        return float(self.law[layout.PERIOD])

    @property
    def zeros(self) -> Array:
        """Lengths (m,) of the cables at angle 0 of their motors, m."""
        return self.cables[: len(self.winches), 6].copy()

    def with_zeros(self, zeros: ArrayLike) -> PlatformController:
        """The same with other zeros (m,). Raises ModelError for what is none."""
        cables = self.cables.copy()
        cables[: len(self.winches), 6] = _numbers(zeros, (len(self.winches),), "zeros")
        return replace(self, cables=cables)

    def change(self, prepared: Prepared, zeros: ArrayLike | None = None) -> PlatformController:
        """The same with new parameters of the robot, for a controller that runs: its state goes on with them. zeros (m,):
        lengths at angle 0 (None: as they are). Raises ModelError for another number of cables or of freedoms, and as
        `platform_controller` does."""
        known = _arrays(prepared)
        _check(known.bounds.shape[1:], self.bounds.shape[1:], "cables")
        _check(known.rows.shape, self.rows.shape, "degrees")
        _check(known.cables.shape, self.cables.shape, "segments")
        same = bool((known.rows == self.rows).all() and (known.cables[:, LAYS] == self.cables[:, LAYS]).all())
        require(
            same,
            "a robot of another kind",
            key="degrees",
            found=prepared.robot.name,
            expected="the same freedoms and segments",
        )
        stretches = self.law[layout.STRETCH] == 0 or bool((known.elasticity > 0).all())
        require(
            stretches, NO_STRETCH, key="elasticity", found=prepared.robot.name, expected="an elasticity of every cable"
        )
        winches = _winches(prepared, self.drums, self.growth, self.winches[:, 4])
        bounds = _bounds(known, winches, self.safe)
        made = replace(self, cables=known.cables.copy(), body=known.body, bounds=bounds, winches=winches)
        return made.with_zeros(self.zeros if zeros is None else zeros)

    def power_up(
        self, pose: ArrayLike, angles: ArrayLike, tension: ArrayLike | None = None
    ) -> tuple[PlatformController, PlatformState]:
        """The controller whose zeros make encoders (m,) that show `angles` at a pose (4, 4) right, and its first state; tension (m,) as
        in `step`.

        Raises ModelError where no tensions within the limits hold the platform there, and for what is no pose or no angle.
        """
        m = len(self.winches)
        at, seen = _numbers(pose, (4, 4), "pose"), _numbers(angles, (m,), "angles")
        sensed = self._sensed(tension)
        require(rigid(at), "no rigid motion", key="pose", found=at.tolist(), expected="a pose (4, 4)")
        full, slope, pull = np.empty(m), np.empty((m, 6)), np.empty(m)
        table = self.cables.copy()
        table[:, 6] = 0.0
        slopes(at, table, full, slope)
        drum = seen / self.winches[:, 2]
        table[:m, 6] = full - drum * (self.winches[:, 0] + 0.5 * self.winches[:, 1] * drum)
        choice = self.bounds, int(self.law[layout.METHOD]), float(self.law[layout.POWER])
        code = held(at, np.zeros(6), table, self.rows, self.body, *choice, pull)
        require(code == FOUND, "no tensions within the limits hold the platform at this pose", key="pose", found=pose)
        free = slope[:, self.rows]
        spans = np.linalg.matrix_rank(free) == len(self.rows)
        require(
            spans,
            "cables do not say where the platform is at this pose",
            key="pose",
            found=at.tolist(),
            expected="a pose that is not singular",
        )
        memory = np.zeros(layout.MEMORY + layout.EACH * m)
        memory[:16], memory[layout.WHICH] = at.ravel(), -1.0
        each = memory[layout.MEMORY :].reshape(layout.EACH, m)
        each[layout.ANGLE], each[layout.TENSION] = seen, pull
        each[layout.FIRST] = np.where(np.isfinite(sensed), sensed, pull) * full
        return replace(self, cables=table), PlatformState(memory, table.copy(), self.winches.copy(), self.rows)

    def step(
        self, state: PlatformState, goal: ArrayLike, angles: ArrayLike, tension: ArrayLike | None = None
    ) -> tuple[PlatformState, Command]:
        """The state one period later, and what the winches are told. Raises ModelError for arrays of another shape."""
        m = len(self.winches)
        seen, target, sensed = _array(angles, (m,), "angles"), _array(goal, (4, 4), "goal"), self._sensed(tension)
        self.check_state(state)
        new, torque = state.copy(), np.empty(m)
        control_step(*self.arrays, target, seen, sensed, new.now, new.drum, new.memory, torque)
        return new, Command(torque, bool(new.memory[layout.CODE] in BRAKED))

    def check_state(self, state: PlatformState) -> None:
        """Raises ModelError for the state of another robot, of which a kernel would read beyond the end."""
        _check(state.now.shape, self.cables.shape, "state")
        _check(state.drum.shape, self.winches.shape, "state")
        _check(state.memory.shape, (layout.MEMORY + layout.EACH * len(self.winches),), "state")

    def _sensed(self, tension: ArrayLike | None) -> Array:
        """Readings (m,) of sensors in N, not numbers where there is none."""
        m = len(self.winches)
        return np.full(m, math.nan) if tension is None else _array(tension, (m,), "tension")

    @property
    def arrays(self) -> tuple[Array, Array, Ints, Array, Array, Array, Array]:
        """What the kernel reads, in its order."""
        return self.law, self.cables, self.rows, self.body, self.bounds, self.winches, self.tables


def platform_controller(
    prepared: Prepared,
    drums: Drums,
    *,
    growth: ArrayLike = 0.0,
    torque_limit: ArrayLike = math.inf,
    motion: MotionLimits | None = None,
    loop: ControlLaw | None = None,
    safe: SafeLimits | None = None,
    tables: ArrayLike | None = None,
    speed_filter: float = 2e-3,
    tension_time: float = 0.3,
    correct_stretch: bool = False,
) -> PlatformController:
    """The controller of a prepared robot and its drums. growth (m,) of drums in m/rad, torque_limit (m,) of motors in N m.

    loop: gains of the velocity loop of every motor (N m s/rad and so on), its period and largest effort; tables (2, m, k + 1): what motors
    ask for over a turn as cable runs out and in, N m, the first entry again at the end. tension_time (s): in which tensions go to what
    sensors should show (inf: sensors only stop it). A gain of the robot's drums enlarges these.

    Raises ModelError for numbers that none has, for cables that sag, for motors that are too weak for the robot's limits, and for stretch
    of an elasticity that nobody knows.
    """
    move, guard = motion or MotionLimits(), safe or SafeLimits()
    law = loop or ControlLaw(0.05, 0.5, 0.0, limit=0.2)
    known = _arrays(prepared)
    m = known.bounds.shape[1]
    require(law.kp > 0, "a loop that does nothing", key="kp", found=law.kp, expected="above 0")
    for key, value in (("period", law.period), ("speed_filter", speed_filter)):
        good = 0 <= value < math.inf
        require(good, "no such time", key=key, found=value, expected="seconds")
    require(tension_time > 0, "no such time", key="tension_time", found=tension_time, expected="above 0 s")
    stretches = not correct_stretch or bool((known.elasticity > 0).all())
    require(stretches, NO_STRETCH, key="elasticity", found=prepared.robot.name, expected="an elasticity of every cable")
    winches = _winches(prepared, drums, growth, torque_limit)
    numbers = np.zeros(layout.LAW)
    for place, number in {
        layout.PERIOD: law.period, layout.SPEED: move.speed, layout.ACCELERATION: move.acceleration,
        layout.TURN_SPEED: move.turn_speed, layout.TURN_ACCELERATION: move.turn_acceleration, layout.LOOP: move.gain,
        layout.STOP: move.stop, layout.GO: move.go, layout.TURN_STOP: move.turn_stop, layout.TURN_GO: move.turn_go,
        layout.ROTATION: ROTATIONS[move.rotation], layout.SPACE: SPACES[move.space], layout.PATH: PATHS[move.path],
        layout.KP: law.kp, layout.KI: law.ki, layout.KD: law.kd, layout.FILTER: law.filter_time, layout.EFFORT: law.limit,
        layout.SPEED_FILTER: speed_filter, layout.METHOD: known.method, layout.POWER: known.power, layout.SHIFT: move.shift,
        layout.RESIDUAL: guard.residual, layout.FOLLOW: guard.follow, layout.TENSION_TIME: tension_time,
        layout.PATIENCE: guard.patience, layout.STRETCH: float(correct_stretch), layout.BLEND: SLOW,
    }.items():  # fmt: skip
        numbers[place] = number
    return PlatformController(
        as_kernel_array(numbers), known.cables.copy(), known.rows, known.body, _bounds(known, winches, guard), winches,
        _tables(tables, m), drums, _each("growth", growth, m), guard,
    )  # fmt: skip


NO_STRETCH = "stretch is to be corrected, and no elasticity is known"


def _arrays(prepared: Prepared) -> PreparedArrays:
    """What kernels read of a robot. Raises ModelError for cables that sag: the step takes them for straight."""
    density = prepared.robot.density
    straight = density is None or not np.any(np.asarray(density) > 0)
    require(
        straight,
        "a controller takes cables for straight",
        key="density",
        found=prepared.robot.name,
        expected="a robot without density",
    )
    return prepared.arrays


def _winches(prepared: Prepared, drums: Drums, growth: ArrayLike, torque_limit: ArrayLike) -> Array:
    """Winches (m, 6) as kernels read them; a gain of the robot's drums enlarges radius, growth and K_t alike."""
    m, gain = len(prepared.robot.cables), prepared.robot.gain
    radius, gear, pull = (
        _each(key, v, m) for key, v in (("radius", drums.radius), ("gear", drums.gear), ("gain", drums.gain))
    )
    layers, limit = _each("growth", growth, m), _each("torque_limit", torque_limit, m)
    require(bool(np.isfinite(layers).all()), "no such growth", key="growth", found=layers.tolist(), expected="m/rad")
    require(bool((limit > 0).all()), "no such torque", key="torque_limit", found=limit.tolist(), expected="above 0 N m")
    elasticity = prepared.arrays.elasticity
    return as_kernel_array(np.column_stack([gain * radius, gain * layers, gear, gain * pull, limit, elasticity]))


def _bounds(known: PreparedArrays, winches: Array, safe: SafeLimits) -> Array:
    """Tensions (BOUNDS, m): those planned, and those at which sensors stop it. Raises ModelError where motors cannot pull the greatest."""
    low, high = known.bounds[layout.LEAST], known.bounds[layout.MOST]
    able = winches[:, 4] / winches[:, 3]
    weak = int(np.argmin(able - high))
    expected = f"at most {able[weak]:.4g} N, or a larger torque_limit"
    require(
        able[weak] >= high[weak],
        "a motor cannot pull the greatest tension of its cable",
        key="limits",
        found=high[weak],
        expected=expected,
    )
    slack = 0.5 * low if safe.least is None else np.full(len(low), safe.least)
    overload = high + 0.5 * low if safe.most is None else np.full(len(low), safe.most)
    return as_kernel_array(np.vstack([known.bounds, slack, overload]))


def _tables(given: ArrayLike | None, m: int) -> Array:
    """What motors ask for over a turn (2, m, k + 1), N m. Raises ModelError for what is none."""
    if given is None:
        return np.zeros((2, m, 1))
    size = np.shape(given)[-1:]
    curves = _numbers(given, (2, m, *(size or (2,))), "tables")
    whole = curves.shape[2] > 1 and bool(
        np.allclose(curves[..., 0], curves[..., -1], rtol=0, atol=1e-6 * np.abs(curves).max() + 1e-12)
    )
    require(
        whole,
        "a table of a whole turn has its first entry again at the end",
        key="tables",
        found=curves[..., [0, -1]].tolist(),
    )
    return curves


def _each(key: str, given: ArrayLike, m: int) -> Array:
    """A number of every cable (m,). Raises ModelError for another count."""
    values = np.asarray(given, float)
    require(
        values.shape in ((), (m,)), "a number of every cable, or one of all", key=key, found=values.shape, expected=(m,)
    )
    return np.broadcast_to(values, m)


def _array(given: ArrayLike, shape: tuple[int, ...], key: str) -> Array:
    """An array as kernels read it. Raises ModelError for another shape, of which a kernel would read beyond the end."""
    try:
        array = as_kernel_array(given)
    except (TypeError, ValueError):
        raise ModelError("these are no numbers", key=key, found=type(given).__name__, expected=shape) from None
    _check(array.shape, shape, key)
    return array


def _numbers(given: ArrayLike, shape: tuple[int, ...], key: str) -> Array:
    """The same, of finite numbers."""
    array = _array(given, shape, key)
    require(bool(np.isfinite(array).all()), "these are no finite numbers", key=key, found=array.tolist())
    return array


def _check(found: tuple[int, ...], expected: tuple[int, ...], key: str) -> None:
    """Raises ModelError for an array of another shape."""
    if found != expected:
        raise ModelError("an array of another shape", key=key, found=found, expected=expected)

"""A cable robot whose numbers are checked once, for loops that ask one pose a thousand times a second.

    tension   t with W t + w = 0 within the limits        forward   the pose whose lengths are those that were read
    twist     L^+ dl/dt                                   torque    K_t t = r t / (g eta)

Nothing that a pose, a length or a load can be raises, a pose that is no rigid motion neither: what was found says so itself. The
searches are those of `cables.tension.distribute` and `cables.forward.forward`, one pose at a time without a detour.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array, as_kernel_indices
from robocal._types import Array, Ints
from robocal.cables.geometry import CableRobot
from robocal.cables.polytope._kernels import FOUND
from robocal.cables.segment_table import cable_table
from robocal.cables.single import _kernels as kernels
from robocal.cables.tension import check_method, distribute
from robocal.cables.tension_choice import METHOD, POWER
from robocal.errors import ModelError, require
from robocal.geometry.gravity import GRAVITY

__all__ = ["Drums", "Placed", "Prepared", "PreparedArrays", "TensionResult"]

KINDS = {
    "norm": kernels.NEAREST,
    "mid": kernels.NEAREST,
    "closed": kernels.CLOSED,
    "barycentre": kernels.CENTRE,
    "p-norm": kernels.POWER,
}
CENTRED = 2  # redundant cables of which the barycentre is worked out


def _numbers(given: object, key: str) -> Array:
    """An array of real numbers. Raises ModelError for what is none."""
    try:
        return np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise ModelError("these are no numbers", key=key, found=given, expected="numbers") from None


class TensionResult(NamedTuple):
    """Tensions (m,) in N, not numbers where there are none, and whether there are."""

    tension: Array
    feasible: bool


class Placed(NamedTuple):
    """A pose (4, 4), residuals (m,) in m (computed less read), covariance (d, d) of the twist's components that the robot has (m and
    rad), iterations, and whether the search came to its end; not numbers where no cable can be so."""

    pose: Array
    residual: Array
    covariance: Array
    iterations: int
    converged: bool


class PreparedArrays(NamedTuple):
    """What kernels read of a prepared robot: segments (p, 14), freedoms (d,), newtons and centre of the weight (4,), least, greatest and
    reference tensions (3, m), elasticity (m,) in 1/N (0: not known), and the method of the distribution with its power."""

    cables: Array
    rows: Ints
    body: Array
    bounds: Array
    elasticity: Array
    method: int
    power: float


class Drums(NamedTuple):
    """What winds a cable up: radius (m,) in m with the cable that lies on it, gear (m,), turns of the motor per turn of the drum, and
    efficiency (m,) of the gear as it pulls."""

    radius: Array
    gear: Array
    efficiency: Array

    @classmethod
    def of(cls, radius: ArrayLike, gear: ArrayLike = 1.0, efficiency: ArrayLike = 1.0) -> Drums:
        """Drums from numbers of each cable or of all. Raises ModelError for a radius, a gear or an efficiency that is not above 0, for an
        efficiency above 1, and for different numbers of cables."""
        given = [_numbers(v, name) for v, name in zip((radius, gear, efficiency), cls._fields, strict=True)]
        sizes = {v.shape for v in given if v.ndim}
        alike, key = len(sizes) <= 1 and all(len(shape) == 1 for shape in sizes), ", ".join(cls._fields)
        shapes, expected = [v.shape for v in given], "one number, or one of each cable"
        require(alike, "drums of as many cables each", key=key, found=shapes, expected=expected)
        values = dict(zip(cls._fields, np.broadcast_arrays(*given), strict=True))
        for name, value in values.items():
            possible = ((value > 0) & (value <= 1.0 if name == "efficiency" else value < np.inf)).all()
            require(possible, f"a drum has no such {name}", key=name, found=value.tolist(), expected="above 0")
        return cls(*(np.array(v) for v in values.values()))

    @property
    def gain(self) -> Array:
        """K_t (m,) in m: torque of the motor per tension, r / (g eta)."""
        return self.radius / (self.gear * self.efficiency)

    def torque(self, tension: ArrayLike) -> Array:
        """Torques (..., m) of the motors in N m that hold tensions (..., m) in N. Raises ModelError for other cables."""
        held, gain = _numbers(tension, "tension"), self.gain
        fits = not np.ndim(gain) or held.shape[-1:] == gain.shape
        require(fits, "an array of another shape", key="tension", found=held.shape, expected=gain.shape)
        return np.asarray(gain * held)


class Prepared:
    """A robot, a platform's weight, limits and a method, entered into kernels once.

    `sigma` is the noise of a length in m (None: residuals say it). Raises ModelError where mass or limits are unknown, for limits that
    are none, an unknown method, or fewer cables than freedoms. Cables are straight or over pulleys, without stretch and sag.
    """

    def __init__(
        self,
        robot: CableRobot,
        *,
        mass: float | None = None,
        com: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        method: str = METHOD,
        power: float = POWER,
        sigma: float | None = None,
    ) -> None:
        m, d = len(robot.cables), len(robot.axes)
        few = f"{m} cables for {d}"
        require(m >= d, "fewer cables than degrees of freedom", found=few, expected=f"at least {d}")
        check_method(str(method))
        bounds = _numbers(robot.need("limits") if limits is None else limits, "limits")
        weight = _numbers(robot.need("mass") if mass is None else mass, "mass")
        centre = _numbers(robot.com if com is None else com, "com")
        noise = _numbers(0.0 if sigma is None else sigma, "sigma")
        expected = "finite, sigma above 0"
        if weight.shape or noise.shape or not (0 <= weight < np.inf and (sigma is None or 0 < noise < np.inf)):
            raise ModelError("no such mass or noise", key="mass, sigma", found=(mass, sigma), expected=expected)
        place = centre.shape == (3,) and np.isfinite(centre).all()  # a kernel would read beyond its end
        expected = "three finite numbers, m"
        require(place, "no such centre of mass", key="com", found=centre.tolist(), expected=expected)
        # One pose through the door that checks limits, power and method.
        distribute(np.zeros((1, d, m)), np.zeros(d), bounds, "norm" if method == "barycentre" else method, power)
        central, why = method != "barycentre" or m - d <= CENTRED, "the barycentre is of at most two redundant cables"
        require(central, why, key="method", found=f"{m} cables for {d} freedoms")
        reference = np.zeros(m) if method == "norm" else bounds.mean(axis=1)
        self.robot, self.method = robot, method
        self._cables = as_kernel_array(cable_table(robot))
        self._rows, self._gain = as_kernel_indices(np.array(robot.axes)), as_kernel_array(robot.gain)
        expected = "a robot without build_up; robocal cable forward has them"
        require(
            not robot.states_build_up,
            "drums that grow with every turn",
            key=f"{robot.cables[0]}.build_up",
            expected=expected,
        )
        self._body = as_kernel_array(np.concatenate([[-weight * GRAVITY[2]], centre]))
        self._bounds = as_kernel_array(np.stack([bounds[:, 0], bounds[:, 1], reference]))
        self._kind, self._power, self._sigma = (
            KINDS[method],
            float(power),
            float(noise) * float(np.sqrt((robot.gain**2).mean())),
        )
        self._still, self._cable_count, self._freedoms = np.zeros(6), m, d

    @property
    def arrays(self) -> PreparedArrays:
        """What a compiled loop reads of it."""
        known = self.robot.elasticity
        strain = np.zeros(self._cable_count) if known is None else np.broadcast_to(known, self._cable_count).copy()
        return PreparedArrays(self._cables, self._rows, self._body, self._bounds, strain, self._kind, self._power)

    def tension(self, pose: Array, wrench: Array | None = None) -> TensionResult:
        """Tensions within the limits that hold the platform at a pose (4, 4), with a wrench (6,), N and N m, beside its weight."""
        pose = self._check_shape(pose, (4, 4))
        load = self._still if wrench is None else self._check_shape(wrench, (6,))
        out = np.empty(self._cable_count)
        choice = self._bounds, self._kind, self._power
        code = kernels.held(pose, load, self._cables, self._rows, self._body, *choice, out)
        return TensionResult(out, code == FOUND)

    def forward(self, lengths: Array, start: Array) -> Placed:
        """The pose that sensors of lengths (m,) in m say, from the pose (4, 4) before it."""
        y, begin = self._check_shape(lengths, (self._cable_count,)), self._check_shape(start, (4, 4))
        pose, r, c = np.empty((4, 4)), np.empty(self._cable_count), np.empty((self._freedoms, self._freedoms))
        code, count = kernels.placed(self._gain * y, begin, self._cables, self._rows, self._sigma, pose, r, c)
        return Placed(pose, r / self._gain, c, count, code == kernels.SETTLED)

    def twist(self, pose: Array, rates: Array) -> Array:
        """The twist (6,) as (v, w) in m/s and rad/s, base axes about the platform's origin, with which what sensors show grows
        by rates (m,) in m/s; not numbers where the pose is singular."""
        at, wound = self._check_shape(pose, (4, 4)), self._check_shape(rates, (self._cable_count,))
        out = np.empty(6)
        kernels.turned(at, self._gain * wound, self._cables, self._rows, out)
        return out

    @staticmethod
    def _check_shape(array: Array, shape: tuple[int, ...]) -> Array:
        try:
            given = as_kernel_array(array)
        except (TypeError, ValueError):
            raise ModelError("these are no numbers", found=type(array).__name__, expected=f"an array {shape}") from None
        # A kernel would read beyond its end.
        require(given.shape == shape, "an array of another shape", found=given.shape, expected=shape)
        return given

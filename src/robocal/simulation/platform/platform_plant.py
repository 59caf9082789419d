"""A platform on elastic cables that moves as masses do: Newton and Euler on SO(3), gravity, and cables that only pull.

    t = max(0, EA (l / rest - 1) + c (dl/dt - d rest/dt))
    m dv/dt = sum t u + m g + f        dL/dt = sum (R b) x t u + n        dR/dt = [omega]_x R,  omega = R I^-1 R^T L

l and u are length and direction of a straight cable, b its end on the platform from the centre of mass, L the angular momentum about that.
The sum of spring and damper is clipped, so that a force has no step where a cable becomes taut. `verlet` is velocity Verlet: order 2, a
free platform keeps its angular momentum to the last digit, and without dampers the energy does not drift. `runge-kutta` is the
classical method of order 4, for reference.

Sources: Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), I.1 and VII.5; Dullweber, Leimkuhler and McLachlan (1997).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.single._kernels import rigid
from robocal.errors import ModelError, look_up, require
from robocal.geometry import se3, so3
from robocal.geometry.gravity import GRAVITY
from robocal.simulation.platform._kernels import runge_kutta, verlet

__all__ = ["METHODS", "STIFF", "Motion", "PlatformPlant", "box_inertia", "each_number", "plant_of"]

METHODS: Mapping[str, Callable[..., None]] = MappingProxyType({"verlet": verlet, "runge-kutta": runge_kutta})
STIFF = 2.0  # tolerance: of a step times the fastest vibration; beyond, Verlet's steps grow without bound


@record(eq=False)
class Motion:
    """How a platform moves: pose (4, 4) of its frame, velocity (3,) of its centre of mass (m/s) and angular momentum (3,) about it
    (kg m2/s), both in base axes; unstretched lengths rest (m,) in m and tensions (m,) in N."""

    pose: Array
    velocity: Array
    momentum: Array
    rest: Array
    tension: Array


@record(eq=False)
class PlatformPlant:
    """Numbers of a platform as kernels read them: cables (m, 5), body (m + 2, 3), components that it can follow (6,), its weight (6,) with
    no moment; where its centre of mass is (3,), and how its principal axes are turned (3, 3), in platform axes."""

    cables: Array
    body: Array
    free: Array
    weight: Array
    centre: Array
    axes: Array

    @property
    def mass(self) -> float:
        """In kg."""
        return float(self.body[-1, 0])

    @property
    def inertia(self) -> Array:
        """Moments of inertia (3,) about its principal axes in kg m2."""
        return np.asarray(self.body[-2])

    def still(self, pose: ArrayLike, rest: ArrayLike) -> Motion:
        """At rest at a pose (4, 4) with unstretched lengths (m,) in m. Raises ModelError for lengths that no cable has."""
        length, at, zero = (
            each_number("rest", rest, len(self.cables), "above 0").copy(),
            as_kernel_array(pose),
            np.zeros(3),
        )
        require(
            at.shape == (4, 4) and rigid(at), "no rigid motion", key="pose", found=at.tolist(), expected="a pose (4, 4)"
        )
        return self.run(Motion(at.copy(), zero, zero, length, 0 * length), 0.0, 1.0)

    def run(
        self,
        motion: Motion,
        seconds: float,
        step: float = 1e-3,
        *,
        speed: ArrayLike = 0.0,
        load: ArrayLike = 0.0,
        method: str = "verlet",
    ) -> Motion:
        """The motion so many `seconds` later, in steps of at most `step` (s). speed (m,): rates of the unstretched lengths in
        m/s; load (6,): force and moment about the centre of mass beside the weight, N and N m in base axes.

        Raises ModelError for an unknown method, for no such times, and for a step in which the fastest vibration turns by more than
        2 rad.
        """
        go = look_up(METHODS, method, "unknown method", "method")
        steps = self.steps(motion.rest, seconds, step)
        period = seconds / steps if steps else step
        x = self.state(motion)
        rest, tension = as_kernel_array(motion.rest.copy()), np.empty(len(self.cables))
        rate = as_kernel_array(each_number("speed", speed, len(rest), "").copy())
        go(x, self.cables, self.body, self.free, self.total(load), rest, rate, tension, period, steps)
        return self.motion(x, rest, tension)

    def total(self, load: ArrayLike) -> Array:
        """Weight and a load (6,) beside it, N and N m. Raises ModelError for what is none."""
        more = np.asarray(load, float)
        good = more.shape in ((), (6,)) and bool(np.isfinite(more).all())
        require(good, "no such load", key="load", found=more.tolist(), expected="six finite numbers, N and N m")
        return as_kernel_array(self.weight + more)

    def steps(self, rest: ArrayLike, seconds: float, step: float) -> int:
        """Into how many steps of at most `step` a time is divided. Raises ModelError for no such times, and for a step that is too long."""
        require(
            0 <= seconds < np.inf and 0 < step < np.inf, "no such times", key="seconds, step", found=(seconds, step)
        )
        steps = int(np.ceil(seconds / step - 1e-9))  # tolerance: of a step; 0.2 / 0.001 is no 201 steps
        turn = seconds / max(steps, 1) * self.fastest(rest)
        expected = f"below {STIFF * step / max(turn, STIFF):.2g} s"
        require(
            turn < STIFF,
            "the step is too long for such stiff cables",
            key="step",
            found=f"{step:.3g} s",
            expected=expected,
        )
        return steps

    def fastest(self, rest: ArrayLike) -> float:
        """A bound of the fastest vibration, and of the rate at which dampers end it, rad/s: all cables as one spring and one damper, on the
        mass and on the least inertia."""
        stiffness = self.cables[:, 3] / np.asarray(rest, float)
        return float(np.sqrt(self._bound(stiffness)) + self._bound(self.cables[:, 4]))

    def _bound(self, each: Array) -> float:
        """The most that springs or dampers (m,) of cables push a platform, per mass and per inertia, along any of its motions."""
        reach = (self.body[:-2] ** 2).sum(axis=1)
        return float(each.sum() / self.mass + (each * reach).sum() / self.inertia.min())

    def energy(self, motion: Motion) -> tuple[float, float, float]:
        """Energy of motion, of height and of stretch, J."""
        x = self.state(motion)
        r = motion.pose[:3, :3] @ self.axes
        omega = r.T @ motion.momentum / self.inertia
        moving = 0.5 * self.mass * motion.velocity @ motion.velocity + 0.5 * (self.inertia * omega**2).sum()
        ends = x[:3] + self.body[:-2] @ r.T
        stretch = np.maximum(0.0, np.linalg.norm(self.cables[:, :3] - ends, axis=1) - motion.rest)
        return (
            float(moving),
            float(-self.weight[:3] @ x[:3]),
            float((0.5 * self.cables[:, 3] / motion.rest * stretch**2).sum()),
        )

    def state(self, motion: Motion) -> Array:
        """The state (13,) of a kernel."""
        pose = np.asarray(motion.pose, float)
        place = pose[:3, :3] @ self.centre + pose[:3, 3]
        return as_kernel_array(
            np.concatenate([place, _quaternion(pose[:3, :3] @ self.axes), motion.velocity, motion.momentum])
        )

    def motion(self, x: Array, rest: Array, tension: Array) -> Motion:
        """The motion of a kernel's state (13,). Raises ModelError where that is no motion: a cable without length, or forces that grew
        without bound."""
        known = bool(np.isfinite(x).all() and np.isfinite(tension).all() and (rest > 0).all())
        require(
            known,
            "the motion of a plant has no end",
            key="motion",
            found=x.tolist(),
            expected="cables of some length, and forces that they bear",
        )
        turn = _rotation(x[3:7]) @ self.axes.T
        return Motion(se3.compose(turn, x[:3] - turn @ self.centre), x[7:10].copy(), x[10:].copy(), rest, tension)


def plant_of(
    robot: CableRobot,
    *,
    damping: ArrayLike = 0.0,
    mass: float | None = None,
    inertia: ArrayLike | None = None,
    elasticity: ArrayLike | None = None,
) -> PlatformPlant:
    """The plant of a robot. damping (m,) of its cables in N s/m; mass in kg, inertia (3, 3) about its centre of mass in kg m2 and
    elasticity (m,) in 1/N where its file does not say them. Without an inertia it is that of a box around the anchors.

    Raises ModelError for pulleys and cables that sag, for unknown numbers, and for those that no body has.
    """
    if robot.pulleys is not None or (robot.density is not None and np.any(robot.density > 0)):
        what = "pulleys" if robot.pulleys is not None else "density"
        raise ModelError("a plant has straight cables", key=what, found=robot.name, expected=f"a robot without {what}")
    m = len(robot.cables)
    weight = float(robot.need("mass") if mass is None else mass)
    require(0 < weight < np.inf, "no such mass", key="mass", found=weight, expected="above 0")
    given = robot.need("elasticity") if elasticity is None else elasticity
    strain = each_number("elasticity", given, m, "above 0")
    damp = each_number("damping", damping, m, "0 or more")
    known = robot.inertia if inertia is None else inertia
    full = box_inertia(robot.b, weight) if known is None else np.asarray(known, float)
    symmetric = full.shape == (3, 3) and np.allclose(full, full.T)
    require(symmetric, "no such inertia", key="inertia", found=full.tolist(), expected="a symmetric (3, 3)")
    moments, axes = np.linalg.eigh(full)
    if robot.planar:  # it turns about one axis of the base only: no other moment matters
        moments, axes = np.diag(full).copy(), np.eye(3)
    solid = robot.planar or moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)  # tolerance: of rounding
    body_like, expected = bool((moments > 0).all()) and solid, "each moment below the sum of the others"
    require(body_like, "no body has such an inertia", key="inertia", found=moments.tolist(), expected=expected)
    axes = axes * np.sign(np.linalg.det(axes))
    free = np.zeros(6)
    free[list(robot.axes)] = 1.0
    return PlatformPlant(
        as_kernel_array(np.column_stack([robot.a, 1 / strain, damp])),
        as_kernel_array(np.vstack([(robot.b - robot.com) @ axes, moments, [weight, 0.0, 0.0]])),
        as_kernel_array(free),
        np.concatenate([weight * np.array(GRAVITY), np.zeros(3)]),
        np.asarray(robot.com, float),
        axes,
    )


def each_number(key: str, given: ArrayLike, count: int, expected: str) -> Array:
    """A number of every cable (m,), "above 0", "0 or more" or, with "", any finite one. Raises ModelError for one that is none."""
    values = np.asarray(given, float)
    many = values.shape in ((), (1,), (count,))
    require(many, "a number of every cable, or one of all", key=key, found=values.shape, expected=(count,))
    good = np.isfinite(values) & (values > 0 if expected == "above 0" else (values >= 0 if expected else True))
    require(bool(good.all()), f"no such {key}", key=key, found=values.tolist(), expected=expected or "a finite number")
    return np.broadcast_to(values, count)


def box_inertia(points: ArrayLike, mass: float) -> Array:
    """Inertia (3, 3) in kg m2, about its middle, of a box of this mass around points (m, 3) in m; a flat one is 1 mm thick."""
    size = np.maximum(np.ptp(np.asarray(points, float), axis=0), 1e-3)  # tolerance: m, no body is without thickness
    return np.diag(mass / 12 * ((size**2).sum() - size**2))


def _quaternion(rotation: Array) -> Array:
    """The quaternion (4,), w first, of a rotation."""
    turn = so3.log(rotation)
    half = 0.5 * np.linalg.norm(turn)
    return np.concatenate([[np.cos(half)], 0.5 * np.sinc(half / np.pi) * turn])


def _rotation(q: Array) -> Array:
    """The rotation (3, 3) of a quaternion of length 1, w first."""
    w, v = q[0], q[1:]
    return np.asarray(np.eye(3) + 2 * w * so3.skew(v) + 2 * so3.skew(v) @ so3.skew(v))

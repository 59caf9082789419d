"""Tensions within their limits that balance a wrench, W t + w = 0, for many poses at once; and how far a wrench is from
having none.

All but `hold` works on arrays: W (k, d, m), w (k, d) or (d,), limits (m, 2) in N.
"""

from __future__ import annotations

from collections.abc import Callable
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.cables.distribution._kernels import centre_kernel, nearest_kernel, power_kernel
from robocal.cables.geometry import CableRobot
from robocal.cables.margin._kernels import margin_kernel, missing_kernel
from robocal.cables.polytope._kernels import FOUND, STUCK
from robocal.cables.statics import gravity_wrench, row_weights, structure_of, structures
from robocal.cables.tension_choice import METHOD, POWER
from robocal.errors import ModelError, RobocalError, look_up, require

__all__ = [
    "METHODS",
    "Distribution",
    "ball",
    "capacity_margin",
    "check_method",
    "distribute",
    "disturbance_margin",
    "hold",
    "is_feasible",
    "missing_wrench",
]


@record
class Distribution:
    """Tensions of k poses, and what they balance.

    tension (k, m) N, NaN where the method found none; `feasible` (k,): whether any tensions within the limits balance
    the wrench; `has_solution` (k,): whether this method gave some. The two differ for "closed" only, which may leave the
    limits where other tensions do not.
    """

    method: str
    tension: Array
    feasible: Bools
    has_solution: Bools
    structure: Array
    wrench: Array
    limits: Array

    def missing(self, length: ArrayLike = 1.0) -> Array:
        """The wrench (k, d) that would have to be added for equilibrium: zero where feasible; see `missing_wrench`."""
        out = np.zeros(self.wrench.shape)
        bad = ~self.feasible
        if bad.any():
            out[bad] = missing_wrench(self.structure[bad], self.wrench[bad], self.limits, length)
        return out


def distribute(
    structure: ArrayLike, wrench: ArrayLike, limits: ArrayLike, method: str = METHOD, power: float = POWER
) -> Distribution:
    """Tensions t (k, m) with W t + w = 0 and limits[:, 0] <= t <= limits[:, 1], by one of METHODS.

    - "norm": least |t|^2, (3.80) of the seed: exact projection on the polygon of solutions (one or two redundant cables),
      dual active set beyond.
    - "mid": nearest to the middle of the limits, exact in the same way; it equals "closed" wherever that one holds.
    - "closed": t = t_mid - W^+ (w + W t_mid) (Pott 2009); not found where it leaves the limits.
    - "barycentre": centre of area of the polygon of solutions (Mikelsons 2008; Lamaury and Gouttefarde 2013), continuous
      along paths; middle of the interval with one redundant cable; up to two redundant cables.
    - "p-norm": least sum t^p, p = `power` >= 2 (Gosselin and Grenier 2011).

    structure (k, d, m) with m >= d, wrench (k, d) or (d,) [N, N m], limits (m, 2) N, 0 <= lower <= upper, finite.
    Raises ModelError for shapes, limits or a method that make no sense.
    """
    problem = _enter(structure, wrench, limits)
    check_method(method)
    require(2.0 <= power < np.inf, "the power of a p-norm is at least 2", key="power", found=power)
    tension = np.full((problem.w.shape[0], problem.w.shape[2]), np.nan)
    feasible, found = METHODS[method](problem, power, tension)
    tension[~found] = np.nan
    return Distribution(method, tension, feasible, found, problem.w, problem.load, problem.limits)


def hold(robot: CableRobot, pose: ArrayLike, method: str = METHOD) -> Distribution:
    """Tensions within the robot's limits that hold its weight at poses (k, 4, 4). Raises ModelError where mass or limits are not known."""
    weight = gravity_wrench(pose, float(robot.need("mass")), robot.com)[:, list(robot.axes)]
    limits = robot.need("limits")
    return distribute(structure_of(robot, pose), weight, limits, method)


def check_method(method: str) -> None:
    """Raises ModelError for a name that is not one of METHODS."""
    look_up(METHODS, method, "unknown tension method", "method")


def is_feasible(structure: ArrayLike, wrench: ArrayLike, limits: ArrayLike) -> Bools:
    """Whether tensions within the limits balance the wrench, (k,)."""
    return distribute(structure, wrench, limits).feasible


def missing_wrench(structure: ArrayLike, wrench: ArrayLike, limits: ArrayLike, length: ArrayLike = 1.0) -> Array:
    """-(W t + w) (k, d) for the tensions within the limits that make it shortest: what would have to be added to w.

    Moments are divided by `length` [m] before they are compared with forces. Zero (to rounding) where feasible.
    """
    problem = _enter(structure, wrench, limits)
    out, code = np.empty(problem.load.shape), np.empty(len(problem.w), np.int64)
    w, load, low, high = problem
    missing_kernel(w, load, row_weights(w.shape[1], length), low, high, out, code)
    _require_convergence(code == 0)
    return out


def capacity_margin(
    structure: ArrayLike, wrench: ArrayLike, limits: ArrayLike, length: ArrayLike = 1.0, taken: ArrayLike | None = None
) -> Array:
    """Signed distance (k,) [N] of wrenches to the boundary of those that the cables can balance; negative: not feasible.

    Any disturbance smaller than the margin can be balanced too; moments are divided by `length` [m]. The boundary's
    hyperplanes are found by shifting (Bouchard, Gosselin and Moore 2010; Gouttefarde and Krut 2010); the margin is that of
    Ruiz, Caro, Cardou and Guay (2015). wrench (d,), (k, d), or (k, v, d) for the least over v wrenches. What is
    `taken`, and the rest, as for `disturbance_margin`.
    """
    rows = np.asarray(structure).shape[-2] if np.ndim(structure) == 3 else 6
    return disturbance_margin(structure, wrench, limits, ball(rows, length), length, taken)


def ball(rows: int, length: ArrayLike = 1.0) -> Array:
    """The shape (d, d) of a disturbance of one newton in any direction, moments divided by `length` [m], for d `rows` of W."""
    return np.diag(1.0 / row_weights(rows, length))


def disturbance_margin(
    structure: ArrayLike,
    wrench: ArrayLike,
    limits: ArrayLike,
    shape: ArrayLike,
    length: ArrayLike = 1.0,
    taken: ArrayLike | None = None,
) -> Array:
    """Greatest x (k,) such that every wrench w + taken f + shape e with |f| <= 1 and |e| <= x can be balanced; negative: those
    without e cannot.

    shape (d, q) or (k, d, q): what one unit of the disturbance does to the platform. For accelerations of the platform in
    any direction, shape = -m [I; [R c]x] and x is in m/s^2. taken (d, p) or (k, d, p): disturbances that have to be balanced
    anyhow, none unless given. A positive margin is exact; a negative one is minus a lower
    bound of the disturbance that would be needed to help. At a singular pose, where the balanceable wrenches have no
    volume, it is zero if every wrench can be balanced and nothing is `taken`, otherwise minus the size of the greatest missing
    one, or of what is taken.
    """
    given = np.asarray(wrench, dtype=float)
    several = given.ndim == 3
    problem = _enter(structure, given[:, 0] if several and given.shape[1] else given, limits)
    w, load, low, high = problem
    if several and (given.shape[0] != len(w) or not np.isfinite(given).all()):
        raise ModelError("wrenches are an array (k, v, d) of finite numbers", found=given.shape)
    stretch = _disturbance(shape, w)
    require(stretch.shape[2] > 0, "a disturbance has at least one component", key="shape", found=np.shape(shape))
    gone = _disturbance(np.zeros((w.shape[1], 0)) if taken is None else taken, w)
    loads = as_kernel_array(given if several else load[:, None])
    margin, code = np.empty(len(w)), np.empty(len(w), np.int64)
    margin_kernel(w, loads, stretch, gone, low, high, margin, code)
    odd = np.flatnonzero(code)  # singular poses: few, or all of them where the two sets of anchors are parallel
    if len(odd):
        anyhow = gone[odd] if len(gone) > 1 else gone
        margin[odd] = _singular_margin(w[odd], loads[odd], anyhow, problem.limits, length)
    return margin


def _singular_margin(w: Array, loads: Array, taken: Array, bounds: Array, length: ArrayLike) -> Array:
    """Minus the size of the greatest missing wrench of loads (k, v, d), or of what is taken; zero where there is none, (k,)."""
    count, v, d = loads.shape
    short = missing_wrench(np.repeat(w, v, axis=0), loads.reshape(-1, d), bounds, length).reshape(count, v, d)
    size = np.linalg.norm(short * row_weights(d, length), axis=2).max(axis=1)
    size = np.maximum(size, np.linalg.norm(taken * row_weights(d, length)[:, None], axis=(1, 2)))
    return np.where(size > 1e-9 * (np.abs(loads).max(axis=(1, 2)) + bounds.max()), -size, 0.0)


class _Problem(NamedTuple):
    """What kernels read of W t + w = 0: W (k, d, m), one wrench of every pose (k, d), the least and the greatest tensions (m,)."""

    w: Array
    load: Array
    low: Array
    high: Array

    @property
    def limits(self) -> Array:
        """Least and greatest tensions, (m, 2)."""
        return np.stack([self.low, self.high], axis=1)


# Methods: each fills `tension` (k, m) and says where any tensions exist, and where it found its own.

_Method = Callable[[_Problem, float, Array], tuple[Bools, Bools]]


def _nearest_to(reference: Callable[[Array], Array]) -> _Method:
    def method(problem: _Problem, power: float, tension: Array) -> tuple[Bools, Bools]:
        code = np.empty(len(tension), np.int64)
        nearest_kernel(*problem, reference(problem.limits), tension, code)
        return _has_solution(code), _has_solution(code)

    return method


def _closure_tension(problem: _Problem, power: float, tension: Array) -> tuple[Bools, Bools]:
    feasible, _ = METHODS["norm"](problem, power, tension)
    w, load, low, high = problem
    code, far = np.empty(len(w), np.int64), np.full(len(low), 1e100)
    nearest_kernel(w, load, -far, far, problem.limits.mean(axis=1), tension, code)  # t_mid - W^+ (w + W t_mid)
    edge = 1e-12 * high.max()
    inside = ((tension >= low - edge) & (tension <= high + edge)).all(axis=1)
    return feasible, inside & feasible


def _centre(problem: _Problem, power: float, tension: Array) -> tuple[Bools, Bools]:
    code, redundancy = np.empty(len(tension), np.int64), np.empty(len(tension), np.int64)
    centre_kernel(*problem, tension, code, redundancy)
    found = _has_solution(code)
    _, d, m = problem.w.shape
    require(
        m - d <= 2, "the barycentre is worked out for at most two redundant cables", key="method",
        found=f"{m} cables for {d} degrees of freedom", expected="norm, mid, closed or p-norm",
    )  # fmt: skip
    return found, found & (redundancy <= 2)


def _power(problem: _Problem, power: float, tension: Array) -> tuple[Bools, Bools]:
    code = np.empty(len(tension), np.int64)
    power_kernel(*problem, 0.0, float(power), tension, code)
    return _has_solution(code), _has_solution(code)


def _has_solution(code: Ints) -> Bools:
    """Where a kernel found tensions, (k,)."""
    return np.asarray(_require_convergence(code != STUCK) & (code == FOUND))


METHODS: MappingProxyType[str, _Method] = MappingProxyType(
    {
        "norm": _nearest_to(lambda limits: np.zeros(len(limits))),
        "mid": _nearest_to(lambda limits: limits.mean(axis=1)),
        "closed": _closure_tension,
        "barycentre": _centre,
        "p-norm": _power,
    }
)


def _enter(structure: ArrayLike, wrench: ArrayLike, limits: ArrayLike) -> _Problem:
    """The three arrays, checked, contiguous, one wrench per pose."""
    w, bounds = structures(structure), as_kernel_array(limits)
    load = np.asarray(wrench, dtype=float)
    count, d, m = w.shape
    require(
        m >= d, "fewer cables than degrees of freedom: such a platform is not held by its cables",
        found=f"{m} cables for {d} degrees of freedom",
    )  # fmt: skip
    if bounds.shape != (m, 2):
        raise ModelError("tension limits are an array (m, 2), one row per cable", found=bounds.shape, expected=(m, 2))
    wrong = ~(np.isfinite(bounds).all(axis=1) & (bounds[:, 0] >= 0.0) & (bounds[:, 0] <= bounds[:, 1]))
    if wrong.any():
        i = int(np.argmax(wrong))
        raise ModelError(
            "tension limits are crossed, negative or not finite: a cable pulls, and cannot push",
            key=f"c{i + 1}", found=bounds[i].tolist(), expected="0 <= lower <= upper, N",
        )  # fmt: skip
    expected = (count, d)
    if load.shape not in ((d,), expected) or not np.isfinite(load).all():
        raise ModelError("wrenches are an array (k, d) or (d,) of finite numbers", found=load.shape, expected=expected)
    return _Problem(w, *as_kernel_array(np.broadcast_to(load, expected), bounds[:, 0], bounds[:, 1]))


def _disturbance(shape: ArrayLike, w: Array) -> Array:
    """An array (1 or k, d, q), contiguous."""
    stretch = np.asarray(shape, dtype=float)
    stretch = as_kernel_array(stretch[None] if stretch.ndim == 2 else stretch)
    if stretch.ndim != 3 or len(stretch) not in (1, len(w)) or stretch.shape[1] != w.shape[1]:
        raise ModelError("a disturbance's shape is an array (d, q) or (k, d, q)", found=np.shape(shape))
    finite = np.isfinite(stretch).all()
    require(finite, "a disturbance's shape holds a number that is none", expected="finite numbers")
    return stretch


def _require_convergence(ok: Bools) -> Bools:
    """Passes on what it is given; raises where an iteration did not come to an end."""
    if not ok.all():
        at = int(np.argmin(ok))
        raise RobocalError(f"the search for tensions did not settle at pose {at}: please report this case")
    return ok

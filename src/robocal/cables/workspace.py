"""Where a platform can be held: the wrench-feasible or the wrench-closure workspace, its margins, and a grid of it.

A position belongs to it when tensions within the limits balance every wrench that is demanded there: all orientations,
masses, extra wrenches and accelerations of a `Demand` (for a convex set of wrenches its corners are enough). To that of wrench
closure it belongs when tensions of any size balance any wrench.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import field, record
from robocal._types import Array, Bools
from robocal.cables.closure import CLOSED, Dexterity, dexterity, tension_factor
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import ball, capacity_margin, disturbance_margin, is_feasible
from robocal.errors import ModelError, require
from robocal.geometry.gravity import GRAVITY

__all__ = ["Demand", "Grid", "accelerations", "as_box", "as_poses", "dexterities", "grid", "holds", "margins"]


@record
class Demand:
    """What has to be held wherever the platform is.

    masses (p,) kg; rotations (n, 3, 3); extra wrenches (e, 6) [N, N m] in base axes beside the weight; `acceleration`
    [m/s^2] of the centre of mass in any direction, without turning; `reserve` [N] of capacity margin on top of that, moments
    divided by `length` [m]; `gravity` (3,) [m/s^2] in base axes. `closure`: any wrench whatever, by tensions of any size, so that
    of all this only the rotations count.
    """

    masses: Array
    rotations: Array = field(default_factory=lambda: np.eye(3)[None])
    extra: Array = field(default_factory=lambda: np.zeros((1, 6)))
    acceleration: float = 0.0
    reserve: float = 0.0
    length: float = 1.0
    gravity: tuple[float, float, float] = GRAVITY
    closure: bool = False


def margins(robot: CableRobot, demand: Demand, where: ArrayLike) -> Array:
    """Least capacity margin (k,) [N] over everything demanded, whichever way it accelerates; negative: outside. Of closure it is the
    tension factor, NaN where there is none.

    `where`: positions (k, 3) m, or poses (k, 4, 4), after whose rotation come the demand's own.
    """
    if demand.closure:
        factor = dexterities(robot, demand, where).tension_factor
        return np.where(factor > CLOSED, factor, np.nan)
    pose, limits = as_poses(where), robot.need("limits")
    length = robot.lengths_of_rows(demand.length)
    least = np.full(len(pose), np.inf)
    for whole, w, loads, turned in _cases(robot, demand, pose):
        if demand.acceleration > 0.0:
            push = _push(robot, turned)
            for mass, own in _by_mass(demand, loads):
                taken = demand.acceleration * mass * push
                least = np.minimum(least, capacity_margin(w, own, limits, length, taken))
        else:
            least = np.minimum(least, capacity_margin(w, loads, limits, length))
        least[~whole] = -np.inf
    return least


def accelerations(robot: CableRobot, demand: Demand, where: ArrayLike) -> Array:
    """Greatest acceleration (k,) [m/s^2] of the centre of mass in any direction, without turning, over everything demanded,
    with the reserve left; infinite without mass. `where` as for `margins`.
    """
    pose, limits = as_poses(where), robot.need("limits")
    least, length = np.full(len(pose), np.inf), robot.lengths_of_rows(demand.length)
    for whole, w, loads, turned in _cases(robot, demand, pose):
        push = _push(robot, turned)
        kept = None if demand.reserve <= 0.0 else demand.reserve * ball(w.shape[1], length)
        for mass, own in _by_mass(demand, loads):
            if mass > 0.0:
                least = np.minimum(least, disturbance_margin(w, own, limits, mass * push, length, kept))
        least[~whole] = -np.inf
    return least


def holds(robot: CableRobot, demand: Demand, where: ArrayLike) -> Bools:
    """Whether everything demanded can be held, (k,); `where` as for `margins`."""
    pose = as_poses(where)
    if demand.closure:
        closed = np.ones(len(pose), bool)
        for whole, w, _ in _structures_by_orientation(robot, demand.rotations, pose):
            closed &= whole & (tension_factor(w) > CLOSED)
        return closed
    if demand.reserve > 0.0 or demand.acceleration > 0.0:
        return margins(robot, demand, pose) >= demand.reserve
    inside, limits = np.ones(len(pose), bool), robot.need("limits")
    for whole, w, loads, _ in _cases(robot, demand, pose):
        inside &= whole
        for v in range(loads.shape[1]):
            inside &= is_feasible(w, loads[:, v], limits)
    return inside


def dexterities(robot: CableRobot, demand: Demand, where: ArrayLike) -> Dexterity:
    """The least tension factor and the greatest condition number over the demand's orientations; moments are divided by its length.
    `where` as for `margins`."""
    pose = as_poses(where)
    factor, condition = np.ones(len(pose)), np.ones(len(pose))
    for whole, w, _ in _structures_by_orientation(robot, demand.rotations, pose):
        found = dexterity(w, robot.lengths_of_rows(demand.length))
        factor = np.minimum(factor, np.where(whole, found.tension_factor, 0.0))
        condition = np.maximum(condition, np.where(whole, found.condition, np.inf))
    return Dexterity(factor, condition, demand.length)


def as_poses(where: ArrayLike) -> Array:
    """Poses (k, 4, 4) from positions (k, 3) or poses."""
    x = np.asarray(where, dtype=float)
    if not ((x.ndim == 2 and x.shape[1] == 3) or (x.ndim == 3 and x.shape[1:] == (4, 4))) or not np.isfinite(x).all():
        raise ModelError("expected positions (k, 3) or poses (k, 4, 4) of finite numbers, m", found=x.shape)
    if x.ndim == 3:
        return x
    pose = np.tile(np.eye(4), (len(x), 1, 1))
    pose[:, :3, 3] = x
    return pose


def _cases(robot: CableRobot, demand: Demand, pose: Array) -> Iterator[tuple[Bools, Array, Array, Array]]:
    """For each orientation: whether all cables have a length (k,); W (k, d, m); wrenches (k, v, d), masses slowest; and
    the poses (k, 4, 4) themselves."""
    masses, extra, rotations = _check(demand)
    rows = list(robot.axes)
    for whole, w, turned in _structures_by_orientation(robot, rotations, pose):
        weight = [gravity_wrench(turned, float(m), robot.com, demand.gravity) for m in masses]
        loads = np.concatenate([(one[:, None] + extra)[..., rows] for one in weight], axis=1)
        yield whole, w, loads, turned


def _structures_by_orientation(
    robot: CableRobot, rotations: Array, pose: Array
) -> Iterator[tuple[Bools, Array, Array]]:
    """For each orientation: whether all cables have a length (k,), W (k, d, m), and the poses (k, 4, 4) themselves."""
    for rotation in rotations:
        turned = pose.copy()
        turned[:, :3, :3] = pose[:, :3, :3] @ rotation
        w = structure_of(robot, turned, strict=False)
        # With a platform anchor on its frame anchor nothing can be said to hold.
        whole: Bools = np.isfinite(w.sum(axis=(1, 2)))
        w[~whole] = 0.0
        yield whole, w, turned


def _push(robot: CableRobot, turned: Array) -> Array:
    """What one m/s^2 along each axis does to one kg, (k, d, 3)."""
    units = [gravity_wrench(turned, 1.0, robot.com, axis) for axis in np.eye(3)]
    return np.stack(units, axis=-1)[:, list(robot.axes)]


def _by_mass(demand: Demand, loads: Array) -> Iterator[tuple[float, Array]]:
    """The wrenches of a case that carry each mass."""
    carried = np.repeat(np.asarray(demand.masses), len(demand.extra))
    for mass in np.unique(carried):
        yield float(mass), loads[:, carried == mass]


def _check(demand: Demand) -> tuple[Array, Array, Array]:
    masses, extra, rotations = (np.asarray(x, dtype=float) for x in (demand.masses, demand.extra, demand.rotations))
    for name, value, shape in (("masses", masses, ()), ("extra", extra, (6,)), ("rotations", rotations, (3, 3))):
        some = value.ndim == len(shape) + 1 and value.shape[1:] == shape and len(value)
        require(some, "a demand needs at least one of them", key=name, found=value.shape)
    for name, number in (("acceleration", demand.acceleration), ("reserve", demand.reserve)):
        require(0.0 <= number < np.inf, "a demand is a finite number, 0 or more", key=name, found=number)
    upward = np.shape(demand.gravity) == (3,)
    require(upward, "gravity has three components, m/s^2", key="gravity", found=demand.gravity)
    orthonormal = np.abs(rotations @ rotations.swapaxes(1, 2) - np.eye(3)).max() < 1e-6
    rigid = orthonormal and (np.linalg.det(rotations) > 0).all()
    require(rigid, "an orientation is a rotation matrix", key="rotations", expected="orthonormal, right-handed")
    return masses, extra, rotations


# Grid


@record
class Grid:
    """Cells of a box: centres along three axes, which of them can be held (nx, ny, nz), and their margins [N] if asked for, of closure
    tension factors."""

    axes: tuple[Array, Array, Array]
    cell: Array
    inside: Bools
    margin: Array | None

    @property
    def volume(self) -> float:
        """Of the cells that can be held, m^3; m^2 for a box without thickness, in which cells across it count once."""
        flat = tuple(int(i) for i in np.flatnonzero(self.cell <= 0.0))
        return float(self.inside.mean(axis=flat).sum() * np.prod(self.cell[self.cell > 0.0]))


def grid(
    robot: CableRobot, demand: Demand, box: ArrayLike, counts: tuple[int, int, int], with_margins: bool = False
) -> Grid:
    """The workspace at the centres of counts[0] x counts[1] x counts[2] cells of the box (3, 2) m; an axis may have no length."""
    sides = as_box(box)
    require(min(counts) >= 1, "a grid has at least one cell along each axis", found=counts)
    cell = (sides[:, 1] - sides[:, 0]) / np.array(counts)
    axes = tuple(sides[i, 0] + cell[i] * (np.arange(n) + 0.5) for i, n in enumerate(counts))
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    margin = margins(robot, demand, points) if with_margins else None
    # A tension factor that is none is not at least 0 either.
    inside = holds(robot, demand, points) if margin is None else margin >= max(demand.reserve, 0.0)
    shaped = None if margin is None else margin.reshape(counts)
    return Grid((axes[0], axes[1], axes[2]), cell, inside.reshape(counts), shaped)


def as_box(box: ArrayLike) -> Array:
    """A box (3, 2), m, checked."""
    sides = np.asarray(box, dtype=float)
    if sides.shape != (3, 2) or not np.isfinite(sides).all() or (sides[:, 0] > sides[:, 1]).any():
        raise ModelError("a box is three rows (lower, upper), m", found=sides.tolist())
    return sides

"""The exact boundary of a workspace along rays, (3.35) of the seed; joined to surfaces and sections; and the motions of a given path:
what each meets first, and how far it can be held."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.cables.geometry import CableRobot
from robocal.cables.interference import Body, Contacts, first_contact
from robocal.cables.workspace import Demand, as_box, as_poses, holds
from robocal.errors import require
from robocal.geometry import se3

__all__ = [
    "Legs",
    "Outline",
    "Surface",
    "directions",
    "first_exit",
    "legs",
    "outline",
    "rays",
    "statics_along",
    "surface",
    "triangulate_directions",
]


# Points asked for in one call: below this a call costs more by itself than by what it is asked.
AT_ONCE = 256
Inside = Callable[[Ints, Array], Bools]


def first_exit(inside: Inside, count: int, steps: int = 64, tolerance: float = 1e-12) -> Array:
    """First exit lambda (count,) in [0, 1] along rays that start inside, (3.35) of the seed; 1 where a ray never leaves.

    `inside(ray, lam)` says for ray numbers (n,) and lambda (n,) whether the point is inside; NaN for a ray whose start is
    not. A ray is looked at in `steps` equal steps; the first that leaves is halved until it is shorter than `tolerance`. An exit
    and return within one step is not seen. Raises ModelError for fewer steps than one and a tolerance that is none.
    """
    sound = steps >= 1 and 0.0 < tolerance < 1.0
    require(sound, "a ray is looked at in steps and halved", key="steps, tolerance", found=(steps, tolerance))
    every = np.arange(count)
    low, high = np.zeros(count), np.ones(count)
    started = inside(every, low)
    going, step = every[started], 0
    while step < steps and len(going):
        some = min(steps - step, max(1, AT_ONCE // len(going)))
        lam = np.arange(step, step + some + 1) / steps
        out = np.column_stack([~_ask(inside, going, np.tile(lam[1:], (len(going), 1))), np.ones(len(going), bool)])
        first = out.argmax(axis=1)  # `some` where the ray is still inside
        left = first < some
        low[going] = lam[first]
        high[going[left]] = lam[first[left] + 1]
        going, step = going[~left], step + some
    rows = np.flatnonzero(started & (low < 1.0))
    halvings = int(np.ceil(np.log2(1.0 / (steps * tolerance)))) if len(rows) else 0
    while halvings > 0:
        depth = min(halvings, max(1, int(np.log2(AT_ONCE / len(rows) + 1.0))))
        low[rows], high[rows] = _halve(inside, rows, low[rows], high[rows], depth)
        halvings -= depth
    low[~started] = np.nan
    return low


def _ask(inside: Inside, ray: Ints, lam: Array) -> Bools:
    """`inside` at lam (n, k) of rays (n,), (n, k)."""
    return inside(np.repeat(ray, lam.shape[1]), lam.reshape(-1)).reshape(lam.shape)


def _halve(inside: Inside, ray: Ints, low: Array, high: Array, depth: int) -> tuple[Array, Array]:
    """Intervals (n,) halved `depth` times, the middles that may be needed asked for at once."""
    points = np.stack([low, high], axis=1)
    for _ in range(depth):
        finer = np.empty((len(ray), 2 * points.shape[1] - 1))
        finer[:, ::2], finer[:, 1::2] = points, 0.5 * (points[:, :-1] + points[:, 1:])
        points = finer
    ok = _ask(inside, ray, points[:, 1:-1])
    every, at, width = np.arange(len(ray)), np.zeros(len(ray), np.int64), 1 << depth
    while width > 1:
        width //= 2
        at += np.where(ok[every, at + width - 1], width, 0)
    return points[every, at], points[every, at + 1]


def rays(robot: CableRobot, demand: Demand, start: ArrayLike, ends: ArrayLike, steps: int = 64) -> Array:
    """lambda (n,) up to which the way from `start` to each of `ends` can be held; see `first_exit`.

    Positions (3,) and (n, 3) m; or poses (4, 4) and (n, 4, 4), between which the origin moves straight and the platform
    turns steadily about one axis, (3.27) and (3.28) of the seed. Raises ModelError when the start cannot be held.
    """
    origin, targets = as_poses(np.asarray(start, dtype=float)[None])[0], as_poses(ends)
    reach = statics_along(robot, demand, steps)(origin, *se3.displacement(origin, targets))
    why = "rays must start inside the workspace: the start cannot be held"
    require(not np.isnan(reach).any(), why, found=origin[:3, 3].tolist())
    return reach


def statics_along(robot: CableRobot, demand: Demand, steps: int = 64) -> Callable[[Array, Array, Array], Array]:
    """lambda_s of motions, as `poses.reachable_poses` asks for it: how far everything demanded can be held.

    The function takes a start (4, 4), or of every motion (n, 4, 4), translations (n, 3) m and rotation vectors (n, 3) rad in base
    axes, and gives (n,) in [0, 1]; NaN where the start itself cannot be held. See `first_exit`.
    """

    def reach(start: Array, translation: Array, rotation: Array) -> Array:
        starts = np.broadcast_to(start, (len(translation), 4, 4))

        def inside(ray: Ints, lam: Array) -> Bools:
            v, w = lam[:, None] * translation[ray], lam[:, None] * rotation[ray]
            return holds(robot, demand, se3.displace(starts[ray], v, w))

        return first_exit(inside, len(translation), steps)

    return reach


def _boundary(robot: CableRobot, demand: Demand, origin: Array, way: Array, box: ArrayLike, steps: int) -> Array:
    """Where rays from `origin` in directions (n, 3) leave the workspace within the box, (n, 3)."""
    sides = as_box(box)
    within = ((origin >= sides[:, 0]) & (origin <= sides[:, 1])).all()
    require(within, "the start lies outside the box", found=origin.tolist(), expected=sides.tolist())
    room = np.where(way > 0.0, sides[:, 1] - origin, origin - sides[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(way == 0.0, np.inf, room / np.abs(way)).min(axis=1)
    ends = origin + reach[:, None] * way
    return np.asarray(origin + rays(robot, demand, origin, ends, steps)[:, None] * (ends - origin))


@record
class Surface:
    """Boundary of the part of the workspace that is seen from `start`: vertices (n, 3) m, faces (f, 3), outwards."""

    start: Array
    vertices: Array
    faces: Ints

    @property
    def volume(self) -> float:
        """Enclosed, m^3."""
        x = self.vertices[self.faces] - self.start
        return float(np.einsum("fi,fi->", x[:, 0], np.cross(x[:, 1], x[:, 2])) / 6.0)


def surface(
    robot: CableRobot, demand: Demand, start: ArrayLike, box: ArrayLike, count: int = 4000, steps: int = 64
) -> Surface:
    """The boundary within a box (3, 2) m by `count` rays in all `directions`, joined into triangles."""
    require(count >= 4, "too few rays for a surface", key="count", found=count, expected="4 or more")
    origin, way = np.asarray(start, dtype=float), directions(count)
    return Surface(origin, _boundary(robot, demand, origin, way, box, steps), triangulate_directions(way))


def directions(count: int) -> Array:
    """Unit vectors (count, 3) spread evenly over all directions: a Fibonacci lattice."""
    i = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * i / count, i * np.pi * (3.0 - np.sqrt(5.0))
    flat = np.sqrt(1.0 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)


def triangulate_directions(way: Array) -> Ints:
    """Triangles (f, 3) that join directions (n, 3) to a closed surface around their origin, corners turning left seen from
    outside. Raises QhullError for directions in one plane."""
    faces: Ints = ConvexHull(way).simplices.astype(np.int64)
    x = way[faces]
    inwards = np.einsum("fi,fi->f", x[:, 0], np.cross(x[:, 1], x[:, 2])) < 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    return faces


@record
class Outline:
    """Boundary of a plane section as seen from `start`: points (n, 3) m in order."""

    start: Array
    points: Array

    @property
    def area(self) -> float:
        """Enclosed, m^2."""
        x = self.points - self.start
        return float(0.5 * np.linalg.norm(np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0)))


def outline(
    robot: CableRobot,
    demand: Demand,
    start: ArrayLike,
    box: ArrayLike,
    axes: tuple[int, int] = (0, 1),
    count: int = 720,
    steps: int = 64,
) -> Outline:
    """The section through `start` in the plane of two axes (0 x, 1 y, 2 z), within a box (3, 2) m; all of it for a planar robot."""
    require(count >= 3, "too few rays for an outline", key="count", found=count, expected="3 or more")
    two = len({*axes} & {0, 1, 2}) == 2
    require(two, "a section lies along two axes", key="axes", found=axes, expected="two of 0 x, 1 y, 2 z")
    origin = np.asarray(start, dtype=float)
    turn = 2.0 * np.pi * np.arange(count) / count
    way = np.zeros((count, 3))
    way[:, axes[0]], way[:, axes[1]] = np.cos(turn), np.sin(turn)
    return Outline(origin, _boundary(robot, demand, origin, way, box, steps))


@record
class Legs:
    """Of n motions from `starts` (n, 4, 4) to `ends` (n, 4, 4): `contacts`, and the share `feasible_share` (n,) of each that the
    tension limits hold, 1 for all of it, 0 where its start is not held, not a number where they were not computed."""

    contacts: Contacts
    feasible_share: Array
    starts: Array
    ends: Array

    @property
    def free(self) -> Array:
        """The share (n,) of each that is possible."""
        return np.fmin(self.contacts.fraction, self.feasible_share)

    @property
    def whole(self) -> Bools:
        """Whether all of it can be, (n,)."""
        return np.asarray(self.contacts.free & ~(self.feasible_share < 1.0))

    @property
    def end_poses(self) -> Array:
        """Where each ends, (n, 4, 4)."""
        v, w = (self.free[:, None] * whole for whole in se3.displacement(self.starts, self.ends))
        return se3.displace(self.starts, v, w)


def legs(
    robot: CableRobot,
    poses: ArrayLike,
    *,
    demand: Demand | None = None,
    diameter: ArrayLike = 0.0,
    body: Body | None = None,
    relief: float | None = None,
    from_first: bool = False,
) -> Legs:
    """The motions from each of the poses (k, 4, 4) to the next, or `from_first` to every other one: the platform's origin on a straight
    line, turning about one axis. Without a demand only contacts are looked for; diameter, body and relief as for `first_contact`.
    Raises ModelError for fewer than two poses."""
    t = np.asarray(poses, float)
    require(t.ndim == 3 and len(t) >= 2, "a path has two poses or more", found=len(t))
    starts, ends = np.repeat(t[:1], len(t) - 1, axis=0) if from_first else t[:-1], t[1:]
    v, w = se3.displacement(starts, ends)
    wheels = robot.pulleys
    contacts = first_contact(
        robot.a, robot.b, starts, v, w, diameter=diameter, pulleys=wheels, body=body, relief=relief
    )
    held = np.full(len(v), np.nan)
    if demand is not None:
        # None where the start itself is not held.
        held = np.nan_to_num(statics_along(robot, demand)(starts, v, w))
    return Legs(contacts, held, starts, ends)

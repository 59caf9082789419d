"""Forward kinematics: the pose whose cable lengths are those measured, by Levenberg-Marquardt on SE(3), many at once.

    minimise 1/2 |l(T) - l_measured|^2,   (L^T L + lam D) (v, w) = -L^T r,   p <- p + v,  R <- exp(w) R

The increment is a rotation vector, never a change of Euler angles (3.15 put right), so no orientation is special. A
step that does not shorten the residual is not taken. With more cables than degrees of freedom there are local minima;
from many starts the best is kept, and other poses that explain the lengths as well are counted, not hidden.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.cables.cable_lengths import model_of, pulls
from robocal.cables.geometry import CableRobot
from robocal.cables.segment_table import cable_table
from robocal.errors import ModelError, require
from robocal.geometry import se3

__all__ = ["Forward", "forward"]

Model = Callable[[Array, Ints], tuple[Array, Array]]
ITERATIONS = 200
CHANCE = 9.0  # chi-squared by which a rival may be worse and still be the pose: three standard deviations
ROUNDING = 1e-10  # m; residuals closer than this are told apart by rounding only
REACH = 1.05  # room for stretch and noise
# Of steps that polish: how many, their damping, how long they are at most and at the end, m and rad.
POLISH, FAINT, NEAR, ENOUGH = 20, 1e-12, 1e-6, 1e-14
WELL, ROUNDED = 1e12, 1e-14  # condition numbers: surely invertible; least over greatest eigenvalue
APART = 1e-5  # m and rad; solutions closer than this are one


class _Ends(NamedTuple):
    """Where searches end, pose (n, 4, 4): whitened residuals (n, m) with their gradient (n, m, d) and square (n,), iterations, and whether
    each came to its end."""

    pose: Array
    left: Array
    slope: Array
    cost: Array
    iterations: Ints
    converged: Bools


@record(eq=False)
class Forward:
    """Poses from lengths: pose (k, 4, 4), residual (k, m) in m (what sensors would show less what they did), covariance (k, d, d) of the
    twist's components that the robot has (m and rad, base axes), iterations (k,), whether each converged.

    `solutions` (k,) counts the distinct poses that explain the lengths as well, this one included: 1 is unique as far
    as the starts tell, 0 was not asked, or there is none. Where no start has cables at all (inside a pulley, or the
    tension does not carry the weight) nothing is a number. `rival` (k, 4, 4) is the best of the others, not a number where there is none.
    """

    pose: Array
    residual: Array
    covariance: Array
    iterations: Ints
    converged: Bools
    solutions: Ints
    rival: Array


def forward(
    robot: CableRobot,
    measured: ArrayLike,
    start: ArrayLike | None = None,
    *,
    tension: ArrayLike | None = None,
    sag: bool = False,
    sigma: ArrayLike | None = None,
    starts: int = 0,
    rng: np.random.Generator | None = None,
    axes: Sequence[int] | None = None,
) -> Forward:
    """Poses of the platform from what the sensors of lengths show (k, m), searched from `start` (k, 4, 4) or (4, 4); by default
    from X_0, below it where the frame is flat. `axes` are the components of the twist that are searched, all that the robot
    has unless stated: (0, 1, 2) is where it would hang without turning.

    `tension` and `sag` as for `inverse`. sigma () or (m,) in m is the noise of a length; without it the residuals
    themselves say (and the covariance is zero times infinity, not a number, when there are no more cables than degrees
    of freedom). `starts` more starts per pose, drawn with `rng` wherever the lengths allow and with any orientation, look
    for other solutions. Where no start lets the cables hang at all, residuals are not numbers and nothing converged. Raises
    ModelError when fewer cables than degrees of freedom, a wrong number of lengths, and for tensions that push.
    """
    y = np.atleast_2d(np.asarray(measured, float))
    k, m = y.shape
    axes = list(robot.axes if axes is None else axes)
    _check(robot, y, axes)
    per = robot.winding(y)
    y = robot.wound(y)  # from here on lengths, less their zeros
    t = None if tension is None else pulls(robot, tension, (k, m))
    s = None if sigma is None else _common(per) * np.broadcast_to(np.asarray(sigma, float), (m,))
    weight = np.ones(m) if s is None else 1 / s

    lengths_at = model_of(robot, sag=sag, tense=t is not None)

    def model(pose: Array, rows: Ints) -> tuple[Array, Array]:
        length, slope = lengths_at(pose, None if t is None else t[rows])
        return (length - y[rows]) * weight, slope[..., axes] * weight[:, None]

    first = _hanging(robot, y) if start is None else np.asarray(start, float)
    pose = np.broadcast_to(first, (k, 4, 4))[:, None]
    if starts:
        drawn = _draw(robot, y, starts, rng or np.random.default_rng(0))
        pose = np.concatenate([pose, drawn], axis=1)
    rows = np.repeat(np.arange(k), pose.shape[1])
    flat, shape = pose.reshape(-1, 4, 4), pose.shape[:2]
    ends = _search(robot, y, weight, flat, rows, axes) if t is None else _descend(model, flat, rows, axes)
    found, cost = ends.pose.reshape(*shape, 4, 4), ends.cost.reshape(shape)
    best, solutions, rival = _choose(found, cost, s is not None, start is not None, m, ROUNDING * float(weight.max()))
    at = shape[1] * np.arange(k) + best
    pose, r, slope, _, iterations, converged = (v[at] for v in ends)
    pose[np.isnan(r).any(axis=1)] = np.nan
    covariance, counted = _covariance(r, slope, s is not None), solutions if starts else np.zeros(k, dtype=np.int64)
    return Forward(pose, r / weight / per, covariance, iterations, converged, counted, rival)


def _common(per: Array) -> Array:
    """How fast lengths grow with what sensors show, (m,): in the middle of the rows (k, m), where drums grow with every turn."""
    return np.asarray(per.mean(axis=0))


def _check(robot: CableRobot, y: Array, axes: list[int]) -> None:
    m, width = len(robot.cables), y.shape[1]
    require(width == m, "wrong number of cable lengths", found=width, expected=f"{m}, one per cable")
    if not np.isfinite(y).all():
        at, cable = (int(v) for v in np.argwhere(~np.isfinite(y))[0])
        raise ModelError("a length is not a number", key=robot.cables[cable], found=f"row {at}")
    if (beyond := robot.unwinds(y)).any():
        at, cable = (int(v) for v in np.argwhere(beyond)[0])
        message = f"cable {robot.cables[cable]} is longer than all that its drum holds with this build-up"
        raise ModelError(message, row=at, key=robot.cables[cable], found=f"{y[at, cable]:.4g} m")
    least, why = f"at least {len(axes)} for {robot.degrees}", "the pose does not follow from so few lengths"
    require(m >= len(axes), why, found=f"{m} cables", expected=least)


def _box(robot: CableRobot, y: Array) -> tuple[Array, Array]:
    """Corners (k, 3) of where the platform can be at all: no further from a frame anchor than its cable is long and the
    platform anchor is out."""
    ways, frame = robot.segments, robot.frame_points
    less = np.bincount(ways.cable, ways.times < 0) > 0  # a difference says nothing of its parts
    some = ~ways.still & ~less[ways.cable]
    full = np.abs(y + robot.zeros)[:, ways.cable[some]] / ways.times[some]
    reach = (REACH * full + np.linalg.norm(robot.ends[some, 3:6], axis=1))[..., None]
    a, away = robot.ends[some, :3], np.ptp(frame, axis=0)
    low = (a - reach).max(axis=1, initial=-np.inf)
    high = (a + reach).min(axis=1, initial=np.inf)
    return np.where(np.isfinite(low), low, frame.min(axis=0) - away), np.where(
        np.isfinite(high), high, frame.max(axis=0) + away
    )


def _hanging(robot: CableRobot, y: Array) -> Array:
    """X_0, lowered where the frame is flat, to a quarter of the room that the lengths leave: in the plane of a suspended
    robot's anchors up and down are alike, and the search would stay there. In a tall frame X_0 is low enough."""
    out = np.broadcast_to(robot.home, (len(y), 4, 4)).copy()
    if 2 in robot.axes:
        low, high = _box(robot, y)
        out[:, 2, 3] -= np.maximum(0.25 * (high - low)[:, 2] - np.ptp(robot.frame_points[:, 2]) / 2, 0.0)
    return out


def _draw(robot: CableRobot, y: Array, starts: int, rng: np.random.Generator) -> Array:
    """Starts (k, starts, 4, 4) where the platform can be, with orientations up to half a turn."""
    shape = (len(y), starts)
    low, high = _box(robot, y)
    step = np.zeros((*shape, 6))
    step[..., :3] = low[:, None] + (high - low)[:, None] * rng.uniform(size=(*shape, 3)) - robot.home[:3, 3]
    turn = rng.normal(size=(*shape, 3))
    # A robot that turns about one axis turns by any angle about it.
    turn[..., [i for i in range(3) if i + 3 not in robot.axes]] = 0.0
    size = np.linalg.norm(turn, axis=-1, keepdims=True)
    step[..., 3:] = turn / np.where(size > 0, size, 1) * rng.uniform(0, np.pi, (*shape, 1))
    step[..., [i for i in range(3) if i not in robot.axes]] = 0.0
    return se3.displace(robot.home, step[..., :3], step[..., 3:])


def _normal_equations(j: Array, r: Array) -> tuple[Array, Array, Array]:
    """J^T J (n, d, d), J^T r (n, d), and D (n, 1, d) by which steps are damped."""
    jt = j.swapaxes(-1, -2)
    a = jt @ j
    d = np.maximum(np.einsum("nii->ni", a), 1e-9 * np.einsum("nii->n", a)[:, None])
    return a, (jt @ r[..., None])[..., 0], d[:, None]


def _search(robot: CableRobot, y: Array, weight: Array, pose: Array, rows: Ints, axes: list[int]) -> _Ends:
    """As `_descend`, of cables that are straight or lie on pulleys: compiled, pose by pose."""
    from robocal.cables.single import _kernels as kernels

    n, pose = len(pose), np.array(pose)
    r, j = np.empty((n, y.shape[1])), np.empty((n, y.shape[1], len(axes)))
    cost, code, count = np.empty(n), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    freedoms = np.array(axes, dtype=np.int64)
    cables = as_kernel_array(cable_table(robot))
    kernels.search_many(as_kernel_array(y), rows, cables, freedoms, weight, pose, r, j, cost, code, count)
    return _Ends(pose, r, j, cost, count, code == kernels.SETTLED)


def _descend(model: Model, pose: Array, rows: Ints, axes: list[int]) -> _Ends:
    """Levenberg-Marquardt in lock step; pose (n, 4, 4), each for the lengths of its row."""
    n, pose = len(pose), np.array(pose)
    r, j = model(pose, rows)
    cost = (r * r).sum(axis=-1)
    lam, grow = np.full(n, 1e-4), np.full(n, 2.0)
    iterations, converged = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
    at = np.flatnonzero(np.isfinite(cost))
    for _ in range(ITERATIONS):
        a, g, d = _normal_equations(j[at], r[at])
        step = -np.linalg.solve(a + lam[at, None, None] * d * np.eye(len(axes)), g[..., None])[..., 0]
        promised = -(step * g).sum(axis=-1) + lam[at] * (step * step * d[:, 0]).sum(axis=-1)
        twist = np.zeros((len(at), 6))
        twist[:, axes] = step
        trial = se3.displace(pose[at], twist[:, :3], twist[:, 3:])
        new_r, new_j = model(trial, rows[at])
        new = (new_r * new_r).sum(axis=-1)
        # At the bottom the cost only jitters: a step of rounding's size ends the search, whichever way it goes.
        settled = np.abs(step).max(axis=-1) < 1e-13 * (1 + np.abs(pose[at, :3, 3]).max(axis=-1))
        better = new < cost[at]
        took = at[better]
        pose[took], r[took], j[took] = trial[better], new_r[better], new_j[better]
        gain = np.where(promised > 0, (cost[at] - new) / np.where(promised > 0, promised, 1), 0)
        cost[took] = new[better]
        iterations[at] += 1
        lam[at] *= np.where(better, np.maximum(1 / 3, 1 - (2 * gain - 1) ** 3), grow[at])
        grow[at] = np.where(better, 2.0, grow[at] * 2)
        stuck = ~better & (promised <= 1e-14 * cost[at] + 1e-32)
        converged[at] |= settled | stuck
        at = at[~(settled | stuck | (lam[at] > 1e12))]
        if not len(at):
            break
    _polish(model, pose, rows, axes, np.flatnonzero(converged), r, j)
    return _Ends(pose, r, j, cost, iterations, converged)


def _polish(model: Model, pose: Array, rows: Ints, axes: list[int], at: Ints, r: Array, j: Array) -> None:
    """Pose (n, 4, 4) of the rows `at` <- the bottom itself: where the cost only jitters the gradient still tells. A step that is no
    rounding is not taken: there the pose is open."""
    for _ in range(POLISH):
        a, g, d = _normal_equations(j[at], r[at])
        twist = np.zeros((len(at), 6))
        twist[:, axes] = -np.linalg.solve(a + FAINT * d * np.eye(len(axes)), g[..., None])[..., 0]
        twist[~(np.abs(twist).max(axis=-1) < NEAR)] = 0.0
        pose[at] = se3.displace(pose[at], twist[:, :3], twist[:, 3:])
        r[at], j[at] = model(pose[at], rows[at])
        at = at[np.abs(twist).max(axis=-1) > ENOUGH]
        if not len(at):
            return


def _choose(found: Array, cost: Array, noisy: bool, meant: bool, m: int, floor: float) -> tuple[Ints, Ints, Array]:
    """Of all ends of one search (k, s), the one to trust, how many distinct ones explain the lengths as well, and the
    best of the others."""
    worst = np.where(np.isnan(cost), np.inf, cost)
    solutions: Ints = np.asarray(np.isfinite(worst).any(axis=1), dtype=np.int64)
    rival: Array = np.full((len(found), 4, 4), np.nan)
    if cost.shape[1] == 1:
        return np.zeros(len(found), dtype=np.int64), solutions, rival
    least = worst.min(axis=1, keepdims=True)
    rounding = 2 * np.sqrt(m * least) * floor + m * floor**2
    good = np.isfinite(worst) & (worst <= least + np.maximum(CHANCE if noisy else 0.0, rounding))
    # The caller's own start is kept when no other is better, ours when rounding alone would decide.
    first = good[:, 0] if meant else (worst <= least + rounding)[:, 0]
    best = np.where(first, 0, worst.argmin(axis=1))
    mine = found[np.arange(len(found)), best]
    others = good & _differ(found, mine[:, None])
    for i in np.flatnonzero(others.any(axis=1)):
        ends = found[i, others[i]][np.argsort(worst[i, others[i]])]
        rival[i] = ends[0]
        while len(ends):
            solutions[i] += 1
            ends = ends[_differ(ends, ends[0])]
    return best, solutions, rival


def _differ(one: Array, other: Array) -> Bools:
    far = np.linalg.norm(one[..., :3, 3] - other[..., :3, 3], axis=-1)
    turned = np.linalg.norm(one[..., :3, :3] - other[..., :3, :3], axis=(-2, -1)) / np.sqrt(2)
    return np.asarray((far > APART) | (turned > APART))


def _covariance(r: Array, j: Array, known: bool) -> Array:
    """(J^T J)^-1 of whitened rows; without a stated noise times the residual's own variance."""
    k, m, d = j.shape
    normal = j.swapaxes(-1, -2) @ j
    normal[~np.isfinite(normal).all(axis=(1, 2))] = 0.0
    out = _inverses(normal)
    if not known:
        out *= ((r * r).sum(axis=-1) / (m - d) if m > d else np.full(k, np.nan))[:, None, None]
    return out


def _inverses(normal: Array) -> Array:
    """Inverses (k, d, d) of symmetric matrices; not numbers where the least eigenvalue is rounding beside the greatest."""
    try:
        out = np.linalg.inv(normal)
        # Most are far from singular: their norms say so, for less than their eigenvalues.
        sizes = [np.einsum("kij,kij->k", v, v) for v in (normal, out)]
        doubt = np.flatnonzero(~(sizes[0] * sizes[1] < WELL**2))
    except np.linalg.LinAlgError:
        out, doubt = np.full_like(normal, np.nan), np.arange(len(normal))
    if len(doubt):
        spread = np.linalg.eigvalsh(normal[doubt])
        seen = spread[:, 0] > ROUNDED * spread[:, -1]
        out[doubt[~seen]] = np.nan
        out[doubt[seen]] = np.linalg.inv(normal[doubt[seen]])
    return np.asarray(out)

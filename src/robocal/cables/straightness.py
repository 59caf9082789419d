"""How far cables are from straight lines of constant length: what sags, what that takes, and what stretches.

A level cable of weight w over a span l, under a horizontal tension t, hangs by h and is longer than its chord by l_c - l:

    u = w l / 2 t        h = (l / 2) (cosh u - 1) / u        l_c - l = l (sinh u / u - 1)

which are (3.81) to (3.84) of the cable-robot thesis with alpha = t / w; (3.84) misses a factor alpha. An inclined cable hangs as
`cables/hanging.py` says, under its tension at the platform. A cable of unloaded length L is longer by L s(t) where it bears t, s its
strain (`cables/rope.py`). Both change the platform's pose by J^+ of what they do to lengths, J the gradient of the lengths.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array, Ints
from robocal.cables.elastic import catenary, hang_by_tension
from robocal.cables.geometry import CableRobot, straight
from robocal.cables.hanging import hang
from robocal.errors import ModelError

__all__ = [
    "excess_of",
    "greatest_tension",
    "least_tension",
    "level_excess",
    "level_sag",
    "pose_change",
    "position_gain",
    "sag_of",
    "sag_slope",
    "where_it_decides",
    "worst_position",
]

SMALL = 1e-3  # tolerance: of u, below which the next term of a series is 1e-13 of the first
ROUNDS = 60  # grid: of the search for a tension; each at least halves what is left
CORNERS = 10  # grid: cables of which all corners are looked at
CLOSE = 1e-6  # tolerance: of a tension, relative
MANY = 1 << 10  # grid: poses whose corners are looked at together
LEAST, MOST = 1e-9, 1e9  # N, beyond which nobody asks


def level_sag(span: ArrayLike, tension: ArrayLike, weight: ArrayLike) -> Array:
    """By how much the middle of a level cable hangs (...) in m; span in m, horizontal tension in N, weight in N/m."""
    l, u = _shape(span, tension, weight)
    at = np.where(np.abs(u) < SMALL, 1.0, u)
    return np.asarray(l / 2 * np.where(np.abs(u) < SMALL, u / 2 * (1 + u * u / 12), 2 * np.sinh(at / 2) ** 2 / at))


def sag_slope(span: ArrayLike, tension: ArrayLike, weight: ArrayLike) -> Array:
    """The derivative (...) of that sag by the weight, in m^2/N."""
    l, u = _shape(span, tension, weight)
    at = np.where(np.abs(u) < SMALL, 1.0, u)
    slope = (at * np.sinh(at) - 2 * np.sinh(at / 2) ** 2) / at**2
    return np.asarray(
        l / 2 * np.where(np.abs(u) < SMALL, 0.5 + u * u / 8, slope) * l / (2 * np.asarray(tension, float))
    )


def level_excess(span: ArrayLike, tension: ArrayLike, weight: ArrayLike) -> Array:
    """By how much a level cable is longer than its chord (...) in m."""
    l, u = _shape(span, tension, weight)
    at = np.where(np.abs(u) < SMALL, 1.0, u)
    return np.asarray(l * np.where(np.abs(u) < SMALL, u * u / 6 * (1 + u * u / 20), np.sinh(at) / at - 1))


def _shape(span: ArrayLike, tension: ArrayLike, weight: ArrayLike) -> tuple[Array, Array]:
    l, t, w = (np.asarray(v, float) for v in (span, tension, weight))
    return l, w * l / (2 * t)


def sag_of(robot: CableRobot, pose: ArrayLike, tension: ArrayLike, weight: ArrayLike) -> tuple[Array, Array]:
    """How far cables hang below their chords (k, m), across these, and by how much they are longer (k, m), in m.

    pose (k, 4, 4), tension (k, m) at the platform in N, weight (m,) in N/m. Not numbers where a tension does not carry its cable. What is
    wrapped on a pulley counts for the length, and not for the chord.
    """
    d, pull, w, longer = _hung(robot, pose, tension, weight)
    return _across(np.stack([np.hypot(d[..., 0], d[..., 1]), d[..., 2]], axis=-1), pull, w), longer


def excess_of(robot: CableRobot, pose: ArrayLike, tension: ArrayLike, weight: ArrayLike) -> Array:
    """By how much cables are longer than their chords (k, m) in m alone, of the same as `sag_of`."""
    return _hung(robot, pose, tension, weight)[3]


def _hung(
    robot: CableRobot, pose: ArrayLike, tension: ArrayLike, weight: ArrayLike
) -> tuple[Array, Array, Array, Array]:
    t = np.asarray(pose, float).reshape(-1, 4, 4)
    full, _, lever = straight(robot, t)
    d = t[:, None, :3, 3] + lever - robot.a
    pull, w = (np.broadcast_to(np.asarray(v, float), full.shape) for v in (tension, weight))
    return d, pull, w, np.maximum(hang(d, pull, w, 0.0, robot.pulleys).length - full, 0.0)


def _across(ends: Array, tension: Array, weight: Array) -> Array:
    """The greatest distance (...) of a catenary from its chord, ends (..., 2) across and up: where it is parallel to it."""
    hung = hang_by_tension(ends, tension, weight, 0.0)
    h, v = hung.force[..., 0], hung.force[..., 1]
    chord = np.linalg.norm(ends, axis=-1)
    heavy = weight > 0
    with np.errstate(all="ignore"):
        steep = h * ends[..., 1] / ends[..., 0]  # the vertical force where the cable is as steep as its chord
        part = np.where(heavy, (steep - (v - weight * hung.length)) / np.where(heavy, weight, 1.0), 0.0)
        at, _ = catenary(np.stack([h, steep], axis=-1), np.clip(part, 0.0, hung.length), weight, 0.0)
        far = np.abs(ends[..., 0] * at[..., 1] - ends[..., 1] * at[..., 0]) / chord
    # An upright cable hangs along its chord.
    return np.asarray(np.where(heavy & (ends[..., 0] > 0), far, np.where(np.isnan(h), np.nan, 0.0)))


def pose_change(robot: CableRobot, pose: ArrayLike, change: ArrayLike) -> Array:
    """The twist (k, 6) in m and rad by which poses (k, 4, 4) seem elsewhere where lengths (k, m) change by so much: least squares, to
    first order."""
    t = np.asarray(pose, float).reshape(-1, 4, 4)
    axes = list(robot.axes)
    _, slope, _ = straight(robot, t)
    out = np.zeros((len(t), 6))
    out[:, axes] = (np.linalg.pinv(slope[..., axes]) @ np.asarray(change, float)[..., None])[..., 0]
    return out


def position_gain(robot: CableRobot, pose: ArrayLike) -> Array:
    """By how much positions at poses (k, 4, 4) seem elsewhere for each of the lengths, (k, 3, m): J^+ to first order."""
    t = np.asarray(pose, float).reshape(-1, 4, 4)
    axes = list(robot.axes)
    rows = [n for n, axis in enumerate(axes) if axis < 3]
    return np.asarray(np.linalg.pinv(straight(robot, t)[1][..., axes])[:, rows])


def worst_position(gain: Array, change: ArrayLike) -> Array:
    """The furthest (k,) in m that positions of a `position_gain` (k, 3, m) seem elsewhere where each length changes by something from 0
    to its `change` (k, m): cables that are tighter than others change less. A norm is largest at a corner of the box; of many cables a
    bound is told."""
    each = gain * np.asarray(change, float)[:, None]
    m = each.shape[2]
    if m > CORNERS:
        return np.asarray(np.linalg.norm(each, axis=1).sum(axis=1))
    corners = ((np.arange(2**m)[:, None] >> np.arange(m)) & 1).T.astype(float)
    out = np.empty(len(each))
    for lo in range(0, len(each), MANY):
        out[lo : lo + MANY] = np.square(each[lo : lo + MANY] @ corners).sum(axis=1).max(axis=1)
    return np.sqrt(out)


def where_it_decides(
    error: Callable[[float, Ints], Array],
    count: int,
    search: Callable[[Callable[[float], float]], float | None],
    wanted: float,
) -> float | None:
    """The tension that a `search` finds for the worst of `count` poses, error(tension, poses) in m of some of them: the pose that is
    worst at one tension is searched alone, and joined by another one where that is worse at what was found."""
    every, some = np.arange(count), np.zeros(0, dtype=np.int64)
    found: float | None = 1.0
    for _ in range(ROUNDS):
        told = error(MOST if found is None else found, every)
        told = np.where(np.isfinite(told), told, np.inf)
        worst = int(told.argmax())
        if len(some) and (worst in some or told[worst] <= wanted):
            break
        some = np.append(some, worst)
        found = search(lambda t, at=some: float(error(t, at).max()))  # type: ignore[misc]
    return found


def least_tension(error: Callable[[float], float], wanted: float, guess: float) -> float:
    """The tension in N above which `error` (m, of one tension in N) is at most `wanted`: it falls as 1 / t^2. An error that is no number
    counts as too large. Raises ModelError where none is found."""
    low, high = 0.0, max(guess, LEAST)
    while not error(high) <= wanted:
        low, high = high, 2 * high
        if high > MOST:
            raise ModelError("no tension makes cables so straight", key="wanted", found=f"{wanted:.3g} m")
    for _ in range(ROUNDS):
        if high - low <= CLOSE * high:
            break
        found = error(high)
        # From where the error is known the law 1 / t^2 leads close; a hair more, so that the other side is met too.
        near = high * np.sqrt(found / wanted) * (1 + CLOSE / 2) if found > 0 else 0.0
        middle = near if low < near < high * (1 - CLOSE / 2) else (low + high) / 2
        below = middle / (1 + CLOSE)
        if not error(middle) <= wanted:
            low = middle
        elif below > low and not error(below) <= wanted:
            low, high = below, middle
        else:
            high = middle
    return float(high)


def greatest_tension(error: Callable[[float], float], wanted: float) -> float | None:
    """The tension in N up to which `error` (m, of one tension in N), which grows with it, is at most `wanted`; None where it always is."""
    low, high = LEAST, MOST
    if error(high) <= wanted:
        return None
    for _ in range(ROUNDS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if error(middle) <= wanted else (low, middle)
        if high - low <= CLOSE * high:
            break
    return low

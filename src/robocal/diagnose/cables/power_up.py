"""Whether lengths that a controller reads fit together as its rough geometry allows, and which drive explains it where they do not.

    r_j = N_j^T (y_j - l(T_j)),   T_j the pose that the lengths say best,  N_j what of lengths no motion changes
    C = A S A^T + B P B^T + s^2 N^T N,   A = N_j^T (dl/da(T_j) - dl/da(X_0)),   B = N_j^T L(X_0)

Frame anchors are off by S and the pose X_0 at power-up by P, and lengths have noise s; so r^T C^-1 r is chi-square distributed with as many
degrees of freedom as numbers, where nothing else is wrong. An encoder that counts half, or two drives that were exchanged, make it large,
and the lengths read otherwise make it small again. Tensions at power-up have to hold the platform in the same way: W t + w is as large as
their errors, and those of anchors and pose, leave.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from robocal._record import record
from robocal._scipy import special
from robocal._types import Array
from robocal.cables.forward import forward
from robocal.cables.geometry import CableRobot, straight
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.geometry import so3

__all__ = [
    "BalanceCause",
    "RoughKnowledge",
    "WiringCause",
    "balance_chance",
    "explain",
    "explain_balance",
    "lengths_chance",
]

GAINS = (0.5, 2.0)  # of what an encoder may count: half, or twice


@record(eq=False)
class RoughKnowledge:
    """What a controller knows before any calibration: sigma (m, 3) of the frame anchors in m, of the pose at power-up (6,) in m and
    rad, and of a length in m."""

    anchors: Array
    start: Array
    length: float


@record
class WiringCause:
    """What makes lengths fit: cables, by number, and the gain of their encoders (1: they were exchanged)."""

    cables: tuple[int, ...]
    gain: float
    chance: float


def lengths_chance(robot: CableRobot, known: RoughKnowledge, home: Array, shown: Array) -> float:
    """How likely lengths (k, m) that sensors show are to fit together no better than they do."""
    found = forward(robot, shown, home)
    every = np.concatenate([home[None], found.pose])
    if not np.isfinite(found.pose).all():
        return 0.0
    _, slope, _ = straight(robot, every)
    direction = slope[:, :, :3]
    rows, left, start, size = [], [], [], []
    m = len(robot.cables)
    for j in range(1, len(every)):
        null = np.linalg.svd(slope[j])[0][:, 6:]
        change = np.zeros((m, m, 3))
        for i in range(m):
            change[i, i] = direction[j, i] - direction[0, i]
        rows.append(null.T @ change.reshape(m, 3 * m))
        start.append(null.T @ slope[0])
        left.append(null.T @ found.residual[j - 1])
        size.append(null.shape[1])
    a, b, r = np.concatenate(rows), np.concatenate(start), np.concatenate(left)
    covariance = (a * known.anchors.reshape(-1) ** 2) @ a.T + (b * known.start**2) @ b.T
    covariance += known.length**2 * np.eye(len(r))
    return _chance(r, covariance)


def explain(
    robot: CableRobot, known: RoughKnowledge, home: Array, shown: Array, first: Array
) -> tuple[WiringCause, ...]:
    """Of what can be wrong with one encoder or two drives, all that may make lengths (k, m) fit, the likeliest first; first (m,) is what
    sensors showed at power-up."""
    every = [
        WiringCause(cables, gain, lengths_chance(robot, known, home, read))
        for cables, gain, read in _readings(shown, first)
    ]
    return tuple(sorted(every, key=lambda e: -e.chance))


def _readings(shown: Array, first: Array) -> Iterator[tuple[tuple[int, ...], float, Array]]:
    """The same lengths, read otherwise."""
    m = shown.shape[1]
    for i in range(m):
        for gain in GAINS:
            other = shown.copy()
            other[:, i] = first[i] + (shown[:, i] - first[i]) / gain
            yield (i,), gain, other
    for pair in combinations(range(m), 2):
        other = shown.copy()
        other[:, list(pair)] = first[list(pair)] + (shown - first)[:, list(pair[::-1])]
        yield pair, 1.0, other


@record
class BalanceCause:
    """What makes tensions hold the platform: the factor of its weight with its sigma, or two cables, by number, that were exchanged."""

    cables: tuple[int, ...]
    weight: float
    sigma: float
    chance: float


def balance_chance(
    robot: CableRobot, known: RoughKnowledge, home: Array, tension: Array, known_to: float, factor: float = 1.0
) -> float:
    """How likely tensions (m,) in N, known to a share, are to hold the platform's weight, times a factor, no better than they do at a pose
    (4, 4) that is off by what is known of the start."""
    w = structure_of(robot, home[None])[0]
    load = factor * gravity_wrench(home[None], float(robot.need("mass")), robot.com)[0]
    return _chance(w @ tension + load, _spread(robot, known, home, w, tension, known_to))


def explain_balance(
    robot: CableRobot, known: RoughKnowledge, home: Array, tension: Array, known_to: float
) -> BalanceCause:
    """Of another weight, or two cables whose drives were exchanged, what makes tensions (m,) hold the platform best."""
    w = structure_of(robot, home[None])[0]
    load = gravity_wrench(home[None], float(robot.need("mass")), robot.com)[0]
    weight = np.linalg.inv(_spread(robot, known, home, w, tension, known_to))
    size = float(load @ weight @ load)
    factor, sigma = float(-(load @ weight @ (w @ tension)) / size), size**-0.5
    best = BalanceCause((), factor, sigma, balance_chance(robot, known, home, tension, known_to, factor))
    for pair in combinations(range(len(tension)), 2):
        other = tension.copy()
        other[list(pair)] = tension[list(pair[::-1])]
        chance = balance_chance(robot, known, home, other, known_to)
        if chance > best.chance:
            best = BalanceCause(pair, 1.0, 0.0, chance)
    return best


def _spread(robot: CableRobot, known: RoughKnowledge, home: Array, w: Array, tension: Array, known_to: float) -> Array:
    """Covariance (6, 6) of the force and moment that tensions leave."""
    levers = robot.b @ home[:3, :3].T
    way = robot.a - home[:3, 3] - levers
    length = np.linalg.norm(way, axis=1)
    out = np.zeros((6, 6))
    for i, (lever, long) in enumerate(zip(levers, length, strict=True)):
        across = (np.eye(3) - np.outer(way[i], way[i]) / long**2) * tension[i] / long
        by_place = np.vstack([across, so3.skew(lever) @ across])
        off = np.diag(known.anchors[i] ** 2)
        out += by_place @ off @ by_place.T + known_to**2 * tension[i] ** 2 * np.outer(w[:, i], w[:, i])
    by_pose = np.zeros((6, 6))
    for i, (lever, long) in enumerate(zip(levers, length, strict=True)):
        across = (np.eye(3) - np.outer(way[i], way[i]) / long**2) * tension[i] / long
        u = way[i] / long
        moves = np.hstack([-across, across @ so3.skew(lever)])
        turns = np.hstack([np.zeros((3, 3)), tension[i] * so3.skew(u) @ so3.skew(lever)])
        by_pose += np.vstack([moves, so3.skew(lever) @ moves + turns])
    return out + (by_pose * known.start**2) @ by_pose.T


def _chance(left: Array, covariance: Array) -> float:
    """Of a chi-square as large as these numbers (n,) by their covariance."""
    return float(special.gammaincc(0.5 * len(left), 0.5 * float(left @ np.linalg.solve(covariance, left))))

"""Rows of a log as a drive wrote them: time that starts anew, and rows that repeat the row before.

A log of several sweeps, one after the other, may begin each at its own zero of time. They are put one behind the other, with a pause as
long as the way between them takes at the slowest pace, so that no speed is asked across it. A logger that is faster than its drive writes
a reading again until there is a new one. Such a row tells nothing; counted, it halves the noise. Equal readings of a coarse effort come
by chance too, whether the angle moved or not: rows are called repeated where equal efforts come with equal angles alone.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from robocal._types import Array, Bools, Ints

__all__ = ["join_restarts", "repeated_rows", "restarts"]

FIRST_STEP = 10.0  # grid: times the middle step of time; a wrong stamp leads back at once, a sweep goes on
CHANCE = (
    0.2  # grid: of equal efforts at angles that moved; above it an effort is so coarse that equal rows are readings
)
SURELY = 0.1  # grid: by how much equal efforts must be more frequent at equal angles


def restarts(time: Array, least: int) -> Ints | None:
    """The rows at which time starts anew; None where it runs backwards otherwise: a part has fewer rows than `least`, or a lone stamp
    is wrong."""
    at = np.flatnonzero(np.diff(time) < 0) + 1
    for first, last in pairwise([0, *at.tolist(), len(time)]):
        step = np.diff(time[first:last])
        if last - first < least or step[0] > FIRST_STEP * np.median(step):
            return None
    return at


def join_restarts(time: Array, angle: Array, at: Ints) -> Array:
    """Time (m,) of parts one behind the other, from that of each by itself."""
    out = np.array(time)
    parts = [slice(a, b) for a, b in pairwise([0, *at.tolist(), len(time)])]
    pace = min(float(np.ptp(angle[p])) / max(float(np.ptp(time[p])), 1e-9) for p in parts)
    for one, two in pairwise(parts):
        way = abs(float(angle[two][0] - angle[one][-1])) + np.pi
        out[two] += out[one][-1] + way / max(pace, 1e-9) - time[two][0]
    return out


def repeated_rows(angle: Array, effort: Array) -> Bools:
    """Rows (m,) that repeat the row before, where a logger wrote readings again."""
    still, same = np.diff(angle) == 0, np.diff(effort) == 0
    out = np.zeros(len(angle), dtype=bool)
    if still.all() or not still.any():
        return out
    by_chance = float(same[~still].mean())
    if by_chance < CHANCE and float(same[still].mean()) - by_chance > SURELY:
        out[1:] = still & same
    return out

"""Which measurements are the same, whatever file they stand in: a number of joint values and readings, rounded to a millionth.

    h <- (h xor v) p mod 2^64,   v = rint(10^6 x),   over joints, the other configuration's joints, what else a row says, readings

as in FNV-1a, over whole numbers instead of bytes. The same pose measured again is another measurement: noise makes it one.
Source: Fowler, Noll and Vo (1991).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.measure.data import DataSet, Observations

__all__ = ["fingerprints"]

START, PRIME = np.uint64(0xCBF29CE484222325), np.uint64(0x100000001B3)
GRID = 1e6  # per m, rad or pixel


def fingerprints(data: DataSet) -> list[NDArray[np.uint64]]:
    """One number per row of each of the observations."""
    return [_of(data, obs) for obs in data.observations]


def _of(data: DataSet, obs: Observations) -> NDArray[np.uint64]:
    joints = data.configurations.joints
    parts = [] if joints is None else [joints[obs.configuration]]
    if joints is not None and obs.second is not None:
        parts.append(joints[obs.second])
    more = [np.asarray(v, dtype=float).reshape(len(obs), -1) for _, v in sorted(obs.extra.items())]
    rows = np.hstack([*parts, *more, obs.value if obs.value.ndim == 2 else obs.value[0]])
    numbers = np.rint(np.nan_to_num(rows) * GRID).astype(np.int64).view(np.uint64)
    out = np.full(len(rows), START)
    with np.errstate(over="ignore"):
        for column in numbers.T:
            out = (out ^ column) * PRIME
            out ^= out >> np.uint64(32)  # the high half decides the low one too
    return out

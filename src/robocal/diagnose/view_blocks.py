"""A view: all that one instrument reads of one configuration at once, such as the corners in an image.

The rows of a view have the joint values and the number of the image in common, and those of one target its label too. What is wrong
with these is wrong with all of them. So a view of which more than half of the rows are far is far as a whole, and so are the rows of
one target in it. A corner on its own stays a row.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Bools, Ints
from robocal.diagnose.limits import VIEW_FAR
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet, Observations

__all__ = ["join_views", "subsample_views", "view_blocks"]


def join_views(data: DataSet, far: Sequence[Bools]) -> tuple[Bools, ...]:
    """Which rows of every observation, (k,) each, are far by themselves or with their view."""
    pairs = zip(data.observations, far, strict=True)
    return tuple([f | (view_blocks(o, f) >= 0) if f.any() else f for o, f in pairs])


def view_blocks(obs: Observations, far: Bools) -> Ints:
    """The block of every row, (k,): one number for all rows of a view that is far, or of one target in it; -1 for any other row."""
    out = np.full(len(obs), -1, dtype=np.int64)
    if not kind_of(obs).views:
        return out
    sights = obs.configuration
    if obs.target is not None:
        several = len(obs.targets)
        sights = obs.configuration * several + obs.target
        out = _mostly(sights, far, out)
        out[out >= 0] += int(obs.configuration.max(initial=0)) + 1
    return _mostly(obs.configuration, far, out)


def _mostly(key: Ints, far: Bools, otherwise: Ints) -> Ints:
    """The key of rows (k,) where more than half of those with this key, two at least, are far."""
    count, many = np.bincount(key), np.bincount(key, far)
    return np.where(((many > VIEW_FAR * count) & (count > 1))[key], key, otherwise)


def subsample_views(obs: Observations, where: Ints, points: int) -> Observations:
    """Some rows of some configurations of one instrument."""
    order = np.lexsort((np.arange(len(obs)), obs.configuration))
    c = obs.configuration[order]
    first = np.flatnonzero(np.append(True, np.diff(c) != 0))
    count = np.diff(np.append(first, len(c)))
    rank = np.arange(len(c)) - np.repeat(first, count)
    step = np.repeat(np.maximum(count // points, 1), count)
    return obs.take(np.sort(order[(rank % step == 0) & np.isin(c, where)]))

"""Whether rows that seem to have moved are those where a joint is in another region: a load that bends it to its other side moves
what was measured as a knock would.

    m_j = dz / dq_j      the moment about joint j of a weight at the tool, z upwards

Either the sign of m_j, or the side of a value of q_j, is one on the rows that are off and the other on all others. A sign of m_j
says so by itself. A side of q_j says so where the joint crosses it twice at least: what crossing back does not undo has moved.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose import limits
from robocal.diagnose.segments.find import Segment
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model
from robocal.measure.reach import names_of, places_by_joints

__all__ = ["find_joint"]

STEP = 1e-4  # rad, m: a difference beside which curvature is nothing


def find_joint(model: Model, data: DataSet, segment: Segment, others: Sequence[Segment]) -> str | None:
    """The joint that is in another region on the rows of a segment, with those of the `others` of its file; None where none is."""
    obs = next((o for o in data.observations if (o.label, o.source) == (segment.group, segment.source)), None)
    q = data.configurations.joints
    if obs is None or q is None or model.mechanism is None or not names_of(model):
        return None
    rows = _rows(obs, segment)
    off = np.zeros(len(obs), dtype=bool)
    for s in others:
        if (s.group, s.source, s.cause, s.name) == (segment.group, segment.source, segment.cause, segment.name):
            off[s.first : s.last + 1] = True
    q, off = q[obs.configuration[rows]], off[rows]
    if not np.isfinite(q).all():
        return None
    crossings = int(np.count_nonzero(off[1:] != off[:-1]))
    for j, name in enumerate(names_of(model)):
        moved = np.zeros(q.shape[1])
        moved[j] = STEP
        rise = places_by_joints(model.mechanism, q + moved)[:, 2] - places_by_joints(model.mechanism, q - moved)[:, 2]
        if _apart(rise, off, 0.0) or (crossings > 1 and _apart(q[:, j], off, _middle(q[:, j], off))):
            return name
    return None


def _rows(obs: Observations, segment: Segment) -> Ints:
    """The rows of what moved, (k,): of one target, its own."""
    names = [t.name for t in obs.targets]
    if obs.target is None or segment.name not in names:
        return np.arange(len(obs))
    return np.flatnonzero(obs.target == names.index(segment.name))


def _middle(value: Array, off: Bools) -> float:
    """Between those that are off and the others."""
    return float(np.median(value[off]) + np.median(value[~off])) / 2 if off.any() and not off.all() else 0.0


def _apart(value: Array, off: Bools, at: float) -> bool:
    """Whether those that are off lie on one side of a value and the others on the other one, but for the few that are near it."""
    if not off.any() or off.all():
        return False
    above = float(np.mean(value[off] > at)), float(np.mean(value[~off] > at))
    return max(above) >= limits.REGION_SHARE and min(above) <= 1 - limits.REGION_SHARE

"""A camera that follows its own way drifts: what changes from pose to pose then say, and how much of their errors is the robot's.

    r_i = u_i + e_i+1 - e_i,    cov(r_i, r_i+1) = -var e,    c = 2 s^2 var e / (2 s^2 var e + n var u)

u adds up from view to view, errors e of the robot's poses do not: of changes over n views these have the share c at a scale s. Changes
over as many views as make both alike lose little. In metres of the camera e grows with the scale, so that a fit would choose a small one;
divided by how they grow, residuals are those of errors in both variables. Source: Fuller, Measurement error models (1987), section 1.3.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.geometry import se3
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Rig
from robocal.prove.decision import Decision

__all__ = ["DriftShare", "changes_alone", "follow_one_another", "read_drift"]

STEP, TURN = 0.05, 0.1  # grid: m, rad, of a change that is compared
DRIFT = 0.5  # tolerance: of the correlation of neighbours: half of it adds up
FAR = 3.0  # tolerance: medians, beyond which an error counts as so large


@record
class DriftShare:
    """Over how many views a change goes at most, the share of the robot in its errors, and the scale (one) where it was read."""

    views: int
    share: float
    scale: float


def follow_one_another(found: Decision[Rig]) -> bool:
    """Whether residuals of neighbours are alike, as those of what adds up on the way."""
    used = [r.value[r.used] for r in found.residuals]
    left = np.concatenate([v / np.maximum(v.std(axis=0), np.finfo(float).tiny) for v in used])
    return float((left[1:] * left[:-1]).mean()) > DRIFT


def changes_alone(data: DataSet, in_hand: bool, drift: DriftShare | None = None) -> DataSet:
    """The same data as changes from each pose to the next that is far enough: of what drifts, these have errors of their own. With less
    way between them errors of the robot may be most of it, unless these are known to be small."""
    (seen,) = data.observations
    way = se3.from_vector(data.configurations.starts)
    good = np.ones(len(way), dtype=bool) if seen.used is None else seen.used
    most = len(way) if drift is None else drift.views
    kept = [int(np.argmax(good))]
    for i, pose in enumerate(way):
        if not good[i]:
            continue
        shift, turn = se3.displacement(way[kept[-1]], pose)
        if np.linalg.norm(shift) > STEP or np.linalg.norm(turn) > TURN or i - kept[-1] >= most:
            kept.append(i)
    stops = np.array(kept)
    away = se3.from_vector(seen.value[stops])
    away = away if in_hand else se3.inverse(away)
    own = seen.frame if in_hand else seen.targets[0]
    assert own is not None
    options = dict(seen.options)
    if drift is not None:
        options["robot_share"] = (drift.share, drift.scale)
    moved = replace(
        seen.take(stops[:-1]), kind="relative_pose", value=se3.to_vector(away[:-1] @ se3.inverse(away[1:])), second=stops[1:],
        frame=None, targets=(own,), sigma=None, used=None, group=str(seen.options["scale"]), options=options,
    )  # fmt: skip
    return replace(data, observations=(moved,))


def read_drift(found: Decision[Rig], data: DataSet, in_hand: bool) -> DriftShare:
    """What changes from each view to the next are off by, where `found` has the frames."""
    (seen,) = found.need_data.observations
    scale = found.values[f"{seen.options['scale']}.scale"]
    every = changes_alone(data, in_hand, DriftShare(1, 0.0, scale))
    made = build(found.model, every, values=found.values)
    left = made.residuals(made.start)[0].value
    views, shares = 1, []
    for part in (left[:, :3], left[:, 3:]):
        adds, own = _variances(part)
        views = max(views, int(np.ceil(2 * own / max(adds, np.finfo(float).tiny)))) if own > 0 else views
        shares.append((adds, own))
    long = float(np.mean(np.diff(np.append(seen.configuration, seen.second[-1]))))  # type: ignore[index]
    adds, own = shares[0]
    whole = 2 * own + min(views, long) * adds
    return DriftShare(min(views, len(data.configurations)), 2 * own / whole if whole > 0 else 0.0, scale)


def _variances(left: Array) -> tuple[float, float]:
    """Variances of what adds up and of what does not, of residuals (k, g) of changes that follow one another."""
    size = np.median(np.abs(left), axis=0)
    left = np.clip(left, -FAR * size, FAR * size)
    whole, next_one = float(np.mean(left**2)), float(np.mean(left[1:] * left[:-1]))
    own = min(max(0.0, -next_one), whole / 2)
    return whole - 2 * own, own

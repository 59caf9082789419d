"""Frames of a camera and its target as most views have them: where the search for gross views begins when a plain fit was drawn away.

A fit to all views, a quarter of them wrong, may end where none fits, and the median of what it leaves is then no noise. Of many sets of
three views most of the right ones agree (`fit/starts/consensus`), and what is far from these is kept out from the beginning.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.estimate.problem import Problem
from robocal.fit.frames_alike import frames_alone
from robocal.fit.starts.consensus import agree, views_near
from robocal.geometry import se3
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.measure.reach import nominal_poses
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["agreed_views"]


def agreed_views(
    model: Model, data: DataSet, configurations: Ints, problem: Problem, x: Array
) -> tuple[Array, Bools] | None:
    """x (1, P) with the frames as most views of some configurations have them, and the rows (k,) of the only observations that are near;
    None where all are near as frames stand or none as most have them, where these are not alone, or where no camera measures the poses of
    one target."""
    if len(data.observations) != 1 or not frames_alone(model, problem.table.free, data):
        return None
    (obs,) = data.observations
    frame, known = obs.frame, nominal_poses(model, data.configurations)
    one = obs.kind == "pose" and len(obs.targets) == 1 and obs.value.ndim == 2
    if known is None or frame is None or not one:
        return None
    target, in_hand = obs.targets[0], frame.mount == "tool"
    if target.mount != ("base" if in_hand else "tool") or not all((*frame.free, *target.free)):
        return None
    at = [[problem.table.index[f"{f.name}.{s}"] for s in FRAME_SYMBOLS] for f in (frame, target)]
    own = [problem.table.index[f"{owner}.scale"] for owner in (obs.options.get("scale"),) if owner]
    hand, away = (se3.from_vector(x[0, i]) for i in (at if in_hand else at[::-1]))
    measured, machine = se3.from_vector(obs.value), known[obs.configuration]
    if in_hand:
        measured, away = se3.inverse(measured), se3.inverse(away)
    chosen = np.isin(obs.configuration, configurations)
    if views_near((away, hand, float(x[0, own[0]]) if own else 1.0), measured[chosen], machine[chosen]).all():
        return None
    found = agree(measured[chosen], machine[chosen], bool(own))
    if found is None:
        return None
    near = views_near(found, measured, machine)
    if not near[chosen].any():  # orientations of a small marker scatter so much that no view says whether it is right
        return None
    away, hand, scale = found
    out = np.array(x)
    out[0, own] = scale
    for i, place in zip(at, (hand, se3.inverse(away)) if in_hand else (away, hand), strict=True):
        out[0, i] = se3.to_vector(place)
    return out, near

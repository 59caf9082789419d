"""Joints that count from elsewhere, by any angle, alone or several: what a fit from the nominal zeros does not reach.

    1 seen      a joint whose turn the free frames answer tells nothing of its zero, and keeps it
    2 coarse    one joint, two and three together, on a grid: frames alone, in one batch
    3 refined   the few best, and the nominal zeros, with all zeros free, then with the arm softly held

A joint's offset is added to what it shows, so nothing here knows by which convention the arm is written.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations, product
from typing import Any

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.diagnose.hypotheses.explain import finite_sights
from robocal.diagnose.hypotheses.lockstep import SoftPrior, fit_trials, reach_of
from robocal.diagnose.hypotheses.sights import Sights, rows_of, taken
from robocal.measure.data import DataSet, Frame
from robocal.measure.machine import Mechanism
from robocal.measure.reach import reach as reach_poses
from robocal.parameters import TYPICAL

__all__ = ["search_zeros"]

IN_BASE = Frame("base")  # of an instrument that reads in base coordinates
PROBE = 1.0  # rad: a turn that shows whether a joint's zero is seen
ASIDE = 0.05  # of the reach: a thing on the last axis would tell nothing of that joint, wherever it is in truth
GRID = (36, 8, 6)  # grid: steps of a turn: of one joint, of two and of three together
BEST, KEPT = 80, 8  # grid: of its points, and of what is refined
ROUNDS = (12, 12, 25)  # grid: steps of a fit, coarse and refined
ANY, NEAR = 3.0, 0.015  # rad: how softly zeros are held where they may be anywhere, and where nothing is lost


def search_zeros(chain: Mechanism, data: DataSet) -> dict[str, float]:
    """The offset of every joint whose zero is lost, rad, by its name; empty where nothing is lost or nobody can tell."""
    framed = (replace(o, frame=o.frame or IN_BASE) for o in data.observations)
    data = DataSet(data.configurations, tuple(framed))
    rows = rows_of(data)
    seen = None if rows is None else finite_sights(chain, taken(data, rows))
    if seen is None or seen.places < limits.HYPOTHESIS_PLACES:
        return {}
    with np.errstate(all="ignore"):
        reach = reach_of(chain, seen)
        stated = float(fit_trials(chain, seen, SoftPrior.of_chain(chain, NEAR)).left[0])
        if stated <= limits.MISFIT_ASKS * reach:
            return {}
        joints = _joints_seen(chain, seen, reach)
        zeros, left = _search(chain, seen, joints)
    if not left * limits.EXPLAINED_CLEARLY <= stated or left > limits.MAKING_LEAVES * reach:
        return {}
    least = limits.ZERO_CHANGE * TYPICAL["rad"]
    return {chain.joints[i].name: float(zeros[i]) for i in joints if abs(zeros[i]) > least}


def _shifted(seen: Sights, zeros: Array) -> Sights:
    """One trial for every row of offsets (B, n)."""
    count = len(zeros)
    own: dict[str, Any] = {n: np.repeat(getattr(seen, n), count, axis=0) for n in ("place", "turn", "thing")}
    return replace(seen, joints=seen.joints + zeros[:, None], **own)


def _joints_seen(chain: Mechanism, seen: Sights, reach: float) -> Ints:
    """The turning joints whose zero the frames do not answer: readings that the nominal arm would give are met by no frames once
    such a joint is turned."""
    things = seen.things.copy()
    things[:, :3, 3] += np.where(seen.things_free[:, :3], ASIDE * reach, 0.0)
    thing = seen.thing[0]
    pose = seen.frames[seen.frame] @ reach_poses(chain, seen.joints[0], (), seen.columns)[0] @ things[thing]
    exact = replace(seen, place=pose[None, :, :3, 3], turn=pose[None, :, :3, :3])
    turning = np.array([i for i, j in enumerate(chain.joints) if j.type != "prismatic"], dtype=np.int64)
    zeros = np.zeros((len(turning), len(chain.joints)))
    zeros[np.arange(len(turning)), turning] = PROBE
    return turning[fit_trials(chain, _shifted(exact, zeros)).left > limits.MISFIT_ASKS * reach]


def _grid(count: int, joints: Ints) -> Array:
    """Offsets (B, n): of one joint, of two and of three together."""
    out = []
    for many, steps in enumerate(GRID, start=1):
        angles = 2 * math.pi * np.arange(1, steps) / steps
        for some in combinations(joints.tolist(), many):
            turned = np.array(list(product(angles, repeat=many)))
            zeros = np.zeros((len(turned), count))
            zeros[:, list(some)] = turned
            out.append(zeros)
    return np.concatenate([np.zeros((1, count)), *out])


def _search(chain: Mechanism, seen: Sights, joints: Ints) -> tuple[Array, float]:
    """The offsets (n,) that leave least, within half a turn, and what they leave (m)."""
    zeros = _grid(len(chain.joints), joints)
    rough = fit_trials(chain, _shifted(seen, zeros), rounds=0).left
    zeros = zeros[np.unique(np.append(np.argsort(rough, kind="stable")[:BEST], 0))]
    loose = np.full(len(chain.joints), NEAR)
    loose[joints] = ANY
    free = SoftPrior((), np.zeros(0), loose)
    whole = replace(SoftPrior.of_chain(chain, ANY), zeros=loose)
    for prior, rounds, keep in zip((free, free, whole), ROUNDS, (KEPT, KEPT, 1), strict=True):
        found = fit_trials(chain, _shifted(seen, zeros), prior, rounds=rounds)
        order = np.argsort(found.left, kind="stable")[:keep]
        zeros = (zeros + found.zeros)[order]
    best = zeros[0] - 2 * math.pi * np.round(zeros[0] / (2 * math.pi))
    return np.asarray(best), float(found.left[order[0]])

"""Two markers with one number, or with each other's: views that agree on another place of a target than most others do.

    B_i = (A M_i)^-1 Y_i,    views of one marker: B_i alike,    exchanged in i: B_i of each is where most views have the other

A is what most views agree on. A marker that stood elsewhere from some view on is no second one: `hand_eye_checks.find_moves` tells it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose.camera_changes import half_turn
from robocal.diagnose.vision_limits import HAND_EYE_ASK
from robocal.fit.starts.consensus import FAR, SHARE, Found, agree, missed
from robocal.geometry import se3, so3
from robocal.measure.data import Observations
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.hand_eye_data import HandEyeData

__all__ = ["tell_renamed", "tell_twins"]

FEWEST = 3  # tolerance: views of a second marker: fewer agree by chance
ALIKE = 0.5  # tolerance: of the size of a board, and rad: another marker is farther
MOST_OF = 0.6  # tolerance: of the views that are far off, that agree on the second place


def tell_renamed(opened: HandEyeData) -> Iterator[Remark]:
    """A remark on every two markers of which some views have each other's number."""
    targets = opened.observations.targets
    views = [opened.target_views(t) for t in range(len(targets))]
    for one, other in combinations(range(len(targets)), 2):
        both, mine, theirs = np.intersect1d(views[one][0], views[other][0], return_indices=True)
        machine = opened.flange[both]
        machine = se3.inverse(machine) if opened.inhand else machine
        seen = views[one][1][mine], views[other][1][theirs]
        found = agree(seen[0], machine)
        if found is None:
            continue
        near, usual = _near(found, seen[0], machine)
        beside = agree(seen[1][near], machine[near])
        if beside is None or usual > HAND_EYE_ASK or near.all():
            continue
        own = _near(beside, seen[1], machine)[0]
        across = _near(beside, seen[0], machine, usual)[0] & _near(found, seen[1], machine, usual)[0]
        if (swapped := across & ~near & ~own).any():
            names = tuple(opened.views[i] for i in both[swapped].tolist())
            yield Remark.of(
                Code.MARKERS_EXCHANGED, one=targets[one].name, other=targets[other].name, count=len(names),
                total=len(both), views=names,
            )  # fmt: skip


def _near(found: Found, seen: Array, machine: Array, usual: float | None = None) -> tuple[Bools, float]:
    """Which views are as near as noise goes, and what most of them miss of the distance of the target, or in rad."""
    place, turn = missed(found, seen, machine)
    error = np.hypot(place / np.median(np.linalg.norm(seen[:, :3, 3], axis=1)), turn)
    most = float(np.quantile(error, SHARE)) if usual is None else usual
    return error <= FAR * most, most


def tell_twins(opened: HandEyeData) -> Iterator[Remark]:
    """A remark on every target whose number two markers have."""
    for target, frame in enumerate(opened.observations.targets):
        where, seen = opened.target_views(target)
        machine = opened.flange[where]
        found = _second_place(seen, se3.inverse(machine) if opened.inhand else machine)
        if found is None:
            continue
        other, between = found
        if _from_other_end(opened.observations, between):
            continue
        names = tuple(opened.views[i] for i in where[other].tolist())
        apart, turned = float(np.linalg.norm(between[:3, 3])), float(np.linalg.norm(so3.log(between[:3, :3])))
        amounts = {"apart": Quantity(apart), "turned": Quantity(turned, "rad")}
        yield Remark.of(
            Code.MARKER_TWICE, marker=frame.name, count=len(names), total=len(where), views=names, **amounts
        )


def _from_other_end(obs: Observations, between: Array) -> bool:
    """Whether the second place is that of the same board, labelled from its other end: `labels-turned` tells it."""
    turn = half_turn(obs) if obs.kind == "pixels" else None
    if turn is None:
        return False
    size = float(np.ptp(obs.extra["point"], axis=0).max())
    shift, angle = between[:3, 3] - turn[:3, 3], so3.log(between[:3, :3].T @ turn[:3, :3])
    return bool(np.hypot(np.linalg.norm(shift) / size, np.linalg.norm(angle)) < ALIKE)


def _second_place(seen: Array, machine: Array) -> tuple[Bools, Array] | None:
    """Which views (n,) agree on another place, and where that is from the first, (4, 4); None where no such views are among the others."""
    found = agree(seen, machine)
    if found is None:
        return None
    distance = float(np.median(np.linalg.norm(seen[:, :3, 3], axis=1)))
    near, usual = _near(found, seen, machine)
    off = np.flatnonzero(~near)
    if usual > HAND_EYE_ASK or len(off) < FEWEST:
        return None
    there = se3.inverse(found[0] @ machine[off]) @ seen[off]
    alike = _alike(there, FAR * usual, distance)
    most = int(alike.sum(axis=1).argmax())
    own = off[alike[most]]
    if len(own) < max(FEWEST, MOST_OF * len(off)) or _in_a_row(own, len(seen)):
        return None
    other = np.zeros(len(seen), dtype=bool)
    other[own] = True
    return other, se3.inverse(found[1]) @ there[most]


def _alike(there: Array, near: float, distance: float) -> Bools:
    """Which places (k, 4, 4) are near each other, (k, k)."""
    apart = np.linalg.norm(there[:, None, :3, 3] - there[None, :, :3, 3], axis=2) / distance
    turn = np.linalg.norm(so3.log(np.swapaxes(there[:, None, :3, :3], 2, 3) @ there[None, :, :3, :3]), axis=2)
    return np.asarray(np.hypot(apart, turn) <= 2 * near)


def _in_a_row(views: Ints, count: int) -> bool:
    """Whether views are the first or the last of all, without a gap."""
    whole = len(views) == views[-1] - views[0] + 1
    return bool(whole and (views[0] == 0 or views[-1] == count - 1))

"""Markers whose places nobody states: where they are to one another, as views that show several say, to begin a fit with.

    T_one_other = T_camera_one^-1 T_camera_other       of every view that shows both, the one that most others agree with

The marker that most views show stays where it is, and all others are found beside it.
"""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.fit.starts.cameras import resect_sights
from robocal.geometry import se3
from robocal.measure.data import Frame, Observations
from robocal.measure.pixels import rays
from robocal.session.vision.corner_table import CornerTable
from robocal.vision.sightings import find_islands

__all__ = ["place_markers"]

EXPECTED = 0.2, 1.0  # of a marker's place where views show it, m and rad
WHOLE = 4  # grid: corners of a marker that is seen whole
SHOWN = 8  # grid: markers that a sentence names


def place_markers(table: CornerTable) -> CornerTable:
    """The same with a start for the place of every marker beside the one that most views show. Raises ModelError where no views join
    them."""
    obs = table.pixels
    if not obs.targets:
        return table
    assert obs.target is not None
    view, marker, poses = _sights(obs, obs.target)
    seen = np.zeros((len(table.data.configurations), len(obs.targets)), dtype=bool)
    seen[view, marker] = True
    islands = find_islands(seen)
    if len(islands) > 1:
        apart = "; ".join(", ".join(obs.targets[i].name for i in island[:SHOWN].tolist()) for island in islands[:SHOWN])
        expected = "views that show markers of both groups, or --sheet, which says where all of them are"
        raise ModelError("no view joins some markers to the others", key="marker", found=apart, expected=expected)
    places = _chain(view, marker, poses, seen)
    first = int(seen.sum(axis=0).argmax())
    targets = tuple(
        Frame(f.name, tuple(se3.to_vector(places[i]).tolist()), (i != first,) * 6, "tool", EXPECTED)
        for i, f in enumerate(obs.targets)
    )
    return replace(table, data=replace(table.data, observations=(replace(obs, targets=targets),)))


def _sights(obs: Observations, target: Ints) -> tuple[Ints, Ints, Array]:
    """Each marker in each view that shows it whole: view and marker (S,), and T_camera_marker (S, 4, 4)."""
    order = np.lexsort((target, obs.configuration))
    key = obs.configuration[order] * len(obs.targets) + target[order]
    kinds, first, many = np.unique(key, return_index=True, return_counts=True)
    whole = many >= WHOLE
    rows = order[np.isin(key, kinds[whole])]
    begin = np.cumsum(np.append(0, many[whole][:-1]))
    along = rays(obs, obs.value)
    found = resect_sights(obs.extra["point"][rows], along[rows], begin, 1)
    at = kinds[whole]
    return at // len(obs.targets), at % len(obs.targets), np.stack([best for (best,) in found])


def _chain(view: Ints, marker: Ints, poses: Array, seen: Bools) -> Array:
    """T_first_marker (M, 4, 4), from the marker that most views show to its neighbours, and on from these."""
    count = seen.shape[1]
    where = {(int(v), int(m)): i for i, (v, m) in enumerate(zip(view, marker, strict=True))}
    together = seen.T.astype(np.int64) @ seen
    first = int(seen.sum(axis=0).argmax())
    out = np.tile(np.eye(4), (count, 1, 1))
    done = np.zeros(count, dtype=bool)
    done[first] = True
    while not done.all():
        pair = np.where(done[:, None] & ~done, together, 0)
        one, other = np.unravel_index(int(pair.argmax()), pair.shape)
        both = np.flatnonzero(seen[:, one] & seen[:, other]).tolist()
        ways = np.stack([se3.inverse(poses[where[v, int(one)]]) @ poses[where[v, int(other)]] for v in both])
        apart = np.abs(ways[:, None, :3] - ways[None, :, :3]).sum(axis=(2, 3))
        out[other] = out[one] @ ways[int(np.median(apart, axis=1).argmin())]
        done[other] = True
    return out

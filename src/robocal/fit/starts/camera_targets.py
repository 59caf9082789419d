"""Where targets start that stand on the base and whose places nobody states, as a camera in hand sees them from where poses start.

    T_base_target = T_base_tool T_tool_camera T_camera_target

Each view tells two such places, by the two poses that the corners of a flat target allow. Of all of them, that one is taken which
those of the other views come nearest to: half of the views may be far off.
"""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal._types import Array, Ints
from robocal.geometry import se3
from robocal.measure.data import DataSet, Observations

__all__ = ["place_camera_targets"]


def place_camera_targets(data: DataSet, number: int, some: Ints) -> DataSet:
    """The data with starts of the targets of the camera of that `number` from what it shows at `some` configurations, whose poses have
    starts; a camera that is not in hand leaves all as it is."""
    obs = data.observations[number]
    start = data.configurations.start
    if start is None or obs.kind != "pixels" or obs.frame is None or obs.frame.mount != "tool" or obs.value.ndim != 2:
        return data
    eye, known = se3.from_vector(np.array(start)) @ se3.from_vector(obs.frame.value), {}
    which = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    for i, target in enumerate(obs.targets):
        if target.mount == "base" and all(target.free) and target.prior is None:
            rows = np.flatnonzero((which == i) & np.isin(obs.configuration, some))
            if (place := _place(obs, rows, eye)) is not None:
                known[target.name] = tuple(se3.to_vector(place).tolist())
    observations = tuple(
        replace(o, targets=tuple(replace(t, value=known.get(t.name, t.value)) for t in o.targets))
        for o in data.observations
    )
    return DataSet(data.configurations, observations)


def _place(obs: Observations, rows: Ints, eye: Array) -> Array | None:
    """T_base_target from rows of one target, with T_base_camera (U, 4, 4); None where no view shows enough of it."""
    from robocal.fit.starts.cameras import POINTS, resect_sights
    from robocal.measure.pixels import rays

    rows = rows[np.argsort(obs.configuration[rows], kind="stable")]
    views, at, many = np.unique(obs.configuration[rows], return_inverse=True, return_counts=True)
    rows, views, many = rows[(many >= POINTS)[at]], views[many >= POINTS], many[many >= POINTS]
    if not len(views):
        return None
    point = obs.extra["point"][rows]
    seen = resect_sights(point, rays(obs, obs.value)[rows], np.cumsum(many) - many, 2)
    poses = np.stack([np.stack([found[0], found[-1]]) for found in seen])
    placed = eye[views][:, None] @ poses  # (V, 2, 4, 4)
    ends = placed[..., :3, :3] @ np.unique(point, axis=0).T + placed[..., :3, 3:]
    each = ends.reshape(2 * len(views), -1)
    apart = np.linalg.norm(each[:, None] - each, axis=-1).reshape(len(each), len(views), 2).min(axis=-1)
    return np.asarray(placed.reshape(-1, 4, 4)[int(np.median(apart, axis=1).argmin())])

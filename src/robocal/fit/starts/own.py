"""Where configurations' own poses start: from what each of them shows by itself, in base coordinates.

    lengths    forward kinematics of the nominal robot
    pose       T_base_tool = T_frame_base^-1 T_frame_target T_tool_target^-1
    pixels     the target's pose in the camera (resection), then the same
    position   of a machine that only shifts

Instruments whose place is not known are found from these poses afterwards (`starts.search`), so a robot that can tell
where it is by itself is asked first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.fit.starts.unknown_zeros import replace_by_anchors
from robocal.geometry import se3
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model, freedom_of

__all__ = ["place_configurations"]

TURNS = (3, 4, 5)


def place_configurations(model: Model, data: DataSet) -> DataSet:
    """The data with a start for the pose of every configuration that has one of its own and none stated; components that
    the machine does not have are zero. What shows nothing starts in the middle of the others."""
    freedom = freedom_of(model)
    if freedom is None:
        return data
    count = len(data.configurations)
    given = data.configurations.start
    start = np.full((count, 6), np.nan) if given is None else np.array(given)
    without = np.asarray(np.isnan(start).any(axis=1))
    for kind, obs in product(OWN, data.observations):
        lacking = np.isnan(start).any(axis=1)
        if obs.kind == kind and lacking.any():
            found = OWN[kind](model, obs, lacking)
            good = np.isfinite(found).all(axis=(1, 2)) & lacking
            vector = se3.to_vector(found[good])
            vector[:, [i for i in range(6) if i not in freedom]] = 0.0
            start[good] = vector
    lacking = np.isnan(start).any(axis=1)
    start[lacking] = 0.0 if lacking.all() else np.median(start[~lacking], axis=0)
    start = replace_by_anchors(model, data, start, without, lambda obs: _as_seen(model, obs, count))
    return replace(data, configurations=replace(data.configurations, start=start))


def _first(obs: Observations, lacking: Bools) -> Ints:
    """One row of each configuration that lacks a start."""
    rows = np.flatnonzero(lacking[obs.configuration])
    return np.asarray(rows[np.unique(obs.configuration[rows], return_index=True)[1]])


def _lengths(model: Model, obs: Observations, lacking: Bools) -> Array:
    from robocal.measure.lengths import locate_platform

    return locate_platform(model, obs, lacking)


def _base(obs: Observations, target: Frame | None, seen: Array) -> Array:
    """T_base_tool (k, 4, 4) from poses of the target as the instrument sees it, with frame and target as stated."""
    held = np.eye(4) if target is None else se3.from_vector(target.value)
    frame = np.eye(4) if obs.frame is None else se3.from_vector(obs.frame.value)
    if obs.frame is not None and obs.frame.mount == "tool":
        return np.asarray(held @ se3.inverse(frame @ seen))
    return np.asarray(se3.inverse(frame) @ seen @ se3.inverse(held))


def _by_target(obs: Observations, rows: Ints) -> list[tuple[Frame | None, Ints]]:
    if not obs.targets:
        return [(None, rows)]
    which = np.zeros(len(rows), dtype=np.int64) if obs.target is None else obs.target[rows]
    return [(t, rows[which == i]) for i, t in enumerate(obs.targets)]


def _pose(model: Model, obs: Observations, lacking: Bools) -> Array:
    out = np.full((len(lacking), 4, 4), np.nan)
    for target, rows in _by_target(obs, _first(obs, lacking)):
        out[obs.configuration[rows]] = _base(obs, target, se3.from_vector(obs.value[rows]))
    return out


def _position(model: Model, obs: Observations, lacking: Bools) -> Array:
    out = np.full((len(lacking), 4, 4), np.nan)
    if set(TURNS) & set(freedom_of(model) or ()):
        return out
    for target, rows in _by_target(obs, _first(obs, lacking)):
        vector = np.concatenate([obs.value[rows], np.zeros((len(rows), 3))], axis=1)
        base = np.eye(4) if obs.frame is None else se3.from_vector(obs.frame.value)
        # The platform does not turn, whatever way the instrument stands.
        point = (se3.inverse(base) @ se3.from_vector(vector))[:, :3, 3]
        held = np.zeros(3) if target is None else np.asarray(target.value[:3])
        out[obs.configuration[rows]] = se3.from_vector(np.concatenate([point - held, np.zeros((len(rows), 3))], axis=1))
    return out


def _as_seen(model: Model, obs: Observations, count: int) -> tuple[Array, Array | None]:
    """What an instrument saw of so many configurations with its frame as stated, (U, 4, 4): the tool, and None; or, of positions, the
    target that most rows show, and where on the tool it is (3,)."""
    every = np.ones(count, dtype=np.bool_)
    if obs.kind != "position":
        return _pose(model, obs, every), None
    which = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    most = int(np.bincount(which).argmax())
    out, rows = np.full((count, 4, 4), np.nan), np.flatnonzero(which == most)
    point = np.concatenate([obs.value[rows], np.zeros((len(rows), 3))], axis=1)
    out[obs.configuration[rows]] = _base(obs, None, se3.from_vector(point))
    return out, np.asarray(obs.targets[most].value[:3]) if obs.targets else np.zeros(3)


def _pixels(model: Model, obs: Observations, lacking: Bools) -> Array:
    from robocal.fit.starts.cameras import POINTS, resect
    from robocal.measure.pixels import rays

    out = np.full((len(lacking), 4, 4), np.nan)
    along = rays(obs, obs.value)
    for target, rows in _by_target(obs, np.flatnonzero(lacking[obs.configuration])):
        for c in np.unique(obs.configuration[rows]):
            mine = rows[obs.configuration[rows] == c]
            if np.isnan(out[c, 0, 0]) and len(mine) >= POINTS:
                seen = resect(obs.extra["point"][mine], along[mine], 1)[0]
                out[c] = _base(obs, target, seen[None])[0]
    return out


# In the order in which they are asked.
Place = Callable[[Model, Observations, Bools], Array]
OWN: dict[str, Place] = {"lengths": _lengths, "pose": _pose, "pixels": _pixels, "position": _position}

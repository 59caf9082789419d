"""Where markers on the base start whose places nobody states, before a camera that the machine carries.

    T_camera_marker of each view -> T_map_camera, T_map_marker         the map grows (`vision.map_start`)
    T_base_map     from markers whose places are stated, else from where the machine stands:
                   T_base_map = T_base_tool T_tool_camera T_map_camera^-1, averaged over the views
    T_base_tool = T_base_map T_map_camera T_tool_camera^-1             of poses that are free

A camera whose own place nobody states is found first, as in hand-eye calibration. Images tell poses of a platform far better than
lengths of a robot that is not calibrated yet, so free poses start from them.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from robocal._record import replace
from robocal._types import Array, Bools
from robocal.errors import ModelError
from robocal.fit.starts.cameras import resect_sights
from robocal.fit.starts.frames import hand_eye
from robocal.geometry import fits, se3, so3
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model, freedom_of
from robocal.measure.pixels import rays
from robocal.measure.reach import nominal_poses
from robocal.vision.map_start import MapStart, MarkerSights, grow_map

__all__ = ["leave_lone_targets", "place_targets", "whole_sights"]

WHOLE = 4  # grid: corners of a marker that is seen whole
FEWEST = 3  # grid: views from which a map is placed beside a machine
FULL = 6  # grid: components of a pose that is free altogether


def whole_sights(obs: Observations) -> MarkerSights:
    """Each marker in each view that shows it whole, with both poses that its four corners allow."""
    assert obs.target is not None
    order = np.lexsort((obs.target, obs.configuration))
    key = obs.configuration[order] * len(obs.targets) + obs.target[order]
    kinds, first, many = np.unique(key, return_index=True, return_counts=True)
    whole = many == WHOLE
    rows = order[first[whole, None] + np.arange(WHOLE)]
    along = rays(obs, obs.value)
    found = resect_sights(
        obs.extra["point"][rows].reshape(-1, 3), along[rows].reshape(-1, 3), WHOLE * np.arange(len(rows)), 2
    )
    poses = np.stack([np.stack([some[0], some[-1]]) for some in found]) if found else np.empty((0, 2, 4, 4))
    view, marker = np.divmod(kinds[whole], len(obs.targets))
    return MarkerSights(view, marker, obs.value[rows], obs.extra["point"][rows], poses)


def place_targets(model: Model, data: DataSet) -> DataSet:
    """The data with starts for targets on the base that a camera in hand sees and whose places are not stated, and for poses of
    configurations that are free. What no views join to the map stays as it was."""
    for number, obs in enumerate(data.observations):
        if _asks(obs):
            data = _place(model, data, number)
    return data


def leave_lone_targets(data: DataSet) -> tuple[DataSet, tuple[str, ...]]:
    """The data without targets of unknown places that a single configuration shows, and their names.

    Such a target says nothing of anything else, and its tilt has two answers that are nearly alike: a fit creeps between them. One
    stays where a configuration would lose all that is measured of it. Raises ModelError where no target of a camera would be left.
    """
    left: list[str] = []
    observations: list[Observations] = []
    for own, obs in enumerate(data.observations):
        elsewhere = {t.name for k, o in enumerate(data.observations) if k != own for t in o.targets}
        others = [o.configuration for k, o in enumerate(data.observations) if k != own]
        measured = np.isin(np.arange(len(data.configurations)), np.concatenate([[-1], *others]))
        lone = _lone(obs, elsewhere, measured) if _asks(obs) else ()
        if lone:
            assert obs.target is not None
            number = np.cumsum([i not in lone for i in range(len(obs.targets))]) - 1
            kept = obs.take(np.flatnonzero(~np.isin(obs.target, lone)))
            assert kept.target is not None
            if not len(kept):
                expected = "two views or more of the same marker, or the place of one of them"
                found = f"{len(lone)} markers of {obs.label}"
                raise ModelError(
                    "no marker is in two views: they say nothing of the robot",
                    key="targets",
                    found=found,
                    expected=expected,
                )
            left += [obs.targets[i].name for i in lone]
            targets = tuple(t for i, t in enumerate(obs.targets) if i not in lone)
            obs = replace(kept, target=number[kept.target], targets=targets)
        observations.append(obs)
    return (DataSet(data.configurations, tuple(observations)) if left else data), tuple(left)


def _lone(obs: Observations, elsewhere: Set[str], measured: Bools) -> tuple[int, ...]:
    """Numbers of targets of unknown places that a single configuration shows, and that no other instrument sees; `measured` are
    configurations (U,) of which another instrument tells."""
    assert obs.target is not None
    seen = np.zeros((len(obs.targets), len(measured)), dtype=bool)
    seen[obs.target, obs.configuration] = True
    lone = [i for i, t in enumerate(obs.targets) if _unplaced(t) and seen[i].sum() == 1 and t.name not in elsewhere]
    kept = measured | np.delete(seen, lone, axis=0).any(axis=0)
    return tuple(i for i in lone if (kept | ~seen[i]).all())


def _unplaced(target: Frame) -> bool:
    return target.mount == "base" and all(target.free) and target.prior is None and not any(target.value)


def _asks(obs: Observations) -> bool:
    """Whether several markers of a camera in hand have no place."""
    aboard = obs.kind == "pixels" and obs.frame is not None and obs.frame.mount == "tool" and obs.target is not None
    at_rest = all(t.mount == "base" for t in obs.targets)
    return aboard and at_rest and obs.value.ndim == 2 and sum(map(_unplaced, obs.targets)) > 1


def _place(model: Model, data: DataSet, number: int) -> DataSet:
    obs, count = data.observations[number], len(data.configurations)
    assert obs.frame is not None
    sights = whole_sights(obs)
    if not len(sights.view):
        return data
    lens = obs.options["intrinsics"]
    assert isinstance(lens, tuple)
    grown = grow_map(sights, np.array(lens), count, len(obs.targets))
    shown, placed = _both_known(grown)
    machine = nominal_poses(model, data.configurations)
    stated = np.array([not any(t.free) for t in obs.targets]) & placed
    eye, at = _camera(obs.frame, grown.views, machine, shown)
    if stated.any():
        at = _at_markers(obs, grown.markers, stated)
    if at is None:
        return data
    views, markers = at @ se3.inverse(grown.views), at @ grown.markers  # T_base_camera, T_base_marker
    if machine is not None and eye is not None:
        views, markers = _islands(sights, np.array(lens), machine @ eye, views, markers)
        shown, placed = np.isfinite(views[:, 0, 0]), np.isfinite(markers[:, 0, 0])
    known = {
        t.name: tuple(se3.to_vector(markers[i]).tolist())
        for i, t in enumerate(obs.targets)
        if _unplaced(t) and placed[i]
    }
    camera = obs.frame if eye is None else replace(obs.frame, value=tuple(se3.to_vector(eye).tolist()))
    observations = tuple(
        replace(
            o,
            frame=camera if o.frame == obs.frame else o.frame,
            targets=tuple(replace(t, value=known.get(t.name, t.value)) for t in o.targets),
        )
        for o in data.observations
    )
    configurations = data.configurations
    if eye is not None and len(freedom_of(model) or ()) == FULL:
        start = np.array(configurations.starts)
        start[shown] = se3.to_vector(views[shown] @ se3.inverse(eye))
        configurations = replace(configurations, start=start)
    return DataSet(configurations, observations)


def _both_known(grown: MapStart) -> tuple[Bools, Bools]:
    """Which views (V,) and markers (M,) have a place."""
    return np.isfinite(grown.views[:, 0, 0]), np.isfinite(grown.markers[:, 0, 0])


def _islands(sights: MarkerSights, lens: Array, machine: Array, views: Array, markers: Array) -> tuple[Array, Array]:
    """T_base_camera (V, 4, 4) and T_base_marker (M, 4, 4) with those that no view joins to the rest: each group of them stands where the
    machine's T_base_camera (V, 4, 4) say, moved as these stand to the views that have a place."""
    both = np.isfinite(views[:, 0, 0]) & np.isfinite(machine[:, 0, 0])
    moved = _mean(views[both] @ se3.inverse(machine[both])) if both.any() else np.eye(4)
    views, markers, known = np.array(views), np.array(markers), np.isfinite(machine[:, 0, 0])
    left = np.isnan(markers[sights.marker, 0, 0]) & known[sights.view]
    while left.any():
        some = MarkerSights(
            *(part[left] for part in (sights.view, sights.marker, sights.corners, sights.points, sights.poses))
        )
        grown = grow_map(some, lens, len(views), len(markers))
        shown, placed = _both_known(grown)
        at = moved @ _mean(machine[shown] @ grown.views[shown])
        views[shown], markers[placed] = at @ se3.inverse(grown.views[shown]), at @ grown.markers[placed]
        left &= ~placed[sights.marker]
    return views, markers


def _camera(frame: Frame, views: Array, machine: Array | None, shown: Bools) -> tuple[Array | None, Array | None]:
    """T_tool_camera, as stated or found, and T_base_map, from T_camera_map (V, 4, 4) of the views that are `shown` and T_base_tool; None of
    what cannot be told."""
    stated = any(frame.value) or not any(frame.free)
    eye = se3.from_vector(frame.value) if stated else None
    if machine is None:
        return eye, None
    both = shown & np.isfinite(machine[:, 0, 0])
    if both.sum() < FEWEST:
        return eye, None
    if eye is None:
        away, hand = hand_eye(se3.inverse(views[both]), machine[both])
        return hand, se3.inverse(away)
    return eye, _mean(machine[both] @ eye @ views[both])


def _mean(poses: Array) -> Array:
    """The middle of poses (m, 4, 4): some may be far off."""
    out = np.eye(4)
    out[:3, :3] = so3.project(np.median(poses[:, :3, :3], axis=0))
    out[:3, 3] = np.median(poses[:, :3, 3], axis=0)
    return out


def _at_markers(obs: Observations, markers: Array, stated: Bools) -> Array:
    """T_base_map that brings corners of the markers whose places are `stated` to where these are."""
    source: list[Array] = []
    goal: list[Array] = []
    assert obs.target is not None
    for i in np.flatnonzero(stated).tolist():
        own = np.unique(obs.extra["point"][obs.target == i], axis=0)
        for t, out in ((markers[i], source), (se3.from_vector(obs.targets[i].value), goal)):
            out.append(own @ t[:3, :3].T + t[:3, 3])
    return fits.rigid(np.concatenate(source), np.concatenate(goal))

"""What may be wrong with the views of a camera, each as a change of its rows that would undo it.

    exchanged   u and v have changed places
    mirrored    u counts from the other side; a target that is seen from behind looks the same
    upward      v counts from below, as mathematics has it: mirrored, and turned by half a turn about the axis of the camera
    shift       the views are k places off their configurations
    turned      labels of a target that looks the same after half a turn count from its other end, in some views or in all

Which views are turned needs no frame. With Y the pose of the target in the camera and T that of what carries it, Y_i Y_j^-1 is
T_i T_j^-1 in other axes, so both turn by one angle. Half a turn S of one of the two, Y_i S Y_j^-1, turns by another. The pairs vote:

    M_ij = | |Y_i S Y_j^-1| - |T_i T_j^-1| | - | |Y_i Y_j^-1| - |T_i T_j^-1| |,     labels = signs of the first eigenvector

A few views whose pose is wrong move none of the others. Source: Singer, Angular synchronization by eigenvectors (2011).
"""

from __future__ import annotations

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.fit.starts.cameras import resect_sights
from robocal.measure.data import Observations
from robocal.measure.pixels import HALF_TURNS, rays

__all__ = [
    "ViewPoses",
    "exchange_axes",
    "flip",
    "half_turn",
    "half_turn_of",
    "half_turns_open",
    "knows_turn",
    "mirror",
    "shift_views",
    "turn_views",
    "turned_views",
    "view_poses",
]

SAME = 1e-6  # tolerance: m, points of a target that are one
ENOUGH = 4  # tolerance: points that make a pose
SHOWN = 16  # grid: points of a view that tell its pose


def exchange_axes(obs: Observations) -> Observations:
    """The same rows, u in the place of v."""
    swap = {n: v[..., ::-1] for n in ("value", "sigma", "digits", "rounding") if (v := getattr(obs, n)) is not None}
    return replace(obs, **swap)


def mirror(obs: Observations) -> Observations:
    """The same rows, u counted from the other side of the middle of the lens."""
    intrinsics = obs.options["intrinsics"]
    assert isinstance(intrinsics, tuple)
    value = np.array(obs.value)
    value[..., 0] = 2 * intrinsics[2] - value[..., 0]
    return replace(obs, value=value)


def flip(obs: Observations) -> Observations:
    """The same rows, v counted from the other side of the middle of the lens."""
    intrinsics = obs.options["intrinsics"]
    assert isinstance(intrinsics, tuple)
    value = np.array(obs.value)
    value[..., 1] = 2 * intrinsics[3] - value[..., 1]
    return replace(obs, value=value)


def knows_turn(obs: Observations) -> bool:
    """Whether something is known of how a camera is turned."""
    return obs.frame is not None and (obs.frame.prior is not None or not all(obs.frame.free[3:]))


def shift_views(obs: Observations, shift: int) -> Observations:
    """The views each beside the configuration `shift` views later in the file; those without one are left out."""
    first = np.unique(obs.configuration, return_index=True)
    order = first[0][np.argsort(first[1], kind="stable")]
    rank = np.empty(int(order.max()) + 1, dtype=np.int64)
    rank[order] = np.arange(len(order))
    to = rank[obs.configuration] + shift
    inside = np.flatnonzero((to >= 0) & (to < len(order)))
    return replace(obs.take(inside), configuration=order[to[inside]])


def half_turn(obs: Observations) -> Array | None:
    """The motion (4, 4) of the target after which its points are the same; None where it has none, or there are several targets."""
    return None if len(obs.targets) > 1 else half_turn_of(obs.extra["point"])


def half_turn_of(points: Array) -> Array | None:
    """The motion (4, 4) by half a turn about the normal of points (k, 3) after which they are the same; None where there is none."""
    points = np.unique(np.round(points, 9), axis=0)
    if len(points) < ENOUGH:
        return None
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
    turn = np.eye(4)
    turn[:3, :3] = 2 * np.outer(normal, normal) - np.eye(3)
    turn[:3, 3] = centre - turn[:3, :3] @ centre
    there = points @ turn[:3, :3].T + turn[:3, 3]
    away = np.linalg.norm(there[:, None] - points, axis=2).min(axis=1)
    return turn if away.max() < SAME else None


def half_turns_open(obs: Observations) -> bool:
    """Whether a view may count its target from either end, and the data file says so."""
    return bool(obs.options.get(HALF_TURNS))


def turn_views(obs: Observations, turn: Array, views: Bools) -> Observations:
    """The same rows, where the points of some configurations (U,) count from the other end."""
    point = np.array(obs.extra["point"])
    mine = views[obs.configuration]
    point[mine] = point[mine] @ turn[:3, :3].T + turn[:3, 3]
    return replace(obs, extra={**obs.extra, "point": point})


@record
class ViewPoses:
    """The configurations (V,) of views, and the pose of the target in the camera that each shows by itself, (V, 4, 4)."""

    configuration: Ints
    pose: Array


def view_poses(obs: Observations) -> ViewPoses:
    """The pose of the only target in every view that shows enough points of it."""
    where = np.unique(obs.configuration)
    rows = [np.flatnonzero(obs.configuration == c) for c in where]
    some = [r[np.unique(np.linspace(0, len(r) - 1, SHOWN).astype(np.int64))] for r in rows if len(r) >= ENOUGH]
    if not some:
        return ViewPoses(where[:0], np.zeros((0, 4, 4)))
    every, first = np.concatenate(some), np.cumsum([0, *map(len, some[:-1])])
    found = resect_sights(obs.extra["point"][every], rays(obs, obs.value[every]), first, 1)
    return ViewPoses(obs.configuration[every[first]], np.stack([best for (best,) in found]))


def turned_views(views: ViewPoses, turn: Array, carrier: Array) -> Bools:
    """Which views (V,) are turned against most of the others, where what carries the target, or the camera, is at (V, 4, 4)."""
    y, t = views.pose[:, :3, :3], carrier[:, :3, :3]
    moved = _angles(t, t)
    votes = np.abs(_angles(y @ turn[:3, :3], y) - moved) - np.abs(_angles(y, y) - moved)
    np.fill_diagonal(votes, 0.0)
    side = np.linalg.eigh(votes)[1][:, -1] > 0
    return side if 2 * side.sum() < len(side) else ~side


def _angles(one: Array, other: Array) -> Array:
    """The angle of R_i R_j^T for every pair, (V, V)."""
    trace = np.einsum("iab,jab->ij", one, other)
    return np.asarray(np.arccos(np.clip((trace - 1) / 2, -1, 1)))

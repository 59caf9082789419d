"""The ends of the segments along which cables run: as lines of a picture, and what small motions of one body do to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from robocal._types import Array
from robocal.cables.rail import RAIL
from robocal.cables.reeving import Reeving

__all__ = ["motions", "points_of", "segment_lines"]


def points_of(segments: Reeving, ends: Array, platform: bool) -> Array:
    """The ends (n, 3) on one body: of ends (p, 7) the first ones, then the second ones."""
    sides = (ends[:, :3], ends[:, 3:6])
    return np.concatenate([side[moves == platform] for side, moves in zip(sides, segments.moves.T, strict=True)])


def segment_lines(segments: Reeving, ends: Array, poses: Array) -> Mapping[str, Array]:
    """Each segment from its second end, that on the platform, to its first, (k, 2, 3) at poses (k, 4, 4)."""
    out = {}
    for name, moves, numbers in zip(segments.names, segments.moves, ends, strict=True):
        points = [
            poses[:, :3, 3] + poses[:, :3, :3] @ point if moved else np.tile(point, (len(poses), 1))
            for point, moved in zip((numbers[:3], numbers[3:6]), moves, strict=True)
        ]
        out[name] = np.stack(points[::-1], axis=1)
    return out


def motions(
    segments: Reeving, ends: Array, rails: Array | None, axes: Sequence[int], row: Callable[[str], str]
) -> Mapping[str, Mapping[str, float]]:
    """Small motions of the base, of the platform's coordinates, and of both together where a robot with components `axes` of the twist
    lacks a direction: rates of the numbers, which stand under the names that `row` says."""
    out: dict[str, Mapping[str, float]] = {}
    of_base, of_platform = (_rates(segments, ends, rails, platform, row) for platform in (False, True))
    of_both = [{**p, **b} for b, p in zip(of_base, of_platform, strict=True)]
    for whose, rates in (("the base", of_base), ("the platform", of_platform), ("base and platform", of_both)):
        for i, rate in enumerate(rates):
            # A motion of both that the robot can follow is a motion of each.
            if rate and not (rates is of_both and i in axes):
                out[f"{whose} {'along' if i < 3 else 'about'} {'xyz'[i % 3]}"] = rate
    return out


def _rates(
    segments: Reeving, ends: Array, rails: Array | None, platform: bool, row: Callable[[str], str]
) -> list[dict[str, float]]:
    """What the six small motions of one body's coordinates do to the ends on it, and to the directions of rails; `row` says under which
    name a number stands."""
    at = [(i, e) for e in (0, 1) for i, moves in enumerate(segments.moves) if bool(moves[e]) == platform]
    names = [row(f"{segments.names[i]}.{'ab'[e]}{s}") for i, e in at for s in "xyz"]
    slides = [] if platform or rails is None else np.flatnonzero(rails[:, 2:].any(axis=1)).tolist()
    names += [row(f"{segments.names[i]}.{s}") for i in slides for s in RAIL[2:]]
    points = points_of(segments, ends, platform)
    turns = np.zeros((0, 3)) if rails is None else rails[slides, 2:]
    moved = [np.concatenate([np.tile(e, (len(points), 1)), 0 * turns]) for e in np.eye(3)]
    moved += [np.concatenate([np.cross(e, points), np.cross(e, turns)]) for e in np.eye(3)]
    return [{n: float(v) for n, v in zip(names, m.ravel(), strict=True) if v != 0.0} for m in moved]

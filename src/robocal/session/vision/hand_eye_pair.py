"""Which pose of the robot belongs to which view: by name, by order or by time. What was paired is always shown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.files.robot_poses import RobotPoses

__all__ = ["WAYS", "Pairs", "pair_views"]

WAYS = ("name", "order", "time")
CLOCKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
NEAR = 0.5  # tolerance: of the time from one pose to the next
SHOWN = 8  # grid: names that a message lists


@record(eq=False)
class Pairs:
    """View and pose (n,) of every pair, how they were found, in words, and what has no partner: names of views and poses."""

    view: Ints
    pose: Ints
    method: str
    description: str
    views_alone: tuple[str, ...] = ()
    poses_alone: tuple[str, ...] = ()


def pair_views(views: Sequence[str], poses: RobotPoses, way: str | None = None) -> Pairs:
    """Pairs of views and poses: by `way`, else by names where these are the same, else in order where there are as many of both. Raises
    ModelError."""
    if way == "time":
        return _by_time(views, poses)
    if way != "order" and poses.names is not None:
        found = _by_name(views, poses.names)
        if found is not None:
            return found
    if way == "name":
        found_names = "no names" if poses.names is None else _some(poses.names)
        raise ModelError("no pose has the name of a view", key="--pair", found=found_names, expected=_some(views))
    if len(views) != len(poses):
        expected = f"a column `image` beside the poses with names as {_some(views[:3])}, or as many of both"
        found_counts = f"{len(views)} views and {len(poses)} poses"
        raise ModelError(
            "views and poses cannot be paired in order", key="--pair", found=found_counts, expected=expected
        )
    every = np.arange(len(views))
    return Pairs(every, every, "order", "in order: the first view with the first pose")


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")


def _by_name(views: Sequence[str], names: Sequence[str]) -> Pairs | None:
    """By whole names, else by the names of files without folder and end."""
    for words in (_whole, _stem):
        mine, theirs = list(map(words, views)), list(map(words, names))
        at = {n: i for i, n in enumerate(theirs)}
        both = [(i, at[n]) for i, n in enumerate(mine) if n in at]
        if both and len(at) == len(theirs) and len(set(mine)) == len(mine):
            view, pose = np.array(both).T
            alone = tuple(v for i, v in enumerate(views) if i not in set(view.tolist()))
            rest = tuple(v for i, v in enumerate(names) if i not in set(pose.tolist()))
            return Pairs(view, pose, "name", "by name", alone, rest)
        twice = sorted({n for n in theirs if theirs.count(n) > 1} & set(mine))
        if twice:
            raise ModelError(
                "several poses have the name of one view",
                key="--pair",
                found=_some(twice),
                expected="one pose for each view",
            )
    return None


def _whole(name: str) -> str:
    return name.replace("\\", "/").strip().casefold()


def _stem(name: str) -> str:
    path = PurePath(_whole(name))
    return path.name if path.suffix[1:].isdigit() else path.stem  # 1700000000.25 is a time, not a file of kind 25


def _by_time(views: Sequence[str], poses: RobotPoses) -> Pairs:
    """The nearest pose in time to each view, whose name is its time."""
    if poses.times is None:
        raise ModelError(
            "the poses have no times", key="--pair", found="no column time", expected="time [s] beside the poses"
        )
    found = [re.search(r"\d+(?:\.\d+)?", _stem(v)) for v in views]
    if any(f is None for f in found):
        raise ModelError(
            "the names of views are no times", key="--pair", found=_some(views), expected="times, as 1700000000.25.png"
        )
    stamp, times = np.array([float(f[0]) for f in found if f is not None]), poses.times
    order = np.argsort(times)
    unit = next((u for u, f in CLOCKS.items() if _overlap(stamp * f, times)), None)
    if unit is None:
        span = f"views {stamp.min():.10g} to {stamp.max():.10g}, poses {times.min():.10g} to {times.max():.10g} s"
        expected = "one clock, and the unit in the head of the column: time [ms]"
        raise ModelError(
            "views and poses are of different times, in every unit", key="--pair", found=span, expected=expected
        )
    stamp = stamp * CLOCKS[unit]
    after = np.clip(np.searchsorted(times[order], stamp), 1, max(len(order) - 1, 1))
    both = np.stack([order[after - 1], order[np.minimum(after, len(order) - 1)]])
    near = both[np.abs(times[both] - stamp).argmin(axis=0), np.arange(len(stamp))]
    step = float(np.median(np.diff(times[order]))) if len(times) > 1 else np.inf
    good = np.abs(times[near] - stamp) <= NEAR * step
    view = np.flatnonzero(good)
    alone = tuple(views[i] for i in np.flatnonzero(~good).tolist())
    apart = 1e3 * float(np.abs(times[near] - stamp)[good].max(initial=0.0))
    words = f"by time, names of views read in {unit}: at most {apart:.3g} ms apart"
    if not len(view):
        raise ModelError(
            "no pose is near a view in time",
            key="--pair",
            found=f"{step:.3g} s from pose to pose",
            expected="poses at the times of views",
        )
    return Pairs(view, near[view], "time", words, alone)


def _overlap(one: Array, other: Array) -> bool:
    span = max(np.ptp(other), 1e-9)
    inside = (one >= other.min() - 0.05 * span) & (
        one <= other.max() + 0.05 * span
    )  # tolerance: of the span, at its ends
    return bool(2 * inside.sum() > len(one))

"""Which pose of the robot belongs to which view: by name, by order or by time. What was paired is always shown."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import PurePath

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.files.robot_poses import RobotPoses

__all__ = ["WAYS", "Pairs", "pair_views", "some_names"]

WAYS = ("name", "order", "time")
CLOCKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
NEAR = 0.5  # tolerance: of the time from one pose to the next
ENDS = 0.05  # tolerance: of the span of poses, beyond its ends
SPAN = 0.02  # tolerance: of the span of poses that views fill at least, where another unit would do better
LATEST = 4e9  # tolerance: s; a clock that counts from 1970 is there in 2096
SHOWN = 8  # grid: names that a message lists


@record(eq=False)
class Pairs:
    """View and pose (n,) of every pair, how they were found, in words, what has no partner: names of views and poses; and the `time` (n,)
    of the view, s, where these were paired by it."""

    view: Ints
    pose: Ints
    method: str
    description: str
    views_alone: tuple[str, ...] = ()
    poses_alone: tuple[str, ...] = ()
    time: Array | None = None

    def take(self, index: Ints) -> Pairs:
        """Some of the pairs."""
        time = None if self.time is None else self.time[index]
        return replace(self, view=self.view[index], pose=self.pose[index], time=time)


def pair_views(
    views: Sequence[str], poses: RobotPoses, way: str | None = None, *, named: bool = True, times: Array | None = None
) -> Pairs:
    """Pairs of views and poses: by `way`, else by names where both have some, else in order where there are as many of both. Views may be
    numbered rows that are not `named`, and may have `times` (s). Raises ModelError."""
    if way == "time":
        return _by_time(views, poses, times)
    if way == "name" and (poses.names is None or not named):
        found_names = f"no names of {'poses' if poses.names is None else 'views'}"
        expected = "a column `image` beside both" if not named else f"a column `image` with {some_names(views[:3])}"
        raise ModelError("names cannot pair views and poses", key="--pair", found=found_names, expected=expected)
    if way != "order" and named and poses.names is not None:
        found = _by_name(views, poses.names)
        if found is not None:
            return found
        both = f"views {some_names(views[:3])}; poses {some_names(poses.names[:3])}"
        expected = "the names of the views beside the poses; or --pair order, where the first belongs to the first"
        raise ModelError("no pose has the name of a view", key="--pair", found=both, expected=expected)
    if len(views) != len(poses):
        expected = f"a column `image` beside the poses with names as {some_names(views[:3])}, or as many of both"
        found_counts = f"{len(views)} views and {len(poses)} poses"
        raise ModelError(
            "views and poses cannot be paired in order", key="--pair", found=found_counts, expected=expected
        )
    every = np.arange(len(views))
    return Pairs(every, every, "order", "in order: the first view with the first pose")


def some_names(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    return ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")


def _by_name(views: Sequence[str], names: Sequence[str]) -> Pairs | None:
    """By whole names, else by the names of files without folder and end; None where no pose has the name of a view."""
    for words in (_whole, _stem):
        mine, theirs = list(map(words, views)), list(map(words, names))
        at = {n: i for i, n in enumerate(theirs)}
        both = [(i, at[n]) for i, n in enumerate(mine) if n in at]
        for count, some, one in ((Counter(theirs), "poses", "view"), (Counter(mine), "views", "pose")):
            twice = sorted(n for n in {mine[i] for i, _ in both} if count[n] > 1)
            if twice:
                message = f"several {some} have the name of one {one}"
                raise ModelError(message, key="--pair", found=some_names(twice), expected="one pose for each view")
        if both:
            view, pose = np.array(both).T
            alone = tuple(v for i, v in enumerate(views) if i not in set(view.tolist()))
            rest = tuple(v for i, v in enumerate(names) if i not in set(pose.tolist()) and v.strip())
            return Pairs(view, pose, "name", "by name", alone, rest)
    return None


def _whole(name: str) -> str:
    return name.replace("\\", "/").strip().casefold()


def _stem(name: str) -> str:
    path = PurePath(_whole(name))
    return path.name if path.suffix[1:].isdigit() else path.stem  # 1700000000.25 is a time, not a file of kind 25


def _by_time(views: Sequence[str], poses: RobotPoses, times: Array | None) -> Pairs:
    """The nearest pose in time to each view, whose name is its time where it has no other."""
    if poses.times is None:
        raise ModelError(
            "the poses have no times", key="--pair", found="no column time", expected="time [s] beside the poses"
        )
    stamp = _stamps(views) if times is None else times
    unit = _clock(stamp, poses)
    stamp, times = stamp * CLOCKS[unit], poses.times
    order = np.argsort(times)
    after = np.clip(np.searchsorted(times[order], stamp), 1, max(len(order) - 1, 1))
    both = np.stack([order[after - 1], order[np.minimum(after, len(order) - 1)]])
    near = both[np.abs(times[both] - stamp).argmin(axis=0), np.arange(len(stamp))]
    step = float(np.median(np.diff(times[order]))) if len(times) > 1 else np.inf
    good = np.abs(times[near] - stamp) <= NEAR * step
    view = np.flatnonzero(good)
    alone = tuple(views[i] for i in np.flatnonzero(~good).tolist())
    apart = 1e3 * float(np.abs(times[near] - stamp)[good].max(initial=0.0))
    words = f"by time, that of views read in {unit}: at most {apart:.3g} ms apart"
    if not len(view):
        raise ModelError(
            "no pose is near a view in time",
            key="--pair",
            found=f"{step:.3g} s from pose to pose",
            expected="poses at the times of views",
        )
    return Pairs(view, near[view], "time", words, alone, time=stamp[view])


def _stamps(views: Sequence[str]) -> Array:
    """The first number in the name of each view."""
    found = [re.search(r"\d+(?:\.\d+)?", _stem(v)) for v in views]
    if any(f is None for f in found):
        raise ModelError(
            "the names of views are no times",
            key="--pair",
            found=some_names(views),
            expected="times, as 1700000000.25.png",
        )
    return np.array([float(f[0]) for f in found if f is not None])


def _clock(stamp: Array, poses: RobotPoses) -> str:
    """The unit of the times of views, with those of poses as they were read. Raises ModelError, with the unit of poses that would fit."""
    assert poses.times is not None
    fits = list(_units(stamp, poses.times))
    if fits and fits[0][1] >= SPAN and poses.times.max() < LATEST:
        return fits[0][0]
    stated = CLOCKS[poses.clock or "s"]
    others = [
        (unit, other)
        for other, factor in CLOCKS.items()
        if factor != stated and (poses.times * factor / stated).max() < LATEST
        for unit, share in _units(stamp, poses.times * factor / stated)
        if share >= SPAN
    ]
    span = f"views {stamp.min():.10g} to {stamp.max():.10g}, poses {poses.times.min() / stated:.10g} to {poses.times.max() / stated:.10g}"
    if others:
        unit, other = others[0]
        raise ModelError(
            f"the times of poses, read in {poses.clock or 's'}, do not fit views; in {other} they do (views in {unit})",
            key="--pair",
            found=span,
            expected=f"`time [{other}]` as the head of the column, if so",
        )
    if not fits:
        raise ModelError(
            "views and poses are of different times, in every unit",
            key="--pair",
            found=span,
            expected="one clock, and the unit in the head of the column: time [ms]",
        )
    return fits[0][0]


def _units(stamp: Array, times: Array) -> Iterator[tuple[str, float]]:
    """Units in which most views are within the times (s) of poses, and the share of these that views fill."""
    span = max(float(np.ptp(times)), 1e-9)
    for unit, factor in CLOCKS.items():
        inside = np.abs(stamp * factor - (times.max() + times.min()) / 2) <= (0.5 + ENDS) * span
        if 2 * inside.sum() > len(stamp):
            yield unit, float(np.ptp(stamp)) * factor / span

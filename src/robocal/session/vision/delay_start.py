"""About how far a camera's clock is behind a robot's: both turn by the same angle at the same time, whichever way the camera is held.

    delay = argmin median_i | |log R_cam(t_i, t_j)| - |log R_robot(t_i - delay, t_j - delay)| |,    t_j - t_i >= SPAN

A turn over a span is a hundred times the noise of a pose, where a speed from frame to frame is not. The median bears wrong views.
Source of the idea: Furrer et al., Field and Service Robotics (2017).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.geometry.pose_path import PosePath

__all__ = ["start_delay"]

SPAN = 0.2  # grid: s
FARTHEST, STEP = 0.6, 0.005  # grid: s, of delays that are tried
FAR, CLEAR = 5.0, 0.25  # grid: s that are tried where no near delay leaves a quarter of what delays leave
ENOUGH = 0.5  # grid: of the spans, that must lie within the path


def start_delay(path: PosePath, time: Array, seen: Array) -> float:
    """The delay (s) of times (m,) at which poses (m, 4, 4) were seen, a far one where it is clear and no near one is; 0 where nothing
    tells it."""
    near, clear = _search(path, time, seen, FARTHEST)
    if clear:
        return near
    far, clear = _search(path, time, seen, FAR)
    return far if clear else near


def _search(path: PosePath, time: Array, seen: Array, farthest: float) -> tuple[float, bool]:
    order = np.argsort(time, kind="stable")
    time, seen = time[order], seen[order]
    first = np.arange(len(time))
    second = np.searchsorted(time, time + SPAN)
    first, second = first[second < len(time)], second[second < len(time)]
    turned = _angle(seen[first], seen[second])
    delays = np.arange(-farthest, farthest + STEP / 2, STEP)
    delays = delays[np.argsort(np.abs(delays), kind="stable")]
    missed = np.full(len(delays), np.inf)
    middle = (path.time[1:] + path.time[:-1]) / 2
    for k, delay in enumerate(delays):
        inside = path.inside(time - delay)
        inside = inside[first] & inside[second]
        if inside.sum() > ENOUGH * len(first):
            a, b = (np.searchsorted(middle, time[i[inside]] - delay) for i in (first, second))
            missed[k] = np.median(np.abs(turned[inside] - _angle(path.poses[a], path.poses[b])))
    if not (tried := np.isfinite(missed)).any():
        return 0.0, False
    return float(delays[np.argmin(missed)]), bool(missed.min() < CLEAR * np.median(missed[tried]))


def _angle(a: Array, b: Array) -> Array:
    """The angle (m,) from poses (m, 4, 4) to others, rad; by its chord, which is exact where it is small."""
    chord = np.linalg.norm(a[:, :3, :3] - b[:, :3, :3], axis=(1, 2)) / np.sqrt(8)
    return np.asarray(2 * np.arcsin(np.minimum(chord, 1.0)))

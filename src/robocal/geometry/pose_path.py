"""A path of poses that were recorded at times: where it is in between, and how fast it moves there.

    log(T_c^-1 T_k) = a_0 + a_1 (t_k - t) + a_2 (t_k - t)^2        over the nearest records c - h <= k <= c + h

T_c is the record nearest to t. The least-squares parabola is the pose at t, T_c exp(a_0), with less noise than one record, and a_1 is
its twist. For twists h is the widest of some windows whose parabolas leave no more than the noise that the narrowest shows: a noisy twist
bends what is found of a delay. Source: Savitzky and Golay, Analytical Chemistry 36 (1964), for vectors.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.geometry import se3, so3

__all__ = ["PosePath"]

DEGREE = 2
WINDOW = 0.02  # grid: s; a machine's acceleration hardly changes in that time
LEAST, MOST = 1, 10  # grid: records on each side
WIDER = (2, 4, 8)  # grid: times that window, where noise is most of what parabolas leave
NOISE_ALONE = 1.1  # tolerance: of the variance that the narrowest window leaves
CENTRES = 200  # grid: records around which that is read


@record(eq=False)
class PosePath:
    """Times (n,) in s that grow, and poses (n, 4, 4), three at least."""

    time: Array
    poses: Array

    def inside(self, time: Array) -> Bools:
        """Which times (m,) lie within the records."""
        return np.asarray((time >= self.time[0]) & (time <= self.time[-1]))

    @property
    def side(self) -> int:
        """How many records on each side of the nearest count for a pose."""
        step = max(float(np.median(np.diff(self.time))), 1e-9)
        return int(np.clip(WINDOW / step, LEAST, min(MOST, (len(self.time) - 1) // 2)))

    @cached_property
    def wide(self) -> int:
        """How many count for a twist."""
        side = self.side
        if 2 * side <= DEGREE:
            return side
        least, found = self._left(side), side
        for times in WIDER:
            if 2 * times * side + 1 > len(self.time) or (self._left(times * side) > NOISE_ALONE * least).any():
                break
            found = times * side
        return found

    def _left(self, side: int) -> Array:
        """What parabolas through so many records leave of each, (2,): the variance of place (m^2) and turn (rad^2)."""
        n = len(self.time)
        near = np.unique(np.linspace(side, n - 1 - side, CENTRES).astype(np.int64))
        values, when = self._around(near, self.time[near], side)
        design = (when / np.abs(when).max())[..., None] ** np.arange(DEGREE + 1)
        rest = values - design @ (np.linalg.pinv(design) @ values)
        square = np.sum(rest**2, axis=(0, 1)).reshape(2, 3).sum(axis=1)
        return np.asarray(square / (3 * len(near) * (2 * side - DEGREE)))

    def _parabola(self, near: Ints, time: Array, side: int) -> tuple[Array, Array]:
        """Place and speed (m, 6) at times (m,), from the record that is `near` each."""
        values, when = self._around(near, time, side)
        scale = np.abs(when).max()
        found = np.linalg.pinv((when / scale)[..., None] ** np.arange(DEGREE + 1)) @ values
        return found[:, 0], found[:, 1] / scale

    def _around(self, near: Ints, time: Array, side: int) -> tuple[Array, Array]:
        """Records around `near` (m,) as vectors from it, (m, k, 6), and their times from `time` (m,), (m, k)."""
        n = len(self.time)
        window = np.clip(near, side, n - 1 - side)[:, None] + np.arange(-side, side + 1)
        centre = self.poses[near]
        rt = np.swapaxes(centre[:, :3, :3], 1, 2)[:, None]
        away = (self.poses[window, :3, 3] - centre[:, None, :3, 3])[..., None]
        turn = so3.log(rt @ self.poses[window, :3, :3])
        return np.concatenate([(rt @ away)[..., 0], turn], axis=2), self.time[window] - time[:, None]

    def at(self, time: Array) -> tuple[Array, Array]:
        """Poses (m, 4, 4) at times (m,), and their twists (m, 6) in base coordinates (m/s, rad/s): the velocity of the point that is
        at the base's origin, and the turn."""
        after = np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1)
        near = after - (np.abs(self.time[after - 1] - time) < np.abs(self.time[after] - time))
        place = self._parabola(near, time, self.side)[0]
        speed = self._parabola(near, time, self.wide)[1]
        centre = self.poses[near]
        r = centre[:, :3, :3]
        pose = se3.compose(r @ so3.exp(place[:, 3:]), centre[:, :3, 3] + (r @ place[:, :3, None])[..., 0])
        v, w = (r @ speed[:, :3, None])[..., 0], (r @ speed[:, 3:, None])[..., 0]
        return pose, np.concatenate([v - np.cross(w, pose[:, :3, 3]), w], axis=1)

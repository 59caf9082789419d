"""A path of poses that were recorded at times: where it is in between, and how fast it moves there.

    log(T_c^-1 T_k) = a_0 + a_1 (t_k - t) + a_2 (t_k - t)^2        over the nearest records c - h <= k <= c + h

T_c is the record nearest to t. The least-squares parabola is the pose at t, T_c exp(a_0), with less noise than one record, and a_1 is
its twist. Source: Savitzky and Golay, Analytical Chemistry 36 (1964), for vectors.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.geometry import se3, so3

__all__ = ["PosePath"]

WINDOW = 0.02  # grid: s; a machine's acceleration hardly changes in that time
LEAST, MOST = 1, 10  # grid: records on each side


@record(eq=False)
class PosePath:
    """Times (n,) in s that grow, and poses (n, 4, 4), three at least."""

    time: Array
    poses: Array

    def inside(self, time: Array) -> Bools:
        """Which times (m,) lie within the records."""
        return np.asarray((time >= self.time[0]) & (time <= self.time[-1]))

    def at(self, time: Array) -> tuple[Array, Array]:
        """Poses (m, 4, 4) at times (m,), and their twists (m, 6) in base coordinates (m/s, rad/s): the velocity of the point that is
        at the base's origin, and the turn."""
        n = len(self.time)
        side = int(np.clip(WINDOW / max(float(np.median(np.diff(self.time))), 1e-9), LEAST, min(MOST, (n - 1) // 2)))
        after = np.clip(np.searchsorted(self.time, time), 1, n - 1)
        near = after - (np.abs(self.time[after - 1] - time) < np.abs(self.time[after] - time))
        window = np.clip(near, side, n - 1 - side)[:, None] + np.arange(-side, side + 1)
        centre = self.poses[near]
        rt = np.swapaxes(centre[:, :3, :3], 1, 2)[:, None]
        away = (self.poses[window, :3, 3] - centre[:, None, :3, 3])[..., None]
        turn = so3.log(rt @ self.poses[window, :3, :3])
        values = np.concatenate([(rt @ away)[..., 0], turn], axis=2)
        when = self.time[window] - time[:, None]
        scale = np.abs(when).max()
        design = (when / scale)[..., None] ** np.arange(3)
        found = np.linalg.pinv(design) @ values
        place, speed = found[:, 0], found[:, 1] / scale
        r = centre[:, :3, :3]
        pose = se3.compose(r @ so3.exp(place[:, 3:]), centre[:, :3, 3] + (r @ place[:, :3, None])[..., 0])
        v, w = (r @ speed[:, :3, None])[..., 0], (r @ speed[:, 3:, None])[..., 0]
        return pose, np.concatenate([v - np.cross(w, pose[:, :3, 3]), w], axis=1)

"""Position and analytic Jacobian of the job's arm, compiled: the one derivative that scipy and Ceres are both given.

Written as a fair opponent would: one pass forward for the frames, one pass for the columns, small work arrays alone.
The residual is whitened, (p - y) / sigma, and only the free columns are written.
"""

import numpy as np
from numba import njit

JOINTS = 5
COLUMNS = 4 * JOINTS + 3


def slots(free) -> np.ndarray:
    """For each of the 23 parameters its column in the Jacobian, or -1 if it is fixed."""
    out = np.full(COLUMNS, -1)
    out[free] = np.arange(len(free))
    return out


@njit
def _cross_into(out, column, u, px, py, pz, k):
    out[0, column] = k * (u[1] * pz - u[2] * py)
    out[1, column] = k * (u[2] * px - u[0] * pz)
    out[2, column] = k * (u[0] * py - u[1] * px)


@njit
def one_pose(x, q, y, weight, slot, want_jacobian, residual, out):
    """Whitened residual (3,) and Jacobian (3, n free) of one pose; x is the full vector (23,)."""
    axes = np.empty((JOINTS, 4, 3))  # x axis, origin before, z axis, origin after
    r = np.eye(3)
    o = np.zeros(3)
    for i in range(JOINTS):
        ca, sa = np.cos(x[4 * i]), np.sin(x[4 * i])
        c, s = np.cos(x[4 * i + 2] + q[i]), np.sin(x[4 * i + 2] + q[i])
        a, d = x[4 * i + 1], x[4 * i + 3]
        for k in range(3):
            rx, ry, rz = r[k, 0], r[k, 1], r[k, 2]
            y1 = ca * ry + sa * rz
            z1 = ca * rz - sa * ry
            axes[i, 0, k] = rx
            axes[i, 1, k] = o[k]
            axes[i, 2, k] = z1
            o[k] += a * rx + d * z1
            axes[i, 3, k] = o[k]
            r[k, 0] = c * rx + s * y1
            r[k, 1] = c * y1 - s * rx
            r[k, 2] = z1
    t = 4 * JOINTS
    px = o[0] + r[0, 0] * x[t] + r[0, 1] * x[t + 1] + r[0, 2] * x[t + 2]
    py = o[1] + r[1, 0] * x[t] + r[1, 1] * x[t + 1] + r[1, 2] * x[t + 2]
    pz = o[2] + r[2, 0] * x[t] + r[2, 1] * x[t + 1] + r[2, 2] * x[t + 2]
    residual[0] = weight * (px - y[0])
    residual[1] = weight * (py - y[1])
    residual[2] = weight * (pz - y[2])
    if not want_jacobian:
        return
    for i in range(JOINTS):
        e = axes[i]
        if slot[4 * i] >= 0:
            _cross_into(out, slot[4 * i], e[0], px - e[1, 0], py - e[1, 1], pz - e[1, 2], weight)
        if slot[4 * i + 1] >= 0:
            for k in range(3):
                out[k, slot[4 * i + 1]] = weight * e[0, k]
        if slot[4 * i + 2] >= 0:
            _cross_into(out, slot[4 * i + 2], e[2], px - e[3, 0], py - e[3, 1], pz - e[3, 2], weight)
        if slot[4 * i + 3] >= 0:
            for k in range(3):
                out[k, slot[4 * i + 3]] = weight * e[2, k]
    for j in range(3):
        if slot[t + j] >= 0:
            for k in range(3):
                out[k, slot[t + j]] = weight * r[k, j]


@njit
def pose_free(free_values, nominal, free, q, y, weight, slot, want_jacobian, residual, out):
    """`one_pose` from the free values; `residual` and `out` are flat, as Ceres hands them."""
    x = nominal.copy()
    x[free] = free_values
    one_pose(x, q, y, weight, slot, want_jacobian, residual, out.reshape(3, free.size))


@njit
def all_poses(free_values, nominal, free, q, y, weight, slot, want_jacobian, residual, out):
    """All poses at once: residual (3 m,) and Jacobian (3 m, n free), both flat."""
    x = nominal.copy()
    x[free] = free_values
    rows = out.reshape(-1, free.size)
    for m in range(q.shape[0]):
        s = slice(3 * m, 3 * m + 3)
        # without a Jacobian `out` is a dummy: hand on its first rows
        one_pose(x, q[m], y[m], weight, slot, want_jacobian, residual[s], rows[s] if want_jacobian else rows[:3])

"""Compiled draws of what cable robots and the instruments around them show."""

from __future__ import annotations

import numpy as np

from robocal._jit import kernel
from robocal.cables.balance._kernels import length_of
from robocal.geometry._kernels import rotation_from_vector


@kernel
def seen_lists(pose, off, noise, bias, sigma, cables, seen):
    """seen (T, n, 4, 4) <- poses as they were measured, noise (T, n, m) <- what the sensors of lengths showed there.

    pose (T or 1, n, 6), place and rotation vector, are the true poses, off (T, n, 6) and noise (T, n, m) normal numbers, which sigma (7,)
    makes the errors of place and orientation (a small rotation in front) and of the lengths, with a constant bias (7,) on top; cables
    (m, 11): a, b, l0, radius, axis.
    """
    true, small, u = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for t in range(noise.shape[0]):
        own = t if pose.shape[0] > 1 else 0
        for k in range(noise.shape[1]):
            p, e = pose[own, k], off[t, k]
            rotation_from_vector(p[3], p[4], p[5], true)
            rotation_from_vector(bias[3] + sigma[3] * e[3], bias[4] + sigma[4] * e[4], bias[5] + sigma[5] * e[5], small)
            for i in range(3):
                for j in range(3):
                    seen[t, k, i, j] = small[i, 0] * true[0, j] + small[i, 1] * true[1, j] + small[i, 2] * true[2, j]
                seen[t, k, i, 3] = p[i] + (bias[i] + sigma[i] * e[i])
                seen[t, k, 3, i] = 0.0
            seen[t, k, 3, 3] = 1.0
            for c in range(noise.shape[2]):
                x, y, z = cables[c, 3], cables[c, 4], cables[c, 5]
                dx = p[0] + true[0, 0] * x + true[0, 1] * y + true[0, 2] * z - cables[c, 0]
                dy = p[1] + true[1, 0] * x + true[1, 1] * y + true[1, 2] * z - cables[c, 1]
                dz = p[2] + true[2, 0] * x + true[2, 1] * y + true[2, 2] * z - cables[c, 2]
                full = length_of(dx, dy, dz, cables[c, 7], cables[c, 8:11], u)
                noise[t, k, c] = full - cables[c, 6] + (bias[6] + sigma[6] * noise[t, k, c])

"""What a lens makes of one direction, compiled: `vision.camera`, for kernels that follow a lens pixel by pixel."""

from __future__ import annotations

import math

from robocal._jit import kernel

AXIS = 1e-12  # of a slope: so near to the axis, angle and slope are one
NEWTON = 12
STEEP = 1.4  # rad: a search that begins farther out may never come back


@kernel(inline=True)
def distort(x, y, lens):
    """Where a lens (n,) of any model has the direction (x, y, 1), less its centre and by its focal lengths; then the derivatives xx, xy
    and yy of that, which is symmetric."""
    r2 = x * x + y * y
    if len(lens) == 8:  # a fisheye
        r = math.sqrt(r2)
        if r < AXIS:
            return x, y, 1.0, 0.0, 1.0
        angle = math.atan(r)
        t = angle * angle
        k1, k2, k3, k4 = lens[4], lens[5], lens[6], lens[7]
        s = angle * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4)))) / r
        rise = (1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * 9.0 * k4)))) / (1.0 + r2)
        q = (rise - s) / r2
        return s * x, s * y, s + q * x * x, q * x * y, s + q * y * y
    k1, k2, p1, p2, k3 = lens[4], lens[5], lens[6], lens[7], lens[8]
    d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    dd = k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3)
    if len(lens) == 12:  # rational
        under = 1.0 / (1.0 + r2 * (lens[9] + r2 * (lens[10] + r2 * lens[11])))
        d *= under
        dd = (dd - d * (lens[9] + r2 * (2.0 * lens[10] + 3.0 * r2 * lens[11]))) * under
    return (
        x * d + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * d + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        d + 2.0 * x * x * dd + 2.0 * p1 * y + 6.0 * p2 * x,
        2.0 * x * y * dd + 2.0 * p1 * x + 2.0 * p2 * y,
        d + 2.0 * y * y * dd + 6.0 * p1 * y + 2.0 * p2 * x,
    )


@kernel
def first_direction(x, y, lens):
    """Where to begin the search for the direction that a lens has at (x, y), less its centre and by its focal lengths."""
    if len(lens) != 8:
        return x, y
    r = math.sqrt(x * x + y * y)
    s = math.tan(min(r, STEEP)) / max(r, AXIS)
    return s * x, s * y


@kernel
def ideal_pixels(u0, v0, width, lens, ideal, slope):
    """ideal (m, 2), slope (m, 4) <- where the pixels of a box of `width` from (u0, v0) would lie without distortion, and the derivative
    by the pixel; lens (n,) as in `vision.camera`. Returns whether Newton's steps, each from the neighbour's end, came to rest."""
    fx, fy, cx, cy = lens[0], lens[1], lens[2], lens[3]
    still = True
    x = y = x0 = y0 = 0.0
    for i in range(len(ideal)):
        xd, yd = (u0 + i % width - cx) / fx, (v0 + i // width - cy) / fy
        if i == 0:
            x, y = first_direction(xd, yd, lens)
        elif i % width == 0:
            x, y = x0, y0
        a, b, c, d = 1.0, 0.0, 0.0, 1.0
        for step in range(NEWTON):
            u, v, a, b, c = distort(x, y, lens)
            ex, ey = u - xd, v - yd
            d = a * c - b * b
            if ex * ex + ey * ey < 1e-18:
                break
            if step == NEWTON - 1 or not d > 0.0:
                still = False
                break
            x, y = x - (c * ex - b * ey) / d, y - (a * ey - b * ex) / d
        if i % width == 0:
            x0, y0 = x, y
        ideal[i, 0], ideal[i, 1] = fx * x + cx, fy * y + cy
        slope[i, 0], slope[i, 1] = c / d, -b / d * fx / fy
        slope[i, 2], slope[i, 3] = -b / d * fy / fx, a / d
    return still

"""Where cables end along a straight motion: at platform anchors, and where they leave their wheels on the frame."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.geometry._kernels import rotation_from_vector

FAR = 2.0  # a step that leaves the motion, whose lambda ends at 1


@kernel
def move(lam, position, v, w, lever, rot, end, rate):
    """end, rate (3,) <- platform anchor and its velocity at lambda; lever (3,): R_0 b; rot (3, 3): exp(lambda w)."""
    x = rot[0, 0] * lever[0] + rot[0, 1] * lever[1] + rot[0, 2] * lever[2]
    y = rot[1, 0] * lever[0] + rot[1, 1] * lever[1] + rot[1, 2] * lever[2]
    z = rot[2, 0] * lever[0] + rot[2, 1] * lever[1] + rot[2, 2] * lever[2]
    end[0] = position[0] + lam * v[0] + x
    end[1] = position[1] + lam * v[1] + y
    end[2] = position[2] + lam * v[2] + z
    rate[0] = v[0] + w[1] * z - w[2] * y
    rate[1] = v[1] + w[2] * x - w[0] * z
    rate[2] = v[2] + w[0] * y - w[1] * x


@kernel
def drawn(near, f, b, speed, fast, way, out):
    """out (3,), moving at `fast` at most, <- the point up to `near` further along the f m to b; how fast that moves, and in what time b
    goes the way, along which f keeps half its length."""
    if near > 0.0:
        share = near / f if near < f else 1.0
        for i in range(3):
            out[i] += share * (b[i] - out[i])
        fast += (speed + fast) * min(1.0, 2.0 * near / f)
    return fast, way / speed if speed > 0.0 else FAR


@kernel
def leave(a, axis, wheel, near, b, speed, out):
    """out (3,) <- where a cable to b leaves its wheel (its anchor without one), and from there up to `near` along it.

    Returns how fast that point moves at most while b, at most at `speed`, goes no further than a certain way, and in what time it
    does; see docs/cables/interference.md.
    """
    for i in range(3):
        out[i] = a[i]
    if wheel <= 0.0:
        if near <= 0.0:
            return 0.0, FAR
        length = 0.0
        for i in range(3):
            length += (b[i] - a[i]) ** 2
        return drawn(near, math.sqrt(length), b, speed, 0.0, 0.5 * math.sqrt(length), out)
    h, s2 = 0.0, 0.0
    for i in range(3):
        h += axis[i] * (b[i] - a[i])
    for i in range(3):
        s2 += (b[i] - a[i] - h * axis[i]) ** 2
    s = math.sqrt(s2)
    e2 = (s - wheel) ** 2 + h * h
    f2 = e2 - wheel * wheel
    if not f2 > 0.0:
        return 0.0, 0.0
    f = math.sqrt(f2)
    cosine = ((wheel - s) * wheel + h * f) / e2
    sine = (h * wheel - (wheel - s) * f) / e2
    aside, along = wheel * (1.0 - cosine), wheel * sine
    for i in range(3):
        side = (b[i] - a[i] - h * axis[i]) / s if s > 0.0 else 0.0
        out[i] += aside * side + along * axis[i]
    # As long as the free segment keeps half its length, and the way to the swivel axis some of its own.
    way = math.sqrt(e2) - math.sqrt(0.25 * f2 + wheel * wheel)
    ahead = max(h, s - 2.0 * wheel)  # wrapped by less than half a turn for as far as that
    low = ahead > 0.25 * s  # and no longer counted on where little of it is left, or steps would end at half a turn
    way = min(way, ahead if low else 0.5 * s)
    least = s - way
    swivel = 2.0 * wheel / least if least > 0.0 else FAR
    if low:
        swivel = min(swivel, 1.0)
    return drawn(near, f, b, speed, speed * max(2.0 * wheel / f, swivel), way, out)


@kernel
def advance_wheel(a, axis, wheel, lever, position, v, w, speed, k, stop, tolerance, limit, work):
    """A platform anchor and the wheel of its own cable, which ends where the free segment does."""
    b, db, rot = work[0], work[1], work[6:9]
    lam = 0.0
    clear = np.inf
    for _ in range(limit):
        rotation_from_vector(lam * w[0], lam * w[1], lam * w[2], rot)
        move(lam, position, v, w, lever[k], rot, b, db)
        h, s2 = 0.0, 0.0
        for i in range(3):
            h += axis[k, i] * (b[i] - a[k, i])
        for i in range(3):
            s2 += (b[i] - a[k, i] - h * axis[k, i]) ** 2
        # No faster than the anchor, since the wheel swivels to it.
        clear = math.sqrt((math.sqrt(s2) - wheel[k]) ** 2 + h * h) - wheel[k]
        if clear <= tolerance:
            return lam, clear
        lam += clear / speed[k] if speed[k] > 0.0 else FAR
        if lam >= stop:
            return stop, clear
    return lam, clear

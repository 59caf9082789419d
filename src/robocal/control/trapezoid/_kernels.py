"""Compiled trapezoids of speed, period by period: where the goal is may change at any time."""

from __future__ import annotations

import math

from robocal._jit import kernel
from robocal.geometry._kernels import vector_from_rotation

LOGARITHM, PROJECTION = 0, 1  # how a turn is measured
SHARE = 8.0  # of an edge: the width of its sigmoid


@kernel(inline=True)
def stop_speed(distance, acceleration, period, loop):
    """The speed of the next period from which steps of `acceleration` stop at a distance: (2.11) in discrete time."""
    half = 0.5 * acceleration * period
    speed = math.sqrt(2.0 * acceleration * distance + half * half) - half
    return min(speed, loop * distance, distance / period)


@kernel(inline=True)
def gate(distance, moving, stop, go):
    """Factor of the distance: a sigmoid about `stop` while it moves, about `go` while it stands."""
    edge = stop if moving != 0.0 else go
    x = SHARE * (distance / edge - 1.0)
    return 1.0 / (1.0 + math.exp(-x)) if x < 40.0 else 1.0


@kernel(inline=True)
def approach(way, first, count, axes, most, acceleration, period, loop, factor, speed):
    """speed[first : first + count] <- the next one towards the end of `way`, within `most` and `acceleration`: along a line, or each
    component by itself."""
    size = 0.0
    for i in range(first, first + count):
        size += way[i] * way[i]
    size = math.sqrt(size)
    change = 0.0
    for i in range(first, first + count):
        if axes:
            wanted = min(most, stop_speed(factor * abs(way[i]), acceleration, period, loop))
            wanted = math.copysign(wanted, way[i])
            step = wanted - speed[i]
            speed[i] += min(acceleration * period, max(-acceleration * period, step))
        else:
            wanted = min(most, stop_speed(factor * size, acceleration, period, loop))
            wanted = wanted * way[i] / size if size > 0.0 else 0.0
            way[i] = wanted - speed[i]
            change += way[i] * way[i]
    if not axes:
        change = math.sqrt(change)
        part = min(1.0, acceleration * period / change) if change > 0.0 else 0.0
        for i in range(first, first + count):
            speed[i] += part * way[i]
    return size


@kernel
def turn_towards(goal, pose, kind, relative, out):
    """out (3,) <- the rotation vector that turns `pose` (4, 4) into `goal`, base axes: the logarithm of Q Q~^T; or the projection of Q
    on the rates that Q~ can have, whose length is the sine of the angle. Beyond a right angle, where the sine falls to nothing at half
    a turn, it is the logarithm too."""
    for i in range(3):
        for k in range(3):
            relative[i, k] = goal[i, 0] * pose[k, 0] + goal[i, 1] * pose[k, 1] + goal[i, 2] * pose[k, 2]
    if kind == PROJECTION and relative[0, 0] + relative[1, 1] + relative[2, 2] > 1.0:
        out[0] = 0.5 * (relative[2, 1] - relative[1, 2])
        out[1] = 0.5 * (relative[0, 2] - relative[2, 0])
        out[2] = 0.5 * (relative[1, 0] - relative[0, 1])
    else:
        vector_from_rotation(relative, out)

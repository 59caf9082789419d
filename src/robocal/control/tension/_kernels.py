"""Compiled tensions of one period of a platform's controller; `control.platform._kernels` says what the arrays are."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.polytope._kernels import FOUND
from robocal.cables.single._kernels import choose
from robocal.control.layout._kernels import (
    CODE,
    DOUBT,
    HEARD,
    HIGH,
    LEAST,
    LOW,
    METHOD,
    MOST,
    MUTE,
    OVERLOAD,
    PATIENCE,
    PERIOD,
    POWER,
    PUSH,
    REFERENCE,
    RUNNING,
    SILENCE,
    SLACK,
    TENSION,
    TENSION_TIME,
    TRIM,
    UNHELD,
    VALUE,
    WHICH,
)
from robocal.estimate._kernels import backward, forward

FALL = 0.05  # s: over which the least tension follows what the motors do beside it


@kernel(inline=True)
def note(memory, code, which, value):
    """Keeps the first reason to stop."""
    if memory[CODE] == RUNNING:
        memory[CODE], memory[WHICH], memory[VALUE] = code, which, value


@kernel(inline=True)
def hold_up(law, rows, body, bounds, pose, slope, memory, each, full):
    """The tensions in `each` <- those that hold the platform; the least of a cable is above what its motor lets go beside them."""
    m, d = bounds.shape[1], rows.shape[0]
    lifted, w, load = np.empty((3, m)), np.empty((1, d, m)), np.empty((1, d))
    x = pose[0, 0] * body[1] + pose[0, 1] * body[2] + pose[0, 2] * body[3]
    y = pose[1, 0] * body[1] + pose[1, 1] * body[2] + pose[1, 2] * body[3]
    for i in range(d):
        row = rows[i]
        load[0, i] = -body[0] if row == 2 else (-y * body[0] if row == 3 else (x * body[0] if row == 4 else 0.0))
        for c in range(m):
            w[0, i, c] = -slope[c, row]
    for c in range(m):
        low, high = bounds[LEAST, c], bounds[MOST, c]
        lifted[LEAST, c] = min(low + max(0.0, each[PUSH, c]), max(low, 0.5 * (low + high)))
        lifted[MOST, c], lifted[REFERENCE, c] = high, bounds[REFERENCE, c]
    code = choose(w, load, lifted, int(law[METHOD]), law[POWER], full)
    if code != FOUND:
        code = choose(w, load, bounds, int(law[METHOD]), law[POWER], full)
    if code == FOUND:
        for c in range(m):
            each[TENSION, c] += law[PERIOD] / (FALL + law[PERIOD]) * (full[c] - each[TENSION, c])
    else:
        note(memory, UNHELD, -1.0, float(code))


@kernel(inline=True)
def project(j, a, g, r):
    """r (m,) <- the part of it that moves the platform; a (d, d) is the factor of j^T j, j (m, d). What only strains it is left out."""
    m, d = j.shape
    for i in range(d):
        s = 0.0
        for c in range(m):
            s += j[c, i] * r[c]
        g[i] = s
    forward(a, d, g)
    backward(a, d, g)
    for c in range(m):
        s = 0.0
        for i in range(d):
            s += j[c, i] * g[i]
        r[c] = s


@kernel(inline=True)
def cut(j, a, g, drum, integral, r):
    """integral (m,) <- the part of it that moves the platform."""
    m = j.shape[0]
    for c in range(m):
        r[c] = integral[c] / drum[c, 3]
    project(j, a, g, r)
    for c in range(m):
        integral[c] = r[c] * drum[c, 3]


@kernel(inline=True)
def regulate(law, bounds, sensed, j, a, g, each, r, kept):
    """The trim of tensions in `each` <- one period on towards what sensors should show: of the difference only what moves nothing, and
    no further than limits allow. A cable without a reading asks for nothing."""
    m, heard = sensed.shape[0], False
    for c in range(m):
        known = math.isfinite(sensed[c])
        heard = heard or known
        r[c] = each[TENSION, c] - sensed[c] if known else 0.0
        kept[c] = r[c]
    if not heard or not law[TENSION_TIME] < math.inf:
        return
    project(j, a, g, r)
    share = law[PERIOD] / (law[TENSION_TIME] + law[PERIOD])
    for c in range(m):
        trim = each[TRIM, c] + share * (kept[c] - r[c])
        each[TRIM, c] = min(bounds[MOST, c] - each[TENSION, c], max(bounds[LEAST, c] - each[TENSION, c], trim))


@kernel(inline=True)
def judge_tensions(law, bounds, sensed, memory, each):
    """Stops where sensors have shown a tension beyond its limits, or nothing any more, for longer than is borne."""
    low = high = mute = -1
    for c in range(sensed.shape[0]):
        if sensed[c] < bounds[SLACK, c]:
            low = c
        if sensed[c] > bounds[OVERLOAD, c]:
            high = c
        if math.isfinite(sensed[c]):
            each[HEARD, c] = 1.0
        elif each[HEARD, c] != 0.0:
            mute = c
    memory[DOUBT] = memory[DOUBT] + law[PERIOD] if low >= 0 or high >= 0 else 0.0
    memory[SILENCE] = memory[SILENCE] + law[PERIOD] if mute >= 0 else 0.0
    if memory[DOUBT] > law[PATIENCE]:
        if low >= 0:
            note(memory, LOW, float(low), sensed[low])
        else:
            note(memory, HIGH, float(high), sensed[high])
    if memory[SILENCE] > law[PATIENCE]:
        note(memory, MUTE, float(mute), memory[SILENCE])

"""Compiled step of the controller of a platform on cables; callers own every buffer, and nothing stays between two calls.

law (LAW,), bounds (BOUNDS, m), memory (MEMORY + EACH m,): numbers by the places of `control.layout`. cables (p, 14): segments of
`cable_table` whose zeros (column 6) make wound(angle) a length; rows (d,): freedoms. body (4,): newtons and centre of the weight. winches
(m, 6): radius (m), growth (m/rad), gear, K_t (m), torque limit (N m) and elasticity (1/N). now (p, 14) and drum (m, 6): cables and winches
in effect, which follow those by at most a shift a period. tables (2, m, k + 1): torque that turns motors towards greater angles over a
turn, as they let out and as they wind in; k = 0: none. seen (m,): angles of the motors (rad); sensed (m,): tensions of sensors (N), not a
number where there is none. torque (m,): what winds cable in (N m).
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.single._kernels import moved, put, rigid, slopes, squares
from robocal.control._kernels import pid_step
from robocal.control.layout._kernels import (
    ACCELERATION,
    ANGLE,
    AXES,
    BLEND,
    CODE,
    EACH,
    EFFORT,
    ERROR,
    FILTER,
    FIRST,
    FOLLOW,
    GO,
    INTEGRAL,
    JOINT_SPEED,
    JOINTS,
    KD,
    KI,
    KP,
    LATE,
    LEFT,
    LEFT_TURN,
    LOOP,
    LOST,
    MEMORY,
    MEND,
    MOTOR_SPEED,
    MOVING,
    NO_TARGET,
    PATH,
    PATIENCE,
    PERIOD,
    PUSH,
    RATE,
    RESIDUAL,
    RMS,
    ROTATION,
    RUNNING,
    SHIFT,
    SPACE,
    SPEED,
    SPEED_FILTER,
    STOP,
    STRAIN,
    STRETCH,
    TENSION,
    TRIM,
    TURN_ACCELERATION,
    TURN_GO,
    TURN_SPEED,
    TURN_STOP,
    TURNING,
    TWIST,
    UNFOLLOWED,
    UNMATCHED,
)  # fmt: skip
from robocal.control.tension._kernels import FALL, cut, hold_up, judge_tensions, note, regulate
from robocal.control.trapezoid._kernels import approach, gate, turn_towards
from robocal.estimate._kernels import backward, cholesky, forward


@kernel(inline=True)
def wind(winches, c, angle):
    """Length that cable c has run out at an angle of its motor."""
    drum = angle / winches[c, 2]
    return drum * (winches[c, 0] + 0.5 * winches[c, 1] * drum)


@kernel(inline=True)
def follow(cables, winches, seen, shift, now, drum):
    """now, drum <- the tables in effect one period on: on a straight way, no place and no length by more than `shift`."""
    differs = False
    for i in range(cables.shape[0]):
        for k in range(11):
            differs = differs or cables[i, k] != now[i, k]
    if differs:
        most = 0.0
        for i in range(cables.shape[0]):
            for k in range(11):
                most = max(most, abs(cables[i, k] - now[i, k]))
        part = min(1.0, shift / most)
        for i in range(cables.shape[0]):
            for k in range(11):
                now[i, k] = cables[i, k] if part == 1.0 else now[i, k] + part * (cables[i, k] - now[i, k])
    for c in range(winches.shape[0]):
        if (
            winches[c, 0] != drum[c, 0] or winches[c, 1] != drum[c, 1] or winches[c, 2] != drum[c, 2]
            or winches[c, 3] != drum[c, 3] or winches[c, 4] != drum[c, 4] or winches[c, 5] != drum[c, 5]
        ):  # fmt: skip
            change = abs(wind(winches, c, seen[c]) - wind(drum, c, seen[c]))
            part = min(1.0, shift / change) if change > 0.0 else 1.0
            for k in range(6):
                drum[c, k] = winches[c, k] if part == 1.0 else drum[c, k] + part * (winches[c, k] - drum[c, k])


@kernel
def locate(length, now, rows, steps, pose, full, slope, j, a, g, r):
    """pose (4, 4) <- where lengths (m,) place the platform, by so many steps of Gauss and Newton from where it was; slope (m, 6) and the
    factor a (d, d) of j^T j are those of the last step, r (m,) what is left of it. Returns the rms of that; not a number: no pose."""
    m, d = length.shape[0], rows.shape[0]
    turn, trial = np.empty((3, 3)), np.empty((4, 4))
    left = math.nan
    for _ in range(steps):
        slopes(pose, now, full, slope)
        for i in range(m):
            r[i] = length[i] + now[i, 6] - full[i]
            for c in range(d):
                j[i, c] = slope[i, rows[c]]
        squares(j, r, a, g)
        if not cholesky(a, d):
            return math.nan
        left = 0.0
        for i in range(m):
            left += r[i] * r[i]
        forward(a, d, g)
        for c in range(d):
            left -= g[c] * g[c]  # what the step takes away
        backward(a, d, g)
        for i in range(m):
            for c in range(d):
                r[i] -= j[i, c] * g[c]
        moved(pose, rows, g, turn, trial)
        put(trial, pose)
    return math.sqrt(max(left, 0.0) / m)


@kernel(inline=True)
def asked(tables, c, angle, speed, blend):
    """Torque that motor c asks for at an angle, of the two directions by a speed."""
    n = tables.shape[2] - 1
    if n < 1:
        return 0.0
    turns = angle / (2.0 * math.pi)
    at = (turns - math.floor(turns)) * n
    i = int(at)
    part = at - i
    out = tables[0, c, i] + part * (tables[0, c, i + 1] - tables[0, c, i])
    back = tables[1, c, i] + part * (tables[1, c, i + 1] - tables[1, c, i])
    share = 0.5 + 0.5 * speed / max(abs(speed), blend)
    return back + share * (out - back)


@kernel
def control_step(law, cables, rows, body, bounds, winches, tables, goal, seen, sensed, now, drum, memory, torque):
    """now, drum, memory and torque (m,) <- those of the next period, for a goal (4, 4) and what sensors show."""
    m, d, period = winches.shape[0], rows.shape[0], law[PERIOD]
    full, slope, j, r, length = np.empty(m), np.empty((m, 6)), np.empty((m, d)), np.empty(m), np.empty(m)
    a, g, way, turn, last = np.empty((d, d)), np.empty(d), np.empty(6), np.empty((3, 3)), np.empty((4, 4))
    each = memory[MEMORY:].reshape((EACH, m))
    pose = memory[:16].reshape((4, 4))
    twist = memory[TWIST : TWIST + 6]
    known = True
    for c in range(m):
        known = known and math.isfinite(seen[c]) and winches[c, 0] + winches[c, 1] * seen[c] / winches[c, 2] > 0.0
    put(pose, last)
    if known:
        follow(cables, winches, seen, law[SHIFT], now, drum)
        for c in range(m):
            wanted = each[STRAIN, c] if law[STRETCH] != 0.0 else 0.0
            each[MEND, c] += min(law[SHIFT], max(-law[SHIFT], wanted - each[MEND, c]))
            length[c] = wind(drum, c, seen[c]) + each[MEND, c]
            quick = (seen[c] - each[ANGLE, c]) / period
            each[ANGLE, c] = seen[c]
            each[MOTOR_SPEED, c] += period / (law[SPEED_FILTER] + period) * (quick - each[MOTOR_SPEED, c])
        memory[RMS] = locate(length, now, rows, 2, pose, full, slope, j, a, g, r)
    if not (known and math.isfinite(memory[RMS]) and rigid(pose)):
        put(last, pose)
        note(memory, LOST, -1.0, math.nan)
    elif not memory[RMS] <= law[RESIDUAL]:
        worst = 0
        for c in range(m):
            worst = c if abs(r[c]) > abs(r[worst]) else worst
        note(memory, UNMATCHED, float(worst), memory[RMS])
    if not (rigid(goal) and reachable(goal, pose, rows, law[GO], law[TURN_GO])):
        note(memory, NO_TARGET, -1.0, 0.0)
    if memory[CODE] == LOST or memory[CODE] == UNMATCHED or memory[CODE] == UNFOLLOWED:
        for c in range(m):  # nothing that is known says where to pull: the brakes hold
            torque[c], each[JOINT_SPEED, c] = 0.0, 0.0
        for i in range(6):
            twist[i] = 0.0
        return
    aim(law, goal, pose, slope, now, rows, way, turn, memory, twist, each, full)
    for c in range(m):
        length[c] += now[c, 6]
    hold_up(law, rows, body, bounds, pose, slope, memory, each, full)
    regulate(law, bounds, sensed, j, a, g, each, r, full)
    for c in range(m):
        radius = (drum[c, 0] + drum[c, 1] * seen[c] / drum[c, 2]) / drum[c, 2]
        wanted = each[JOINT_SPEED, c] / radius
        error = wanted - each[MOTOR_SPEED, c]
        integral, before, rate, effort = pid_step(
            law[KP], law[KI], law[KD], law[FILTER], law[EFFORT], period,
            each[INTEGRAL, c], each[ERROR, c], each[RATE, c], error,
        )  # fmt: skip
        each[INTEGRAL, c], each[ERROR, c], each[RATE, c] = integral, before, rate
        each[PUSH, c] += period / (FALL + period) * (effort / drum[c, 3] - each[PUSH, c])
        # a motor never pushes its cable out: it only pulls less
        pull = drum[c, 3] * (each[TENSION, c] + each[TRIM, c])
        raw = max(0.0, pull - effort) - asked(tables, c, seen[c], wanted, law[BLEND])
        torque[c] = min(drum[c, 4], max(-drum[c, 4], raw))
        each[LATE, c] = each[LATE, c] + period if abs(error) > law[FOLLOW] else 0.0
        if each[LATE, c] > law[PATIENCE]:
            note(memory, UNFOLLOWED, float(c), error)
        # a sensor knows what friction holds back in the winch
        drawn = sensed[c] if math.isfinite(sensed[c]) else each[TENSION, c]
        change = drum[c, 5] * (drawn * length[c] - each[FIRST, c]) - each[STRAIN, c]
        each[STRAIN, c] += period / (FALL + period) * change
    cut(j, a, g, drum, each[INTEGRAL], r)
    judge_tensions(law, bounds, sensed, memory, each)


@kernel(inline=True)
def reachable(goal, pose, rows, near, level):
    """Whether a goal is off by no more than `near` (m) and `level` (rad) along what the platform cannot do."""
    d = rows.shape[0]
    if d == 6:
        return True
    turn, way = np.empty((3, 3)), np.zeros(6)
    turn_towards(goal, pose, 0, turn, way[3:])
    for i in range(3):
        way[i] = goal[i, 3] - pose[i, 3]
    good = True
    for i in range(6):
        free = False
        for c in range(d):
            free = free or rows[c] == i
        good = good and (free or abs(way[i]) <= (near if i < 3 else level))
    return good


@kernel(inline=True)
def aim(law, goal, pose, slope, now, rows, way, turn, memory, twist, each, there):
    """twist (6,) and the speeds of the cables <- the next ones on the way to a goal; a stop brakes them."""
    m, d, period = slope.shape[0], rows.shape[0], law[PERIOD]
    for i in range(6):
        way[i] = 0.0
    if memory[CODE] == RUNNING:
        turn_towards(goal, pose, int(law[ROTATION]), turn, way[3:])
        for i in range(3):
            way[i] = goal[i, 3] - pose[i, 3]
        if d < 6:
            for i in range(6):
                free = False
                for c in range(d):
                    free = free or rows[c] == i
                way[i] = way[i] if free else 0.0
    far = math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    turned = math.sqrt(way[3] * way[3] + way[4] * way[4] + way[5] * way[5])
    memory[LEFT], memory[LEFT_TURN] = far, turned
    memory[MOVING] = 1.0 if far > (law[STOP] if memory[MOVING] != 0.0 else law[GO]) else 0.0
    memory[TURNING] = 1.0 if turned > (law[TURN_STOP] if memory[TURNING] != 0.0 else law[TURN_GO]) else 0.0
    near = gate(far, memory[MOVING], law[STOP], law[GO])
    level = gate(turned, memory[TURNING], law[TURN_STOP], law[TURN_GO])
    axes, loop = law[PATH] == AXES, law[LOOP]
    if law[SPACE] == JOINTS:
        reach, here, gradient = np.zeros(m), np.empty(m), np.empty((m, 6))
        if memory[CODE] == RUNNING:  # on straight ways of their own, the lengths of the goal
            slopes(pose, now, here, gradient)
            slopes(goal, now, there, gradient)
            for c in range(m):
                reach[c] = there[c] - here[c]
        factor = max(near, level)
        approach(reach, 0, m, axes, law[SPEED], law[ACCELERATION], period, loop, factor, each[JOINT_SPEED])
    else:
        approach(way, 0, 3, axes, law[SPEED], law[ACCELERATION], period, loop, near, twist)
        approach(way, 3, 3, axes, law[TURN_SPEED], law[TURN_ACCELERATION], period, loop, level, twist)
        for c in range(m):
            s = 0.0
            for i in range(6):
                s += slope[c, i] * twist[i]
            each[JOINT_SPEED, c] = s

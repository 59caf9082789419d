"""Compiled motion of a rigid platform on elastic cables; callers own every buffer.

state (13,): the centre of mass (m) and the quaternion, w first, of the principal axes in the base; the velocity (m/s) of the centre of
mass and the angular momentum (kg m2/s) about it in base axes. body (m + 2, 3): the cables' ends on the platform from its centre of mass in
principal axes, then the moments of inertia, then the mass and two numbers without use. cables (m, 5): frame anchor, EA (N), damping
(N s/m). free (6,): 1 for each component of force and moment that the platform can follow, else 0. load (6,): force and moment beside the
cables. rest (m,), speed (m,): unstretched lengths and their rates.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.control.layout._kernels import (
    CODE,
    LEFT,
    LEFT_TURN,
    LOST,
    MOVING,
    RMS,
    RUNNING,
    TURNING,
    UNFOLLOWED,
    UNMATCHED,
)
from robocal.control.platform._kernels import control_step


@kernel(inline=True)
def pull(x, cables, body, free, load, rest, speed, tension, out):
    """tension (m,) <- what every cable pulls with, out (6,) <- force and moment on the platform in base axes, its load included."""
    m = cables.shape[0]
    w, i, j, k = x[3], x[4], x[5], x[6]
    r00, r01, r02 = 1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j)
    r10, r11, r12 = 2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i)
    r20, r21, r22 = 2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j)
    # the angular velocity in base axes, from the angular momentum
    p = (r00 * x[10] + r10 * x[11] + r20 * x[12]) / body[m, 0]
    q = (r01 * x[10] + r11 * x[11] + r21 * x[12]) / body[m, 1]
    s = (r02 * x[10] + r12 * x[11] + r22 * x[12]) / body[m, 2]
    ox, oy, oz = r00 * p + r01 * q + r02 * s, r10 * p + r11 * q + r12 * s, r20 * p + r21 * q + r22 * s
    fx, fy, fz, tx, ty, tz = load[0], load[1], load[2], load[3], load[4], load[5]
    for c in range(m):
        bx = r00 * body[c, 0] + r01 * body[c, 1] + r02 * body[c, 2]
        by = r10 * body[c, 0] + r11 * body[c, 1] + r12 * body[c, 2]
        bz = r20 * body[c, 0] + r21 * body[c, 1] + r22 * body[c, 2]
        ux, uy, uz = cables[c, 0] - x[0] - bx, cables[c, 1] - x[1] - by, cables[c, 2] - x[2] - bz
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        ux, uy, uz = ux / length, uy / length, uz / length
        rate = -(ux * (x[7] + oy * bz - oz * by) + uy * (x[8] + oz * bx - ox * bz) + uz * (x[9] + ox * by - oy * bx))
        t = max(0.0, cables[c, 3] * (length / rest[c] - 1.0) + cables[c, 4] * (rate - speed[c]))
        tension[c] = t
        fx, fy, fz = fx + t * ux, fy + t * uy, fz + t * uz
        tx, ty, tz = tx + t * (by * uz - bz * uy), ty + t * (bz * ux - bx * uz), tz + t * (bx * uy - by * ux)
    out[0], out[1], out[2] = free[0] * fx, free[1] * fy, free[2] * fz
    out[3], out[4], out[5] = free[3] * tx, free[4] * ty, free[5] * tz


@kernel(inline=True)
def turn(x, inertia, period):
    """x <- the platform after `period` of free rotation: its angular momentum stays as it is.

    Turns about one principal axis at a time, 1 2 3 2 1, each exact (Dullweber, Leimkuhler and McLachlan, J. Chem. Phys. 107, 1997).
    """
    w, i, j, k = x[3], x[4], x[5], x[6]
    lx, ly, lz = x[10], x[11], x[12]
    a = (1 - 2 * (j * j + k * k)) * lx + 2 * (i * j + w * k) * ly + 2 * (i * k - w * j) * lz
    b = 2 * (i * j - w * k) * lx + (1 - 2 * (i * i + k * k)) * ly + 2 * (j * k + w * i) * lz
    c = 2 * (i * k + w * j) * lx + 2 * (j * k - w * i) * ly + (1 - 2 * (i * i + j * j)) * lz
    half, whole = 0.25 * period, 0.5 * period  # halves of the angles that quaternions take
    for stage in range(5):
        if stage == 0 or stage == 4:
            angle = half * a / inertia[0]
            co, si = math.cos(angle), math.sin(angle)
            w, i, j, k = w * co - i * si, i * co + w * si, j * co + k * si, k * co - j * si
            cc, ss = 1 - 2 * si * si, 2 * si * co
            b, c = b * cc + c * ss, c * cc - b * ss
        elif stage == 1 or stage == 3:
            angle = half * b / inertia[1]
            co, si = math.cos(angle), math.sin(angle)
            w, i, j, k = w * co - j * si, i * co - k * si, j * co + w * si, k * co + i * si
            cc, ss = 1 - 2 * si * si, 2 * si * co
            a, c = a * cc - c * ss, c * cc + a * ss
        else:
            angle = whole * c / inertia[2]
            co, si = math.cos(angle), math.sin(angle)
            w, i, j, k = w * co - k * si, i * co + j * si, j * co - i * si, k * co + w * si
            cc, ss = 1 - 2 * si * si, 2 * si * co
            a, b = a * cc + b * ss, b * cc - a * ss
    size = 1.0 / math.sqrt(w * w + i * i + j * j + k * k)
    x[3], x[4], x[5], x[6] = w * size, i * size, j * size, k * size


@kernel(inline=True)
def drift(x, acting, body, period):
    """x <- half a kick by the forces `acting` (6,), and the motion of `period` after it: the first part of a step of Verlet's."""
    m = body.shape[0] - 2
    half = 0.5 * period
    mass = body[m + 1, 0]
    for c in range(3):
        x[7 + c] += half * acting[c] / mass
        x[10 + c] += half * acting[3 + c]
        x[c] += period * x[7 + c]
    turn(x, body[m], period)


@kernel(inline=True)
def kick(x, ahead, cables, body, free, load, rest, speed, tension, acting, period):
    """x <- the second half of a step of Verlet's; acting (6,) and tension (m,) <- those at its end. Dampers see the velocity that the last
    forces foretell; ahead (13,) is a buffer."""
    m = body.shape[0] - 2
    half = 0.5 * period
    mass = body[m + 1, 0]
    for c in range(7):
        ahead[c] = x[c]
    for c in range(3):
        ahead[7 + c] = x[7 + c] + half * acting[c] / mass
        ahead[10 + c] = x[10 + c] + half * acting[3 + c]
    pull(ahead, cables, body, free, load, rest, speed, tension, acting)
    for c in range(3):
        x[7 + c] += half * acting[c] / mass
        x[10 + c] += half * acting[3 + c]


@kernel
def verlet(x, cables, body, free, load, rest, speed, tension, period, steps):
    """state x after `steps` of `period` by velocity Verlet, rest (m,) and tension (m,) with it: order 2."""
    acting, ahead, first = np.empty(6), np.empty(13), rest.copy()
    pull(x, cables, body, free, load, rest, speed, tension, acting)
    for n in range(steps):
        drift(x, acting, body, period)
        for c in range(len(rest)):
            rest[c] = first[c] + (n + 1) * period * speed[c]  # sums of small steps would lose digits
        kick(x, ahead, cables, body, free, load, rest, speed, tension, acting, period)


@kernel(inline=True)
def slope(x, cables, body, free, load, rest, speed, tension, acting, out):
    """out (13,) <- the rate of a state."""
    m = cables.shape[0]
    pull(x, cables, body, free, load, rest, speed, tension, acting)
    w, i, j, k = x[3], x[4], x[5], x[6]
    lx, ly, lz = x[10], x[11], x[12]
    a = ((1 - 2 * (j * j + k * k)) * lx + 2 * (i * j + w * k) * ly + 2 * (i * k - w * j) * lz) / body[m, 0]
    b = (2 * (i * j - w * k) * lx + (1 - 2 * (i * i + k * k)) * ly + 2 * (j * k + w * i) * lz) / body[m, 1]
    c = (2 * (i * k + w * j) * lx + 2 * (j * k - w * i) * ly + (1 - 2 * (i * i + j * j)) * lz) / body[m, 2]
    out[3], out[4] = -0.5 * (i * a + j * b + k * c), 0.5 * (w * a + j * c - k * b)
    out[5], out[6] = 0.5 * (w * b + k * a - i * c), 0.5 * (w * c + i * b - j * a)
    for n in range(3):
        out[n], out[7 + n], out[10 + n] = x[7 + n], acting[n] / body[m + 1, 0], acting[3 + n]


@kernel
def runge_kutta(x, cables, body, free, load, rest, speed, tension, period, steps):
    """The same by the classical method of Runge and Kutta: order 4."""
    acting, at, k = np.empty(6), np.empty(13), np.empty((4, 13))
    length, first = np.empty(len(rest)), rest.copy()
    for n in range(steps):
        for stage in range(4):
            h = 0.0 if stage == 0 else (period if stage == 3 else 0.5 * period)
            for c in range(13):
                at[c] = x[c] + (h * k[stage - 1, c] if stage > 0 else 0.0)
            for c in range(len(rest)):
                length[c] = first[c] + (n * period + h) * speed[c]
            slope(at, cables, body, free, load, length, speed, tension, acting, k[stage])
        for c in range(13):
            x[c] += period / 6 * (k[0, c] + 2 * (k[1, c] + k[2, c]) + k[3, c])
        size = 1.0 / math.sqrt(x[3] ** 2 + x[4] ** 2 + x[5] ** 2 + x[6] ** 2)
        for c in range(3, 7):
            x[c] *= size
        for c in range(len(rest)):
            rest[c] = first[c] + (n + 1) * period * speed[c]
    pull(x, cables, body, free, load, rest, speed, tension, acting)


@kernel(inline=True)
def wound(winches, c, angle):
    """Length that cable c has run out at an angle of its drum (rad): radius times angle, and what layers add."""
    return angle * (winches[c, 0] + 0.5 * winches[c, 1] * angle)


@kernel(inline=True)
def resist(winches, cogging, c, state, now, period):
    """Friction (Dahl's bristle and what grows with the speed `now`) and cogging of motor c in N m; its bristle bends by `period`."""
    speed, reach = state[c, 1], winches[c, 5]
    end = reach if speed > 0.0 else -reach
    state[c, 2] = end + (state[c, 2] - end) * math.exp(-abs(speed) * period / reach)
    out = winches[c, 4] * state[c, 2] / reach + winches[c, 6] * now
    n = cogging.shape[1] - 1
    if n > 0:
        turns = state[c, 0] / (2.0 * math.pi)
        at = (turns - math.floor(turns)) * n
        i = int(at)
        out += cogging[c, i] + (at - i) * (cogging[c, i + 1] - cogging[c, i])
    return out


@kernel(inline=True)
def winch_rest(winches, state, first, rest, speed, push, ahead):
    """rest (m,) and speed (m,) <- what drums have run out, and how fast, where the motors will be `ahead` s later at push (m,)."""
    for c in range(len(rest)):
        angle = state[c, 0] / winches[c, 2]
        rest[c] = first[c] + wound(winches, c, angle)
        rate = (state[c, 1] + ahead * push[c]) / winches[c, 2]
        speed[c] = (winches[c, 0] + winches[c, 1] * angle) * rate


@kernel(inline=True)
def winch_push(winches, cogging, state, tension, torque, push, period):
    """push (m,) <- angular acceleration of the motors: the cable pulls them round, torque (m,) winds it in."""
    for c in range(len(push)):
        radius = (winches[c, 0] + winches[c, 1] * state[c, 0] / winches[c, 2]) / winches[c, 2]
        now = state[c, 1] + 0.5 * period * push[c]  # as the last push foretells
        push[c] = (radius * tension[c] - torque[c] - resist(winches, cogging, c, state, now, period)) / winches[c, 3]


@kernel(inline=True)
def advance(
    x, cables, body, free, load, winches, cogging, first, state, torque, tension, period, steps,
    acting, ahead, push, rest, speed,
):  # fmt: skip
    """The steps of `winched` from the forces `acting` and the accelerations `push` at their beginning."""
    m, half = cables.shape[0], 0.5 * period
    for _ in range(steps):
        for c in range(m):
            state[c, 1] += half * push[c]
            state[c, 0] += period * state[c, 1]
        winch_rest(winches, state, first, rest, speed, push, half)
        drift(x, acting, body, period)
        kick(x, ahead, cables, body, free, load, rest, speed, tension, acting, period)
        winch_push(winches, cogging, state, tension, torque, push, period)
        for c in range(m):
            state[c, 1] += half * push[c]


@kernel
def winched(x, cables, body, free, load, winches, cogging, first, state, torque, tension, period, steps):
    """state x of the platform and state (m, 4) of the motors after `steps` of `period` at torques (m,) in N m, tension (m,) with them.

    winches (m, 7): radius of the drum (m), growth of it (m/rad), gear, inertia at the motor (kg m2), Coulomb torque (N m), angle over which
    it builds up (rad) and viscous coefficient (N m s) at the motor. cogging (m, k + 1): its table over one turn of the motor, the first
    entry again at its end; k = 0: none. first (m,): unstretched lengths where motors stand at 0. state: angle and speed of the motor,
    its bristle (rad), and one number without use; positive angles let cable out. Velocity Verlet, motors and platform alike.
    """
    m = cables.shape[0]
    acting, ahead, push = np.empty(6), np.empty(13), np.zeros(m)
    rest, speed = np.empty(m), np.empty(m)
    winch_rest(winches, state, first, rest, speed, push, 0.0)
    pull(x, cables, body, free, load, rest, speed, tension, acting)
    winch_push(winches, cogging, state, tension, torque, push, 0.0)
    advance(
        x, cables, body, free, load, winches, cogging, first, state, torque, tension, period, steps,
        acting, ahead, push, rest, speed,
    )  # fmt: skip


@kernel
def controlled(
    law, known, rows, weight, bounds, gears, tables, goal, wiring, now, drum, memory,
    x, cables, body, free, load, winches, cogging, first, state, limit, tension, steps, ticks, settle, every, log,
):  # fmt: skip
    """All states <- those after so many periods of the controller, `steps` steps of the plant in each; returns the periods that were run:
    fewer where brakes closed, or where it had stood at its goal for `settle` periods (0: it goes on).

    The first two lines of arguments are those of `control_step` and `winched`. wiring (m, 6): what the encoder shows per turn of its
    motor, where it shows 0 (rad), its count (rad; 0: exact), the cable whose motor it is on, the way that motor turns (1, -1), and 1
    where a sensor of tension is. limit (m,): largest torque (N m). log (ticks // every, 28 + 3 m): state x (13), believed pose (12), rms
    of the lengths, what is left of the way (m, rad), and per cable what its encoder shows, torque and tension.
    """
    m = cables.shape[0]
    seen, sensed, torque, told = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    period, stood = law[0] / steps, 0
    acting, ahead, push, rest, speed = np.empty(6), np.empty(13), np.zeros(m), np.empty(m), np.empty(m)
    winch_rest(winches, state, first, rest, speed, push, 0.0)
    pull(x, cables, body, free, load, rest, speed, tension, acting)
    for n in range(ticks):
        for c in range(m):
            shown = wiring[c, 0] * state[int(wiring[c, 3]), 0] + wiring[c, 1]
            if wiring[c, 2] > 0.0:
                shown = math.floor(shown / wiring[c, 2] + 0.5) * wiring[c, 2]
            seen[c] = shown
            sensed[c] = tension[c] if wiring[c, 5] != 0.0 else math.nan
        control_step(law, known, rows, weight, bounds, gears, tables, goal, seen, sensed, now, drum, memory, told)
        for c in range(m):
            of = int(wiring[c, 3])
            torque[of] = min(limit[of], max(-limit[of], wiring[c, 4] * told[c]))
        if memory[CODE] == LOST or memory[CODE] == UNMATCHED or memory[CODE] == UNFOLLOWED:
            for c in range(m):
                state[c, 1] = 0.0  # brakes close
            return n
        winch_push(winches, cogging, state, tension, torque, push, 0.0)
        advance(
            x, cables, body, free, load, winches, cogging, first, state, torque, tension, period, steps,
            acting, ahead, push, rest, speed,
        )  # fmt: skip
        if (n + 1) % every == 0 and n // every < log.shape[0]:
            row = log[n // every]
            for i in range(13):
                row[i] = x[i]
            for i in range(12):
                row[13 + i] = memory[i]
            row[25], row[26], row[27] = memory[RMS], memory[LEFT], memory[LEFT_TURN]
            for c in range(m):
                row[28 + c], row[28 + m + c], row[28 + 2 * m + c] = seen[c], torque[c], tension[c]
        stands = memory[CODE] == RUNNING and memory[MOVING] == 0.0 and memory[TURNING] == 0.0
        stood = stood + 1 if stands else 0
        if settle > 0 and stood >= settle:
            return n + 1
    return ticks

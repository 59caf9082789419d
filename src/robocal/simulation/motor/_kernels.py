"""Compiled loop of a motor under a controller; callers own every buffer."""

from __future__ import annotations

import math

from robocal._jit import kernel
from robocal.control._kernels import pid_step
from robocal.drives._kernels import cogging_at

TURN = 2.0 * math.pi


@kernel(inline=True)
def look_up(table, angle):
    """Linear interpolation in a table of one turn whose entries are equally spaced."""
    n = len(table)
    at = (angle / TURN - math.floor(angle / TURN)) * n
    i = int(at)
    part = at - i
    return (1.0 - part) * table[i % n] + part * table[(i + 1) % n]


@kernel
def run_motor(plant, orders, cosine, sine, law, tables, reference, substeps, state, log):
    """log (m, 8) <- reference, angle that the encoder shows, true angle, true speed, torque, the controller's part of it, friction and
    cogging; a row for each period of the controller.

    plant (11,): inertia, Coulomb and breakaway torque, Stribeck speed, viscous coefficient, bristle stiffness and damping, half the width
    of the cogging's hysteresis, its offset, torque limit, encoder counts per turn (0: exact). orders, cosine, sine (n,): cogging.
    law (6,): kp, ki, kd, filter time, limit, period. tables (2, k): compensation by desired direction, forward first; k = 0 for none.
    reference (m + 1,): desired angles. state (7,) -> its value after the run: angle, speed, bristle, angle of the cogging behind its
    hysteresis, and integral, last error and rate of the controller.
    """
    inertia, coulomb, breakaway, stribeck = plant[0], plant[1], plant[2], plant[3]
    viscous, stiffness, damping, half = plant[4], plant[5], plant[6], plant[7]
    offset, limit, counts = plant[8], plant[9], plant[10]
    short = law[5] / substeps
    angle, speed, bristle, behind = state[0], state[1], state[2], state[3]
    integral, last, rate = state[4], state[5], state[6]
    for k in range(len(log)):
        shown = angle
        if counts > 0.0:
            shown = math.floor(angle / TURN * counts + 0.5) * TURN / counts
        error = reference[k] - shown
        integral, last, rate, effort = pid_step(
            law[0], law[1], law[2], law[3], law[4], law[5], integral, last, rate, error
        )
        torque = effort
        if tables.shape[1] > 0:
            torque += look_up(tables[1 if reference[k + 1] < reference[k] else 0], shown)
        torque = min(limit, max(-limit, torque))
        log[k, 0], log[k, 1], log[k, 2], log[k, 3] = reference[k], shown, angle, speed
        log[k, 4], log[k, 5] = torque, effort
        for i in range(substeps):
            sliding = coulomb + (breakaway - coulomb) * math.exp(-((speed / stribeck) ** 2))
            before = bristle
            bristle = (bristle + short * speed) / (1.0 + short * abs(speed) * stiffness / sliding)
            friction = stiffness * bristle + damping * (bristle - before) / short + viscous * speed
            behind = min(angle + half, max(angle - half, behind))
            cogging = offset + cogging_at(behind, 0.0, orders, cosine, sine, 0.0)
            if i == 0:
                log[k, 6], log[k, 7] = friction, cogging
            speed += short * (torque - friction - cogging) / inertia
            angle += short * speed
    state[0], state[1], state[2], state[3] = angle, speed, bristle, behind
    state[4], state[5], state[6] = integral, last, rate

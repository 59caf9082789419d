"""Places, poses and loads of a cable robot; linear programs as judges."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from robocal.cables.statics import gravity_wrench, structure
from robocal.geometry import so3


def box(machine):
    """Where the platform may be: the box of the frame anchors, down to the floor for a robot hung from above."""
    sides = np.stack([machine.a.min(axis=0), machine.a.max(axis=0)], axis=1)
    if sides[2, 1] - sides[2, 0] < 0.5:
        sides[2, 0] = 0.0
    return sides


def poses(machine, count, rng, tilt=0.3):
    sides = box(machine)
    pose = np.tile(np.eye(4), (count, 1, 1))
    pose[:, :3, 3] = rng.uniform(sides[:, 0], sides[:, 1], (count, 3))
    pose[:, :3, :3] = so3.exp(rng.uniform(-tilt, tilt, (count, 3)))
    return pose


def problem(machine, count, rng):
    """Structure matrices and weights at random poses."""
    pose = poses(machine, count, rng)
    return structure(pose, machine.a, machine.b), gravity_wrench(pose, machine.mass, machine.com)


def slack(w, load, limits):
    """By how much [N] the limits would have to give for the wrench to be balanced (negative: what is to spare): a linear program."""
    d, m = w.shape
    ones = np.ones((m, 1))
    answer = linprog(
        np.r_[np.zeros(m), 1.0],
        A_ub=np.block([[np.eye(m), -ones], [-np.eye(m), -ones]]),
        b_ub=np.r_[limits[:, 1], -limits[:, 0]],
        A_eq=np.c_[w, np.zeros(d)],
        b_eq=-load,
        bounds=[(None, None)] * (m + 1),
        method="highs",
    )
    assert answer.status == 0, answer.message
    return answer.fun

"""Places, poses and loads of a cable robot; linear programs as judges."""

from __future__ import annotations

import numpy as np
from scipy import sparse
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
    return slacks(w[None], load[None], limits)[0]


def slacks(w, load, limits, together=50):
    """The same of structure matrices w (k, d, m) and wrenches (k, d): programs that have nothing in common, solved some at a time, since
    scipy takes longer to read one than HiGHS to solve it."""
    d, m = w.shape[1:]
    ones = np.ones((m, 1))
    within = np.block([[np.eye(m), -ones], [-np.eye(m), -ones]])
    out = []
    for i in range(0, len(w), together):
        some, own = w[i : i + together], load[i : i + together]
        k = len(some)
        answer = linprog(
            np.tile(np.r_[np.zeros(m), 1.0], k),
            A_ub=sparse.kron(sparse.eye_array(k), within, format="csc"),
            b_ub=np.tile(np.r_[limits[:, 1], -limits[:, 0]], k),
            A_eq=sparse.block_diag([np.c_[one, np.zeros(d)] for one in some], format="csc"),
            b_eq=-own.ravel(),
            bounds=(None, None),
            method="highs",
        )
        assert answer.status == 0, answer.message
        out.append(answer.x[m :: m + 1])
    return np.concatenate(out)

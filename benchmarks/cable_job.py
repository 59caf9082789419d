"""The cable jobs that every contestant is given: one generic robot of eight crossed cables, written down here, and its tasks.

Needs numpy and scipy alone: it knows nothing of robocal. Lengths in m, forces in N, base z up; a pose is a rotation (3, 3) and a
position (3,). `W t + w = 0` with columns (u_i, R b_i x u_i), u_i from the platform to the frame.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

SIDES = np.array([[-3.0, 3.0], [-2.0, 2.0], [0.0, 3.0]])  # the frame
A = np.array([(x, y, z) for z in SIDES[2] for y in SIDES[1] for x in SIDES[0]])
HALF = np.array([0.25, 0.2, 0.15])  # the platform is a box
# The lower four cables run to the platform's top and the upper four to its bottom, beside each other.
B = np.array(
    [(0.10 * x, 0.20 * y, 0.15) if z < 0 else (0.25 * x, 0.06 * y, -0.15) for x, y, z in np.sign(A - [0, 0, 1.5])]
)
CABLES = len(A)
LIMITS = np.tile([20.0, 2000.0], (CABLES, 1))
MASS, GRAVITY = 40.0, 9.80665
DIAMETER = 0.006
RELIEF = 10 * DIAMETER  # up to here a cable may touch its own eyelet
TILT = 0.3  # rad
SCALE, TURN = 1.1, np.pi / 6  # the box of random poses over the frame, and its turns about each axis
SURE = 1e-6  # N: problems that the limits decide by less than this are left out
HERE = Path(__file__).resolve().parent


def structure(rotation, position):
    """Structure matrices (k, 6, m) of rotations (k, 3, 3) and positions (k, 3)."""
    lever = np.einsum("kij,mj->kmi", rotation, B)
    u = A - position[:, None] - lever
    u /= np.linalg.norm(u, axis=2)[..., None]
    return np.ascontiguousarray(np.concatenate([u, np.cross(lever, u)], axis=2).swapaxes(1, 2))


def weight(count):
    """The platform's weight at its origin, (k, 6)."""
    return np.tile([0.0, 0.0, -MASS * GRAVITY, 0.0, 0.0, 0.0], (count, 1))


def slack(w, load):
    """By how much [N] every limit has to give before the wrench is balanced; negative: what is to spare. A linear program."""
    d, m = w.shape
    ones = np.ones((m, 1))
    answer = linprog(
        np.r_[np.zeros(m), 1.0],
        A_ub=np.block([[np.eye(m), -ones], [-np.eye(m), -ones]]),
        b_ub=np.r_[LIMITS[:, 1], -LIMITS[:, 0]],
        A_eq=np.c_[w, np.zeros(d)],
        b_eq=-load,
        bounds=[(None, None)] * (m + 1),
        method="highs",
    )
    # Singular and out of balance: no limits would do.
    return answer.fun if answer.status == 0 else np.inf


def tension_jobs(count=2000, seed=0):
    """{"feasible": {...}, "infeasible": {...}}: as many random poses in the frame of each kind, as the linear program judges."""
    rng = np.random.default_rng(seed)
    kept = {"feasible": [], "infeasible": []}
    while min(map(len, kept.values())) < count:
        position = rng.uniform(SIDES[:, 0], SIDES[:, 1])
        rotation = Rotation.from_rotvec(rng.uniform(-TILT, TILT, 3)).as_matrix()
        kind = (
            "feasible"
            if (room := slack(structure(rotation[None], position[None])[0], weight(1)[0])) < 0
            else "infeasible"
        )
        if abs(room) > SURE and len(kept[kind]) < count:
            kept[kind].append((rotation, position))
    jobs = {}
    for kind, poses in kept.items():
        rotation, position = (np.array(part) for part in zip(*poses, strict=True))
        jobs[kind] = {
            "rotation": rotation,
            "position": position,
            "structure": structure(rotation, position),
            "wrench": weight(count),
        }
    return jobs


def place_job(count=500, seed=0):
    """Lengths with 1 mm of noise at random poses in the frame, and starts about 17 mm and 3 deg away from them."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(0.6 * SIDES[:, 0] + [0, 0, 0.5], 0.6 * SIDES[:, 1] + [0, 0, 0.5], (count, 3))
    turn = rng.uniform(-TILT, TILT, (count, 3))
    rotation = Rotation.from_rotvec(turn).as_matrix()
    length = np.linalg.norm(A - position[:, None] - np.einsum("kij,mj->kmi", rotation, B), axis=2)
    begin = position + rng.uniform(-0.017, 0.017, (count, 3))
    turned = Rotation.from_rotvec(turn + rng.uniform(-0.05, 0.05, (count, 3))).as_matrix()
    return {
        "length": length + rng.normal(scale=1e-3, size=length.shape), "begin_position": begin, "begin_rotation": turned,
    }  # fmt: skip


def pose_job(count=20, seed=0):
    """Random motions from the middle of the frame, in the order in which a list of poses draws them."""
    half = np.concatenate([0.5 * SCALE * np.ptp(A, axis=0), np.full(3, TURN)])
    twist = np.random.default_rng(seed).uniform(-half, half, (count, 6))
    return {"seed": seed, "start": A.mean(axis=0), "translation": twist[:, :3].copy(), "rotation": twist[:, 3:].copy()}


def grid_job(cells=41, sample=300, hulls=10, seed=0):
    """A grid of cells^3 positions in the frame, some of which (flat numbers) are for those who cannot do them all."""
    total = cells**3
    some = np.random.default_rng(seed).permutation(total)
    axes = [low + (high - low) / cells * (np.arange(cells) + 0.5) for low, high in SIDES]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return {"cells": cells, "sample": np.sort(some[:sample]), "hulls": np.sort(some[:hulls]), "points": points}


def save(name, job):
    """Write a job where contestants read it."""
    path = HERE / ".cache" / "jobs" / f"{name}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **job)
    return path

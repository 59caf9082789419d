"""Starts of instruments that know only directions: theodolites and cameras.

    d_i x (R p_i + t) = 0       linear and homogeneous in (R, t), then orthogonal iteration

A camera also sees several points of one target at once, which gives the pose of the target, and hand-eye calibration
takes over. Source: Lu, Hager and Mjolsness, Fast and globally convergent pose estimation from video images (2000).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.fit.starts.frames import poses
from robocal.fit.starts.target_rows import TargetRows, frame_values, start
from robocal.geometry import se3, so3
from robocal.measure.bearing import directions
from robocal.measure.pixels import rays

__all__ = ["resect"]

# How many rotations are kept and how many steps are made with them: first all, then the best few to the end.
ITERATIONS = ((8, 20), (4, 120))
SAME = 1e-2  # rotations nearer than that are one
# Points that make a pose, and poses that are enough for a start.
POINTS, POSES = 4, 12


def resect(points: Array, directions: Array, keep: int = 2) -> list[Array]:
    """The T (4, 4) whose T p_i lie along the unit directions d_i (m, 3), the best `keep` of them; points (m, 3), m >= 3.

    Starts are the linear solution and the 24 rotations of a cube, each followed by orthogonal iteration.
    """
    centre = points.mean(axis=0)
    p = points - centre
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    solve = np.linalg.pinv(across.sum(axis=0))
    r = _cube()
    if len(p) >= 6:
        r = np.concatenate([_linear(p, directions)[None], r])

    def shift(r: Array) -> Array:
        return np.asarray(-np.einsum("ij,mjk,bmk->bi", solve, across, p @ np.swapaxes(r, 1, 2)))

    for many, rounds in ITERATIONS:
        for _ in range(rounds):
            seen = p @ np.swapaxes(r, 1, 2) + shift(r)[:, None]
            along = np.einsum("bmi,mi->bm", seen, directions)[..., None] * directions
            r = so3.project(np.einsum("bmi,mj->bij", along - along.mean(axis=1, keepdims=True), p))
        t = shift(r)
        seen = p @ np.swapaxes(r, 1, 2) + t[:, None]
        depth = np.einsum("bmi,mi->bm", seen, directions)
        off = np.linalg.norm(seen - depth[..., None] * directions, axis=2).mean(axis=1)
        # What the instrument sees lies in front of it.
        order = np.argsort(np.where((depth > 0).all(axis=1), off, off + 1e3), kind="stable")
        chosen: list[int] = []
        for b in order:
            if len(chosen) < max(many, keep) and all(np.abs(r[b] - r[c]).max() > SAME for c in chosen):
                chosen.append(int(b))
        r, t = r[chosen], t[chosen]
    return [se3.compose(a, b - a @ centre) for a, b in zip(r[:keep], t[:keep], strict=True)]


def _linear(p: Array, directions: Array) -> Array:
    """R from d x (R p + t) = 0 as a homogeneous linear system; p (m, 3) about their centre, m >= 6."""
    size = max(float(np.linalg.norm(p, axis=1).mean()), 1e-12)
    known = np.concatenate([p / size, np.ones((len(p), 1))], axis=1)
    design = np.einsum("mik,mj->mikj", so3.skew(directions), known).reshape(-1, 12)
    found = np.linalg.svd(design, full_matrices=False)[2][-1].reshape(3, 4)
    depth = np.einsum("mi,ij,mj->m", directions, found, known).mean()
    return so3.project(found[:, :3] if depth > 0 else -found[:, :3])


def _cube() -> Array:
    """The 24 rotations of a cube, (24, 3, 3)."""
    quarter = so3.exp(np.pi / 2 * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3), 2 * np.eye(3)[:1]]))
    every = np.einsum("aij,bjk,ckl->abcil", quarter, quarter, quarter).reshape(-1, 9)
    return np.unique(np.rint(every), axis=0).reshape(-1, 3, 3)


# --- what the registry calls --------------------------------------------------------------------------------------------


@start("bearing")
def _bearing(seen: TargetRows) -> list[dict[str, float]]:
    frame = seen.outside
    if frame is None:
        return []
    return [frame_values(frame.name, found) for found in resect(seen.points, directions(seen.value))]


@start("pixels")
def _pixels(seen: TargetRows) -> list[dict[str, float]]:
    frame = seen.obs.frame
    if frame is None or not any(frame.free):
        return []
    point = seen.obs.extra["point"][seen.index]
    along = rays(seen.obs, seen.value)
    out = []
    if seen.outside is not None:
        held = seen.at(seen.machine)
        there = np.einsum("mij,mj->mi", held[:, :3, :3], point) + held[:, :3, 3]
        out += [frame_values(frame.name, t) for t in resect(there, along)]
    where = seen.obs.configuration[seen.index]
    places = [i for i in (np.flatnonzero(where == c) for c in np.unique(where)) if len(i) >= POINTS][:POSES]
    if len(places) >= 3:
        measured = np.stack([resect(point[i], along[i], 1)[0] for i in places])
        out += poses(seen, measured, seen.machine[[i[0] for i in places]])
    return out

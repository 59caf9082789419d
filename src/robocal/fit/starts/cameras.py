"""Starts of instruments that know only directions: theodolites and cameras.

    d_i x (R p_i + t) = 0       linear and homogeneous in (R, t), then orthogonal iteration

A camera also sees several points of one target at once, which gives the pose of the target, and hand-eye calibration
takes over. Source: Lu, Hager and Mjolsness, Fast and globally convergent pose estimation from video images (2000).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from robocal._types import Array, Ints
from robocal.fit.starts.frames import poses
from robocal.fit.starts.target_rows import TargetRows, frame_values, start
from robocal.geometry import se3, so3
from robocal.measure.bearing import directions
from robocal.measure.pixels import rays

__all__ = ["resect", "resect_sights"]

# How many rotations are kept and how many steps are made with them: first all, then the best few to the end.
ITERATIONS = ((8, 20), (4, 120))
SAME = 1e-2  # rotations nearer than that are one
STILL = 1e-12  # a rotation has arrived where a step moves its numbers by less
# Points that make a pose, and poses that are enough for a start.
POINTS, POSES = 4, 12
LINEAR = 6  # points from which the linear system says where to begin
BLOCK = 10_000  # rows at once: what is asked of every start and row fits into memory


def resect(points: Array, directions: Array, keep: int = 2) -> list[Array]:
    """The T (4, 4) whose T p_i lie along the unit directions d_i (m, 3), the best `keep` of them; points (m, 3), m >= 3."""
    return resect_sights(points, directions, np.zeros(1, dtype=np.int64), keep)[0]


def resect_sights(points: Array, directions: Array, first: Ints, keep: int = 2) -> list[list[Array]]:
    """The same of many sights at once: rows (n, 3) sight by sight, each beginning at row first[s]; the best `keep` of each.

    Starts are the linear solution and the 24 rotations of a cube, each followed by orthogonal iteration. With V_i = d_i d_i^T, S the
    inverse of sum (I - V_i), and points about their centre, a step costs the same for any number of points:

        R <- project( sum V_i (R p_i + t) p_i^T ),   t = S sum V_i R p_i
    """
    out: list[list[Array]] = []
    ends = np.append(first[1:], len(points))
    while len(out) < len(first):
        i = len(out)
        j = max(int(np.searchsorted(ends, first[i] + BLOCK)), i + 1)
        rows = slice(int(first[i]), int(ends[j - 1]))
        out += _resect_block(points[rows], directions[rows], first[i:j] - first[i], keep)
    return out


def _resect_block(points: Array, directions: Array, first: Ints, keep: int) -> list[list[Array]]:
    from robocal.geometry._kernels import turn_until_still

    count = np.diff(np.append(first, len(points)))
    own = np.repeat(np.arange(len(first)), count)

    def total(each: Array) -> Array:
        return np.asarray(np.add.reduceat(each, first, axis=0))

    centre = total(points) / count[:, None]
    p = points - centre[own]
    along = directions[:, :, None] * directions[:, None, :]
    # R enters as nine numbers: sum V_i R p_i is (3, 9) times them, sum V_i R p_i p_i^T (9, 9).
    mean = total(along[:, :, :, None] * p[:, None, None, :])
    twice = total(along[:, :, None, :, None] * (p[:, :, None] * p[:, None, :])[:, None, :, None, :])
    across = total(np.eye(3) - along)
    place = np.linalg.pinv(across) @ mean.reshape(-1, 3, 9)
    step = twice.reshape(-1, 9, 9) + np.swapaxes(mean, 2, 3).reshape(-1, 9, 3) @ place
    r = np.repeat(_cube()[None], len(first), axis=0)
    if (count >= LINEAR).any():
        r = np.concatenate([_linear(p, directions, own, count)[:, None], r], axis=1)
    several = np.ones(len(first), dtype=np.int64)
    for many, rounds in ITERATIONS:
        r = np.ascontiguousarray(r)
        turn_until_still(step, r, rounds, STILL)
        t = np.einsum("sij,sbj->sbi", place, r.reshape(*r.shape[:2], 9))
        seen = np.einsum("nbij,nj->nbi", r[own], p) + t[own]
        depth = np.einsum("nbi,ni->nb", seen, directions)
        off = total(np.linalg.norm(seen - depth[..., None] * directions[:, None], axis=2)) / count[:, None]
        # What the instrument sees lies in front of it.
        behind = total((depth <= 0).astype(float)) > 0
        order = np.argsort(np.where(behind, off + 1e3, off), axis=1, kind="stable")
        index, several = _differ(r, order, max(many, keep))
        r, t = (np.take_along_axis(v, index.reshape(*index.shape, *[1] * (v.ndim - 2)), axis=1) for v in (r, t))
    return [
        [se3.compose(r[s, b], t[s, b] - r[s, b] @ centre[s]) for b in range(min(keep, n))]
        for s, n in enumerate(several.tolist())
    ]


def _differ(rotations: Array, order: Ints, most: int) -> tuple[Ints, Ints]:
    """Of each sight the first of its rotations (S, B, 3, 3), in this order (S, B), no two of which are one: their numbers (S, k), the first
    again where there are fewer, and how many there are, (S,)."""
    every, count = np.arange(len(order)), np.zeros(len(order), dtype=np.int64)
    index, held = np.repeat(order[:, :1], most, axis=1), np.full((len(order), most, 3, 3), np.inf)
    for b in order.T:
        one = rotations[every, b]
        new = (np.abs(held - one[:, None]).max(axis=(2, 3)) > SAME).all(axis=1) & (count < most)
        held[new, count[new]], index[new, count[new]] = one[new], b[new]
        count += new
    return index[:, : count.max(initial=1)], count


def _linear(p: Array, directions: Array, own: Ints, count: Ints) -> Array:
    """R (S, 3, 3) from d x (R p + t) = 0 as a homogeneous linear system; p (n, 3) about their centre."""
    size = np.sqrt(np.bincount(own, (p * p).sum(axis=1)) / count) + 1e-12
    known = np.concatenate([p / size[own, None], np.ones((len(p), 1))], axis=1)
    design = (so3.skew(directions)[..., None] * known[:, None, None]).reshape(-1, 3, 12)
    out = np.empty((len(count), 3, 3))
    for m in np.unique(count):
        # A null vector of the squares would have half the digits.
        same = count == m
        rows = same[own]
        found = np.linalg.svd(design[rows].reshape(-1, 3 * m, 12), full_matrices=False)[2][:, -1].reshape(-1, 3, 4)
        at, of = directions[rows].reshape(-1, m, 3), known[rows].reshape(-1, m, 4)
        depth = np.einsum("smi,sij,smj->s", at, found, of, optimize=True)
        out[same] = np.where(depth > 0, 1.0, -1.0)[:, None, None] * found[:, :, :3]
    return so3.project(out)


@cache
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
        every, first = np.concatenate(places), np.cumsum([0, *map(len, places[:-1])])
        measured = np.stack([best for (best,) in resect_sights(point[every], along[every], first, 1)])
        out += poses(seen, measured, seen.machine[[i[0] for i in places]])
    return out

"""Poses of a body from points that were measured on it.

    T (4, 4) minimises sum_j |(R a_j + p - b_j) / sigma_j|^2,    covariance = (J^T W J)^-1,    J_j = [1, -[R a_j]_x]

a_j is where a point is on the body, b_j where an instrument saw it. The start is the closed form with one weight per point; Newton's steps
then weigh every coordinate. Points on one line leave the turn about that line open: their pose is not told.

Source: Kabsch (1976); Umeyama (1991); Arun, Huang and Blostein (1987).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.errors import require
from robocal.geometry import se3, so3

__all__ = ["FEWEST", "PointPoses", "body_of", "point_poses"]

FEWEST = 3  # tolerance: points, which six numbers take
STEPS = 4
FLAT = 1e-10  # tolerance: of the largest eigenvalue; below, the points are on one line to rounding
WIDE = 0.3  # tolerance: rad, of the turn's sigma; beyond, a covariance by derivatives is not true
MOST = 50  # tolerance: steps of the search for the body
FINE = 1e-3  # tolerance: of its size; all weights are alike
STILL = 1e-12  # tolerance: of its size


@record(eq=False)
class PointPoses:
    """Poses (k, 4, 4) of a body, their covariance (k, 6, 6) of (v, w) in the instrument's axes about the body's origin (m, rad), how many
    points told each (k,), and what they leave: residuals (k, j, 3) in m, chi2 (k,) with its degrees of freedom (k,). `known` (k,) is
    False where the points tell no pose; its numbers are NaN."""

    poses: Array
    covariance: Array
    points: Ints
    residuals: Array
    chi2: Array
    freedom: Ints
    known: Bools


def point_poses(places: ArrayLike, seen: ArrayLike, sigma: ArrayLike = 1.0) -> PointPoses:
    """Poses from points at `places` (j, 3) on the body that were `seen` (k, j, 3) in m, with standard deviations (k, j, 3); NaN where
    one was not measured.

    Raises ModelError for other shapes.
    """
    a, b = np.asarray(places, float), np.asarray(seen, float)
    fits = a.ndim == 2 and b.ndim == 3 and a.shape[1] == 3 and b.shape[1:] == a.shape
    require(fits, "one place is needed for each point", found=(a.shape, b.shape), expected="(j, 3) and (k, j, 3)")
    there = np.isfinite(b).all(axis=2)
    weight = np.where(there[..., None], 1 / np.broadcast_to(np.asarray(sigma, float), b.shape) ** 2, 0.0)
    b = np.where(there[..., None], b, 0.0)
    count = there.sum(axis=1)
    some = count >= FEWEST
    pose = np.full((len(b), 4, 4), np.nan)
    covariance, left = np.full((len(b), 6, 6), np.nan), np.full(b.shape, np.nan)
    if some.any():
        pose[some], covariance[some], left[some] = _fit(a, b[some], weight[some])
    turn = np.sqrt(np.trace(covariance[:, 3:, 3:], axis1=1, axis2=2))
    known = some & (turn < WIDE)
    pose[~known], covariance[~known], left[~known] = np.nan, np.nan, np.nan
    chi2 = np.where(known, np.nansum(left**2 * weight, axis=(1, 2)), np.nan)
    return PointPoses(pose, covariance, count, np.where(there[..., None], left, np.nan), chi2, 3 * count - 6, known)


def _fit(a: Array, b: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Poses, covariance and residuals of bodies that three points or more saw."""
    w = weight.mean(axis=2)
    total = w.sum(axis=1)[:, None]
    ca, cb = (w @ a) / total, np.einsum("kj,kji->ki", w, b) / total
    r = so3.project(np.einsum("kj,kji,kjl->kil", w, b - cb[:, None], a - ca[:, None]))
    pose = se3.compose(r, cb - np.einsum("kij,kj->ki", r, ca))
    size = np.sqrt(((a - a.mean(axis=0)) ** 2).sum(axis=1).max())
    scale = np.repeat([1.0, max(size, np.finfo(float).tiny)], 3)
    normal = np.zeros((len(b), 6, 6))
    for _ in range(STEPS):
        lever = a @ pose[:, :3, :3].swapaxes(1, 2)
        j = np.zeros((*b.shape, 6))
        j[..., :3], j[..., 3:] = np.eye(3), -so3.skew(lever)
        left = b - lever - pose[:, None, :3, 3]
        normal = np.einsum("kjia,kji,kjib->kab", j, weight, j)
        gradient = np.einsum("kjia,kji,kji->ka", j, weight, left)
        step = np.einsum("kab,kb->ka", _inverse(normal, scale), gradient)
        step = np.where(np.isfinite(step), step, 0.0)
        pose = se3.displace(pose, step[:, :3], step[:, 3:])
    left = b - a @ pose[:, :3, :3].swapaxes(1, 2) - pose[:, None, :3, 3]
    return pose, _inverse(normal, scale), left


def _inverse(normal: Array, scale: Array) -> Array:
    """Inverses (k, 6, 6) of normal matrices; NaN where they have none."""
    lengths = normal / scale[:, None] / scale
    values, vectors = np.linalg.eigh(lengths)
    values = np.where(values > FLAT * values[:, -1:], values, np.nan)
    return np.asarray((vectors / values[:, None]) @ vectors.swapaxes(1, 2) / scale[:, None] / scale)


def body_of(seen: ArrayLike) -> Array:
    """Where points (j, 3) are on a body that nobody has described, from what was `seen` of it (k, j, 3), NaN where one was not measured:
    around their middle, in the axes of the first view that has them all.

    Raises ModelError where no view has every point.
    """
    b = np.asarray(seen, float)
    whole = np.flatnonzero(np.isfinite(b).all(axis=(1, 2)))
    require(len(whole) > 0, "no view has every point", found="none", expected="one row with all points")
    body = b[whole[0]] - b[whole[0]].mean(axis=0)
    fine = FINE * max(float(np.abs(body).max()), np.finfo(float).tiny)
    for _ in range(MOST):
        found = point_poses(body, b, fine)
        require(found.known.any(), "the points are on one line", key="targets", expected="a point beside the line")
        back = np.einsum("kji,ktj->kti", found.poses[:, :3, :3], b - found.poses[:, None, :3, 3])
        mean = np.nanmean(back[found.known], axis=0)
        new = mean - mean.mean(axis=0)
        moved, body = np.abs(new - body).max(), new
        if moved <= STILL * np.abs(body).max():
            break
    return np.asarray(body)

"""The poses of a single square from its four corners: seen from far or from the front, two of them fit alike."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.geometry import se3
from robocal.vision.camera import image_of, project
from robocal.vision.marker.fit import homography
from robocal.vision.sheets import SQUARE

__all__ = ["SquarePose", "poses_of_square"]

ROUNDS, STILL = 30, 1e-10
UNFLAT = 0.3  # px: what lens and print are off by in all corners of a marker, beside their covariance
APART = 1e-3  # rad, between normals: nearer ones are one pose


@record(eq=False)
class SquarePose:
    """A pose (4, 4) of a square in the camera (x right, y up, z out of the print), what it leaves of the corners (rms of a coordinate, px,
    and e' C^-1 e, with two degrees of freedom), and the angle between its normal and the line to the camera (rad)."""

    pose: Array
    rms: float
    chi2: float
    tilt: float


def poses_of_square(corners: Array, covariance: Array, size: float, lens: Array) -> tuple[SquarePose, ...]:
    """Both poses of a square of edge `size` (m), the one that fits better first; one where it faces the camera.

    corners (4, 2) in px, top left first, with covariance (8, 8), to which `UNFLAT` is added; lens (n,) as in `vision.camera`. From far a
    plane looks like its mirror image at a plane across the line of sight: the second search begins there. From near its end may be the
    first pose; then the second one is that mirror image, in the place that fits best.
    """
    points = SQUARE * (size / 2)
    weight = np.asarray(np.linalg.inv(covariance + UNFLAT**2 * np.eye(8)), dtype=float)
    first = _search(_start(corners, points, lens), points, corners, weight, lens)
    mirror = _mirror(first.pose)
    for count in (6, 3):
        second = _search(mirror, points, corners, weight, lens, count)
        if np.linalg.norm(first.pose[:3, 2] - second.pose[:3, 2]) > APART:
            return (first, second) if first.chi2 <= second.chi2 else (second, first)
    return (first,)


def _start(corners: Array, points: Array, lens: Array) -> Array:
    """A pose from the homography, made orthonormal."""
    rays = np.column_stack([(corners - lens[2:4]) / lens[:2], np.ones(4)])
    for _ in range(ROUNDS):
        rays[:, :2] += (corners - image_of(rays, lens)) / lens[:2]
    h = np.append(homography(points[:, :2], rays[:, :2]), 1.0).reshape(3, 3)
    h *= 2 / (np.linalg.norm(h[:, 0]) + np.linalg.norm(h[:, 1]))
    u, _, v = np.linalg.svd(h[:, :2], full_matrices=False)
    return _upright(u @ v, h[:, 2])


def _upright(xy: Array, place: Array) -> Array:
    """A pose (4, 4) from the first two axes (3, 2) of its rotation."""
    return se3.compose(np.column_stack([xy, np.cross(xy[:, 0], xy[:, 1])]), place)


def _mirror(pose: Array) -> Array:
    """The pose whose axes are mirrored at the plane across the line of sight."""
    sight = pose[:3, 3] / np.linalg.norm(pose[:3, 3])
    return _upright(pose[:3, :2] - 2 * np.outer(sight, sight @ pose[:3, :2]), pose[:3, 3])


def _search(pose: Array, points: Array, corners: Array, weight: Array, lens: Array, count: int = 6) -> SquarePose:
    """The nearest pose (Levenberg and Marquardt), by its place and, where `count` is 6, its turn."""
    damp, step = 1e-3, np.zeros(6)

    def left_of(at: Array) -> tuple[Array, Array]:
        turned = points @ at[:3, :3].T
        seen, by, _ = project(turned + at[:3, 3], lens)
        cross = np.zeros((4, 3, 3))
        cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = turned[:, 2], -turned[:, 1], turned[:, 0]
        cross -= np.swapaxes(cross, 1, 2)
        return (seen - corners).ravel(), np.concatenate([by, by @ cross], axis=2).reshape(8, 6)[:, :count]

    left, by = left_of(pose)
    for _ in range(ROUNDS):
        normal = by.T @ weight @ by
        step[:count] = np.linalg.solve(normal + damp * np.diag(np.diag(normal)), -by.T @ weight @ left)
        trial = se3.displace(pose, step[:3], step[3:])
        left_there, by_there = left_of(trial)
        if trial[2, 3] > 0 and left_there @ weight @ left_there <= left @ weight @ left:
            pose, left, by, damp = trial, left_there, by_there, 0.1 * damp
            if np.abs(step).max() < STILL:
                break
        else:
            damp *= 10
    sight = pose[:3, 3] / np.linalg.norm(pose[:3, 3])
    tilt = float(np.arccos(np.clip(-pose[:3, 2] @ sight, -1, 1)))
    return SquarePose(pose, float(np.sqrt(np.mean(left**2))), float(left @ weight @ left), tilt)

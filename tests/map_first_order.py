"""What first-order theory says of a map and of cameras in it, from differences of the camera alone: nothing of the estimators is used.

Small motions (v, w) of cameras T_map_camera and markers T_map_marker along and about the axes of the map, and the numbers of a lens.
"""

from __future__ import annotations

import numpy as np

from robocal.geometry import se3
from robocal.vision.camera import image_of
from robocal.vision.map_gauge import rigid_projector

STEP = 1e-6


def moved(t, k):
    """Poses (n, 4, 4) moved by a step along one of six directions."""
    out = t.copy()
    if k < 3:
        out[:, k, 3] += STEP
    else:
        w = np.zeros(6)
        w[k] = STEP
        out[:, :3, :3] = se3.from_vector(w)[:3, :3] @ t[:, :3, :3]
    return out


class FirstOrder:
    """The errors that noise makes of a map, its lens and new images from the same cameras (V, 4, 4), and their covariances."""

    def __init__(self, there, cameras, sights, numbers, known, sigma):
        self.there, self.cameras, self.sigma = there, cameras, sigma
        self.count, self.views, self.lens = len(there.names), len(cameras), len(known)
        own = there.corners - there.vector[:, None, :3]
        local = np.einsum("mji,mcj->mci", there.poses[:, :3, :3], own)

        def pixels(views, markers, lens):
            t = se3.inverse(views)[sights.view] @ markers[sights.marker]
            return image_of(np.einsum("kij,kcj->kci", t[:, :3, :3], local[sights.marker]) + t[:, None, :3, 3], lens)

        at, rows = pixels(cameras, there.poses, numbers), np.arange(len(sights.view))
        self.j = np.zeros((*at.shape, 6 * self.count + self.lens + 6 * self.views))
        for k in range(6):
            for first, part, changed in (
                (0, sights.marker, pixels(cameras, moved(there.poses, k), numbers)),
                (6 * self.count + self.lens, sights.view, pixels(moved(cameras, k), there.poses, numbers)),
            ):
                self.j[rows, :, :, first + 6 * part + k] = (changed - at) / STEP
        for i, number in enumerate(known):
            lens = np.array(numbers)
            lens[number] += STEP
            self.j[..., 6 * self.count + i] = (pixels(cameras, there.poses, lens) - at) / STEP
        self.j = self.j.reshape(-1, self.j.shape[-1]) / sigma
        self.shared = slice(0, 6 * self.count + self.lens)
        self.numbers = slice(6 * self.count, 6 * self.count + self.lens)

    def solve(self, prior):
        """Of the map: prior covariance (k, k) of the lens. What is found, projected, is linear in noise and in what is stated."""
        free = np.r_[6 : self.j.shape[1]]  # the first marker stands still; the projection below does not know which
        information = self.j.T @ self.j
        information[self.numbers, self.numbers] += np.linalg.inv(prior)
        inverse = np.zeros_like(information)
        inverse[np.ix_(free, free)] = np.linalg.inv(information[np.ix_(free, free)])
        whole = np.eye(self.shared.stop)
        whole[: 6 * self.count, : 6 * self.count] = rigid_projector(self.there)
        self.map_noise = whole @ (inverse @ self.j.T)[self.shared]
        self.map_lens = whole @ (inverse[:, self.numbers] @ np.linalg.inv(prior))[self.shared]
        self.covariance = whole @ inverse[self.shared, self.shared] @ whole.T
        # New images take map and lens for independent of each other.
        apart = self.covariance.copy()
        apart[self.numbers, : 6 * self.count] = apart[: 6 * self.count, self.numbers] = 0.0
        weight = np.linalg.inv(apart + 1e-12 * np.eye(len(apart)) * (np.arange(len(apart)) < 6 * self.count))
        information = self.j.T @ self.j
        information[self.shared, self.shared] += weight
        inverse = np.linalg.inv(information)
        cameras = slice(self.shared.stop, None)
        self.view_noise = (inverse @ self.j.T)[cameras]
        self.view_prior = (inverse[:, self.shared] @ weight)[cameras]
        spread = self.view_noise @ self.view_noise.T + self.view_prior @ self.covariance @ self.view_prior.T
        self.camera = np.stack([spread[6 * u : 6 * u + 6, 6 * u : 6 * u + 6] for u in range(self.views)])
        return self

    def errors(self, off, first, second):
        """Of the cameras (V, 6), where the lens is stated off by (k,), from the noise of corners (n, 2) in both sets of images, px."""
        shared = self.map_noise @ first.ravel() / self.sigma + self.map_lens @ off
        return (self.view_noise @ second.ravel() / self.sigma + self.view_prior @ shared).reshape(-1, 6)

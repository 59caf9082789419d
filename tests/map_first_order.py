"""What first-order theory says of a map and of cameras in it, from differences of the camera alone: nothing of the estimators is used.

Small motions (v, w) of cameras T_map_camera and markers T_map_marker along and about the axes of the map, and the numbers of a lens.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

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

        def bent(number):
            lens = np.array(numbers)
            lens[number] += STEP
            return pixels(cameras, there.poses, lens)

        six = np.arange(6)
        at, first_lens, first_view = pixels(cameras, there.poses, numbers), 6 * self.count, 6 * self.count + self.lens
        changed = [pixels(cameras, moved(there.poses, k), numbers) for k in six]
        changed += [bent(number) for number in known]
        changed += [pixels(moved(cameras, k), there.poses, numbers) for k in six]
        columns = np.concatenate(
            [
                6 * sights.marker[:, None] + six,
                np.tile(first_lens + np.arange(self.lens), (len(sights.view), 1)),
                first_view + 6 * sights.view[:, None] + six,
            ],
            axis=1,
        )
        values = np.stack([(c - at) / STEP for c in changed], axis=-1) / sigma  # (k, 4, 2, 12 + lens)
        rows = np.broadcast_to(np.arange(at.size).reshape(at.shape)[..., None], values.shape)
        columns = np.broadcast_to(columns[:, None, None, :], values.shape)
        shape = at.size, first_view + 6 * self.views
        self.j = csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape)
        self.shared = slice(0, first_view)
        self.numbers = slice(first_lens, first_view)

    def solve(self, prior):
        """Of the map: prior covariance (k, k) of the lens. What is found, projected, is linear in noise and in what is stated."""
        own = (self.j.T @ self.j).toarray()
        free = np.r_[6 : len(own)]  # the first marker stands still; the projection below does not know which
        information = own.copy()
        self.stated = np.linalg.inv(prior)
        information[self.numbers, self.numbers] += self.stated
        inverse = np.zeros_like(information)
        inverse[np.ix_(free, free)] = np.linalg.inv(information[np.ix_(free, free)])
        whole = np.eye(self.shared.stop)
        whole[: 6 * self.count, : 6 * self.count] = rigid_projector(self.there)
        self.map_gain = whole @ inverse[self.shared]
        self.covariance = whole @ inverse[self.shared, self.shared] @ whole.T
        # The place of the whole map is known well enough, and what markers and lens have in common counts.
        whole = 1e-12 * np.eye(len(self.covariance)) * (np.arange(len(self.covariance)) < 6 * self.count)
        self.weight = np.linalg.inv(self.covariance + whole)
        information = own.copy()
        information[self.shared, self.shared] += self.weight
        cameras = slice(self.shared.stop, None)
        self.view_gain = np.linalg.inv(information)[cameras]
        by_prior = self.view_gain[:, self.shared] @ self.weight
        spread = self.view_gain @ own @ self.view_gain.T + by_prior @ self.covariance @ by_prior.T
        self.camera = np.stack([spread[6 * u : 6 * u + 6, 6 * u : 6 * u + 6] for u in range(self.views)])
        return self

    def errors(self, off, first, second):
        """Of the map (M, 6) and the cameras (V, 6), where the lens is stated off by (k,), from the noise of corners (n, 2) in both sets of
        images, px."""
        right = self.j.T @ first.ravel() / self.sigma
        right[self.numbers] += self.stated @ off
        shared = self.map_gain @ right
        right = self.j.T @ second.ravel() / self.sigma
        right[self.shared] += self.weight @ shared
        return shared[: 6 * self.count].reshape(-1, 6), (self.view_gain @ right).reshape(-1, 6)

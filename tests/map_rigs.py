"""Rigs that are drawn from a plan of `vision require`: what its map and the cameras in it are off by, beside first-order theory of the same
noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from map_first_order import FirstOrder

from robocal._record import replace as changed
from robocal.geometry import se3
from robocal.geometry.fits import rigid
from robocal.session.vision.map_fit import fit_map
from robocal.session.vision.map_requirement import PredictedMap, corner_table, predict_map
from robocal.session.vision.place_views import locate_views
from robocal.vision.camera import image_of
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import move_map, rigid_projector, take_markers
from robocal.vision.map_views import project_map
from robocal.vision.maps import MarkerMap


@dataclass
class Plan:
    """Markers, cameras T_map_camera (V, 4, 4) that see some, a lens with its covariance, the noise of a corner in px; what is predicted."""

    there: MarkerMap
    views: np.ndarray
    lens: Lens
    noise: float
    size: tuple[int, int]
    told: PredictedMap
    theory: FirstOrder | None = None

    @classmethod
    def of(cls, there, views, lens, noise, size):
        """Cameras that see no marker and markers that no camera sees are left out."""
        told = predict_map(there, views, lens, noise, size)
        return cls(told.map, views[told.markers > 0], lens, noise, size, told)

    def with_theory(self):
        """The same with what first-order theory says of it."""
        known = [list(self.lens.kind.symbols).index(s) for s in self.lens.known]
        sights = project_map(self.there, self.views, self.lens.intrinsics, self.size)
        theory = FirstOrder(self.there, self.views, sights, self.lens.intrinsics, known, self.noise)
        return replace(self, theory=theory.solve(self.lens.covariance))

    @property
    def predicted(self):
        """Rms errors: map along x and y, map z, cameras along x and y, camera z, m."""
        e = self.told.errors
        return np.array([e.map_xy, e.map_z, e.camera_xy, e.camera_z])

    def draw(self, seed, sign=1.0):
        """A rig: errors of its map (M, 6) and of its cameras (V, 6), and both of theory where the plan has one. With `sign` -1 its mirror: noise
        and what the lens is off by reversed."""
        first, second, table, off_by = self.tables(seed, sign)
        found = fit_map(first, self.lens, "none")
        off, moved = error_of(found.map, self.there)
        held = locate_views(second, moved, found.lens)
        v, w = se3.displacement(held.poses, self.views[[int(i) - 1 for i in held.ids]])
        noise = [t.pixels.value - table.pixels.value for t in (first, second)]
        theory = self.theory.errors(-off_by, *noise) if self.theory else None
        return off, np.concatenate([v, w], axis=1), None if theory is None else tuple(-t for t in theory)

    def tables(self, seed, sign=1.0):
        """Corners of images of the map and of new ones, the same without noise, and what the lens is off by."""
        rng = np.random.default_rng(seed)
        off_by = np.zeros(len(self.lens.intrinsics))
        known = [list(self.lens.kind.symbols).index(s) for s in self.lens.known]
        off_by[known] = sign * np.linalg.cholesky(self.lens.covariance) @ rng.normal(size=len(known))
        sights = project_map(self.there, self.views, self.lens.intrinsics, self.size)
        sights = changed(sights, pixels=self.seen_through(sights, self.lens.intrinsics + off_by))
        many = np.bincount(sights.marker, minlength=len(self.there.names))
        table = corner_table(self.there, self.views, sights, many, self.noise, self.size)
        first, second = (self.noisy(table, sign, rng) for _ in range(2))
        return first, second, table, off_by[known]

    def seen_through(self, sights, numbers):
        """The same corners through another lens."""
        inward = se3.inverse(self.views)[sights.view]
        points = np.einsum("kij,kcj->kci", inward[:, :3, :3], self.there.corners[sights.marker])
        return image_of(points + inward[:, None, :3, 3], numbers)

    def noisy(self, table, sign, rng):
        """A table with noise."""
        obs = table.pixels
        obs = changed(obs, value=obs.value + sign * rng.normal(0, self.noise, obs.value.shape))
        return changed(table, data=changed(table.data, observations=(obs,)))


def error_of(found: MarkerMap, true: MarkerMap):
    """The errors (M, 6) of a map laid on the truth as well as it goes, and the map there."""
    mine = take_markers(true, found.names)
    laid = move_map(found, rigid(found.corners.reshape(-1, 3), mine.corners.reshape(-1, 3)))
    off = np.concatenate(se3.displacement(laid.poses, mine.poses), axis=1).ravel()
    return (rigid_projector(mine) @ off).reshape(-1, 6), laid


def squares(errors):
    """Mean squares along x and y, and along z, of map and cameras (k, 6): four numbers."""
    return np.array([np.mean(np.square(a)) for e in errors for a in (e[:, :2], e[:, 2])])

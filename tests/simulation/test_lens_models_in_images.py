"""Markers drawn through any model of lenses, and their corners fitted with it: where the lens projects them."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.geometry import se3
from robocal.simulation.images import Photograph, render
from robocal.vision.camera import image_of, project
from robocal.vision.marker.fit import fit_marker
from robocal.vision.sheets import Marker, Sheet, marker_corners

SIZE = (480, 360)
LENSES = {
    "brown": np.array([420.0, 425, 238.1, 181.3, -0.25, 0.08, 1e-3, -2e-3, 0.01]),
    "rational": np.array([420.0, 425, 238.1, 181.3, 0.3, 0.05, 1e-3, -2e-3, 0.0, 0.55, 0.1, 0.01]),
    "fisheye": np.array([200.0, 202, 238.1, 181.3, -0.03, 0.01, -2e-3, 3e-4]),
}


@pytest.mark.parametrize("model", LENSES)
def test_corners_lie_where_the_lens_projects_them(model):
    """Along the edges of the image, where lenses bend most: a fisheye's markers are up to 65 degrees off its axis."""
    lens, rng = LENSES[model], np.random.default_rng(7)
    cells = np.zeros((8, 8))
    cells[1:-1, 1:-1] = rng.random((6, 6)) > 0.5
    reach = 0.35 if model != "fisheye" else 0.9
    grid = [(x, y) for x in (-reach, 0.0, reach) for y in (-0.6 * reach, 0.6 * reach)]
    edge = 0.11 if model != "fisheye" else 0.28
    markers = tuple(Marker("6x6_250", i, cells, x, y, edge) for i, (x, y) in enumerate(grid))
    pose = se3.compose(np.diag([1.0, -1, -1]), [0, 0, 0.6]) @ se3.from_vector([0, 0, 0, 0.1, -0.1, 0.2])
    sheet = Sheet("six", 4 * reach, 4 * reach, markers)
    image = render([(sheet, pose)], lens, SIZE, Photograph(blur=0.7, noise=1.5), rng=rng).astype(float)
    errors, sizes = [], []
    for marker in markers:
        true = image_of(marker_corners(marker) @ pose[:3, :3].T + pose[:3, 3], lens)
        found = fit_marker(image, true + rng.normal(scale=0.7, size=(4, 2)), cells, lens)
        assert found is not None
        off = (found.corners - true).ravel()
        errors.append(off)
        sizes.append(off @ np.linalg.solve(found.covariance, off))
    assert np.sqrt(np.mean(np.square(errors))) < 0.03 and 2 < np.mean(sizes) < 16  # of 8 numbers each
    assert project(np.ones(3), lens)[2].shape == (2, len(lens))

"""A lens that bends edges of markers more than the camera does is told; the right one, and one that bends nothing, are not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.files.image_files import find_images, read_images
from robocal.session.vision.lens_edges import LensEdges
from robocal.session.vision.target import Target
from robocal.session.vision.views import look_at

TRUE = np.array([520.0, 523.0, 321.0, 237.0, -0.25, 0.06, 0, 0, 0])
BENT = np.array([0, 0, 0, 0, 1, 0, 0, 0, 0])  # k1 alone


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """Four images of six markers through a lens that bends by 20 px in the corners."""
    cv2 = pytest.importorskip("cv2")
    from robocal.files.images import family_cells
    from robocal.simulation.images import Photograph, render
    from robocal.vision.sheets import Marker, Sheet

    cells = family_cells("6x6_250", range(6))
    places = [(x, y) for y in (0.04, -0.04) for x in (-0.08, 0.0, 0.08)]
    sheet = Sheet("s", 0.24, 0.16, tuple(Marker("6x6_250", i, cells[i], *at, 0.055) for i, at in enumerate(places)))
    rng, folder = np.random.default_rng(3), tmp_path_factory.mktemp("im")
    for k in range(4):
        at = np.eye(4)
        at[:3, :3] = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3)).as_matrix() @ np.diag([1.0, -1, -1])
        at[:3, 3] = [*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.22, 0.3)]
        image = render([(sheet, at)], TRUE, (640, 480), Photograph(blur=0.8, noise=3.0), 110.0, rng)
        assert cv2.imwrite(str(folder / f"v{k}.png"), image)
    return list(read_images(find_images([str(folder)]), 1))


@pytest.mark.parametrize(
    ("lens", "told"), [(TRUE, False), (TRUE + 0.02 * BENT, False), (TRUE + 0.6 * BENT, True), (TRUE - 1.5 * BENT, True)]
)
def test_a_lens_of_another_camera_is_told(images, lens, told):
    edges = LensEdges("6x6_250", lens)
    for image in images:
        edges.add(image, look_at(image, Target(family="6x6_250", size=0.055, lens=lens)).sightings)
    assert edges.count >= 14
    assert bool(edges.remarks) == told, (edges.count, edges.worse)

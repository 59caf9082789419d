"""What the camera of a virtual rig shows, drawn, and the corners of markers that are found in it, through the lens as calibrated."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.files.image_files import GreyImage
from robocal.files.images import family_cells
from robocal.files.text import InputFile
from robocal.geometry import se3
from robocal.progress import Watch, tell
from robocal.session.commissioning.rig_world import RigWorld
from robocal.session.vision.target import Target
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.sheets import Marker, Sheet

__all__ = ["THROUGH", "photograph"]

FAMILY = "36h11"
# px, stated of corners that were found through the calibrated lens: they are nearer, but a lens that is wrong moves them all.
THROUGH = 0.1
WIDEST = 1.5  # grid: slope of a ray, beyond which no camera of a rig looks


def photograph(
    world: RigWorld, cameras: Array, rng: np.random.Generator, watch: Watch | None
) -> tuple[tuple[tuple[int, int, Array], ...], tuple[NDArray[np.uint8], ...]]:
    """Corners as (view, marker, (4, 2) px) that are found in the images of cameras T_base_camera (k, 4, 4), and the images. Raises
    MissingExtra."""
    said = world.spec.model
    size = (said.camera.resolution[0], said.camera.resolution[1])
    sheets = _sheets(world)
    how = Photograph(blur=said.images.blur_px, noise=said.images.grey_noise)
    target = Target(FAMILY, size=said.markers.size, lens=world.stated_lens)
    corners: list[tuple[int, int, Array]] = []
    images = []
    for view, camera in enumerate(cameras):
        tell(watch, "images", what=str(view + 1))
        near = list(_near(world, sheets, se3.inverse(camera)))
        grey = render(near, world.lens, size, how, texture(size, int(rng.integers(1 << 30))), rng)
        images.append(grey)
        file = InputFile(Path(f"{view}.png"), "")
        found, _, _ = target.search(GreyImage(str(view), file, np.asarray(grey), grey.astype(float)))
        corners += [
            (view, int(s.marker), s.place) for s in found if len(s.corner) == 4 and s.marker < len(world.markers)
        ]
    return tuple(corners), tuple(images)


def _sheets(world: RigWorld) -> tuple[Sheet, ...]:
    """A printed sheet for each marker."""
    count = len(world.markers)
    cells = family_cells(FAMILY, range(count))
    paper = world.edge * (1 + 2 / cells.shape[1])
    return tuple(
        Sheet(f"m{i}", paper, paper, (Marker(FAMILY, i, cells[i], 0.0, 0.0, world.edge),)) for i in range(count)
    )


def _near(world: RigWorld, sheets: tuple[Sheet, ...], back: Array) -> Iterator[tuple[Sheet, Array]]:
    """The sheets before a camera T_camera_base (4, 4), where they may be in its image."""
    for sheet, marker in zip(sheets, world.markers, strict=True):
        there = back @ marker
        if there[2, 3] > 0.1 and np.hypot(*there[:2, 3]) < WIDEST * there[2, 3]:  # tolerance: m, before the camera
            yield sheet, there

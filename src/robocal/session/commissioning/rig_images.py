"""What the camera of a virtual rig shows, drawn, and the corners of markers that are found in it, through the lens as calibrated."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.cable.rig_spec import CableRigSpec
from robocal.files.image_files import GreyImage
from robocal.files.images import family_cells
from robocal.files.text import InputFile
from robocal.geometry import se3
from robocal.progress import Watch, tell
from robocal.session.commissioning.rig_world import RigWorld
from robocal.session.vision.target import Target
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.camera import unproject
from robocal.vision.sheets import Marker, Sheet

__all__ = ["THROUGH", "check_family", "photograph"]

FAMILY = "36h11"
# px, stated of corners that were found through the calibrated lens: they are nearer, but a lens that is wrong moves them all.
THROUGH = 0.1
WIDEST = 1.5  # grid: slope of a ray, beyond which no camera of a rig looks
BORDER = 9  # grid: places along a side of the image at which rays are asked for
ROOM = 1.05  # tolerance: times the slopes of rays there, for what lies between them and for blur


def check_family(spec: CableRigSpec) -> None:
    """Raises FormatError where the family has fewer markers than lie on the floor, MissingExtra where nothing draws them."""
    count = int(np.prod(spec.model.markers.grid))
    try:
        family_cells(FAMILY, [count - 1])
    except ModelError as error:
        raise error.of_file(
            spec.file.file, key="markers.grid", found=f"{count} markers", expected=error.expected
        ) from None


def photograph(
    world: RigWorld, cameras: Array, rng: np.random.Generator, watch: Watch | None
) -> tuple[tuple[tuple[int, int, Array], ...], tuple[NDArray[np.uint8], ...]]:
    """Corners as (view, marker, (4, 2) px) that are found in the images of cameras T_base_camera (k, 4, 4), and the images. Raises
    MissingExtra."""
    said = world.spec.model
    size = (said.camera.resolution[0], said.camera.resolution[1])
    sheets, widest = _sheets(world), _slopes(world.lens, size)
    how = Photograph(blur=said.images.blur_px, noise=said.images.grey_noise)
    target = Target(FAMILY, size=said.markers.size, lens=world.stated_lens)
    corners: list[tuple[int, int, Array]] = []
    images = []
    for view, camera in enumerate(cameras):
        tell(watch, "images", what=str(view + 1))
        near = list(_near(world, sheets, se3.inverse(camera), widest))
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


def _slopes(lens: Array, size: tuple[int, int]) -> Array:
    """The greatest slopes (2,) of rays that reach an image, sideways and down; of a lens that folds back before its border, WIDEST."""
    share = np.linspace(0.0, 1.0, BORDER)
    x, y = np.meshgrid(share, share)
    along = unproject(np.column_stack([x.ravel() * (size[0] - 1), y.ravel() * (size[1] - 1)]), lens)
    most = ROOM * np.abs(along[:, :2] / along[:, 2:]).max(axis=0)
    return np.asarray(np.where(most < WIDEST, most, WIDEST))


def _near(world: RigWorld, sheets: tuple[Sheet, ...], back: Array, widest: Array) -> Iterator[tuple[Sheet, Array]]:
    """The sheets before a camera T_camera_base (4, 4), where they may be in its image: every other one costs time at each pixel."""
    for sheet, marker in zip(sheets, world.markers, strict=True):
        there = back @ marker
        reach, depth = float(np.hypot(sheet.width, sheet.height)) / 2, there[2, 3]
        if (
            depth > 0.1 and (np.abs(there[:2, 3]) < widest * (depth + reach) + reach).all()
        ):  # tolerance: m, before the camera
            yield sheet, there

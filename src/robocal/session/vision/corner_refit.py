"""Corners of markers and boards once more, in their images, with the lens that the corners told: straight edges are straight then.

Without a lens a marker's pixels are fitted as if its edges were straight, so that a wide lens moves its corners. With the lens the
corners move, and with the corners the lens; two or three rounds end below what matters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.vision_limits import CORNER_AT_REST
from robocal.errors import ModelError
from robocal.files.image_files import GreyImage, find_images, read_images
from robocal.measure.machine import Rig
from robocal.measure.sights.correlations import COVARIANCES
from robocal.progress import Watch, tell
from robocal.prove.decision import Decision
from robocal.session.vision.corner_table import CornerTable
from robocal.session.vision.target import cells_of
from robocal.vision.checker.crossing import fit_saddles
from robocal.vision.lenses import Lens
from robocal.vision.marker.fit import fit_marker

__all__ = ["RefitCorners", "refit_corners", "refit_once"]

ROUNDS = 6  # grid: of corners and lens; each moves them a tenth of the one before
ASTRAY = 0.1, 1.0  # tolerance: of a marker's extent, or px: that corners may move in one round


@record
class RefitCorners:
    """How many markers and boards were fitted again, in how many rounds, and how far corners moved in the first and last (px, rms)."""

    markers: int
    rounds: int
    first: float
    last: float


Fit = Callable[[CornerTable], tuple[Decision[Rig], Lens]]


def refit_corners(
    table: CornerTable, lens: Lens, places: Sequence[str], fit: Fit, watch: Watch | None = None
) -> tuple[CornerTable, Decision[Rig], Lens, RefitCorners]:
    """Corners of markers in images with a lens, and the lens of these corners, until corners rest: the table of the last round, what
    was decided of it, its lens, and how far they moved. Raises FileError, ModelError."""
    images = _images(table, places)
    moves: list[float] = []
    while True:
        tell(watch, "detect", what="again")
        table, move, markers = _once(table, lens, images)
        moves.append(move)
        made, lens = fit(table)
        if move < CORNER_AT_REST or len(moves) == ROUNDS:
            return table, made, lens, RefitCorners(markers, len(moves), moves[0], moves[-1])


def refit_once(table: CornerTable, lens: Lens, places: Sequence[str], watch: Watch | None = None) -> CornerTable:
    """Corners of markers in images with a lens that is known. Raises FileError, ModelError."""
    images = _images(table, places)
    tell(watch, "detect", what="again")
    return _once(table, lens, images)[0]


def _images(table: CornerTable, places: Sequence[str]) -> dict[str, GreyImage]:
    """The images of its views."""
    if table.family is None and not table.columns:
        expected = "corners.json of vision detect beside the list; --checker of a board"
        raise ModelError("nobody says what the target looks like", key="--images", expected=expected)
    ids = table.data.configurations.ids
    images = {i.view: i for i in read_images(find_images(places), 1) if i.view in ids}
    if not images:
        expected = f"images of these names: {', '.join(ids[:3])}, ..."
        raise ModelError("no image is one of the views", key="--images", found=", ".join(places), expected=expected)
    return images


def _once(table: CornerTable, lens: Lens, images: dict[str, GreyImage]) -> tuple[CornerTable, float, int]:
    obs, ids = table.pixels, table.data.configurations.ids
    value = obs.value.copy()
    sigma = np.full_like(value, np.nan) if obs.sigma is None else obs.sigma.copy()
    marker, covariances = np.array(table.marker), obs.extra.get(COVARIANCES)
    covariances = None if covariances is None else covariances.copy()
    key = np.array([f"{c} {m}" for c, m in zip(obs.configuration.tolist(), table.marker, strict=True)])
    order = np.lexsort((table.corner, key))
    count = 0
    for rows in np.split(order, np.flatnonzero(key[order][1:] != key[order][:-1]) + 1):
        image = images.get(ids[obs.configuration[rows[0]]])
        if image is None:
            continue
        if marker[rows[0]].isdigit():
            kept, places, spread = _marker(image, obs.value[rows], table.family, int(marker[rows[0]]), lens)
        else:
            kept, places, spread = _board(image, table.corner[rows], obs.value[rows], table.columns, lens)
        if not len(kept):
            continue
        at = rows[kept]
        value[at], sigma[at] = places, np.sqrt(np.diag(spread)).reshape(-1, 2)
        if covariances is not None:
            covariances[at] = (
                _own_blocks(spread) if len(kept) != 4 or not marker[at[0]].isdigit() else spread.reshape(4, 2, 8)
            )
        count += 1
    moved = float(np.sqrt(np.mean(np.square(value - obs.value))))
    extra = obs.extra if covariances is None else {**obs.extra, COVARIANCES: covariances}
    again = replace(obs, value=value, sigma=None if np.isnan(sigma).any() else sigma, extra=extra)
    return replace(table, data=replace(table.data, observations=(again,))), moved, count


Corners = tuple[Ints, Array, Array]
NONE: Corners = np.zeros(0, dtype=np.int64), np.zeros((0, 2)), np.zeros((0, 0))


def _marker(image: GreyImage, before: Array, family: str | None, number: int, lens: Lens) -> Corners:
    """Which corners of a marker, by their row, are where, and their covariance; all of them or none."""
    if family is None or len(before) != 4:
        return NONE
    one = fit_marker(image.levels, before, cells_of(family, number), lens.intrinsics)
    if one is None or np.abs(one.corners - before).max() > max(ASTRAY[0] * np.ptp(before, axis=0).max(), ASTRAY[1]):
        return NONE
    return np.arange(4), one.corners, one.covariance


def _board(image: GreyImage, corner: Ints, before: Array, columns: int, lens: Lens) -> Corners:
    """The same of a board, without the corners that cannot be fitted; those of a crossing never go far."""
    seen = fit_saddles(image.levels, corner, before, columns, lens.intrinsics) if columns else None
    if seen is None:
        return NONE
    row = {n: k for k, n in enumerate(corner.tolist())}
    return np.array([row[n] for n in seen.corner.tolist()]), seen.place, seen.covariance


def _own_blocks(spread: Array) -> Array:
    """Covariances (k, 2, 8) of corners (2 k, 2 k) that are independent of each other."""
    out = np.zeros((len(spread) // 2, 2, 8))
    for k, block in enumerate(out):
        block[:, :2] = spread[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
    return out

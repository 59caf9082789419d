"""Corners of markers once more, in their images, with the lens that the corners told: straight edges are straight then.

Without a lens a marker's pixels are fitted as if its edges were straight, so that a wide lens moves its corners. With the lens the
corners move, and with the corners the lens; two or three rounds end below what matters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robocal._record import record, replace
from robocal.diagnose.limits import CORNER_AT_REST
from robocal.errors import ModelError
from robocal.files.image_files import GreyImage, find_images, read_images
from robocal.measure.machine import Rig
from robocal.measure.sights.correlations import COVARIANCES
from robocal.progress import Watch, tell
from robocal.prove.decision import Decision
from robocal.session.vision.corner_table import CornerTable
from robocal.session.vision.target import cells_of
from robocal.vision.lenses import Lens
from robocal.vision.marker.fit import fit_marker

__all__ = ["RefitCorners", "refit_corners"]

ROUNDS = 6  # grid: of corners and lens; each moves them a tenth of the one before
ASTRAY = 0.1, 1.0  # tolerance: of a marker's extent, or px: that corners may move in one round


@record
class RefitCorners:
    """How many markers were fitted again, in how many rounds, and by how much corners moved in the first and in the last (px, rms)."""

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
    if table.family is None:
        expected = "corners.json of vision detect beside the list, with markers"
        raise ModelError("nobody says what the markers look like", key="--images", expected=expected)
    ids = table.data.configurations.ids
    images = {i.view: i for i in read_images(find_images(places), 1) if i.view in ids}
    if not images:
        expected = f"images of these names: {', '.join(ids[:3])}, ..."
        raise ModelError("no image is one of the views", key="--images", found=", ".join(places), expected=expected)
    moves: list[float] = []
    while True:
        tell(watch, "detect", what="again")
        table, move, markers = _once(table, lens, table.family, images)
        moves.append(move)
        made, lens = fit(table)
        if move < CORNER_AT_REST or len(moves) == ROUNDS:
            return table, made, lens, RefitCorners(markers, len(moves), moves[0], moves[-1])


def _once(table: CornerTable, lens: Lens, family: str, images: dict[str, GreyImage]) -> tuple[CornerTable, float, int]:
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
        if image is None or len(rows) != 4 or not marker[rows[0]].isdigit():
            continue
        before = obs.value[rows]
        one = fit_marker(image.levels, before, cells_of(family, int(marker[rows[0]])), lens.intrinsics)
        if one is None or np.abs(one.corners - before).max() > max(ASTRAY[0] * np.ptp(before, axis=0).max(), ASTRAY[1]):
            continue
        value[rows], sigma[rows] = one.corners, np.sqrt(np.diag(one.covariance)).reshape(4, 2)
        if covariances is not None:
            covariances[rows] = one.covariance.reshape(4, 2, 8)
        count += 1
    moved = float(np.sqrt(np.mean(np.square(value - obs.value))))
    extra = obs.extra if covariances is None else {**obs.extra, COVARIANCES: covariances}
    again = replace(obs, value=value, sigma=None if np.isnan(sigma).any() else sigma, extra=extra)
    return replace(table, data=replace(table.data, observations=(again,))), moved, count

"""Whether the markers of a ChArUco board are where the board that was named has them, and which board has them there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.diagnose.vision_limits import BOARD_MISFIT
from robocal.errors import ModelError
from robocal.files.marker_search import MarkersInImage, charuco_markers
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["judge_layout"]

LEAST, MOST = 3, 20  # grid: squares along a side of boards that are tried
SHARE = 0.5  # of a square: middles of markers do not ask for it
CLEARLY = 0.5  # tolerance: of boards with as many columns the smallest is named, unless another fits so much better
POINTS = 6  # tolerance: markers of an image that tell: a homography fits four


def judge_layout(found: Sequence[MarkersInImage], family: str, squares: tuple[int, int], legacy: bool) -> Remark | None:
    """What speaks against a board of columns x rows squares, by markers in some images: that they are elsewhere on it."""
    some = [f for f in found if len(f) >= POINTS]
    if not some or _misfit(some, family, squares, legacy) <= BOARD_MISFIT:
        return None
    most = max(int(f.ids.max()) for f in some)
    best, left = None, BOARD_MISFIT / CLEARLY
    for columns in range(LEAST, MOST + 1):
        # Numbers run by rows: how many rows there are shows in them alone.
        for rows in range(LEAST, MOST + 1):
            if columns * rows // 2 <= most:
                continue
            for pattern in (legacy, not legacy):
                if (misfit := _misfit(some, family, (columns, rows), pattern)) < CLEARLY * left:
                    best, left = (columns, rows), misfit
            if columns * rows // 2 > most + columns:
                break
    facts = {} if best is None else {"wide": best[0], "high": best[1]}
    return Remark.of(Code.BOARD_OTHER, columns=squares[0], rows=squares[1], **facts)


def _misfit(found: Sequence[MarkersInImage], family: str, squares: tuple[int, int], legacy: bool) -> float:
    """How far markers are from where a board has them, through the homography that fits best: rms in squares, of the image where most."""
    try:
        corners = charuco_markers(squares, family, legacy, SHARE)
    except ModelError:  # more than the dictionary has
        return np.inf
    worst = 0.0
    for one in found:
        if not set(one.ids.tolist()) <= set(corners):
            return np.inf
        board = np.array([corners[n][:, :2].mean(axis=0) for n in one.ids.tolist()])
        worst = max(worst, _plane_misfit(one.corners.mean(axis=1), board))
    return worst


def _plane_misfit(image: Array, board: Array) -> float:
    """The rms (in the unit of the board) that a homography from image (k, 2) to board (k, 2) leaves."""
    middle, extent = image.mean(axis=0), float(np.ptp(image, axis=0).max())
    x, y = ((image - middle) / extent).T
    one, none = np.ones_like(x), np.zeros((len(x), 3))
    u, v = board.T
    rows = np.vstack(
        [np.column_stack([x, y, one, none, -u * x, -u * y]), np.column_stack([none, x, y, one, -v * x, -v * y])]
    )
    h = np.append(np.linalg.lstsq(rows, np.concatenate([u, v]), rcond=None)[0], 1.0).reshape(3, 3)
    there = np.column_stack([x, y, one]) @ h.T
    return float(np.sqrt(np.mean((there[:, :2] / there[:, 2:] - board) ** 2)))

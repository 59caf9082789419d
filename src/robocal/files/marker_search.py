"""Where OpenCV finds markers and checkerboards: to about a pixel, as start values. Only detection; the corners are fitted elsewhere.

Two looks: at the image as it is, and where it has few pixels at twice its size, which finds markers of 10 to 20 px and steep ones.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.diagnose.vision_limits import DICTIONARY_AHEAD
from robocal.errors import ModelError
from robocal.files.images import FAMILIES, opencv

__all__ = [
    "FamilyTrial", "MarkersInImage", "charuco_markers", "choose_family", "encode_picture", "find_charuco", "find_checker",
    "find_markers", "largest_family", "measure_checker", "smallest_family",
]  # fmt: skip

ENLARGE = 1_500_000  # px: larger images are looked at once
SMALL = (
    7,
    15,
)  # px: windows of thresholds that find what is small, at twice its size; more find no more, and take as much time each
TRIAL = 1_000_000  # px: dictionaries are tried on images of at most so many
UNEVEN = (
    1.7  # tolerance: from step to step along a board: tilted views change by less, a line that is left out doubles one
)
PATIENCE = 3.0  # s, that trials of dictionaries may take
# One dictionary of each family, the largest: the smaller ones are its beginning.
LARGEST = (
    "36h11", "4x4_1000", "5x5_1000", "6x6_1000", "7x7_1000", "mip_36h12", "original", "25h9", "16h5", "36h10",
)  # fmt: skip
# What a marker fills of its square, where OpenCV looks for corners by homographies of the markers beside them: it hardly matters.
SHARE = 0.5
SIZES = (50, 100, 250, 1000)


@record(eq=False)
class MarkersInImage:
    """Markers in an image: numbers (k,) and corners (k, 4, 2), top left first, in pixels."""

    ids: Ints
    corners: Array

    def __len__(self) -> int:
        return len(self.ids)


@record
class FamilyTrial:
    """The largest dictionary of the family that fits best, or none, how many markers these are, and of the next family; the smallest
    dictionaries of both with all numbers that were found."""

    family: str | None
    smallest: str
    count: int
    next: int
    next_family: str


NOTHING = MarkersInImage(np.empty(0, dtype=np.int64), np.empty((0, 4, 2)))


def find_markers(grey: Array, family: str, border: int = 1, wanted: Sequence[int] = ()) -> MarkersInImage:
    """Markers of a dictionary in an image (h, w) of bytes; border: cells of black around their code; wanted: all numbers that there can be,
    where they are known."""
    first = _look(grey, family, border, strict=False)
    if grey.size > ENLARGE or (len(wanted) and set(wanted) <= set(first.ids.tolist())):
        return first
    cv2 = opencv()
    twice = cv2.resize(grey, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    second = _look(twice, family, border, strict=False, windows=SMALL)
    return _join(first, MarkersInImage(second.ids, (second.corners - 0.5) / 2))


def choose_family(images: Sequence[Array]) -> FamilyTrial:
    """The family of the markers in some images, by trying all: it has at least twice as many as the next. Of its dictionaries the smaller
    are the beginning of the larger: they cannot be told apart but by their numbers."""
    cv2, start = opencv(), time.monotonic()
    counts = dict.fromkeys(LARGEST, 0)
    most = dict.fromkeys(LARGEST, -1)
    for grey in images:
        shrink = max(1.0, (grey.size / TRIAL) ** 0.5)
        small = (
            grey
            if shrink == 1.0
            else cv2.resize(grey, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
        )
        for family in LARGEST:
            found = _look(small, family, 1, strict=True)
            counts[family] += len(found)
            most[family] = max([most[family], *found.ids.tolist()])
        if time.monotonic() - start > PATIENCE * 2 / 3:
            break
    best, *others = sorted(LARGEST, key=lambda f: -counts[f])
    count, following = counts[best], counts[others[0]]
    chosen = best if count and count >= DICTIONARY_AHEAD * following else None
    smallest = [smallest_family(f, most[f]) for f in (best, others[0])]
    return FamilyTrial(chosen, smallest[0], count, following, smallest[1])


def smallest_family(family: str, number: int) -> str:
    """The smallest dictionary of a family that holds a number."""
    stem, _, size = family.partition("_")
    if not size.isdigit():
        return family
    return next(f"{stem}_{n}" for n in SIZES if number < n)


def largest_family(family: str) -> str:
    """The largest dictionary of the family of one."""
    stem, _, size = family.partition("_")
    return f"{stem}_{SIZES[-1]}" if size.isdigit() else family


def _look(
    grey: Array, family: str, border: int, *, strict: bool, windows: tuple[int, int] | None = None
) -> MarkersInImage:
    cv2 = opencv()
    aruco = cv2.aruco
    how = aruco.DetectorParameters()
    how.cornerRefinementMethod = aruco.CORNER_REFINE_NONE
    how.perspectiveRemovePixelPerCell = 8
    how.markerBorderBits = border
    how.minMarkerPerimeterRate = 0.01
    if windows is not None:
        how.adaptiveThreshWinSizeMin, how.adaptiveThreshWinSizeMax = windows
        how.adaptiveThreshWinSizeStep = windows[1] - windows[0]
    if strict:
        how.errorCorrectionRate = 0.0
    search = aruco.ArucoDetector(aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[family])), how)
    corners, ids, _ = search.detectMarkers(grey)
    if ids is None or len(ids) == 0:
        return NOTHING
    return MarkersInImage(np.asarray(ids, dtype=np.int64).ravel(), np.asarray(corners, dtype=float).reshape(-1, 4, 2))


def _join(one: MarkersInImage, other: MarkersInImage) -> MarkersInImage:
    """Markers of two looks, each once: one whose middle lies in another of its number is the same."""
    kept = [
        k
        for k, (number, corners) in enumerate(zip(other.ids, other.corners, strict=True))
        if not any(_inside(corners.mean(axis=0), c) for c in one.corners[one.ids == number])
    ]
    return MarkersInImage(
        np.concatenate([one.ids, other.ids[kept]]), np.concatenate([one.corners, other.corners[kept]])
    )


def _inside(point: Array, corners: Array) -> bool:
    side = np.roll(corners, -1, axis=0) - corners
    to = point - corners
    turn = side[:, 0] * to[:, 1] - side[:, 1] * to[:, 0]
    return bool((turn > 0).all() or (turn < 0).all())


def find_checker(grey: Array, columns: int, rows: int) -> Array | None:
    """Inner corners (rows, columns, 2) of a checkerboard with so many of them, or None. The square at the top left is black, where a
    turn of the board can make it so."""
    cv2 = opencv()
    size = (columns, rows)
    finders: tuple[Callable[[], Any], ...] = (
        lambda: cv2.findChessboardCornersSB(grey, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE),
        lambda: cv2.findChessboardCorners(
            grey, size, flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
        ),
    )
    for find in finders:
        there, corners = find()
        if there and corners is not None and len(corners) == columns * rows:
            grid = np.asarray(corners, dtype=float).reshape(rows, columns, 2)
            if _even(grid):
                return _black_first(grey, grid)
    return None


def _even(grid: Array) -> bool:
    """Whether corners (rows, columns, 2) follow each other in steps that hardly change: of a larger board finders leave lines out."""
    for axis in (0, 1):
        step = np.linalg.norm(np.diff(grid, axis=axis), axis=2)
        first, second = np.delete(step, -1, axis=axis), np.delete(step, 0, axis=axis)
        if (np.maximum(first, second) > UNEVEN * np.minimum(first, second)).any():
            return False
    return True


def _black_first(grey: Array, grid: Array) -> Array:
    """The corners (rows, columns, 2), from that of its ends on at which the first square is black: finders begin at any. Never mirrored."""
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if along[0] * down[1] - along[1] * down[0] < 0:
        grid = grid[:, ::-1]
    rows, columns = grid.shape[:2]
    for turned in [grid, grid[::-1, ::-1], *((np.rot90(grid, k) for k in (1, 3)) if rows == columns else ())]:
        middle = (turned[:-1, :-1] + turned[1:, 1:] + turned[:-1, 1:] + turned[1:, :-1]) / 4
        u, v = np.rint(middle).astype(int).reshape(-1, 2).T
        level = grey[v, u].astype(float)
        odd = np.indices((rows - 1, columns - 1)).sum(axis=0).ravel() % 2 == 1
        if level[~odd].mean() < level[odd].mean():
            return np.asarray(turned)
    return grid


def measure_checker(grey: Array) -> tuple[int, int] | None:
    """Inner corners (columns, rows) of the largest checkerboard in an image; None where there is none."""
    cv2 = opencv()
    there, _, board = cv2.findChessboardCornersSBWithMeta(grey, (3, 3), cv2.CALIB_CB_LARGER)
    if not there or board is None or min(board.shape) < 3 or max(board.shape) < 4:
        return None  # 3 x 3 corners are found in much that is no board
    rows, columns = board.shape
    return max(columns, rows), min(columns, rows)


def _charuco(squares: tuple[int, int], family: str, legacy: bool, ids: Sequence[int] = ()) -> Any:
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, FAMILIES[family]))
    wanted, most = squares[0] * squares[1] // 2, len(dictionary.bytesList)
    if wanted > most:
        found, expected = f"{squares[0]} x {squares[1]} squares", f"at most {most} markers, those of {family}"
        raise ModelError("the dictionary has too few markers for this board", found=found, expected=expected)
    try:
        board = cv2.aruco.CharucoBoard(squares, 1.0, SHARE, dictionary, np.array(ids, dtype=np.int32) if ids else None)
    except (cv2.error, SystemError) as error:  # what its constructor refuses reaches Python as either
        found = f"{squares[0]} x {squares[1]} squares, {len(ids) or wanted} markers"
        raise ModelError("OpenCV knows no such board", found=found, expected=f"{wanted} markers") from error
    board.setLegacyPattern(legacy)
    return board


def find_charuco(
    grey: Array, squares: tuple[int, int], family: str, legacy: bool, ids: Sequence[int] = (), border: int = 1
) -> tuple[Ints, Array] | None:
    """Numbers (k,) and places (k, 2) of the inner corners of a ChArUco board of columns x rows squares, whose markers have numbers from 0
    or `ids`, by rows from the top left; None where too few markers tell."""
    cv2 = opencv()
    board = _charuco(squares, family, legacy, ids)
    how = cv2.aruco.DetectorParameters()
    how.markerBorderBits = border
    search = cv2.aruco.CharucoDetector(board, cv2.aruco.CharucoParameters(), how)
    corners, numbers, _, _ = search.detectBoard(grey)
    if numbers is None or len(numbers) == 0:
        return None
    return np.asarray(numbers, dtype=np.int64).ravel(), np.asarray(corners, dtype=float).reshape(-1, 2)


def charuco_markers(squares: tuple[int, int], family: str, legacy: bool, share: float) -> dict[int, Array]:
    """Corners (4, 3) of each marker of a ChArUco board by its number, in squares about its middle, x right and y up;
    `share`: the edge of a marker in squares."""
    board = _charuco(squares, family, legacy)
    places = np.asarray(board.getObjPoints(), dtype=float) * [1.0, -1.0, 1.0] - [squares[0] / 2, -squares[1] / 2, 0.0]
    middles = places.mean(axis=1, keepdims=True)
    places = middles + (places - middles) * (share / SHARE)
    return dict(zip(np.asarray(board.getIds()).ravel().tolist(), places, strict=True))


def encode_picture(grey: Array, width: int) -> bytes:
    """A small picture of an image (JPEG), at most so many pixels wide."""
    cv2 = opencv()
    scale = min(1.0, width / grey.shape[1])
    small = grey if scale == 1.0 else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    there, made = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 60])
    return bytes(made) if there else b""

"""The printed target that images show: as it was named, or found by looking at three of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.vision_limits import DICTIONARY_AHEAD
from robocal.errors import FileError, ModelError, look_up
from robocal.files.apriltag_search import find_tags, tag_search
from robocal.files.image_files import GreyImage, ImageSource, read_images
from robocal.files.images import FAMILIES, family_border, family_cells
from robocal.files.marker_search import (
    MarkersInImage,
    charuco_markers,
    choose_family,
    find_charuco,
    find_checker,
    find_markers,
    largest_family,
    measure_checker,
    smallest_family,
)
from robocal.files.sheet import read_sheet
from robocal.progress import Watch, tell
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.board_layout import judge_layout
from robocal.vision.checker.crossing import fit_saddles
from robocal.vision.sheets import SQUARE, Sheet, inner_corners, marker_corners
from robocal.vision.sightings import BOARD, METHODS, Sighting, fit_sighting

__all__ = ["SEARCHES", "Target", "find_target", "target_of", "target_on", "use_search"]

SEARCHES = ("opencv", "apriltag")
LOOKS = 3  # images that tell what the target is
FURTHER = 2  # grid: markers of larger numbers than a dictionary has, that are no chance
FEWEST, PLAIN = (
    3,
    4,
)  # tolerance: squares along a board with markers, and without: OpenCV looks for three inner corners in a row
MOST_SQUARES = 200  # tolerance: what a board may have


@record
class Target:
    """Markers of a dictionary (`family`), a board of `squares` (columns, rows), or both: ChArUco. Edges in m, where they are known;
    `legacy`: the first square of a ChArUco board is white where rows are even, as OpenCV before 4.6 printed it; `border`: cells of black
    around the code of a marker; `sheet`: what stands where, where its file was given; `library`: one of SEARCHES; `lens` (9,): the
    intrinsics of a known lens, through which straight edges are curves."""

    family: str | None = None
    squares: tuple[int, int] | None = None
    size: float | None = None
    square: float | None = None
    legacy: bool = False
    border: int = 1
    sheet: Sheet | None = None
    library: str = SEARCHES[0]
    lens: Array | None = None

    @property
    def text(self) -> str:
        """In words."""
        board = "" if self.squares is None else f"{self.squares[0]} x {self.squares[1]} squares"
        if self.family is None:
            return f"checkerboard of {board}" if board else "none"
        return f"ChArUco board of {board}, {self.family}" if board else f"markers of {self.family}"

    @property
    def document(self) -> dict[str, Any]:
        """For machines, lengths in mm."""
        kind = "none" if self.family is None and self.squares is None else "markers"
        if self.squares is not None:
            kind = "checkerboard" if self.family is None else "charuco"
        size, square = (None if v is None else {"value": 1e3 * v, "unit": "mm"} for v in (self.size, self.square))
        return {"kind": kind, "dictionary": self.family, "squares": self.squares, "size": size, "square": square}

    def cells(self, number: int) -> Array | None:
        """Cells (n, n) of a marker; None of one that is not on the sheet."""
        if self.sheet is not None:
            return next((m.cells for m in self.sheet.markers if m.id == number), None)
        return cells_of(self.family or "", number)

    def search(self, image: GreyImage) -> tuple[list[Sighting], list[int], list[int]]:
        """What an image shows of it, the numbers of markers that could not be fitted, and of those that it does not have."""
        seen: list[Sighting] = []
        dropped: list[int] = []
        strangers: list[int] = []
        if self.family is not None:
            found = self.find(image.grey, self.family)
            for number, corners in zip(found.ids.tolist(), found.corners, strict=True):
                cells = self.cells(number)
                if cells is None:
                    strangers.append(number)
                    continue
                one = fit_sighting(image.levels, number, corners, cells, self.lens)
                if one is None:
                    dropped.append(number)
                else:
                    seen.append(one)
        if self.squares is not None:
            columns, rows = self.squares[0] - 1, self.squares[1] - 1
            if self.family is None:
                grid = find_checker(image.grey, columns, rows)
                start = None if grid is None else (np.arange(columns * rows), grid.reshape(-1, 2))
            else:
                start = find_charuco(image.grey, self.squares, self.family, self.legacy, self.ids, self.border)
            if start is not None:
                board = fit_saddles(image.levels, *start, columns, self.lens)
                if board is not None:
                    seen.append(board)
        return seen, dropped, strangers

    def find(self, grey: Array, family: str) -> MarkersInImage:
        """Where its markers may be in an image (h, w) of bytes."""
        if self.library == SEARCHES[1]:
            return find_tags(grey, family)
        return find_markers(grey, family, self.border, self.ids)

    @property
    def ids(self) -> tuple[int, ...]:
        """The numbers of the markers on its sheet."""
        return () if self.sheet is None else tuple(m.id for m in self.sheet.markers)

    def places(self, sighting: Sighting) -> Array | None:
        """Where the corners (k, 3) are on the target, in m: of a marker about its middle, else about the board's;
        None where sizes lack. Of a sheet about the middle of its paper."""
        if self.sheet is not None:
            if sighting.marker != BOARD:
                return marker_corners(next(m for m in self.sheet.markers if m.id == sighting.marker))[sighting.corner]
            return inner_corners(self.sheet.checkers[0]).reshape(-1, 3)[sighting.corner]
        if sighting.marker != BOARD and self.squares is None:
            return None if self.size is None else SQUARE[sighting.corner] * (self.size / 2)
        if self.square is None or self.squares is None:
            return None
        if sighting.marker != BOARD:
            at = None if self.size is None or self.family is None else _on_board(self)
            return (
                None if at is None or sighting.marker not in at else at[sighting.marker][sighting.corner] * self.square
            )
        columns, rows = self.squares[0] - 1, self.squares[1] - 1
        row, column = np.divmod(sighting.corner, columns)
        x, y = column - (columns - 1) / 2, (rows - 1) / 2 - row
        return np.stack([x, y, np.zeros(len(row))], axis=1) * self.square


@cache
def _on_board(target: Target) -> dict[int, Array]:
    """Corners of the markers of a ChArUco board, in squares."""
    assert (
        target.squares is not None
        and target.family is not None
        and target.size is not None
        and target.square is not None
    )
    return charuco_markers(target.squares, target.family, target.legacy, target.size / target.square)


@cache
def cells_of(family: str, number: int) -> Array:
    """Cells (n, n) of one marker."""
    return np.asarray(family_cells(family, [number])[0])


def target_on(path: Path) -> Target:
    """The target on the sheet of a sheet.yaml. Raises InputError."""
    sheet = read_sheet(path)
    if len(sheet.checkers) > 1:
        raise FileError("a sheet of several boards", file=path, key="checkerboards", expected="one, or markers alone")
    if not sheet.checkers and not sheet.markers:
        raise FileError("a sheet with nothing on it", file=path, expected="markers, or a board")
    board = sheet.checkers[0] if sheet.checkers else None
    squares = None if board is None else (board.columns, board.rows)
    square, legacy = (None, False) if board is None else (board.square, board.white_first)
    if board is not None:
        count, wanted = len(sheet.markers), board.columns * board.rows // 2
        fewest = FEWEST if count else PLAIN
        if min(board.columns, board.rows) < fewest:
            found = f"{board.columns} x {board.rows} squares"
            raise FileError(
                "too small a board", file=path, key="checkerboards", found=found, expected=f"at least {fewest}"
            )
        if count not in (0, wanted):
            expected = f"{wanted}, one in each white square, or none"
            raise FileError("a board with other markers", file=path, key="markers", found=count, expected=expected)
    if not sheet.markers:
        return Target(None, squares, None, square, sheet=sheet)
    one = sheet.markers[0]
    return Target(one.family, squares, one.size, square, legacy, family_border(one.family, len(one.cells)), sheet)


def target_of(
    dictionary: str | None, checker: str | None, charuco: str | None, size: float | None, square: float | None
) -> Target | None:
    """The target as options name it, edges in mm; None where they name none. Raises ModelError."""
    if checker is not None and (charuco is not None or dictionary is not None):
        raise ModelError(
            "a checkerboard has no markers", key="--checker", expected="--charuco for a board with markers"
        )
    family = None
    if dictionary is not None:
        family = re.sub(r"^(dict_)?(aruco_|apriltag_?|tag)?", "", dictionary.lower())
        look_up(FAMILIES, family, "unknown dictionary of markers", key="--dictionary")
    size, square = (None if v is None else 1e-3 * v for v in (size, square))
    if charuco is not None:
        if family is None:
            raise ModelError(
                "a ChArUco board has markers of a dictionary", key="--charuco", expected="--dictionary too"
            )
        if size is not None and square is not None and size >= square:
            expected = "the marker's edge below that of the square around it"
            raise ModelError(
                "a marker larger than its square", key="--size", found=f"{1e3 * size:g} mm", expected=expected
            )
        return Target(family, read_squares(charuco, "--charuco"), size, square)
    if checker is not None:
        return Target(None, read_squares(checker, "--checker"), size, square)
    return None if family is None else Target(family, None, size, square)


def use_search(target: Target | None, search: str) -> Target | None:
    """The target as options name it, looked for by one of SEARCHES. Raises ModelError, MissingExtra."""
    if search == SEARCHES[0]:
        return target
    if target is None or target.family is None or target.squares is not None or target.border != 1:
        expected = "--dictionary or --sheet of AprilTags with one cell of black around the code; or --search opencv"
        raise ModelError("the AprilTag library looks for single tags", key="--search", found=search, expected=expected)
    tag_search(target.family)
    return replace(target, library=search)


def read_squares(word: str, key: str) -> tuple[int, int]:
    found = re.fullmatch(r"\s*(\d+)\s*[xX×]\s*(\d+)\s*", word)
    numbers = (int(found[1]), int(found[2])) if found else (0, 0)
    fewest = PLAIN if key == "--checker" else FEWEST
    if min(numbers) < fewest or max(numbers) > MOST_SQUARES:
        expected = f"columns x rows, as 10x8, each at least {fewest}"
        raise ModelError("not the squares of a board", key=key, found=word, expected=expected)
    return numbers


def find_target(
    wanted: Target | None, lengths: Target, sources: Sequence[ImageSource], every: int, watch: Watch | None
) -> tuple[Target, list[Remark]]:
    """The target that was named, with what speaks against it, or the one that three of the images show: of markers the largest dictionary
    of their family, for other images may have other numbers."""
    tell(watch, "target")
    some = _some(sources, every)
    if wanted is not None:
        return _check(wanted, some, sources, every)
    trial = choose_family([i.grey for i in some])
    if trial.family is not None:
        found = replace(lengths, family=trial.family)
        if _numbers(trial.family, some):  # few bits agree with textures by chance; their pixels do not
            return found, []
    for image in some:
        if (board := measure_checker(image.grey)) is not None:
            columns, rows = board[0] + 1, board[1] + 1
            return replace(lengths, squares=(columns, rows)), [Remark.of(Code.BOARD_FOUND, columns=columns, rows=rows)]
    mirror = choose_family([some[0].mirrored.grey])
    if mirror.family is not None and mirror.count > trial.count:
        found = replace(lengths, family=mirror.family)
        if found.search(some[0].mirrored)[0]:
            return found, []
    if trial.count and trial.family is None:
        names = {"first": trial.smallest, "second": trial.next_family}
        counts = {"count": trial.count, "next": trial.next}
        return lengths, [Remark.of(Code.DICTIONARY_UNSURE, ahead=DICTIONARY_AHEAD, **counts, **names)]
    return lengths, []


def _some(sources: Sequence[ImageSource], every: int) -> list[GreyImage]:
    """The first, the middle and the last image."""
    wanted = sorted({0, len(sources) // 2, len(sources) - 1})
    out: list[GreyImage] = []
    for k in wanted:
        for image in read_images([sources[k]], every):
            out.append(image)
            if len(sources) > 1 or len(out) == LOOKS:
                break
    return out


def _numbers(family: str, images: Iterable[GreyImage]) -> list[int]:
    """Numbers of markers that all their pixels agree with."""
    target = Target(family)
    return [s.marker for i in images for s in target.search(i)[0] if s.method == METHODS[0]]


def _other(given: str, count: int, largest: str, found: int, sources: Sequence[ImageSource], every: int) -> Remark:
    """Another dictionary than that given is seen: the smallest that holds the numbers of all images."""
    better = smallest_family(largest, max(_numbers(largest, read_images(sources, every)), default=0))
    return Remark.of(Code.OTHER_DICTIONARY, given=given, count=count, better=better, found=found)


def _check(
    wanted: Target, some: Sequence[GreyImage], sources: Sequence[ImageSource], every: int
) -> tuple[Target, list[Remark]]:
    """What speaks for another dictionary than the one named: that it is not seen and another is, or that larger numbers of its family
    are; and how a ChArUco board was printed."""
    family = wanted.family
    if family is None:
        return wanted, []
    found = [wanted.find(i.grey, family) for i in some]
    count = sum(map(len, found))
    if wanted.squares is not None and wanted.sheet is None:
        finds = {
            legacy: sum(
                len(f[0]) for i in some if (f := find_charuco(i.grey, wanted.squares, family, legacy)) is not None
            )
            for legacy in (True, False)
        }
        wanted = replace(wanted, legacy=finds[True] > finds[False])
        if (other := judge_layout(found, family, wanted.squares or (0, 0), wanted.legacy)) is not None:
            return wanted, [other]
    largest = largest_family(family)
    if count < len(some):
        trial = choose_family([i.grey for i in some])
        if trial.family not in (None, largest) and trial.count >= DICTIONARY_AHEAD * max(count, 1):
            return wanted, [_other(family, count, str(trial.family), trial.count, sources, every)]
    if wanted.squares is None and wanted.sheet is None and largest != family:
        numbers = _numbers(largest, some)
        if sum(n >= int(family.partition("_")[2]) for n in numbers) >= FURTHER:
            return wanted, [_other(family, count, largest, len(numbers), sources, every)]
    return wanted, []

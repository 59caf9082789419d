"""The printed target that images show: as it was named, or found by looking at three of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.limits import DICTIONARY_AHEAD
from robocal.errors import ModelError, look_up
from robocal.files.image_files import GreyImage, ImageSource, read_images
from robocal.files.images import FAMILIES, family_cells
from robocal.files.marker_search import (
    charuco_markers,
    choose_family,
    find_charuco,
    find_checker,
    find_markers,
    measure_checker,
)
from robocal.progress import Watch, tell
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.vision.checker.crossing import fit_saddles
from robocal.vision.sightings import BOARD, Sighting, fit_sighting

__all__ = ["Target", "find_target", "target_of"]

LOOKS = 3  # images that tell what the target is
MOST_SQUARES = 200  # tolerance: what a board may have


@record
class Target:
    """Markers of a dictionary (`family`), a board of `squares` (columns, rows), or both: ChArUco. Edges in m, where they are known;
    `legacy`: the first square of a ChArUco board is white where rows are even, as OpenCV before 4.6 printed it."""

    family: str | None = None
    squares: tuple[int, int] | None = None
    size: float | None = None
    square: float | None = None
    legacy: bool = False

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

    def search(self, image: GreyImage) -> tuple[list[Sighting], list[int]]:
        """What an image shows of it, and the numbers of markers that were found and could not be fitted."""
        seen: list[Sighting] = []
        dropped: list[int] = []
        if self.family is not None:
            found = find_markers(image.grey, self.family)
            for number, corners in zip(found.ids.tolist(), found.corners, strict=True):
                one = fit_sighting(image.levels, number, corners, cells_of(self.family, number))
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
                start = find_charuco(image.grey, self.squares, self.family, self.legacy)
            if start is not None:
                board = fit_saddles(image.levels, *start, columns)
                if board is not None:
                    seen.append(board)
        return seen, dropped

    def places(self, sighting: Sighting) -> Array | None:
        """Where the corners (k, 3) are on the target, in m: of a marker about its middle, else about the board's;
        None where sizes lack."""
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


SQUARE = np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


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


def read_squares(word: str, key: str) -> tuple[int, int]:
    found = re.fullmatch(r"\s*(\d+)\s*[xX×]\s*(\d+)\s*", word)
    numbers = (int(found[1]), int(found[2])) if found else (0, 0)
    if min(numbers) < 3 or max(numbers) > MOST_SQUARES:
        raise ModelError("not the squares of a board", key=key, found=word, expected="columns x rows, as 10x8")
    return numbers


def find_target(
    wanted: Target | None, lengths: Target, sources: Sequence[ImageSource], every: int, watch: Watch | None
) -> tuple[Target, list[Remark]]:
    """The target that was named, with what speaks against it, or the one that three of the images show: of markers the largest dictionary
    of their family, for other images may have other numbers."""
    tell(watch, "target")
    some = _some(sources, every)
    if wanted is not None:
        return _check(wanted, some)
    trial = choose_family([i.grey for i in some])
    if trial.family is not None:
        found = replace(lengths, family=trial.family)
        if any(found.search(i)[0] for i in some):  # few bits agree with textures by chance; their pixels do not
            return found, []
    for image in some:
        if (board := measure_checker(image.grey)) is not None:
            columns, rows = board[0] + 1, board[1] + 1
            return replace(lengths, squares=(columns, rows)), [Remark.of(Code.BOARD_FOUND, columns=columns, rows=rows)]
    if trial.count and trial.family is None:
        return lengths, [Remark.of(Code.DICTIONARY_UNSURE, ahead=DICTIONARY_AHEAD, count=trial.count, next=trial.next)]
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


def _check(wanted: Target, some: Sequence[GreyImage]) -> tuple[Target, list[Remark]]:
    """Another target than the one named where that is not seen and another is; how a ChArUco board was printed."""
    if wanted.family is not None:
        count = sum(len(find_markers(i.grey, wanted.family)) for i in some)
        if wanted.squares is not None:
            old, new = (
                sum(
                    len(f[0])
                    for i in some
                    if (f := find_charuco(i.grey, wanted.squares, wanted.family, legacy)) is not None
                )
                for legacy in (True, False)
            )
            wanted = replace(wanted, legacy=old > new)
        if count < len(some):
            trial = choose_family([i.grey for i in some])
            if (
                trial.family is not None
                and trial.family != wanted.family
                and trial.count >= DICTIONARY_AHEAD * max(count, 1)
            ):
                facts = {"given": wanted.family, "count": count, "better": trial.smallest, "found": trial.count}
                return wanted, [Remark.of(Code.OTHER_DICTIONARY, **facts)]
    return wanted, []

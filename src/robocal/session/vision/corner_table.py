"""A table of corners as `intrinsics` takes it: what `vision detect` writes, or one of the same columns that somebody made."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.vision_limits import TARGET_LEAST, TARGET_MOST
from robocal.errors import FileError, FormatError, ModelError
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.dataset import Reading, read_datasets
from robocal.files.image_files import shows_images
from robocal.files.sheet import read_sheet
from robocal.files.text import InputFile, read_text
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Rig
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.target import read_squares
from robocal.vision.lenses import Lens
from robocal.vision.sheets import Checker, inner_corners

__all__ = ["CAMERA", "CORNERS", "CornerTable", "image_size", "read_corners"]

CAMERA = "lens"  # the owner of its numbers
CORNERS = "corners"  # who measured
VIEWS = "view", "image", "id"  # columns that name a view
SIGMAS = "su", "sv"
PLACES = tuple(f"point_{a}" for a in "xyz")
DECIMALS = 1e-9  # tolerance: m, of places that are one


@record(kw_only=True, eq=False)
class CornerTable:
    """Corners as data of kind pixels, whose lens is to be found; width and height of the images; of every row its marker and the number of
    its corner (n,); the dictionary of the markers where it is known; and whether it is known that places on the target are those of its
    printed side, x right, y up."""

    data: DataSet
    size: tuple[int, int]
    marker: tuple[str, ...]
    corner: Ints
    family: str | None
    upright: bool
    files: tuple[InputFile, ...]
    remarks: tuple[Any, ...]
    columns: int = 0  # of the inner corners of a board, where it is known
    edge: float | None = None  # of its markers (m), where the corners say it

    @property
    def pixels(self) -> Observations:
        """The one list of observations."""
        return self.data.observations[0]

    def with_lens(self, intrinsics: Sequence[float], free: Sequence[str]) -> CornerTable:
        """The same seen through a lens with these numbers."""
        return self._through(intrinsics=tuple(map(float, intrinsics)), free=tuple(free))

    def with_prior(self, lens: Lens) -> CornerTable:
        """The same seen through a lens whose numbers are free within what it says of them."""
        return self._through(intrinsics=lens.numbers, free=lens.known, known=lens.known, covariance=lens.covariance)

    def _through(self, **options: Any) -> CornerTable:
        obs = replace(self.pixels, options={**self.pixels.options, **options})
        return replace(self, data=replace(self.data, observations=(obs,)))

    def keep(self, rows: Bools) -> CornerTable:
        """Some of its rows, and the views and targets that these show."""
        at = np.flatnonzero(rows)
        obs = self.pixels.take(at)
        views, view = np.unique(obs.configuration, return_inverse=True)
        obs = replace(obs, configuration=view.astype(np.int64))
        if obs.target is not None:
            targets, target = np.unique(obs.target, return_inverse=True)
            obs = replace(obs, targets=tuple(obs.targets[t] for t in targets.tolist()), target=target.astype(np.int64))
        data = DataSet(self.data.configurations.take(views), (obs,))
        marker, corner = tuple(self.marker[i] for i in at.tolist()), self.corner[at]
        return replace(self, data=data, marker=marker, corner=corner)


def read_corners(
    place: Path,
    *,
    size: float | None,
    square: float | None,
    checker: str | None,
    sheet: Path | None,
    image: str | None,
    exclude: Sequence[str],
) -> CornerTable:
    """A list of corners, with the JSON that `vision detect` writes beside it. Lengths in mm. Raises FileError, FormatError, ModelError."""
    if place.is_dir() or shows_images(place):
        expected = "their corners: robocal vision detect IMAGES -o corners.csv"
        raise FileError("these are images", file=place, expected=expected)
    beside, known = _beside(place)
    table = read_csv(place)
    width_height = image_size(image, known.get("image"))
    view = next(filter(table.has, VIEWS), None)
    if view is None:
        raise FormatError(
            "no column names the view", file=place, expected="view, u, v, and places or numbers of corners"
        )
    given: dict[str, Any] = {
        "robocal": 1, "kind": "pixels", "file": place.name, "csv": {"missing": "skip"}, "units": {"length": "mm", "angle": "deg"},
        "pixels": {"columns": ["u", "v"]}, "camera": {"name": CAMERA, "fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0},
        "frame": {"name": "camera", "mount": "base", "free": False}, "configuration": {"id": view},
    }  # fmt: skip
    if all(map(table.has, SIGMAS)):
        given["pixels"]["sigma"] = {"columns": list(SIGMAS)}
    found, upright = _placed(place, table, given, known, (size, square, checker, sheet), exclude)
    (obs,) = found.dataset.observations
    data = replace(found.dataset, observations=(replace(obs, frame=None, group=CORNERS),))
    files = found.files if beside is None else (*found.files, beside)
    return CornerTable(
        data=data, size=width_height, marker=tuple(_cells(table, found, "marker", "")),
        corner=np.array(_cells(table, found, "corner", "0"), dtype=float).astype(np.int64),
        family=(known.get("target") or {}).get("dictionary"), upright=upright, files=files,
        remarks=(*_news(found), *_odd_size(obs)), columns=_columns(checker, known.get("target") or {}),
        edge=_edge((known.get("target") or {}).get("size")),
    )  # fmt: skip


def _columns(checker: str | None, target: Mapping[str, Any]) -> int:
    squares = read_squares(checker, "--checker") if checker is not None else target.get("squares")
    return int(squares[0]) - 1 if squares else 0


def _edge(said: Any) -> float | None:
    """The edge (m) of a target's markers as `vision detect` was told it."""
    value = said.get("value") if isinstance(said, dict) else None
    return 1e-3 * value if isinstance(value, int | float) and said.get("unit") == "mm" else None


def _odd_size(obs: Observations) -> Iterator[Remark]:
    """Whether places on the target look as if they were in another unit."""
    size = float(np.ptp(obs.extra["point"], axis=0).max())
    if not TARGET_LEAST <= size <= TARGET_MOST:
        yield Remark.of(Code.TARGET_SIZE_ODD, size=Quantity(size, "m"))


Options = tuple[float | None, float | None, str | None, Path | None]


def _placed(
    place: Path, table: CsvTable, given: dict[str, Any], known: Mapping[str, Any], told: Options, exclude: Sequence[str]
) -> tuple[Reading, bool]:
    """The rows with their places on the target; and whether these are those of the printed side."""
    size, square, checker, sheet = told
    target = known.get("target") or {}
    if sheet is not None or (size is not None and not target.get("squares")):
        _insist(table, place, "marker", "corner")
        given["target"] = "marker"
        given["corners"] = {"column": "corner", "size": 2e3 if size is None else size}
        found = read_datasets([place], Rig(), exclude=exclude, given=given)
        return (found if sheet is None else _on_sheet(found, sheet, size)), True
    if checker is not None or (target.get("squares") and not target.get("dictionary") and square is not None):
        columns, rows = read_squares(checker, "--checker") if checker is not None else map(int, target["squares"])
        if square is None:
            raise ModelError(
                "the edge of a square is not stated", key="--square", expected="as measured on the print, in mm"
            )
        _insist(table, place, "corner")
        given["points"] = {"columns": ["corner"] * 3, "unit": "m"}
        found = read_datasets([place], Rig(), exclude=exclude, given=given)
        return _on_board(
            found, place, inner_corners(Checker(columns, rows, 1e-3 * square)).reshape(-1, 3)
        ), "target" in known
    for key, length in (("--size", size), ("--square", square)):
        if length is not None:
            if target.get("squares"):
                more = f"vision detect with {key}, which lists the places"
            else:
                more = (
                    "--size of the markers" if target.get("dictionary") else "--checker too, or the places in the table"
                )
            raise ModelError(
                "the places of these corners do not follow it", key=key, found=f"{length:g} mm", expected=more
            )
    if not all(map(table.has, PLACES)):
        expected = (
            "--size of the markers, --checker and --square of a board, or --sheet; or columns point_x, point_y, point_z"
        )
        raise FormatError("the corners have no places on the target", file=place, expected=expected)
    given["points"] = {"columns": list(PLACES)}
    if table.has("marker"):
        given["target"] = "marker"
    return _one_or_several(read_datasets([place], Rig(), exclude=exclude, given=given)), "target" in known


def _one_or_several(found: Reading) -> Reading:
    """Corners of one target, unless markers have theirs at the same places: each is about the middle of its own marker then."""
    (obs,) = found.dataset.observations
    if obs.target is not None and len(obs.targets) > 1:
        at = np.round(obs.extra["point"] / DECIMALS).astype(np.int64)
        places, place = np.unique(at, axis=0, return_inverse=True)
        pairs = np.unique(np.stack([place.ravel(), obs.target]), axis=1)
        if pairs.shape[1] > len(places):
            return found
    return _with_points(found, obs.extra["point"])


def _insist(table: CsvTable, place: Path, *names: str) -> None:
    for name in names:
        if not table.has(name):
            raise FormatError("a column is missing", file=place, column=name, expected="as vision detect writes it")


def _with_points(found: Reading, points: Array, keep: Array | None = None) -> Reading:
    """The reading with other places on one target, of the rows that are kept."""
    (obs,) = found.dataset.observations
    obs = replace(obs, extra={**obs.extra, "point": points}, targets=(), target=None)
    if keep is not None:
        obs = obs.take(np.flatnonzero(keep))
    return replace(found, dataset=replace(found.dataset, observations=(obs,)))


def _on_board(found: Reading, place: Path, corners: Array) -> Reading:
    (obs,) = found.dataset.observations
    number = np.rint(obs.extra["point"][:, 0]).astype(int)
    if number.min() < 0 or number.max() >= len(corners):
        expected = f"0 to {len(corners) - 1}, by rows from the top left"
        raise FormatError(
            "no inner corner of this board", file=place, column="corner", found=int(number.max()), expected=expected
        )
    return _with_points(found, corners[number])


def _on_sheet(found: Reading, sheet: Path, size: float | None) -> Reading:
    """Corners at the places that a sheet's own file says; the edge as it was measured, where it is told."""
    (obs,) = found.dataset.observations
    printed = {str(m.id): m for m in read_sheet(sheet).markers}
    assert obs.target is not None
    names = [t.name for t in obs.targets]
    missing = [n for n in names if n not in printed]
    if missing:
        raise FormatError(
            "markers that this sheet does not have",
            file=sheet,
            found=", ".join(missing[:8]),
            expected="the sheet that was seen",
        )
    scale = 1.0 if size is None else 1e-3 * size / next(iter(printed.values())).size
    # A negative edge is half a turn.
    edge = np.array([-printed[n].size if printed[n].turned else printed[n].size for n in names]) * scale
    middle = np.array([[printed[n].x, printed[n].y, 0.0] for n in names]) * scale
    unit = obs.extra["point"] / (1.0 if size is None else 5e-4 * size)
    return _with_points(found, unit * edge[obs.target, None] / 2 + middle[obs.target])


def _beside(place: Path) -> tuple[InputFile | None, Mapping[str, Any]]:
    """What `vision detect` said of its list, where it stands beside it."""
    other = place.with_suffix(".json")
    if place.suffix == ".json" or not os.path.exists(other):
        return None, {}
    source = read_text(other)
    try:
        said = json.loads(source.text)
    except ValueError:
        return None, {}
    known = isinstance(said, dict) and "corners" in said and "image" in said
    if known and any(r.get("code") == Code.IMAGE_SIZES_DIFFER for r in said.get("remarks", ()) if isinstance(r, dict)):
        expected = "images of one size: each crop or scale has a lens of its own"
        raise FormatError("these corners are of images of several sizes", file=other, expected=expected)
    return (InputFile(other, source.sha256), said) if known else (None, {})


def image_size(
    word: str | None, known: Any, expected: str = "--image 1920x1080, or corners.json beside the list"
) -> tuple[int, int]:
    """The size of images (width, height) px as an option has it, else as it is `known`; `expected`: what would do. Raises ModelError."""
    if word is not None:
        found = re.fullmatch(r"\s*(\d+)\s*[xX×]\s*(\d+)\s*", word)
        if found is None or min(int(found[1]), int(found[2])) < 2:
            raise ModelError(
                "not a size of images", key="--image", found=word, expected="width x height in pixels, as 1920x1080"
            )
        return int(found[1]), int(found[2])
    if known is None:
        raise ModelError("the size of the images is not known", key="--image", expected=expected)
    return int(known[0]), int(known[1])


def _cells(table: CsvTable, found: Reading, column: str, otherwise: str) -> list[str]:
    """A column of the table at the rows that were read."""
    (obs,) = found.dataset.observations
    if obs.rows is None or not table.has(column):
        return [otherwise] * len(obs)
    cells = table.texts(column)
    return [cells[i] for i in np.searchsorted(table.lines, obs.rows).tolist()]


def _news(found: Reading) -> tuple[Any, ...]:
    return tuple(r for r in found.warnings if r.code != Code.COLUMNS_UNREAD)

"""Corners of markers straight from images, as `vision detect` lists them, for a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from robocal._record import replace
from robocal.errors import ModelError
from robocal.files.display import listing_text
from robocal.files.plain import json_text
from robocal.files.scratch import scratch_files
from robocal.measure.machine import Rig
from robocal.progress import Watch
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.session.vision.corner_refit import refit_corners, refit_once
from robocal.session.vision.corner_table import CornerTable, read_corners
from robocal.session.vision.detection import Detected, detect
from robocal.session.vision.hand_eye_images import DOCUMENT, EVERY, LIST, is_table
from robocal.session.vision.map_fit import MapFit
from robocal.session.vision.map_table import read_map_table, sizes_of
from robocal.session.vision.sheet_prior import PrintedSheets
from robocal.vision.lenses import Lens
from robocal.vision.maps import MarkerMap

__all__ = ["open_corners", "open_corners_of_map"]

ALREADY = "the corners were detected already"
# A map joins markers itself, and has their sizes from its own option.
UNSAID = (Code.SIZE_NOT_STATED, Code.MARKERS_APART, Code.MARKER_HAS_TWO_POSES)


def open_corners(o: Any, lens: Lens, sheets: PrintedSheets, watch: Watch | None = None) -> CornerTable:
    """The corners of a list, or of images, with what is to be said of these. Raises InputError."""
    sizes = sizes_of(o.size, bool(sheets.maps))
    _refuse_two_images(o)
    if is_table(o.corners):
        if o.dictionary is not None:
            raise ModelError(ALREADY, key="--dictionary", found=o.dictionary, expected="images, or corners alone")
        return read_map_table(o.corners, lens, sizes, o.image, o.exclude, o.without, sheets.sizes)
    found, texts = _detected(o, o.dictionary or sheets.family, watch)
    with scratch_files(texts) as folder:
        table = read_map_table(folder / LIST, lens, sizes, o.image, o.exclude, o.without, sheets.sizes)
    return _of_images(table, found, o.corners)


def _refuse_two_images(o: Any) -> None:
    """Raises ModelError for images beside images."""
    if o.images and not is_table(o.corners):
        expected = "images in one place; --images are those of a list of corners"
        raise ModelError("images twice", key="--images", found=str(o.corners), expected=expected)


def fit_with_images(
    table: CornerTable,
    lens: Lens,
    images: Sequence[str],
    fit: Callable[[CornerTable], MapFit],
    watch: Watch | None = None,
) -> tuple[CornerTable, MapFit]:
    """Corners in images through the lens that the map has, and the map of these corners, until corners rest. Raises FileError,
    ModelError."""
    made: list[MapFit] = []

    def through(corners: CornerTable) -> tuple[Decision[Rig], Lens]:
        made[:] = [fit(corners)]
        return made[0].decision, made[0].lens

    table, *_ = refit_corners(table, lens, images, through, watch)
    return table, made[0]


def open_corners_of_map(o: Any, known: MarkerMap, lens: Lens, watch: Watch | None = None) -> CornerTable:
    """Corners of markers of a map, of a list or of photographs; of any size: places on markers are those of the map. Raises InputError."""
    image = o.image or (None if lens.size is None else "{}x{}".format(*lens.size))
    _refuse_two_images(o)
    told: dict[str, Any] = {"size": 1e3 * float(known.size[0]), "square": None, "checker": None, "sheet": None}
    if is_table(o.corners):
        if o.dictionary is not None:
            raise ModelError(ALREADY, key="--dictionary", found=o.dictionary, expected="images, or corners alone")
        table = read_corners(o.corners, **told, image=image, exclude=o.exclude)
        return refit_once(table, lens, o.images, watch) if o.images else table
    found, texts = _detected(o, o.dictionary or known.family, watch)
    with scratch_files(texts) as folder:
        table = read_corners(folder / LIST, **told, image=None, exclude=o.exclude)
    return refit_once(_of_images(table, found, o.corners), lens, (str(o.corners),), watch)


def _detected(o: Any, dictionary: str | None, watch: Watch | None) -> tuple[Detected, dict[str, str]]:
    """What images show of markers, and the files that `vision detect` writes of it."""
    asked = {"sheet": None, "dictionary": dictionary, "checker": None, "charuco": None, "size": None, "square": None}
    images = SimpleNamespace(images=(str(o.corners),), every=EVERY, refuse=o.refuse, **asked)
    found = detect(images, watch, files=(LIST,))
    if found.reasons:
        reason = found.reasons[0]
        raise ModelError(reason.sentence, key="CORNERS", found=str(o.corners), expected=reason.advice)
    if found.target.squares is not None:
        expected = "single markers; robocal vision intrinsics takes boards"
        raise ModelError("a board is no map of markers", key="CORNERS", found=found.target.text, expected=expected)
    texts = {LIST: listing_text(found.listing), DOCUMENT: json_text(found.document)}
    return found, texts


def _of_images(table: CornerTable, found: Detected, place: Path) -> CornerTable:
    """A list that was never written, as one of images, with what is to be said of these."""
    obs = replace(table.pixels, source=str(place))
    said = tuple(r for r in found.remarks if r.code not in UNSAID)
    data = replace(table.data, observations=(obs,))
    return replace(table, data=data, remarks=(*said, *table.remarks), files=tuple(found.inputs))

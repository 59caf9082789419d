"""Corners of markers straight from images, as `vision detect` lists them, for a map."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from robocal._record import replace
from robocal.errors import ModelError
from robocal.files.display import listing_text
from robocal.files.plain import json_text
from robocal.files.scratch import scratch_files
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.session.vision.corner_table import CornerTable
from robocal.session.vision.detection import detect
from robocal.session.vision.hand_eye_images import DOCUMENT, EVERY, LIST, is_table
from robocal.session.vision.map_table import read_map_table, sizes_of
from robocal.vision.lenses import Lens

__all__ = ["open_corners"]

ALREADY = "the corners were detected already"
# A map joins markers itself, and has their sizes from its own option.
UNSAID = (Code.SIZE_NOT_STATED, Code.MARKERS_APART, Code.MARKER_HAS_TWO_POSES)


def open_corners(o: Any, lens: Lens, watch: Watch | None = None) -> CornerTable:
    """The corners of a list, or of images, with what is to be said of these. Raises InputError."""
    sizes = sizes_of(o.size)
    if is_table(o.corners):
        if o.dictionary is not None:
            raise ModelError(ALREADY, key="--dictionary", found=o.dictionary, expected="images, or corners alone")
        return read_map_table(o.corners, lens, sizes, o.image, o.exclude, o.without)
    asked = {"sheet": None, "dictionary": o.dictionary, "checker": None, "charuco": None, "size": None, "square": None}
    images = SimpleNamespace(images=(str(o.corners),), every=EVERY, refuse=o.refuse, **asked)
    found = detect(images, watch, files=(LIST,))
    if found.reasons:
        reason = found.reasons[0]
        raise ModelError(reason.sentence, key="CORNERS", found=str(o.corners), expected=reason.advice)
    if found.target.squares is not None:
        expected = "single markers; robocal vision intrinsics takes boards"
        raise ModelError("a board is no map of markers", key="CORNERS", found=found.target.text, expected=expected)
    texts = {LIST: listing_text(found.listing), DOCUMENT: json_text(found.document)}
    with scratch_files(texts) as folder:
        table = read_map_table(folder / LIST, lens, sizes, o.image, o.exclude, o.without)
    obs = replace(table.pixels, source=str(o.corners))
    said = tuple(r for r in found.remarks if r.code not in UNSAID)
    data = replace(table.data, observations=(obs,))
    return replace(table, data=data, remarks=(*said, *table.remarks), files=tuple(found.inputs))

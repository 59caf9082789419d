"""Corners of a target straight from images, as `vision detect` lists them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from robocal._record import replace
from robocal.errors import ModelError
from robocal.files.display import listing_text
from robocal.files.plain import json_text
from robocal.files.scratch import scratch_files
from robocal.progress import Watch
from robocal.remarks.remark import Remark
from robocal.session.vision.corner_table import CornerTable, read_corners
from robocal.session.vision.detection import Detected, detect

__all__ = ["DOCUMENT", "EVERY", "LENS_EXPECTED", "LIST", "detect_corners", "is_table"]

TABLES = (".csv", ".tsv", ".dat")
EVERY = 10  # grid: frames of a video, as for detect
LENS_EXPECTED = (
    "--lens lens.yaml of robocal vision intrinsics, or a file of OpenCV, ROS, Kalibr or a depth camera; or --free-lens"
)
LIST, DOCUMENT = "corners.csv", "corners.json"


def is_table(place: Path) -> bool:
    """Whether a place is a list of corners or poses; else it is images."""
    return place.suffix.lower() in TABLES


def detect_corners(o: Any, watch: Watch | None = None) -> tuple[Detected, CornerTable]:
    """What images show of a target, and its corners as a table. Raises InputError."""
    words = ("sheet", "dictionary", "checker", "charuco", "size", "square")
    asked = {name: getattr(o, name) for name in words}
    if o.lens is None and not o.free_lens:
        raise ModelError("images say where a camera is only with its lens", key="--lens", expected=LENS_EXPECTED)
    found = detect(
        SimpleNamespace(images=(str(o.corners),), every=EVERY, refuse=o.refuse, **asked), watch, files=(LIST,)
    )
    if found.reasons:
        reason = found.reasons[0]
        raise ModelError(reason.sentence, key="VIEWS", found=str(o.corners), expected=reason.advice)
    target = found.target
    if target.sheet is None and None in (target.size if target.squares is None else target.square,):
        what = "--size of the markers" if target.squares is None else "--square of the board"
        raise ModelError(
            "the size of the target is not stated",
            key="VIEWS",
            found=target.text,
            expected=f"{what}, as measured on the print",
        )
    texts = {LIST: listing_text(found.listing), DOCUMENT: json_text(found.document)}
    with scratch_files(texts) as folder:
        # The list has places on the target already, but where markers have places of their own.
        size = o.size if target.squares is None and target.sheet is None else None
        table = read_corners(
            folder / LIST, size=size, square=None, checker=None, sheet=None, image=None, exclude=o.exclude
        )
        said = tuple(_of_images(r, str(folder / LIST), str(o.corners)) for r in table.remarks)
    obs = replace(table.pixels, source=str(o.corners))
    return found, replace(table, data=replace(table.data, observations=(obs,)), remarks=said)


def _of_images(said: Remark, place: str, images: str) -> Remark:
    """A remark on a list that was never written, as one on the images."""
    return Remark.of(said.code, **{k: images if v == place else v for k, v in said.items})

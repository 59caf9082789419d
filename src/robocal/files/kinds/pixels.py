"""Pixels: where a camera saw points of a target. The points are columns, or corners of a marker by number.

corners: {column: corner, size: 60}     0 top left, 1 top right, 2 bottom right, 3 bottom left, z towards the camera
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, FiniteFloat

from robocal.errors import one_of
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import FramedModel, ValueModel
from robocal.files.kinds.kind import Around, KindFile, KindOutput, Part, QuantityColumns, Values, whole
from robocal.files.schema import FileModel, Name, refuse
from robocal.files.units import Units, number
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations
from robocal.vision.camera import SYMBOLS

__all__ = ["PIXELS"]

PIXEL = QuantityColumns("pixels", ("u", "v"), ("su", "sv"), "px")
POINT = QuantityColumns("points", ("point_x", "point_y", "point_z"), ())
# A square of edge 2 about the origin, in the order in which ArUco and AprilTag detectors list corners.
SQUARE = np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


def _free(value: Any) -> Any:
    parts = [] if value in (None, False) else list(SYMBOLS) if value is True else value
    parts = parts if isinstance(parts, list) else [parts]
    for part in parts:
        if part not in SYMBOLS:
            refuse("not a number of a camera", found=part, **one_of(part, SYMBOLS))
    return tuple(dict.fromkeys(parts))


class CameraModel(FileModel):
    """A camera's intrinsics in pixels, its distortion, and what of them is identified."""

    name: Name = "camera"
    fx: FiniteFloat
    fy: FiniteFloat
    cx: FiniteFloat
    cy: FiniteFloat
    k1: FiniteFloat = 0.0
    k2: FiniteFloat = 0.0
    p1: FiniteFloat = 0.0
    p2: FiniteFloat = 0.0
    k3: FiniteFloat = 0.0
    free: Annotated[Any, BeforeValidator(_free)] = ()


class CornersModel(FileModel):
    """Corners of a square marker: the column with their number from 0, and the length of an edge."""

    column: str | int = "corner"
    size: FiniteFloat


class PixelsModel(FramedModel):
    """Pixels of known points of a target, and the camera that saw them."""

    pixels: ValueModel = ValueModel.model_construct()
    points: ValueModel | None = None
    corners: CornersModel | None = None
    camera: CameraModel


def read_pixels(model: PixelsModel, table: CsvTable, document: YamlDocument) -> Values:
    """Pixels (k, 2), and the points (k, 3) in m in the target's frame."""
    given = model.pixels
    if given.unit is None and all(table.unit(c) is None for c in given.columns or PIXEL.names):
        # Pixels are pixels.
        given = given.model_copy(update={"unit": "px"})
    values = PIXEL.values(given, table, document)
    if model.camera.fx <= 0 or model.camera.fy <= 0:
        found = [model.camera.fx, model.camera.fy]
        document.fail("a focal length must be above 0", ("camera",), found=found, expected="fx and fy in pixels")
    if (model.points is None) == (model.corners is None):
        expected = "points: {columns: [...], unit: mm}, or corners"
        document.fail("the measured points are not specified", ("points",), expected=expected)
    if model.points is not None:
        points = POINT.values(model.points, table, document)
        return replace(values, length=points.length, extra={"point": points.value})
    assert model.corners is not None
    column = model.corners.column
    which = table.numbers([column])[:, 0]
    table.insist(np.isin(which, np.arange(4)), [column], "no corner of a square", which, expected="0, 1, 2, 3")
    return replace(values, extra={"point": SQUARE[which.astype(int)]})


def parts(model: PixelsModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one camera."""
    camera = model.camera
    extra = dict(values.extra)
    if model.corners is not None:
        if model.corners.size <= 0:
            around.document.fail("not a length", ("corners", "size"), found=model.corners.size, expected="above 0")
        extra["point"] = extra["point"] * around.units.length.to_si(model.corners.size) / 2
    around.refuse_taken(camera.name, ("camera", "name"))
    numbers = tuple(float(getattr(camera, s)) for s in SYMBOLS)
    options = {"camera": camera.name, "intrinsics": numbers, "free": camera.free}
    return whole(model, replace(values, extra=extra, options=options), around)


def write_pixels(obs: Observations, units: Units) -> KindOutput:
    """Pixels, points and the camera."""
    values, free = obs.options["intrinsics"], obs.options.get("free", ())
    assert isinstance(values, tuple) and isinstance(free, tuple)
    words = [f"{s}: {number(float(v))}" for s, v in zip(SYMBOLS, values, strict=True)]
    camera = f"camera: {{name: {obs.options['camera']}, {', '.join(words)}, free: [{', '.join(free)}]}}"
    points = tuple((n, units.length, obs.extra["point"][:, i]) for i, n in enumerate(POINT.names))
    lines = (PIXEL.line(obs), "points: {columns: [point_x, point_y, point_z]}", camera)
    return KindOutput((*PIXEL.columns(obs, units), *points), lines)


PIXELS_KEYS = """pixels: {{columns: [u, v], sigma: 0.2}}
points: {{columns: [point_x, point_y, point_z], unit: {length}}}    # in the target's frame; or corners: {{column: corner, size: 60}}
frame: {{name: camera, mount: base, free: true}}    # say roughly where: the base seen from the camera; in hand: mount: tool
camera: {{name: lens, fx: 1400, fy: 1400, cx: 640, cy: 480, free: []}}    # also k1 k2 p1 p2 k3; free: true identifies all
"""
# What `vision detect` writes beside what is read here.
DETECTED = (
    *"marker corner point_x point_y point_z blur method suv".split(),
    *(f"c{a}_{b}{j}" for a in "uv" for j in range(4) for b in "uv"),
)
PIXELS = KindFile(PixelsModel, read_pixels, write_pixels, PIXELS_KEYS, parts=parts, silent=DETECTED)

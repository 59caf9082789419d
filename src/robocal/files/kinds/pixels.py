"""Pixels: where a camera saw points of a target. The points are columns, or corners of a marker by number.

corners: {column: corner, size: 60}     0 top left, 1 top right, 2 bottom right, 3 bottom left, z towards the camera

A camera states its numbers, or a file that has them. What is known with a sigma is free under that prior unless `free` says otherwise.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from pydantic import FiniteFloat, PositiveFloat, PositiveInt

from robocal._types import Array
from robocal.diagnose.vision_limits import MARKER_LEAST, TARGET_MOST
from robocal.errors import InputError
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import FramedModel, SigmaModel, ValueModel
from robocal.files.kinds.corner_covariance import COVARIANCE, WITH_OTHERS, columns_of, corner_covariances
from robocal.files.kinds.kind import Around, KindFile, KindOutput, Part, QuantityColumns, Values, whole
from robocal.files.lens import Numbers, read_lens, spread_keys
from robocal.files.other_lenses import check_numbers
from robocal.files.parts import SCHEMA
from robocal.files.schema import FileModel, Name
from robocal.files.stated_covariance import covariance_of
from robocal.files.text import InputFile
from robocal.files.units import UNITS, Units, number
from robocal.files.yamlio import YamlDocument, read_json
from robocal.measure.data import Observations
from robocal.measure.pixels import HALF_TURNS, LENS_FILE
from robocal.vision.camera import MODELS, SYMBOLS, model_of
from robocal.vision.lenses import Lens

__all__ = ["PIXELS"]

PIXEL = QuantityColumns("pixels", ("u", "v"), ("su", "sv"), "px")
POINT = QuantityColumns("points", ("point_x", "point_y", "point_z"), ())
PINHOLE = SYMBOLS[:4]
EVERY = tuple(dict.fromkeys(s for m in MODELS.values() for s in m.symbols))
RIM = 1.0  # px: half a pixel to the rim, and as much where corners count from 1
ROUNDED = 1  # px: what a size loses when images are scaled
# A square of edge 2 about the origin, in the order in which ArUco and AprilTag detectors list corners.
SQUARE = np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])


class CameraModel(FileModel):
    """A camera's lens, as numbers in pixels or as a file, and what of it is identified."""

    name: Name = "lens"
    file: str | None = None
    scale: PositiveFloat | None = None  # of the images beside those of the file
    model: Literal["brown", "rational", "fisheye"] | None = None
    fx: FiniteFloat | None = None
    fy: FiniteFloat | None = None
    cx: FiniteFloat | None = None
    cy: FiniteFloat | None = None
    k1: FiniteFloat | None = None
    k2: FiniteFloat | None = None
    p1: FiniteFloat | None = None
    p2: FiniteFloat | None = None
    k3: FiniteFloat | None = None
    k4: FiniteFloat | None = None
    k5: FiniteFloat | None = None
    k6: FiniteFloat | None = None
    sigma: Numbers = None
    correlation: list[list[FiniteFloat]] | None = None
    free: Any = None


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
    image: list[PositiveInt] | None = None  # width and height
    half_turns: Literal["undo"] | None = (
        None  # of a target that looks the same after one: undone in views that ask for it
    )


def read_pixels(model: PixelsModel, table: CsvTable, document: YamlDocument) -> Values:
    """Pixels (k, 2), and the points (k, 3) in m in the target's frame."""
    given = model.pixels
    if given.unit is None and all(table.unit(c) is None for c in given.columns or PIXEL.names):
        # Pixels are pixels.
        given = given.model_copy(update={"unit": "px"})
    values = PIXEL.values(given, table, document)
    size = _size(model, table, document)
    lens, files = read_camera(model.camera, size, document)
    options: dict[str, object] = {
        "camera": model.camera.name,
        "intrinsics": lens.numbers,
        "free": _free(model.camera, lens, document),
    }
    options |= {"known": lens.known, "covariance": lens.covariance} if lens.known else {}
    options |= {LENS_FILE: files[0].file} if files else {}
    options |= {"size": size} if size else {}
    options |= {HALF_TURNS: True} if model.half_turns else {}
    if model.scale is not None and model.scale.free:
        options |= {"print": model.scale.name, "print sigma": model.scale.sigma}
    sigma = given.sigma.columns if isinstance(given.sigma, SigmaModel) else None
    extra = corner_covariances(table, sigma, values.sigma)
    values = replace(values, options=options, files=files, extra=extra)
    if not files and size is not None:
        _insist_inside(lens, size, document)
        _refuse_exchanged_sides(values.value, lens, size, document)
    if (model.points is None) == (model.corners is None):
        expected = "points: {columns: [...], unit: mm}, or corners"
        document.fail("the measured points are not specified", ("points",), expected=expected)
    if model.points is not None:
        points = POINT.values(model.points, table, document)
        return replace(values, length=points.length, extra={**extra, "point": points.value})
    assert model.corners is not None
    column = model.corners.column
    which = table.numbers([column])[:, 0]
    table.insist(np.isin(which, np.arange(4)), [column], "no corner of a square", which, expected="0, 1, 2, 3")
    return replace(values, extra={**extra, "point": SQUARE[which.astype(int)]})


def read_camera(
    camera: CameraModel, size: tuple[int, int] | None, document: YamlDocument
) -> tuple[Lens, tuple[InputFile, ...]]:
    """The lens that a camera states, of images of this size where it is known, and the file that has it. Raises FormatError."""
    stated = [s for s in (*EVERY, "model", "sigma", "correlation") if getattr(camera, s) is not None]
    if camera.file is None:
        document.insist(
            camera.scale is None, "this scales the lens of a file", ("camera", "scale"), expected="file: lens.yaml"
        )
        return _stated_lens(camera, stated, document), ()
    if stated:
        document.fail(
            "the lens is in the file",
            ("camera", stated[0]),
            expected="file, or numbers, but not both: write the numbers there",
        )
    found = read_lens(os.path.normpath(document.path.parent / camera.file), camera.name)
    lens = found.lens if camera.scale is None else found.lens.scale(camera.scale)
    if (
        size is not None
        and lens.size is not None
        and max(abs(a - b) for a, b in zip(size, lens.size, strict=True)) > ROUNDED * (camera.scale is not None)
    ):
        _refuse_size(camera, size, found.lens, document)
    return lens, (found.file,)


def _refuse_exchanged_sides(pixels: Array, lens: Lens, size: tuple[int, int], document: YamlDocument) -> None:
    """Raises FormatError where pixels (k, 2) lie outside the image, and inside it once width and height are exchanged; where the centre of
    the lens is nearer to the middle of the image as stated, u and v are, and a fit says so."""

    def inside(sides: Array) -> bool:
        return bool(((pixels >= -RIM) & (pixels <= sides - 1 + RIM)).all())

    stated = np.array(size)
    off, other = (float(np.abs(lens.intrinsics[2:4] - sides / 2).max()) for sides in (stated, stated[::-1]))
    if not inside(stated) and inside(stated[::-1]) and other < off:
        far = f"{size[0]} x {size[1]} px, and pixels up to {pixels[:, 0].max():.0f}, {pixels[:, 1].max():.0f}"
        message = "width and height of the images are exchanged"
        document.fail(message, ("image",), found=far, expected=f"[{size[1]}, {size[0]}]: width and height")


def _insist_inside(lens: Lens, size: tuple[int, int], document: YamlDocument) -> None:
    """Raises FormatError for a centre outside the image: that of another size of images, or exchanged."""
    for symbol, value, most in zip(PINHOLE[2:], lens.numbers[2:4], size, strict=True):
        expected = f"0 to {most}, in images of {size[0]} x {size[1]} px"
        document.insist(
            0 <= value <= most, "the centre lies outside the image", ("camera", symbol), found=value, expected=expected
        )


def _refuse_size(camera: CameraModel, size: tuple[int, int], lens: Lens, document: YamlDocument) -> None:
    """Raises FormatError for images of another size than the lens is for."""
    assert lens.size is not None
    (width, height), (wide, high) = size, lens.size
    factor = width / wide
    other = f"{width} x {height} px, and the lens is of {wide} x {high} px"
    if abs(height - factor * high) > ROUNDED:
        expected = "the lens of these images: another shape is a crop, or another camera"
        document.fail(
            "the images have another shape than those of the lens", ("camera", "file"), found=other, expected=expected
        )
    expected = f"where images were scaled, `scale: {number(factor)}` beside `file`: f -> s f, c -> s (c + 0.5) - 0.5"
    document.fail(
        "the images have another size than those of the lens",
        ("camera", "scale" if camera.scale else "file"),
        found=other,
        expected=expected,
    )


def _stated_lens(camera: CameraModel, stated: Sequence[str], document: YamlDocument) -> Lens:
    kind = MODELS[camera.model or "brown"]
    for symbol in stated:
        if symbol in EVERY and symbol not in kind.symbols:
            fitting = next((m for m in MODELS.values() if symbol in m.symbols), kind)
            expected = f"{', '.join(kind.symbols)}; or model: {fitting.name}"
            document.fail(f"not a number of a {kind.name} lens", ("camera", symbol), found=symbol, expected=expected)
    for symbol in PINHOLE:
        document.insist(
            symbol in stated, "a key is missing", ("camera", symbol), expected="a number, or file: lens.yaml"
        )
    numbers = [float(getattr(camera, s) or 0.0) for s in kind.symbols]
    check_numbers(document, numbers, ("camera",))
    sigma = camera.sigma or {}
    covariance = covariance_of(document, sigma, camera.correlation, kind.symbols, ("camera",))
    return Lens.of(kind.name, numbers, None, tuple(sigma), covariance)


def _free(camera: CameraModel, lens: Lens, document: YamlDocument) -> tuple[str, ...]:
    """What is identified: as stated, else what is known with a sigma."""
    if camera.free is None:
        return lens.known
    if isinstance(camera.free, bool):
        return lens.kind.symbols if camera.free else ()
    parts = camera.free if isinstance(camera.free, list) else [camera.free]
    for part in parts:
        document.insist_known(part, lens.kind.symbols, "not a number of a camera", ("camera", "free"))
    return tuple(dict.fromkeys(parts))


def _size(model: PixelsModel, table: CsvTable, document: YamlDocument) -> tuple[int, int] | None:
    """Width and height of the images: as stated, else what `vision detect` wrote beside its table."""
    if model.image is not None:
        document.insist(
            len(model.image) == 2,
            "wrong number of values",
            ("image",),
            found=len(model.image),
            expected="width and height",
        )
        return model.image[0], model.image[1]
    beside = table.path.with_suffix(".json")
    if not beside.is_file():
        return None
    try:
        data = read_json(beside, "no document", "an object").data
    except InputError:
        return None  # a file of the same name that is none of ours
    image = data.get("image") if data.get("robocal") == SCHEMA and "views" in data else None
    good = isinstance(image, list) and len(image) == 2 and all(isinstance(v, int) and v > 0 for v in image)
    return (image[0], image[1]) if good and image else None


def parts(model: PixelsModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one camera."""
    extra = dict(values.extra)
    if model.corners is not None:
        if model.corners.size <= 0:
            around.document.fail("not a length", ("corners", "size"), found=model.corners.size, expected="above 0")
        edge = around.units.length.to_si(model.corners.size)
        if not MARKER_LEAST <= edge <= TARGET_MOST:
            what = f"the edge of a marker, {MARKER_LEAST:g} m to {TARGET_MOST:g} m: in which unit is it?"
            around.document.fail("no marker has such a size", ("corners", "size"), found=f"{edge:g} m", expected=what)
        extra["point"] = extra["point"] * edge / 2
    around.refuse_taken(model.camera.name, ("camera", "name"))
    if model.half_turns:
        _refuse_uneven(model, extra["point"], around)
    return whole(model, replace(values, extra=extra), around)


def _refuse_uneven(model: PixelsModel, points: Array, around: Around) -> None:
    """Raises FormatError for a target that half a turn changes."""
    from robocal.diagnose.camera_changes import half_turn_of

    found = "several targets" if model.target is not None else "points that half a turn changes"
    if model.target is not None or half_turn_of(points) is None:
        expected = "one target that looks the same after half a turn; else leave this key out"
        around.document.fail("there are no half turns to undo", (HALF_TURNS,), found=found, expected=expected)


def write_pixels(obs: Observations, units: Units) -> KindOutput:
    """Pixels with what correlates them, points and the camera."""
    o = obs.options
    numbers, free, known = o["intrinsics"], o.get("free", ()), o.get("known", ())
    assert isinstance(numbers, tuple) and isinstance(free, tuple) and isinstance(known, tuple)
    lens = Lens(model_of(np.array(numbers)).name, numbers, None, known, o.get("covariance", ()))  # type: ignore[arg-type]
    words = [f"name: {o['camera']}", *([f"model: {lens.model}"] if lens.model != "brown" else [])]
    words += [f"{s}: {number(float(v))}" for s, v in zip(lens.kind.symbols, numbers, strict=True)]
    camera = f"camera: {{{', '.join([*words, *spread_keys(lens)])}, free: [{', '.join(free)}]}}"
    points = tuple((n, units.length, obs.extra["point"][:, i]) for i, n in enumerate(POINT.names))
    lines = [PIXEL.line(obs), "points: {columns: [point_x, point_y, point_z]}", camera]
    if isinstance(size := o.get("size"), tuple):
        lines.append(f"image: [{size[0]}, {size[1]}]")
    beside = tuple((name, UNITS["1"], values) for name, values in columns_of(obs).items())
    return KindOutput((*PIXEL.columns(obs, units), *points, *beside), tuple(lines))


PIXELS_KEYS = """pixels: {{columns: [u, v], sigma: 0.2}}
points: {{columns: [point_x, point_y, point_z], unit: {length}}}    # in the target's frame; or corners: {{column: corner, size: 60}}
frame: {{name: camera, mount: base, free: true}}    # say roughly where: the base seen from the camera; in hand: mount: tool
camera: {{name: lens, fx: 1400, fy: 1400, cx: 640, cy: 480, free: []}}    # or file: lens.yaml; free: true identifies all
"""
# What `vision detect` writes beside what is read here.
DETECTED = (*"marker corner point_x point_y point_z blur method".split(), COVARIANCE, *WITH_OTHERS)
PIXELS = KindFile(PixelsModel, read_pixels, write_pixels, PIXELS_KEYS, parts=parts, silent=DETECTED)

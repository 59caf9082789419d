"""Files of lenses, read and written: robocal's own lens.yaml, OpenCV's FileStorage, ROS' camera_info, Kalibr's camchain.

robocal: 1
kind: lens
model: brown                      # or rational, fisheye
image: [1280, 960]                # width and height in pixels
numbers: {fx: 1400.2, fy: 1399.8, cx: 641.1, cy: 482.5, k1: -0.21, k2: 0.05, p1: 0, p2: 0, k3: 0}    # px, 1; as OpenCV means them
sigma: {fx: 0.8, fy: 0.8, cx: 1.1, cy: 1.0, k1: 0.002}     # of those that were identified
correlation: [[1, 0.98, ...], ...]                         # of these, in their order
source: what it was made from
shutter: rolling                  # where it is: images are of stops then

Intrinsics of librealsense are read too
(`factory_lens`). The other formats say nothing of sigma. The centre of the first pixel is (0, 0) in all of them.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, FiniteFloat, PositiveInt

from robocal._record import record, replace
from robocal.errors import FormatError, look_up
from robocal.files.factory_lens import factory_lens, is_factory, is_listing, listed_lens
from robocal.files.other_lenses import (
    cameras_of,
    check_numbers,
    exact,
    kalibr_text,
    opencv_text,
    read_kalibr,
    read_matrices,
    ros_text,
)
from robocal.files.schema import FileModel, Version, refuse, validate
from robocal.files.stated_covariance import covariance_of
from robocal.files.text import InputFile, read_text
from robocal.files.yamlio import YamlDocument, parse, quote
from robocal.vision.camera import MODELS
from robocal.vision.lenses import Lens

__all__ = ["FORMS", "LensFile", "Numbers", "lens_text", "read_lens", "spread_keys"]

LIMIT = 1 << 20  # bytes
EXPECTED = "lens.yaml of robocal, a FileStorage of OpenCV, camera_info of ROS, a camchain of Kalibr, or intrinsics of librealsense"


@record
class LensFile:
    """A lens as a file has it, the file, the format: a key of FORMS or `factory`; and whether the shutter is
    known to roll."""

    lens: Lens
    file: InputFile
    form: str
    rolling: bool = False


# --- robocal's own --------------------------------------------------------------------------------------------------------


def _numbers(value: Any) -> Any:
    if not isinstance(value, dict):
        refuse("not a mapping of keys", found=value, expected="symbol: number")
    for symbol, given in value.items():
        if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
            refuse("not a finite number", found=f"{symbol}: {given}", expected="a number for each symbol")
    return {symbol: float(given) for symbol, given in value.items()}


Numbers = Annotated[Any, BeforeValidator(_numbers)]


class LensModelFile(FileModel):
    """lens.yaml as it is written."""

    robocal: Version
    kind: Literal["lens"]
    model: str
    image: list[PositiveInt] | None = None
    numbers: Numbers
    sigma: Numbers = None
    correlation: list[list[FiniteFloat]] | None = None
    source: str = ""
    shutter: Literal["global", "rolling"] | None = None


def _read_own(document: YamlDocument, camera: str) -> Lens:
    kind = document.data.get("kind")
    document.insist(kind == "lens", "this is no lens", ("kind",), found=kind, expected="kind: lens")
    given = validate(LensModelFile, document)
    if re.fullmatch(r"line[-_ ]?scan|push[-_ ]?broom", given.model):
        expected = "a camera with an image of rows and columns"
        document.fail("a line-scan camera is not read: its images are of many moments", ("model",), expected=expected)
    document.insist_known(given.model, tuple(MODELS), "no such model of lenses", ("model",))
    symbols = MODELS[given.model].symbols
    for symbol in given.numbers:
        document.insist_known(symbol, symbols, f"not a number of a {given.model} lens", ("numbers", symbol))
    for symbol in symbols:
        document.insist(symbol in given.numbers, "a key is missing", ("numbers", symbol))
    size = given.image
    if size is not None and len(size) != 2:
        document.fail("wrong number of values", ("image",), found=len(size), expected="width and height")
    sigma = given.sigma or {}
    covariance = covariance_of(document, sigma, given.correlation, symbols, ())
    numbers = [given.numbers[s] for s in symbols]
    check_numbers(document, numbers, ("numbers",))
    shape = None if size is None else (size[0], size[1])
    return Lens.of(given.model, numbers, shape, tuple(sigma), covariance, given.source)


def _own_text(lens: Lens, name: str) -> str:
    lines = [
        "# A lens, by robocal: pixels and ratios as in OpenCV; the centre of the first pixel is (0, 0).",
        "robocal: 1",
        "kind: lens",
    ]
    lines.append(f"model: {lens.model}")
    if lens.size is not None:
        lines.append(f"image: [{lens.size[0]}, {lens.size[1]}]")
    lines.append("numbers:")
    lines += [f"  {s}: {exact(v)}" for s, v in zip(lens.kind.symbols, lens.numbers, strict=True)]
    lines += [line.replace("], [", "],\n  [") for line in spread_keys(lens)]
    if lens.source:
        lines.append(f"source: {quote(lens.source)}")
    return "\n".join(lines) + "\n"


def spread_keys(lens: Lens) -> list[str]:
    """The keys that say sigma and correlation of a lens, each as YAML; none where it states none."""
    if not lens.known:
        return []
    sigma = ", ".join(f"{s}: {exact(v)}" for s, v in lens.sigma.items())
    rows = ", ".join(f"[{', '.join(map(exact, row))}]" for row in lens.correlation.tolist())
    return [f"sigma: {{{sigma}}}", f"correlation: [{rows}]"]


# --- all ------------------------------------------------------------------------------------------------------------------

Write = Callable[[Lens, str], str]
FORMS: dict[str, Write] = {"robocal": _own_text, "opencv": opencv_text, "ros": ros_text, "kalibr": kalibr_text}


def lens_text(lens: Lens, form: str = "robocal", name: str = "camera") -> str:
    """The text of a lens in one of FORMS; `name` is the camera's, where a format has one. Raises ModelError where it cannot be said."""
    return look_up(FORMS, form, "no such format of lenses")(lens, name)


def _form(data: Mapping[str, Any]) -> str:
    if "robocal" in data:
        return "robocal"
    if is_factory(data):
        return "factory"
    return "ros" if "camera_matrix" in data else "kalibr" if cameras_of(data) else ""


def read_lens(path: str | os.PathLike[str], camera: str = "", size: tuple[int, int] | None = None) -> LensFile:
    """Reads a lens in any of FORMS, or of a depth camera; `camera`, or the size of the images, chooses one of several. Raises
    FileError, or FormatError naming the line and key."""
    source = read_text(path, limit=LIMIT)
    text = source.text
    if text.startswith("<"):
        raise FormatError(
            "this is XML", file=source.path, row=1, expected="the same as YAML: a FileStorage whose name ends in .yml"
        )
    if is_listing(text):
        return LensFile(listed_lens(source, camera, size), InputFile(source.path, source.sha256), "factory")
    storage = text.startswith("%YAML:")
    if storage:
        # FileStorage's first line and tags are no YAML of today; as many characters stay, so that lines do.
        text = re.sub(r"^%YAML:[^\n]*", "#", text).replace("!!opencv-matrix", "")
    document = parse(replace(source, text=text))
    form = "opencv" if storage else _form(document.data)
    if not form:
        document.fail("this is no lens", (), found=f"the keys {', '.join(list(document.data)[:4])}", expected=EXPECTED)
    readers = {
        "robocal": _read_own,
        "opencv": read_matrices,
        "ros": read_matrices,
        "kalibr": read_kalibr,
        "factory": factory_lens,
    }
    rolling = form == "robocal" and document.data.get("shutter") == "rolling"
    return LensFile(readers[form](document, camera), InputFile(source.path, source.sha256), form, rolling)

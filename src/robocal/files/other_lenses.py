"""Lenses of others: FileStorage of OpenCV, camera_info of ROS, camchain of Kalibr; they say nothing of sigma."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError, one_of
from robocal.files.units import number
from robocal.files.yamlio import Path_, YamlDocument, quote
from robocal.quantities import LARGEST
from robocal.vision.camera import MODELS
from robocal.vision.lenses import Lens

__all__ = [
    "cameras_of",
    "check_numbers",
    "exact",
    "kalibr_text",
    "opencv_text",
    "read_kalibr",
    "read_matrices",
    "ros_text",
]

ZERO = 1e-12  # tolerance: of a number that must be 0, as rounding leaves it


def exact(value: float) -> str:
    """A number to its last bit: correlations near 1 need them all."""
    text = number(value)
    return text if float(text) == value else re.sub(r"^(-?\d+)e", r"\1.0e", repr(value))


# --- OpenCV and ROS -------------------------------------------------------------------------------------------------------

DISTORTIONS = {"plumb_bob": "brown", "rational_polynomial": "rational", "equidistant": "fisheye", "fisheye": "fisheye"}
COUNTS = {"brown": (0, 4, 5), "rational": (8,), "fisheye": (4,)}
MATRIX, COEFFICIENTS = "camera_matrix", "distortion_coefficients"


def read_matrices(document: YamlDocument, camera: str) -> Lens:
    """camera_matrix and distortion_coefficients, as OpenCV's sample and ROS write them."""
    k = _matrix(document, MATRIX)
    document.insist(
        k.shape == (3, 3), "a camera matrix has 3 rows of 3", (MATRIX,), found=" x ".join(map(str, k.shape))
    )
    if np.abs(k[[0, 1, 2, 2], [1, 0, 0, 1]]).max() > ZERO or abs(k[2, 2] - 1) > ZERO:
        document.fail(
            "axes of pixels that are not at right angles are not read",
            (MATRIX, "data"),
            expected="fx 0 cx 0 fy cy 0 0 1",
        )
    numbers = _matrix(document, COEFFICIENTS).ravel()
    model = _model_of(document, len(numbers))
    if len(numbers) > 8 and model == "rational":
        # Thin prism and tilt of newer OpenCV: read where they are not used.
        document.insist(
            len(numbers) in (12, 14),
            "a distortion that is not read",
            (COEFFICIENTS,),
            found=len(numbers),
            expected=_counts(),
        )
        extra = np.abs(numbers[8:]).max() > 0
        document.insist(not extra, "a thin prism or a tilted sensor is not read", (COEFFICIENTS,), expected=_counts())
        numbers = numbers[:8]
    document.insist(
        len(numbers) in COUNTS[model],
        f"not the numbers of a {model} lens",
        (COEFFICIENTS,),
        found=len(numbers),
        expected=_counts(),
    )
    size = tuple(_whole(document, key) for key in ("image_width", "image_height") if key in document.data)
    if len(size) == 1:
        document.fail("a key is missing", ("image_height" if "image_width" in document.data else "image_width",))
    return _made(
        document, model, k[[0, 1, 0, 1], [0, 1, 2, 2]], numbers, (size[0], size[1]) if size else None, (MATRIX, "data")
    )


def _counts() -> str:
    return "4 or 5 (k1 k2 p1 p2 k3), 8 (k4 k5 k6 too), or 4 of a fisheye (k1 k2 k3 k4)"


def _model_of(document: YamlDocument, count: int) -> str:
    word, flag = document.data.get("distortion_model"), document.data.get("fisheye_model", 0)
    if word is not None:
        document.insist_known(word, tuple(DISTORTIONS), "a distortion that is not read", ("distortion_model",))
        return DISTORTIONS[word]
    document.insist(flag in (0, 1), "not 0 or 1", ("fisheye_model",), found=flag)
    return "fisheye" if flag else "brown" if count <= 5 else "rational"


def _made(
    document: YamlDocument,
    model: str,
    pinhole: Iterable[float],
    bent: Iterable[float],
    size: tuple[int, int] | None,
    at: Path_,
) -> Lens:
    """The lens of four numbers of a pinhole and those of its distortion, of which the last may be left out."""
    numbers = [*map(float, pinhole), *map(float, bent)]
    numbers += [0.0] * (len(MODELS[model].symbols) - len(numbers))
    check_numbers(document, numbers, at)
    return Lens.of(model, numbers, size)


def check_numbers(document: YamlDocument, numbers: Sequence[float], at: Path_) -> None:
    """Raises FormatError for numbers of a lens that none has."""
    if min(numbers[:2]) <= 0:
        document.fail("a focal length must be above 0", at, found=min(numbers[:2]), expected="fx and fy in pixels")
    most = max(map(abs, numbers))
    document.insist(most < LARGEST, "no lens has so large a number", at, found=most, expected=f"below {LARGEST:g}")


def _matrix(document: YamlDocument, key: str) -> Array:
    given = document.data.get(key)
    document.insist(
        isinstance(given, dict),
        "a key is missing" if given is None else "not a matrix",
        (key,),
        expected="rows, cols, data",
    )
    assert isinstance(given, dict)
    rows, columns = (_whole(document, key, part, least=0) for part in ("rows", "cols"))
    data = _list(document, (key, "data"), given.get("data"))
    if len(data) != rows * columns:
        document.fail("wrong number of values", (key, "data"), found=len(data), expected=f"{rows} x {columns}")
    return np.array(data).reshape(rows, columns)


def _list(document: YamlDocument, at: Path_, given: object) -> list[float]:
    if not isinstance(given, list):
        document.fail(
            "a key is missing" if given is None else "not a list", at, found=given, expected="a list of numbers"
        )
    for i, value in enumerate(given):
        good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        document.insist(good, "not a finite number", (*at, i), found=value)
    return [float(v) for v in given]


def _whole(document: YamlDocument, *at: str, least: int = 1) -> int:
    given: Any = document.data
    for key in at:
        given = given.get(key)
    good = isinstance(given, int) and not isinstance(given, bool) and least <= given < 1 << 20
    document.insist(
        good,
        "a key is missing" if given is None else "not a whole number",
        at,
        found=given,
        expected=f"{least} or more",
    )
    assert isinstance(given, int)
    return given


def _bent(lens: Lens) -> list[float]:
    return list(lens.numbers[4:])


def _size(lens: Lens, form: str) -> tuple[int, int]:
    if lens.size is None:
        raise ModelError("this format needs the size of the images", key=form, expected="a lens that states it")
    return lens.size


def opencv_text(lens: Lens, name: str) -> str:
    def matrix(rows: int, data: Sequence[float]) -> list[str]:
        shape = [f"   rows: {rows}", f"   cols: {len(data) // rows}", "   dt: d"]
        return [*shape, f"   data: [ {', '.join(map(_real, data))} ]"]

    lines = ["%YAML:1.0", "---"]
    if lens.size is not None:
        lines += [f"image_width: {lens.size[0]}", f"image_height: {lens.size[1]}"]
    lines += [
        f"fisheye_model: {int(lens.model == 'fisheye')}",
        f"{MATRIX}: !!opencv-matrix",
        *matrix(3, _pinhole(lens)),
    ]
    bent = _bent(lens)
    return (
        "\n".join(
            [*lines, f"{COEFFICIENTS}: !!opencv-matrix", *matrix(len(bent) if lens.model == "fisheye" else 1, bent)]
        )
        + "\n"
    )


def ros_text(lens: Lens, name: str) -> str:
    width, height = _size(lens, "ros")
    word = next(w for w, m in DISTORTIONS.items() if m == lens.model)
    fx, fy, cx, cy = lens.numbers[:4]

    def matrix(key: str, rows: int, data: Sequence[float]) -> list[str]:
        return [
            f"{key}:",
            f"  rows: {rows}",
            f"  cols: {len(data) // rows}",
            f"  data: [{', '.join(map(_real, data))}]",
        ]

    lines = [
        f"image_width: {width}",
        f"image_height: {height}",
        f"camera_name: {quote(name)}",
        *matrix(MATRIX, 3, _pinhole(lens)),
    ]
    lines += [f"distortion_model: {word}", *matrix(COEFFICIENTS, 1, _bent(lens))]
    lines += matrix("rectification_matrix", 3, np.eye(3).ravel().tolist())
    return "\n".join([*lines, *matrix("projection_matrix", 3, [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])]) + "\n"


def _pinhole(lens: Lens) -> list[float]:
    fx, fy, cx, cy = lens.numbers[:4]
    return [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]


def _real(value: float) -> str:
    """A number that no parser takes for a whole one."""
    text = exact(float(value))
    return text if any(c in text for c in ".e") else f"{text}.0"


# --- Kalibr ---------------------------------------------------------------------------------------------------------------

KALIBR = {"radtan": "brown", "equidistant": "fisheye"}


def cameras_of(data: Mapping[str, Any]) -> list[str]:
    """The cameras of a camchain."""
    return [n for n, part in data.items() if isinstance(part, dict) and "intrinsics" in part]


def read_kalibr(document: YamlDocument, camera: str) -> Lens:
    names = cameras_of(document.data)
    chosen = names[0] if len(names) == 1 else camera
    if chosen not in names:
        document.fail("several cameras: the name says which", (), found=camera or None, **one_of(camera, names))
    part = document.data[chosen]
    for key, known in (("camera_model", ("pinhole",)), ("distortion_model", tuple(KALIBR))):
        document.insist(key in part, "a key is missing", (chosen, key), expected=", ".join(known))
        document.insist_known(part[key], known, "a lens that is not read", (chosen, key))
    lists = {}
    for key, count, words in (
        ("intrinsics", 4, "fx fy cx cy"),
        ("distortion_coeffs", 4, "4 numbers"),
        ("resolution", 2, "width height"),
    ):
        lists[key] = _list(document, (chosen, key), part.get(key))
        if len(lists[key]) != count:
            document.fail("wrong number of values", (chosen, key), found=len(lists[key]), expected=words)
    width, height = (int(v) for v in lists["resolution"])
    if [width, height] != lists["resolution"] or min(width, height) < 1:
        document.fail(
            "not a size of images", (chosen, "resolution"), found=lists["resolution"], expected="two whole numbers"
        )
    model = KALIBR[part["distortion_model"]]
    return _made(
        document, model, lists["intrinsics"], lists["distortion_coeffs"], (width, height), (chosen, "intrinsics")
    )


def kalibr_text(lens: Lens, name: str) -> str:
    width, height = _size(lens, "kalibr")
    words = {model: word for word, model in KALIBR.items()}
    if lens.model not in words or (lens.model == "brown" and lens.numbers[8] != 0):
        expected = "a fisheye, or a brown lens with k3 = 0: identify it without k3"
        raise ModelError("Kalibr has no such lens", key="kalibr", found=lens.model, expected=expected)
    lines = [
        "cam0:",
        "  cam_overlaps: []",
        "  camera_model: pinhole",
        f"  distortion_coeffs: [{', '.join(map(_real, _bent(lens)[:4]))}]",
    ]
    lines += [f"  distortion_model: {words[lens.model]}", f"  intrinsics: [{', '.join(map(_real, lens.numbers[:4]))}]"]
    return (
        "\n".join([*lines, f"  resolution: [{width}, {height}]", f"  rostopic: {quote(f'/{name}/image_raw')}"]) + "\n"
    )

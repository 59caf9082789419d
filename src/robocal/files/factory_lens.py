"""Lenses of depth cameras as their maker has them: intrinsics of librealsense as JSON, and what `rs-enumerate-devices -c` prints.

    {"width": 1280, "height": 720, "ppx": 641.2, "ppy": 362.7, "fx": 911.4, "fy": 911.9, "model": "brown_conrady", "coeffs": [0, 0, 0, 0]}

They are of one stream and one size, and state no sigma: as a prior they may be off by some px, and their distortion by what is usual.
Sources: librealsense, rs_types.h and rs-enumerate-devices.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from robocal.diagnose.vision_limits import LENS_FACTORY_PRIOR
from robocal.errors import FormatError
from robocal.files.text import Source
from robocal.files.yamlio import YamlDocument
from robocal.vision.camera import MODELS
from robocal.vision.lenses import Lens

__all__ = ["factory_lens", "is_factory", "is_listing", "listed_lens"]

HEAD = re.compile(r'^Intrinsic of "([^"]+)"\s*/\s*(\d+)x(\d+)', re.MULTILINE)
KEYS = {"width": "Width", "height": "Height", "ppx": "PPX", "ppy": "PPY", "fx": "Fx", "fy": "Fy"}
NUMBERS = ("fx", "fy", "ppx", "ppy")
PLAIN = ("none", "brown conrady")  # as OpenCV means k1 k2 p1 p2 k3
OTHERS = ("inverse brown conrady", "modified brown conrady")  # the same where all are 0
WIDE = "kannala brandt4"
EXPECTED = "distortion none or Brown Conrady, or numbers of 0; or the lens of robocal vision intrinsics"
LATE = ("k3", "k4", "k5", "k6")  # powers that stay zero


def is_factory(data: Mapping[str, Any]) -> bool:
    """Whether keys are those of intrinsics of librealsense."""
    return all(k in data for k in ("width", "height", *NUMBERS))


def is_listing(text: str) -> bool:
    """Whether a text is what rs-enumerate-devices prints."""
    return HEAD.search(text) is not None


def factory_lens(document: YamlDocument, camera: str) -> Lens:
    """The lens of a JSON. Raises FormatError."""
    data = document.data
    numbers = {}
    for key in ("width", "height", *NUMBERS):
        value = data[key]
        good = isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value) and value > 0
        document.insist(good, "not a number above 0", (key,), found=value, expected="a number in pixels")
        numbers[key] = float(value)
    coefficients = data.get("coeffs", data.get("distortion_coeffs", []))
    good = isinstance(coefficients, list) and all(isinstance(v, int | float) for v in coefficients)
    document.insist(good, "not a list of numbers", ("coeffs",), found=coefficients, expected="k1, k2, p1, p2, k3")
    model, made = str(data.get("model", "none")), None
    try:
        made = _made(numbers, model, [float(v) for v in coefficients])
    except ValueError as error:
        document.fail("a distortion that is not read", ("model",), found=f"{model}: {error}", expected=EXPECTED)
    return made


def listed_lens(source: Source, camera: str, size: tuple[int, int] | None) -> Lens:
    """The lens of one stream of a listing: that of `camera` ("Color"), at the size of the images. Raises FormatError."""
    found = []
    heads = list(HEAD.finditer(source.text))
    for head, end in zip(heads, [*(h.start() for h in heads[1:]), len(source.text)], strict=True):
        part = source.text[head.end() : end].split("Extrinsic")[0]
        cells = dict(re.findall(r"^\s*([A-Za-z][\w ()]*?)\s*:\s*(.+?)\s*$", part, re.MULTILINE))
        row = source.text.count("\n", 0, head.start()) + 1
        found.append((head[1], (int(head[2]), int(head[3])), cells, row))
    stream = camera.casefold() or "color"
    some = [f for f in found if f[0].casefold() == stream] or [
        f for f in found if stream == "color" and len(found) == 1
    ]
    fit = [f for f in some if size is None or f[1] == size]
    sizes = sorted({f"{f[0]} {f[1][0]}x{f[1][1]}" for f in found})
    if not fit or (size is None and len({f[1] for f in fit}) > 1):
        wanted = f"{stream}{'' if size is None else ' {}x{}'.format(*size)}"
        message = "no stream is that of the images" if not fit else "several streams: the size of the images says which"
        raise FormatError(message, file=source.path, found=", ".join(sizes), expected=wanted)
    _, _, cells, row = fit[0]
    try:
        numbers = {k: float(cells[word]) for k, word in KEYS.items()}
        coefficients = [float(v) for v in cells.get("Coeffs", "").split()]
        return _made(numbers, cells.get("Distortion", "none"), coefficients)
    except (KeyError, ValueError) as error:
        raise FormatError(
            "this stream cannot be read", file=source.path, row=row, found=str(error).strip("'"), expected=EXPECTED
        ) from None


def _made(numbers: Mapping[str, float], model: str, coefficients: list[float]) -> Lens:
    """The lens with its prior. Raises ValueError for a distortion that is not read."""
    word = re.sub(r"[_\s]+", " ", model.casefold().rpartition(".")[2]).strip()
    used = any(coefficients)
    if word in PLAIN or (word in OTHERS and not used):
        kind, bent = MODELS["brown"], (coefficients + [0.0] * 5)[:5]
    elif word == WIDE:
        kind, bent = MODELS["fisheye"], (coefficients + [0.0] * 4)[:4]
    else:
        raise ValueError(" ".join(f"{v:g}" for v in coefficients) or "no numbers")
    known = tuple(s for s in kind.symbols if s not in LATE or kind.name == "fisheye")
    expected = dict(zip(kind.symbols, kind.expected, strict=True)) | dict.fromkeys(kind.symbols[:4], LENS_FACTORY_PRIOR)
    covariance = np.diag([expected[s] ** 2 for s in known])
    size = int(numbers["width"]), int(numbers["height"])
    return Lens.of(kind.name, [*(numbers[k] for k in NUMBERS), *bent], size, known, covariance, "factory")

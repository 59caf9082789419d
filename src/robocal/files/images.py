"""The one boundary to OpenCV: dictionaries of markers. It is loaded when something asks for it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.errors import MissingExtra, ModelError, one_of

__all__ = ["FAMILIES", "encode_png", "family_border", "family_cells", "opencv"]

# Our names of dictionaries, and OpenCV's.
FAMILIES = {f"{n}x{n}_{count}": f"DICT_{n}X{n}_{count}" for n in (4, 5, 6, 7) for count in (50, 100, 250, 1000)}
FAMILIES |= {name: f"DICT_APRILTAG_{name}" for name in ("16h5", "25h9", "36h10", "36h11")}
FAMILIES |= {"mip_36h12": "DICT_ARUCO_MIP_36h12", "original": "DICT_ARUCO_ORIGINAL"}

LOGS = {"OPENCV_LOG_LEVEL": "SILENT", "OPENCV_FFMPEG_LOGLEVEL": "-8"}


def opencv() -> Any:
    """The module cv2. Raises MissingExtra."""
    for name, level in LOGS.items():  # what is wrong with a file is said in our words
        os.environ.setdefault(name, level)
    try:
        import cv2
    except ImportError:
        raise MissingExtra("vision", "OpenCV") from None
    return cv2


def family_border(family: str, cells: int) -> int:
    """Cells of black around the code of a dictionary's markers that have so many cells along a side."""
    aruco = opencv().aruco
    return int(cells - aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[family])).markerSize) // 2


def family_cells(family: str, ids: Iterable[int], border: int = 1) -> Array:
    """Cells (ids, n, n) of markers, 1 white and 0 black, with their black border of so many cells; row 0 at the top.

    Raises ModelError for a name or number that no dictionary has, MissingExtra.
    """
    name = re.sub(r"^(dict_)?(aruco_|apriltag_?|tag)?", "", family.lower())
    if name not in FAMILIES:
        raise ModelError("unknown dictionary of markers", found=family, **one_of(name, FAMILIES))
    aruco = opencv().aruco
    dictionary = aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[name]))
    count, side = len(dictionary.bytesList), dictionary.markerSize + 2 * border
    wanted = list(ids)
    for number in wanted:
        if not 0 <= number < count:
            message = "the dictionary has no such marker"
            raise ModelError(message, key="id", found=number, expected=f"0 to {count - 1} of {name}")
    made = [aruco.generateImageMarker(dictionary, int(number), side, borderBits=border) for number in wanted]
    return np.array(made, dtype=float).reshape(len(wanted), side, side) / 255.0


def encode_png(grey: Array | NDArray[np.uint8]) -> bytes:
    """An image (h, w) of grey levels as a PNG file. Raises MissingExtra."""
    _, made = opencv().imencode(".png", np.asarray(grey, np.uint8))
    return bytes(made)

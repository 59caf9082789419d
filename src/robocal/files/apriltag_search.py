"""Where the AprilTag library finds tags: a second search beside that of OpenCV, an extra. Only detection, as in `marker_search`."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import MissingExtra, ModelError
from robocal.files.marker_search import MarkersInImage

__all__ = ["TAGS", "find_tags", "tag_search"]

TAGS = ("36h11", "25h9", "16h5")  # dictionaries that both have
HALF = 0.5  # px: there the first pixel begins at 0, here its centre is (0, 0)


@cache
def tag_search(family: str) -> Any:
    """The search for a dictionary. Raises ModelError for one that the library does not have, MissingExtra."""
    if family not in TAGS:
        expected = f"{', '.join(TAGS)}; or --search opencv"
        raise ModelError("the AprilTag library has no such tags", key="--dictionary", found=family, expected=expected)
    try:
        import pyapriltags

        return pyapriltags.Detector(f"tag{family}", nthreads=1, quad_decimate=1.0)
    except (ImportError, OSError):  # not there, or not for this machine
        raise MissingExtra("apriltag", "pyapriltags") from None


def find_tags(grey: Array, family: str) -> MarkersInImage:
    """Tags in an image (h, w) of bytes; corners as OpenCV counts and places them. Raises ModelError, MissingExtra."""
    found = tag_search(family).detect(np.ascontiguousarray(grey))
    ids = np.array([one.tag_id for one in found], dtype=np.int64)
    corners = np.array([one.corners for one in found], dtype=float).reshape(-1, 4, 2)
    # There they run the other way round, and a tag stands on its head.
    return MarkersInImage(ids, np.roll(corners[:, ::-1], 2, axis=1) - HALF)

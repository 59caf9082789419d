"""How a file of an image says that it should be turned for looking at it: the tag of EXIF, in JPEG, PNG, WebP and TIFF.

Numbers of pixels belong to the lens only where the image lies as the sensor stored it. Source: EXIF 2.3, tag 0x0112.
"""

from __future__ import annotations

from typing import Literal

__all__ = ["as_stored", "stated_orientation"]

TIFF = (b"II*\0", b"MM\0*")
STARTS = (b"Exif\0\0", b"eXIf", b"EXIF")  # of JPEG, PNG (a chunk) and WebP (a chunk, its length behind the name)
HEAD = 1 << 16  # bytes: where cameras write it; WebP has it behind the image
TAG = 0x0112


def stated_orientation(data: bytes) -> int:
    """The orientation that a file states, 1 to 8; 1, upright, where it states none that can be read."""
    if data.startswith(TIFF):
        return _of_tiff(data)[0]
    part = data if data[:4] == b"RIFF" and data[8:12] == b"WEBP" else data[:HEAD]
    for start in STARTS:
        at = part.find(start)
        while at >= 0:
            for skip in (0, 4, 10):  # WebP: a length, and of some writers "Exif" once more
                block = data[at + len(start) + skip :][:HEAD]
                if block.startswith(TIFF):
                    return _of_tiff(block)[0]
            at = part.find(start, at + 1)
    return 1


def as_stored(data: bytes) -> bytes:
    """The file of which decoders make an image as it was stored: they turn a TIFF even where they are told not to."""
    way, at = _of_tiff(data) if data.startswith(TIFF) else (1, 0)
    if way == 1:
        return data
    return data[:at] + (1).to_bytes(2, "little" if data[:2] == b"II" else "big") + data[at + 2 :]


def _of_tiff(data: bytes) -> tuple[int, int]:
    """The orientation, and where it stands."""
    order: Literal["little", "big"] = "little" if data[:2] == b"II" else "big"

    def read(at: int, size: int) -> int:
        return int.from_bytes(data[at : at + size], order)

    first = read(4, 4)
    for at in range(first + 2, min(first + 2 + 12 * read(first, 2), len(data) - 11), 12):
        if read(at, 2) == TAG:
            way = read(at + 8, 2)
            return (way, at + 8) if 1 <= way <= 8 else (1, 0)
    return 1, 0

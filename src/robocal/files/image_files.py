"""Images from files, folders, lists and videos: one brightness per pixel, of 0 to 255. The centre of the first pixel is (0, 0)."""

from __future__ import annotations

import glob
import hashlib
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.vision_limits import VIDEO_FRAMES
from robocal.errors import FileError, reason_of
from robocal.files.image_orientation import as_stored, stated_orientation
from robocal.files.images import opencv
from robocal.files.text import InputFile, read_bytes, read_text
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["GreyImage", "ImageSource", "find_images", "name_views", "read_images", "shows_images"]

IMAGES = frozenset(".png .jpg .jpeg .bmp .tif .tiff .pgm .ppm .pnm .webp .jp2".split())
VIDEOS = frozenset(".avi .mp4 .mkv .mov .m4v .mpg .mpeg .wmv .webm".split())
BYTES = 256 << 20  # of one image file
VIDEO_BYTES = 16 << 30
PIXELS = 100_000_000  # of one image: a detector needs some ten bytes for each
SIDE = 16  # px: nothing can be found in less
RANGES = (255, 1023, 4095, 16383, 65535)  # of cameras that write 16 bits
# How a whole file begins, and what it holds near its end.
ENDS = ((b"\x89PNG\r\n\x1a\n", b"IEND"), (b"\xff\xd8", b"\xff\xd9"))
TAIL = 1 << 16  # bytes: cameras write previews and notes behind an image


@record(eq=False)
class GreyImage:
    """An image of a view: its brightness (h, w) as bytes for searching, and as it was read, in levels of 0 to 255, for fitting; as the
    sensor stored it; whether its file says to turn or mirror it (EXIF), which is not done: the lens does not turn with it."""

    view: str
    file: InputFile
    grey: Array
    levels: Array
    turned: bool = False
    remarks: tuple[Remark, ...] = ()

    @property
    def mirrored(self) -> GreyImage:
        """The same from right to left."""
        grey, levels = (np.ascontiguousarray(part[:, ::-1]) for part in (self.grey, self.levels))
        return replace(self, grey=grey, levels=levels)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.grey.shape[1], self.grey.shape[0]


@record
class ImageSource:
    """A file with one image, or a video."""

    path: Path
    video: bool


HOLES = 1e-3  # tolerance: of the pixels, that are at the edge of a hole
HOLE_EDGE = 0.03  # tolerance: of the largest: blur leaves neighbours of black darker


def shows_images(place: Path) -> bool:
    """Whether a file has the name of an image or a video."""
    return place.suffix.lower() in IMAGES | VIDEOS


def find_images(places: Sequence[str]) -> tuple[ImageSource, ...]:
    """The files that are meant by files, folders, patterns (img*.png) and lists (.txt, a path in each line): each once, numbers in names
    in the order of numbers. Raises FileError."""
    found: dict[str, Path] = {}
    for place in places:
        for path in _expand(place):
            found.setdefault(os.path.realpath(path), path)
    if not found:
        raise FileError("there are no images", file=", ".join(places), expected="files, folders, or a video")
    return tuple(ImageSource(p, p.suffix.lower() in VIDEOS) for p in sorted(found.values(), key=_natural))


def name_views(sources: Sequence[ImageSource]) -> tuple[str, ...]:
    """The names of files without their ends, where these differ; else with as much before them as makes them differ."""
    for parts in range(1, max(len(s.path.parts) for s in sources) + 1):
        names = tuple("/".join((*s.path.parts[-parts:-1], s.path.stem)) for s in sources)
        if len(set(names)) == len(names):
            return names
    return tuple("/".join(s.path.parts) for s in sources)  # img1.png beside img1.jpg


def read_images(sources: Sequence[ImageSource], every: int = 10) -> Iterator[GreyImage]:
    """Each image in turn, and of a video every so many frames. Raises FileError with the file and what is wrong with it."""
    for source, view in zip(sources, name_views(sources), strict=True):
        if source.video:
            yield from _frames(source.path, view, every)
        else:
            yield _image(source.path, view)


def _expand(place: str) -> list[Path]:
    path = Path(place)
    if path.is_dir():
        named = (p for p in path.iterdir() if p.suffix.lower() in IMAGES | VIDEOS and not p.name.startswith("."))
        inside = [p for p in named if not p.is_dir()]
        if not inside:
            raise FileError("there are no images in this folder", file=path, expected=", ".join(sorted(IMAGES)))
        return inside
    if not path.exists() and any(c in place for c in "*?["):
        matches = glob.glob(place)
        if not matches:
            raise FileError("no file has such a name", file=place)
        return [Path(m) for m in matches]
    if path.suffix.lower() == ".txt":
        lines = [line.strip() for line in read_text(path).text.splitlines()]
        listed = [path.parent / line for line in lines if line and not line.startswith("#")]
        if not listed:
            raise FileError("there are no images in this list", file=path, expected="a path in each line")
        return listed
    return [path]


def _natural(path: Path) -> tuple[Any, ...]:
    """img2 before img10: of numbers the longer is the larger."""
    parts = (t.lstrip("0") if t.isdigit() else t for t in re.split(r"(\d+)", str(path)))
    return tuple((len(t), t) if k % 2 else (0, t) for k, t in enumerate(parts))


def _image(path: Path, view: str) -> GreyImage:
    data = read_bytes(path, limit=BYTES)
    _refuse_part(data, path)
    cv2 = opencv()
    raw = _decode(as_stored(data), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION)
    if raw is None:
        expected = "an image: PNG, JPEG, TIFF, BMP, PGM, WebP"
        raise FileError("this is not an image that OpenCV can read", file=path, expected=expected)
    made = _grey(raw, view, InputFile(path, hashlib.sha256(data).hexdigest()))
    return replace(made, turned=stated_orientation(data) != 1)


def _decode(data: bytes, flags: int) -> Any:
    cv2 = opencv()
    try:
        return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error:  # more pixels than OpenCV takes, a header that promises what is not there
        return None


def _refuse_part(data: bytes, path: Path) -> None:
    """Raises FileError for a file that ends early, which decoders fill with grey, and for one that asks for too much memory."""
    for start, end in ENDS:
        if data.startswith(start) and end not in data[-TAIL:]:
            raise FileError("the image ends early: a part of the file is missing", file=path, expected="a whole copy")
    if data.startswith(b"BM") and len(data) >= 6 and int.from_bytes(data[2:6], "little") > len(data):
        raise FileError("the image ends early: a part of the file is missing", file=path, expected="a whole copy")
    if data.startswith(ENDS[0][0]) and len(data) > 24:
        _refuse_size(int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big"), path)


def _refuse_size(width: int, height: int, path: Path) -> None:
    if width * height > PIXELS:
        expected = f"at most {PIXELS // 1_000_000} million pixels"
        raise FileError("the image is too large", file=path, found=f"{width} x {height} pixels", expected=expected)
    if min(width, height) < SIDE:
        raise FileError("the image is too small", file=path, found=f"{width} x {height} pixels")


def _grey(raw: Any, view: str, file: InputFile) -> GreyImage:
    """Levels of 0 to 255; of 16 bits the range that the camera uses."""
    _refuse_size(raw.shape[1], raw.shape[0], file.file)
    if raw.dtype == np.uint8:
        return GreyImage(view, file, raw, raw)
    most = float(np.max(raw)) if np.isfinite(raw).all() else np.inf
    if not 0 < most < np.inf or (raw.dtype.kind == "f" and most > RANGES[-1]):
        raise FileError("the image has no levels of brightness", file=file.file, found=f"a maximum of {most:g}")
    top = next(r for r in RANGES if most <= r) if raw.dtype.kind != "f" or most > 1 else 1.0
    _refuse_depth(raw, most, file.file)
    levels: Array = (255.0 / top) * np.asarray(raw, dtype=float)
    return GreyImage(view, file, np.clip(np.rint(levels), 0, 255).astype(np.uint8), levels)


def _refuse_depth(raw: Any, most: float, path: Path) -> None:
    """Raises FileError for distances in place of brightness: holes of 0 whose neighbours are far from it, which no optics leaves."""
    named = "depth" in path.name.casefold()
    holes = raw == 0
    beside = np.concatenate(
        [raw[:, 1:][holes[:, :-1]], raw[:, :-1][holes[:, 1:]], raw[1:][holes[:-1]], raw[:-1][holes[1:]]]
    )
    edge = beside[beside > 0]
    sharp = len(edge) > HOLES * raw.size and float(np.median(edge)) > HOLE_EDGE * most
    if named or sharp:
        found = "16 bits, and `depth` in the name" if named else "16 bits with holes of 0, as in distances"
        raise FileError(
            "this is a depth image, which is not read",
            file=path,
            found=found,
            expected="the colour images of the camera",
        )


def _frames(path: Path, view: str, every: int) -> Iterator[GreyImage]:
    cv2 = opencv()
    file = InputFile(path, _digest(path))
    film = cv2.VideoCapture(str(path))
    try:
        if not film.isOpened():
            raise FileError("this is not a video that OpenCV can read", file=path, expected="a video, or images")
        film.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # as the sensor stored it
        turned = film.get(cv2.CAP_PROP_ORIENTATION_META) % 360 != 0
        number = 0
        last: GreyImage | None = None  # one is kept back, for what is said at the end
        while film.grab():
            if number % every == 0:
                there, frame = film.retrieve()
                if there:
                    if last is not None:
                        yield last
                    flat = frame if frame.ndim == 2 else cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
                    last = replace(_grey(flat, f"{view}-{number}", file), turned=turned)
            number += 1
        if last is None:
            raise FileError("the video has no frames", file=path)
        stated = int(film.get(cv2.CAP_PROP_FRAME_COUNT))
        short = number < VIDEO_FRAMES * stated
        said = [Remark.of(Code.VIDEO_ENDS_EARLY, file=str(path), count=number, stated=stated)] if short else []
        yield replace(last, remarks=tuple(said))
    finally:
        film.release()


def _digest(path: Path) -> str:
    try:
        if path.stat().st_size > VIDEO_BYTES:
            raise FileError("the file is too big", file=path, expected=f"at most {VIDEO_BYTES >> 30} GB")
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise FileError(f"cannot be read: {reason_of(error)}", file=path) from None

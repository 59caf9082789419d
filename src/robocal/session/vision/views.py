"""One view of a target: an image, what it shows, and how good it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.vision_limits import IMAGE_SMEAR, SMEAR_CELL
from robocal.files.image_files import GreyImage
from robocal.files.kinds.corner_covariance import COVARIANCE, WITH_OTHERS
from robocal.files.marker_search import encode_picture
from robocal.quantities import Column, Listing
from robocal.session.vision.target import Target
from robocal.vision.marker.bend import COMMON_LENS
from robocal.vision.marker.motion import blur_of_motion
from robocal.vision.sightings import BOARD, METHODS, Sighting, coverage_of
from robocal.vision.square import poses_of_square

__all__ = ["ImageView", "ViewSummary", "list_corners", "look_at", "look_mirrored"]

MARKERS = 5  # grid: of a view that tell how it is smeared: a lens bends larger ones more
BLOCK = 4  # grid: squares along a part of a board that is looked at for a smear
WIDTH = 420  # px, of a small picture


@record(kw_only=True)
class ViewSummary:
    """One view: its image, how many markers and corners it shows, the share of all numbers that any view shows, blur (px, the median), the
    length and direction by which it is smeared (px, deg), the share of bright pixels that may be cut off, the share of the image's parts
    with corners, markers at the border, numbers seen twice, those that could not be fitted, those that are not on the sheet, whether its
    file says to turn it (EXIF), which is not done, and of one marker alone the angles between each pose that it may have and facing the
    camera (deg, through a common lens)."""

    view: str
    file: str
    width: int
    height: int
    markers: int
    corners: int
    share: float = 0.0
    blur: float | None
    motion: float
    direction: float
    white: float
    coverage: float
    border: int
    edges: int
    twice: tuple[int, ...] = ()
    dropped: tuple[int, ...] = ()
    strangers: tuple[int, ...] = ()
    mirrored: bool = False
    turned: bool = False
    tilts: tuple[float, ...] = ()


@record(eq=False)
class ImageView:
    """One image with what it shows, and a small picture of it (JPEG) where a page wants one."""

    summary: ViewSummary
    sightings: tuple[Sighting, ...]
    picture: bytes = b""

    @property
    def lacking(self) -> bool:
        """Whether it shows nothing, or not all that was found."""
        return not self.sightings or bool(self.summary.dropped)

    def with_picture(self, image: GreyImage) -> ImageView:
        """The same, with a small picture."""
        return replace(self, picture=encode_picture(image.grey, WIDTH))

    def with_share(self, share: float) -> ImageView:
        """The same, with the share of all numbers that it shows."""
        return replace(self, summary=replace(self.summary, share=share))


def look_at(image: GreyImage, target: Target) -> ImageView:
    """What an image shows of a target. A number that it shows twice is left out: nobody knows which is which."""
    seen, dropped, strangers = target.search(image)
    counts = Counter(s.marker for s in seen)
    twice = tuple(sorted(n for n, count in counts.items() if count > 1))
    kept = tuple(sorted((s for s in seen if s.marker not in twice), key=lambda s: s.marker))
    markers = [s for s in kept if s.marker != BOARD]
    length, direction = _motion(image.levels, kept, target)
    blurs = [s.blur for s in kept if np.isfinite(s.blur)]
    width, height = image.size
    summary = ViewSummary(
        view=image.view, file=str(image.file.file), width=width, height=height, markers=len(markers),
        corners=sum(len(s.corner) for s in kept), blur=float(np.median(blurs)) if blurs else None, motion=length, direction=direction,
        white=float(np.mean([s.white for s in kept])) if kept else 0.0, coverage=coverage_of([s.place for s in kept], width, height),
        border=sum(s.cut for s in kept), edges=sum(s.method == METHODS[1] for s in kept), twice=twice, dropped=tuple(sorted(dropped)),
        turned=image.turned, strangers=tuple(sorted(set(strangers))),
        tilts=_tilts(kept[0], image.size) if len(kept) == len(markers) == 1 else (),
    )  # fmt: skip
    return ImageView(summary, kept)


def look_mirrored(view: ImageView, image: GreyImage, target: Target) -> ImageView:
    """The same view, which shows no marker; said where its mirror image does."""
    return replace(view, summary=replace(view.summary, mirrored=bool(target.search(image.mirrored)[0])))


def _motion(levels: Array, seen: Sequence[Sighting], target: Target) -> tuple[float, float]:
    """Length (px) and direction (deg, from u towards v) of a motion while the image was taken: a motion by L adds L^2 / 12 to the
    variance of the blur along it, in all markers alike; what a lens does differs between them. 0 where no marker is large enough."""
    found: list[Array] = []
    for place, cells, blur, off, white in sorted(_prints(seen, target), key=lambda p: _shortest_side(p[0])):
        if _shortest_side(place) >= SMEAR_CELL * len(cells) and len(found) < MARKERS:
            one = blur_of_motion(levels, place, cells, blur, off, white)
            found.append(one)
            low, high = np.linalg.eigvalsh(one)
            if 12 * (high - low) < IMAGE_SMEAR**2:  # others can only make it less
                break
    if not found:
        return 0.0, 0.0
    across, along = np.linalg.eigh(np.mean(found, axis=0))[1].T
    wider = min(float(along @ one @ along - across @ one @ across) for one in found)
    return float(np.sqrt(12 * max(wider, 0.0))), float(np.degrees(np.arctan2(along[1], along[0])) % 180)


def _tilts(s: Sighting, size: tuple[int, int]) -> tuple[float, ...]:
    """How far (deg) a marker is from facing the camera, in both of its poses."""
    focal, (u, v) = COMMON_LENS[0] * size[0], (np.array(size) - 1) / 2
    lens = np.array([focal, focal, u, v, COMMON_LENS[1], 0.0, 0.0, 0.0, 0.0])
    return tuple(float(np.degrees(p.tilt)) for p in poses_of_square(s.place, s.covariance, 1.0, lens))


def _prints(
    seen: Sequence[Sighting], target: Target
) -> Iterator[tuple[Array, Array, float, tuple[float, float], bool]]:
    """Corners (4, 2), cells, blur, and place of the cells of what is fitted by all pixels, and whether white is around it: markers, and
    blocks of a board without them."""
    for s in seen:
        if s.marker != BOARD and s.method == METHODS[0] and (cells := target.cells(s.marker)) is not None:
            yield s.place, cells, s.blur, s.off, True
        elif s.marker == BOARD and target.family is None and target.squares is not None:
            columns, rows = target.squares[0] - 1, target.squares[1] - 1
            at = dict(zip(s.corner.tolist(), s.place, strict=True))
            n = min(BLOCK, columns - 1, rows - 1)
            for row, column in np.ndindex((rows - 1) // n, (columns - 1) // n):
                first = row * n * columns + column * n
                corners = [first, first + n, first + n * columns + n, first + n * columns]
                if all(k in at for k in corners):
                    place = np.array([at[k] for k in corners])
                    yield place, np.indices((n, n)).sum(axis=0) % 2.0, s.blur, (0.0, 0.0), False


def _shortest_side(place: Array) -> float:
    return float(np.hypot(*(np.roll(place, -1, axis=0) - place).T).min())


def list_corners(views: Sequence[ImageView], target: Target) -> Listing:
    """A row for each corner: view, marker, corner, place with its standard deviations, the covariance of this corner with the others of its
    marker, blur and method; where on the target it is, where that is known."""
    rows = [(v.summary.view, s, k) for v in views for s in v.sightings for k in range(len(s.corner))]
    boards = any(s.marker == BOARD for _, s, _ in rows)
    place = np.array([s.place[k] for _, s, k in rows]).reshape(-1, 2)
    sigma = np.array([s.sigma[k] for _, s, k in rows]).reshape(-1, 2)
    columns = [
        Column("view", "", [v for v, _, _ in rows]),
        Column("marker", "", ["board" if s.marker == BOARD else s.marker for _, s, _ in rows]),
        Column("corner", "", [int(s.corner[k]) for _, s, k in rows]),
        *(Column(n, "px", place[:, i], decimals=4) for i, n in enumerate("uv")),
        *(Column(n, "px", sigma[:, i], digits=4) for i, n in enumerate(("su", "sv"))),
    ]
    where = {id(s): target.places(s) for _, s, _ in rows}
    if any(p is not None for p in where.values()):
        none = np.full(3, np.nan)
        points = np.array([none if (p := where[id(s)]) is None else 1e3 * p[k] for _, s, k in rows]).reshape(-1, 3)
        columns += [Column(f"point_{a}", "mm", points[:, i], digits=9) for i, a in enumerate("xyz")]
    columns += [Column("blur", "px", np.array([s.blur for _, s, _ in rows]), digits=4)]
    columns += [Column("method", "", [s.method for _, s, _ in rows])]
    own = np.array([s.covariance[2 * k, 2 * k + 1] for _, s, k in rows])
    columns += [Column(COVARIANCE, "px^2", own, digits=6)]
    if not boards or target.family is not None:
        both = np.array([_block(s, k) for _, s, k in rows]).reshape(-1, 16)
        columns += [Column(n, "px^2", both[:, i], digits=6) for i, n in enumerate(WITH_OTHERS)]
    return Listing(tuple(columns))


def _block(s: Sighting, k: int) -> Array:
    """The covariance of u and of v of a marker's corner with all eight numbers of the marker; a board has none between its corners."""
    return np.full(16, np.nan) if s.marker == BOARD else s.covariance[2 * k : 2 * k + 2].ravel()

"""What `vision detect` finds: corners view by view, and what is wrong with the images."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal.errors import ModelError
from robocal.files.display import listing_text
from robocal.files.image_files import GreyImage, find_images, read_images
from robocal.files.lens import read_lens
from robocal.files.marker_search import smallest_family
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.text import InputFile, read_text
from robocal.progress import Watch, tell
from robocal.quantities import Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.report.sections import Section
from robocal.session.verb_base import VerbResult
from robocal.session.vision.further import views_before_a_fit
from robocal.session.vision.judge import judge_views
from robocal.session.vision.lens_edges import LensEdges
from robocal.session.vision.target import SEARCHES, Target, find_target, target_of, target_on, use_search
from robocal.session.vision.views import ImageView, ViewSummary, list_corners, look_at, look_mirrored
from robocal.vision.sightings import BOARD, METHODS, coverage_of, find_islands

__all__ = ["DetectDocument", "Detected", "detect"]

PICTURES = 24  # grid: on a page; of more images an even selection, and as many of those that lack something
MIRRORS = 3  # grid: images without a marker, mirrored or not, after which no more are looked at mirrored


@record(kw_only=True)
class DetectDocument(Document):
    """corners.json: the target, the size of the images, each view, groups of markers that views join, the share of the image with
    corners, how many markers or boards were fitted in which way, the corners, and the views that would help most to find the
    lens."""

    target: dict[str, Any]
    image: tuple[int, int]
    views: list[ViewSummary]
    islands: list[list[int]]
    coverage: float
    methods: dict[str, int]
    corners: Listing
    further: Listing | None
    provenance: Origin


@record(kw_only=True, eq=False)
class Detected(VerbResult):
    """Corners of a target in images, and the names of the files that they are written to."""

    target: Target
    views: tuple[ImageView, ...]
    islands: tuple[tuple[int, ...], ...]
    coverage: float
    files: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of most images."""
        return Counter((v.summary.width, v.summary.height) for v in self.views).most_common(1)[0][0]

    @property
    def methods(self) -> dict[str, int]:
        """How many markers and boards were fitted in which way."""
        counts = Counter(s.method for v in self.views for s in v.sightings)
        return {m: counts[m] for m in METHODS if counts[m]}

    @property
    def listing(self) -> Listing:
        """A row for each corner."""
        return list_corners(self.views, self.target)

    @property
    def printed(self) -> tuple[str | None, Listing | None]:
        """The list, where it is not written."""
        return (None, None) if self.files else (listing_text(self.listing), self.listing)

    @cached_property
    def further(self) -> Listing | None:
        """The views that would help most to find the lens; None of markers whose places on one target nobody states."""
        numbers = {s.marker for v in self.views for s in v.sightings}
        whole = self.target.squares is not None or self.target.sheet is not None or len(numbers) == 1
        if not whole or len({(v.summary.width, v.summary.height) for v in self.views}) > 1:
            return None
        target = replace(self.target, size=self.target.size or 1.0, square=self.target.square or 1.0)
        seen = [(k, s, p) for k, v in enumerate(self.views) for s in v.sightings if (p := target.places(s)) is not None]
        if not seen:
            return None
        view = np.repeat([k for k, _, _ in seen], [len(p) for _, _, p in seen])
        pixels, places = np.concatenate([s.place for _, s, _ in seen]), np.concatenate([p for _, _, p in seen])
        return views_before_a_fit(places, pixels, view, len(self.views), self.size)

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        width, height = self.size
        facts = (("Target", self.target.text), ("Images", f"{len(self.views)} of {width} x {height} pixels"))
        return {"title": "Corners in images", "kind": "Detection", "facts": facts}

    @property
    def document(self) -> DetectDocument:
        """What --json says."""
        return self.document_of(
            DetectDocument,
            target=self.target.document,
            image=self.size,
            views=[v.summary for v in self.views],
            islands=[list(i) for i in self.islands],
            coverage=self.coverage,
            methods=self.methods,
            corners=self.listing,
            further=self.further,
        )

    def texts(self) -> Mapping[str, str | bytes]:
        """The list and the document."""
        return {self.files[0]: listing_text(self.listing), self.files[1]: json_text(self.document)}

    def details(self) -> Iterator[Section]:
        """Pictures of the views."""
        from robocal.report.detected import detect_pictures

        yield from detect_pictures(self)


def detect(
    o: Any, watch: Watch | None = None, command: str = "", files: tuple[str, ...] = (), lens: Path | None = None
) -> Detected:
    """Finds the target that options name, then its corners in every image, through a `lens` where its file is given. Raises InputError."""
    named = ("dictionary", "checker", "charuco", "size", "square")
    if o.sheet is not None:
        o.refuse(named, "the sheet says this already", "--sheet alone, or none")
        wanted: Target | None = target_on(o.sheet)
    else:
        wanted = target_of(*(getattr(o, n) for n in named))
    wanted = use_search(wanted, getattr(o, "search", SEARCHES[0]))
    sources = find_images(o.images)
    lengths = Target(size=_metres(o.size), square=_metres(o.square))
    target, said = find_target(wanted, lengths, sources, o.every, watch)
    read = None if lens is None else read_lens(lens)
    target = target if read is None else replace(target, lens=read.lens.intrinsics)
    bends = read is not None and target.family is not None
    edges = LensEdges(str(target.family), np.asarray(target.lens)) if bends else None
    apart = max(1, -(-len(sources) // PICTURES))
    views: list[ImageView] = []
    inputs: dict[InputFile, None] = {} if o.sheet is None else {InputFile(o.sheet, read_text(o.sheet).sha256): None}
    inputs |= {} if read is None else {read.file: None}
    misses = lacking = 0
    for number, image in enumerate(read_images(sources, o.every)):
        tell(watch, "detect", what=image.view)
        inputs[image.file] = None
        if read is not None and read.lens.size is not None:
            _insist_size(image, read.lens.size)
        said.extend(image.remarks)
        view = look_at(image, target)
        if not view.sightings and target.family is not None and misses < MIRRORS:
            view = look_mirrored(view, image, target)
            misses += not view.summary.mirrored
        if edges is not None:
            edges.add(image, view.sightings)
        chosen = number % apart == 0 and number < apart * PICTURES
        if files and (chosen or (view.lacking and lacking < PICTURES)):
            lacking += not chosen
            view = view.with_picture(image)
        views.append(view)
    numbers = sorted({(s.marker, k) for v in views for s in v.sightings for k in s.corner.tolist()})
    views = [v.with_share(v.summary.corners / max(len(numbers), 1)) for v in views]
    markers = sorted({n for n, _ in numbers if n != BOARD})
    if wanted is None and target.family is not None and markers:
        target = replace(target, family=smallest_family(target.family, max(markers, default=0)))
        said.append(Remark.of(Code.DICTIONARY_FOUND, family=str(target.family)))
    seen = np.array([[any(s.marker == n for s in v.sightings) for n in markers] for v in views], dtype=bool)
    islands = tuple(tuple(markers[i] for i in island) for island in find_islands(seen)) if markers else ()
    first = views[0].summary
    coverage = coverage_of([s.place for v in views for s in v.sightings], first.width, first.height)
    said += edges.remarks if edges else ()
    warnings, reasons = judge_views([v.summary for v in views], islands, coverage, target)
    return Detected(
        target=target, views=tuple(views), islands=islands, coverage=coverage, files=files, warnings=(*said, *warnings),
        reasons=tuple(reasons), inputs=tuple(inputs), command=command,
    )  # fmt: skip


def _insist_size(image: GreyImage, size: tuple[int, int]) -> None:
    """Raises ModelError for an image of another size than the lens'."""
    height, width = image.grey.shape
    if (width, height) != size:
        found, expected = f"{width} x {height} px of {image.view}", "{} x {} px, as the lens".format(*size)
        raise ModelError(
            "an image of another size than those of the lens", key="--lens", found=found, expected=expected
        )


def _metres(length: float | None) -> float | None:
    return None if length is None else 1e-3 * length

"""What `vision map --held` finds: where the camera was in a map, as a list of poses that `verify` takes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.limits import GROSS_SHARE
from robocal.diagnose.vision_limits import LENS_MISSES, LENS_MISSES_TIMES, MARKER_SIZE
from robocal.errors import ModelError
from robocal.files.display import listing_text
from robocal.files.lens import read_lens
from robocal.files.map import read_map
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.geometry import so3
from robocal.progress import Watch, tell
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, percent
from robocal.report.sections import Section
from robocal.session.verb_base import VerbResult
from robocal.session.vision.corner_table import CornerTable
from robocal.session.vision.map_images import open_corners_of_map
from robocal.session.vision.map_sizes import edge_errors
from robocal.session.vision.place_views import LocatedViews, locate_views
from robocal.session.watching import computable
from robocal.vision.lenses import Lens
from robocal.vision.maps import MarkerMap

__all__ = ["MapPlaces", "PlacesDocument", "find_places"]

UNSTATED = 0.1  # px: of a corner, where nobody states it
NAMED = 12  # grid: names of a sentence


@record(kw_only=True)
class PlacesDocument(Document):
    """poses.json: T_map_camera of every image that has one pose, with standard deviations of its place and of small turns about the axes
    of the map; of every image its markers and corners, and what is left of them; both poses of images that have two; images
    that were not placed, what is left of all corners, and how many of them were excluded."""

    poses: Listing
    views: Listing
    rivals: Listing
    lacking: list[str]
    left: Any
    excluded: int
    provenance: Origin


@record(kw_only=True, eq=False)
class MapPlaces(VerbResult):
    """Images in a map, and the names of the files that they are written to."""

    views: LocatedViews
    known: MarkerMap
    lens: Lens
    files: tuple[str, ...] = ()

    @cached_property
    def double(self) -> frozenset[int]:
        """The views that have two poses."""
        return frozenset(r.view for r in self.views.rivals)

    @cached_property
    def listing(self) -> Listing:
        """A row for each image with one pose."""
        rows = [u for u in range(len(self.views.ids)) if u not in self.double]
        return _poses(self.views, rows)

    @cached_property
    def quality(self) -> Listing:
        """A row for each image: its markers and corners, how many of these are excluded, what is left of the others, and sigma of its
        place in all directions together."""
        v = self.views
        sigma = 1e3 * np.sqrt(np.trace(v.covariance[:, :3, :3], axis1=1, axis2=2))
        return Listing(
            (
                Column("id", "", list(v.ids)),
                Column("markers", "", v.markers.tolist()),
                Column("corners", "", v.corners.tolist()),
                Column("excluded", "", v.aside.tolist()),
                Column("rms", "px", v.rms, digits=4, figures=3),
                Column("sigma", "mm", sigma, digits=4, figures=2),
            )
        )

    @cached_property
    def rivals(self) -> Listing:
        """Both poses of every image that has two, and how likely each is."""
        v = self.views
        names, ranks, poses, likely = [], [], [], []
        for r in v.rivals:
            names += [v.ids[r.view]] * 2
            ranks += [1, 2]
            poses += [v.poses[r.view], r.pose]
            likely += [1 / (1 + r.likelihood), r.likelihood / (1 + r.likelihood)]
        at = np.array(poses).reshape(-1, 4, 4)
        head = (Column("id", "", names), Column("pose", "", ranks), Column("chance", "", np.array(likely), figures=2))
        return Listing((*head, *_place_columns(at)))

    @property
    def printed(self) -> tuple[str | None, Listing | None]:
        """The list, where it is not written."""
        return (None, None) if self.files else (listing_text(self.listing), self.listing)

    @property
    def note(self) -> str:
        """How many images, and how surely."""
        sigma = np.sqrt(np.trace(self.views.covariance[:, :3, :3], axis1=1, axis2=2))
        return f"{len(self.listing.columns[0].values)} images, sigma of their places {1e3 * float(np.median(sigma)):.2g} mm (median)"

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (
            ("Map", f"{len(self.known.names)} markers, {self.known.source}"),
            ("Images", f"{len(self.views.ids)}"),
            ("Lens", f"{self.lens.model}"),
        )
        return {"title": "Images in a map", "kind": "Places", "facts": facts}

    @property
    def document(self) -> PlacesDocument:
        """What --json says."""
        left = {"value": self.views.left, "unit": "px"}
        return self.document_of(
            PlacesDocument, poses=self.listing, views=self.quality, rivals=self.rivals, lacking=list(self.views.lacking), left=left,
            excluded=int(self.views.aside.sum()),
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The list and the document."""
        return {self.files[0]: listing_text(self.listing), self.files[1]: json_text(self.document)}

    def details(self) -> Iterator[Section]:
        """The map with the cameras in it."""
        from robocal.report.places_page import places_pictures

        yield from places_pictures(self)


def _place_columns(poses: Array) -> tuple[Column, ...]:
    """x, y, z in mm and a rotation vector in deg."""
    turn = np.degrees(so3.log(poses[:, :3, :3]))
    place = (Column(n, "mm", 1e3 * poses[:, i, 3], digits=10) for i, n in enumerate("xyz"))
    return (*place, *(Column(n, "deg", turn[:, i], digits=10) for i, n in enumerate(("rx", "ry", "rz"))))


def _poses(v: LocatedViews, rows: Sequence[int]) -> Listing:
    sigma = np.sqrt(np.einsum("vii->vi", v.covariance[rows])) * np.repeat([1e3, 180 / np.pi], 3)
    units = ("mm",) * 3 + ("deg",) * 3
    names = ("sx", "sy", "sz", "srx", "sry", "srz")
    return Listing(
        (
            Column("id", "", [v.ids[u] for u in rows]),
            *_place_columns(v.poses[rows]),
            *(
                Column(n, unit, sigma[:, i], digits=4, figures=2)
                for i, (n, unit) in enumerate(zip(names, units, strict=True))
            ),
        )
    )


def find_places(
    o: Any, watch: Watch | None = None, command: str = "", files: tuple[str, ...] = (), table: CornerTable | None = None
) -> MapPlaces:
    """Reads map, lens and corners (unless the `table` of corners is there already), and places the images. Raises InputError."""
    tell(watch, "read")
    read = read_map(o.held)
    known = read.map
    if o.lens is None:
        expected = "lens.yaml of robocal vision intrinsics, or a file of OpenCV, ROS or Kalibr"
        raise ModelError("images are placed through a lens", key="--lens", expected=expected)
    through = read_lens(o.lens)
    edges = edge_errors(o, known.size.tolist())
    if table is None:
        table = open_corners_of_map(o, known, through.lens, watch)
    lens = through.lens
    if lens.size is not None and lens.size != table.size:
        found, expected = "{} x {}".format(*lens.size), "{} x {} px, as the corners".format(*table.size)
        raise ModelError("a lens of images of another size", key="--lens", found=found, expected=expected)
    if known.family is not None and table.family is not None and known.family != table.family:
        raise ModelError("a map of another dictionary", key="--held", found=known.family, expected=table.family)
    with computable(o.held):
        views = locate_views(table, known, lens, edges, watch)
    said = [*read.file.remarks, *through.file.remarks, *table.remarks, *_remarks(views, known, lens, o)]
    return MapPlaces(
        views=views, known=known, lens=lens, files=files, warnings=tuple(said), reasons=tuple(_reasons(views, table, known)),
        inputs=(*table.files, read.file, through.file), command=command,
    )  # fmt: skip


def _remarks(views: LocatedViews, known: MarkerMap, lens: Lens, o: Any) -> Iterator[Remark]:
    total = len(views.ids) + len(views.lacking)
    for m in views.moved:
        away = Quantity(m.distance, "m")
        facts: dict[str, Any] = {"distance": away, "aside": m.aside, "total": m.corners, "other": m.other or None}
        yield Remark.of(Code.MAP_MARKER_MOVED, name=m.name, **facts)
    if views.rivals:
        names = tuple(dict.fromkeys(views.ids[r.view] for r in views.rivals))
        yield Remark.of(Code.VIEW_HAS_TWO_POSES, count=len(names), total=total, views=names)
    if views.lacking:
        yield Remark.of(Code.VIEW_WITHOUT_MAP, count=len(views.lacking), total=total, views=views.lacking)
    if views.strangers:
        yield Remark.of(Code.MARKERS_NOT_IN_MAP, count=len(views.strangers), names=views.strangers)
    if known.covariance is None:
        yield Remark.of(Code.MAP_WITHOUT_SIGMA, file=Path(o.held).name)
    if not lens.known:
        yield Remark.of(Code.LENS_WITHOUT_SIGMA, file=Path(o.lens).name)


def _reasons(views: LocatedViews, table: CornerTable, known: MarkerMap) -> Iterator[Remark]:
    """Why the poses must not be trusted."""
    edge = float(np.median(known.size))
    if views.larger is not None:
        yield Remark.of(Code.MAP_SIZES_UNLIKE, edge=Quantity(edge, "m"), seen=Quantity(edge * (1 + views.larger), "m"))
    if table.edge is not None and np.abs(known.size / table.edge - 1).min() > MARKER_SIZE:
        yield Remark.of(Code.MAP_OF_OTHER_SIZE, edge=Quantity(edge, "m"), told=Quantity(table.edge, "m"))
    times = views.left / (UNSTATED if views.stated is None else views.stated)
    if views.left > LENS_MISSES * table.size[0] and times > LENS_MISSES_TIMES:
        yield Remark.of(Code.MAP_UNLIKE_VIEWS, left=Quantity(views.left, "px"), times=times)
    share = float(views.aside.sum()) / max(float(views.corners.sum()), 1.0)
    if share > GROSS_SHARE:
        yield Remark.of(Code.MAP_CORNERS_EXCLUDED, share=percent(share))

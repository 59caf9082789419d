"""What `vision map` finds: where markers are to one another, how surely, and how well views that were left out are met."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.vision_limits import MAP_WEAK
from robocal.errors import ModelError
from robocal.files.display import to_display
from robocal.files.lens import read_lens
from robocal.files.map import MapFile, map_covariance_text, map_text, read_map
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.result import Verdict as VerdictPart
from robocal.geometry import se3
from robocal.progress import Watch
from robocal.prove.statistics import Statistic
from robocal.prove.verdict import Verdict
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark, sentences
from robocal.report.sections import Section
from robocal.session.base_markers import whole_sights
from robocal.session.verb_base import VerdictResult
from robocal.session.vision.corner_errors import CornerErrors, corner_errors
from robocal.session.vision.corner_table import CornerTable
from robocal.session.vision.hand_eye_images import is_table
from robocal.session.vision.lens_prior import lens_with_prior
from robocal.session.vision.map_fit import MapFit, fit_map
from robocal.session.vision.map_images import fit_with_images, open_corners
from robocal.session.vision.map_judge import judge_map, remarks_of_map
from robocal.session.vision.map_moved import MarkerMotion, find_moved
from robocal.session.vision.map_sizes import edge_errors, edges_of
from robocal.session.vision.map_table import sizes_of
from robocal.session.vision.sheet_prior import PrintedSheets, read_sheets
from robocal.session.watching import computable
from robocal.vision.lenses import Lens
from robocal.vision.maps import MarkerMap

__all__ = ["MapDocument", "MarkerMapResult", "find_map"]


@record(kw_only=True)
class MapErrors:
    """What corners are off by in px, both axes together: median and rms of all of them, those that were set aside included; as fitted,
    without these; and of views that were left out, whose own poses were fitted."""

    median: float
    every: float
    fitted: Statistic
    left_out: Statistic | None


@record(kw_only=True)
class MapDocument(Document):
    """map.json: verdict, errors in px, each marker with its place, what it may be off by (mm, deg) and how it is met, each view, the lens
    as it was given and found, and the loss."""

    verdict: VerdictPart
    origin: str
    errors: MapErrors
    unit: str
    markers: Listing
    views: Listing
    lens: Listing
    loss: str
    aside: int
    provenance: Origin


@record(kw_only=True, eq=False)
class MarkerMapResult(VerdictResult):
    """A map of markers from corners, with everything that its page shows."""

    fit: MapFit
    given: Lens
    stated: bool  # whether the lens states what it may be off by
    table: CornerTable
    off: CornerErrors
    verdict: Verdict
    moved: tuple[MarkerMotion, ...] = ()
    loss: str
    files: tuple[str, ...] = ()

    @property
    def map(self) -> MarkerMap:
        """Where the markers are."""
        return self.fit.map

    @property
    def trusted(self) -> bool:
        """Whether it is located."""
        return self.verdict.status == "located"

    @cached_property
    def errors(self) -> MapErrors:
        """What corners are off by."""
        size = np.linalg.norm(self.off.left, axis=1)
        return MapErrors(
            median=float(np.median(size)),
            every=float(np.sqrt(np.mean(size**2))),
            fitted=self.off.fitted,
            left_out=self.off.left_out,
        )

    @property
    def origin(self) -> str:
        """The marker in whose place the map has its origin: coordinates alone hang on it."""
        return self.map.names[int(np.abs(self.map.vector).sum(axis=1).argmin())]

    @cached_property
    def sigma(self) -> Array:
        """What each marker may be off by along its worst direction (m), and about its worst axis (rad), (M, 2)."""
        assert self.map.covariance is not None
        c = self.map.covariance.reshape(len(self.map.names), 6, len(self.map.names), 6)
        own = np.einsum("mimj->mij", c)
        worst = [np.linalg.eigvalsh(own[:, k : k + 3, k : k + 3])[:, -1] for k in (0, 3)]
        return np.asarray(np.sqrt(np.maximum(np.stack(worst, axis=1), 0.0)))

    @cached_property
    def many(self) -> Ints:
        """In how many views each marker is seen, (M,)."""
        obs = self.table.pixels
        pairs = np.unique(np.stack([obs.configuration, self._target]), axis=1)
        return np.asarray(np.bincount(pairs[1], minlength=len(self.map.names)), dtype=np.int64)

    @property
    def _target(self) -> Ints:
        target = self.table.pixels.target
        assert target is not None
        return target

    def _each(self, label: Ints, count: int) -> tuple[Array, Array, Array, Ints]:
        """Root mean squares as fitted and when left out, the largest error, and how many rows were set aside, of each label."""
        size, used, missed = np.linalg.norm(self.off.left, axis=1), self.off.used, self.off.missed
        out = []
        for values, some in ((size, used), (missed, used & np.isfinite(missed))):
            n = np.bincount(label[some], minlength=count)
            with np.errstate(invalid="ignore"):
                out.append(np.sqrt(np.bincount(label[some], values[some] ** 2, minlength=count) / n))
        worst = np.zeros(count)
        np.maximum.at(worst, label, size)
        aside = np.bincount(label[~used], minlength=count).astype(np.int64)
        return out[0], out[1], worst, aside

    @cached_property
    def markers(self) -> Listing:
        """A row for each marker, the least sure first."""
        known, (rms, left_out, _, aside) = self.map, self._each(self._target, len(self.map.names))
        at = np.argsort(-self.sigma[:, 0], kind="stable")
        mm, turn = 1e3 * known.vector[at, :3], np.degrees(known.vector[at, 3:])
        return Listing((
            Column("marker", "", [known.names[i] for i in at.tolist()]),
            Column("views", "", self.many[at].tolist()),
            Column("size", "mm", 1e3 * known.size[at], figures=5),
            *(Column(a, "mm", mm[:, k], spec=".2f") for k, a in enumerate("xyz")),
            *(Column(f"r{a}", "deg", turn[:, k], spec=".3f") for k, a in enumerate("xyz")),
            Column("sigma", "mm", 1e3 * self.sigma[at, 0], figures=2),
            Column("turn_sigma", "deg", np.degrees(self.sigma[at, 1]), figures=2, label="sigma [deg]"),
            Column("rms", "px", rms[at], figures=3),
            Column("left_out", "px", left_out[at], figures=3, label="left out [px]"),
            Column("aside", "", aside[at].tolist(), label="set aside"),
        ))  # fmt: skip

    @cached_property
    def views(self) -> Listing:
        """A row for each view."""
        obs, ids = self.table.pixels, self.table.data.configurations.ids
        rms, left_out, worst, aside = self._each(obs.configuration, len(ids))
        pairs = np.unique(np.stack([obs.configuration, self._target]), axis=1)
        return Listing((
            Column("view", "", list(ids)),
            Column("markers", "", np.bincount(pairs[0], minlength=len(ids)).tolist()),
            Column("rms", "px", rms, figures=3),
            Column("left_out", "px", left_out, figures=3, label="left out [px]"),
            Column("worst", "px", worst, figures=3),
            Column("aside", "", aside.tolist(), label="set aside"),
        ))  # fmt: skip

    @cached_property
    def lens(self) -> Listing:
        """The numbers of the lens, as given and as found."""
        found, given = self.fit.lens, self.given
        symbols = given.kind.symbols
        before, after = given.sigma, found.sigma
        return Listing((
            Column("name", "", list(symbols)),
            Column("given", "", np.array(given.numbers), figures=6),
            Column("prior", "", np.array([before.get(s, np.nan) for s in symbols]), figures=2, label="known to"),
            Column("found", "", np.array(found.numbers), figures=7),
            Column("sigma", "", np.array([after.get(s, np.nan) for s in symbols]), figures=2),
            Column("unit", "", ["" if u == "1" else u for u in given.kind.units]),
        ))  # fmt: skip

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (
            ("Markers", f"{len(self.map.names)}" + (f" of {self.map.family}" if self.map.family else "")),
            ("Views", f"{len(self.table.data.configurations)} with {len(self.off.left)} corners"),
            ("Origin", f"marker {self.origin}"),
        )
        return {"title": "A map of markers", "kind": "Map", "facts": facts}

    @property
    def document(self) -> MapDocument:
        """What --json says."""
        said = to_display(VerdictPart, self.verdict, reasons=sentences(self.verdict.remarks))
        return self.document_of(
            MapDocument, verdict=said, origin=self.origin, errors=self.errors, unit="px", markers=self.markers, views=self.views,
            lens=self.lens, loss=self.loss, aside=int((~self.off.used).sum()),
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The map, its covariance, and the document."""
        return {
            self.files[0]: map_text(self.map, beside=self.files[1]), self.files[1]: map_covariance_text(self.map),
            self.files[2]: json_text(self.document),
        }  # fmt: skip

    def details(self) -> Iterator[Section]:
        """Pictures: the map in space."""
        from robocal.report.map_page import map_pictures

        yield from map_pictures(self)


def find_map(o: Any, watch: Watch | None = None, command: str = "", files: tuple[str, ...] = ()) -> MarkerMapResult:
    """Reads corners, finds the map, and judges it. Raises InputError."""
    if len(set(files)) < len(files):
        raise ModelError("a map is a YAML", key="--output", found=files[0], expected="a name that ends in .yaml")
    if watch:
        watch({"stage": "read"})
    read = read_lens(o.lens)
    if not o.size and not o.sheet and o.departs("size_sigma"):
        found = f"--size-sigma {o.size_sigma:g}, which is how surely it is known"
        raise ModelError("the size of the markers is not stated", key="--size", found=found, expected="--size MM too")
    usual, own = sizes_of(o.size, bool(o.sheet))
    sheets = read_sheets(o.sheet, usual, own)
    edges = edge_errors(o, [1e-3 * e for e in (usual, *own.values(), *(sheets.sizes or {}).values()) if e is not None])
    table = open_corners(o, read.lens, sheets, watch)
    if o.origin is not None and o.origin not in table.marker:
        raise ModelError(
            "no marker of this number is seen", key="--origin", found=o.origin, expected="one of the markers"
        )
    given = lens_with_prior(
        Lens.of(read.lens.model, read.lens.numbers, table.size, read.lens.known, _matrix(read.lens)), o.fix
    )
    before = None if o.prior is None else read_map(o.prior)
    if before is not None and not set(table.marker) & {n for m in before.maps for n in m.names}:
        names, expected = ", ".join(before.maps[0].names[:8]), "a map of some of these markers"
        raise ModelError(
            "the prior has none of the markers that are seen", key="--prior", found=names, expected=expected
        )
    if (unseen := _unseen(sheets, table)) is not None:
        raise ModelError(
            "the sheet has none of the markers that are seen",
            key="--sheet",
            found=unseen.source,
            expected="one that the images show",
        )
    known = (*(before.maps if before else ()), *sheets.maps)
    source = f"{len(table.data.configurations)} views, {Path(o.corners).name}"
    images = o.images if is_table(o.corners) else (str(o.corners),)
    with computable(o.corners):

        def fit_of(corners: CornerTable) -> MapFit:
            return fit_map(corners, given, o.loss, o.origin, source, watch, known, edges)

        table, fit = (table, fit_of(table)) if not images else fit_with_images(table, given, images, fit_of, watch)
        off = corner_errors(fit.decision)
        moved = tuple(_moved(table, fit, off))
        ids = table.data.configurations.ids
        # A marker of another size scatters as if it moved.
        others = {s.name for s in fit.sizes.wrong}
        moved = tuple(m for m in moved if fit.map.names[m.marker] not in others)
        verdict = judge_map(fit.decision, off, moved, fit.sizes, table.size[0], ids)
        found = MarkerMapResult(
            fit=fit, given=given, stated=bool(read.lens.known), table=table, off=off, verdict=verdict, moved=moved, loss=o.loss,
            files=files, reasons=verdict.reasons, inputs=(*table.files, read.file, *([before.file] if before else [])), command=command,
        )  # fmt: skip
        few = [n for n, k in zip(fit.map.names, found.many.tolist(), strict=True) if k < MAP_WEAK]
        beside = remarks_of_map(fit.decision, off, fit.sizes, given, fit.lens, few)
    beside = [*(before.file.remarks if before else ()), *_displaced(fit, before, sheets), *beside]
    return replace(found, warnings=(*table.remarks, *beside))


def _unseen(sheets: PrintedSheets, table: CornerTable) -> MarkerMap | None:
    """A sheet of which no marker is seen."""
    return next((m for m in sheets.maps if not set(m.names) & set(table.marker)), None)


def _displaced(fit: MapFit, before: MapFile | None, sheets: PrintedSheets) -> Iterator[Remark]:
    for m in fit.displaced:
        printed = [k.source for k in sheets.maps if m.change.name in k.names]
        source = printed[0] if printed or before is None else before.file.file.name
        away = Quantity(m.change.distance, "m")
        facts: dict[str, Any] = {"distance": away, "other": m.other or None}
        yield Remark.of(Code.MARKER_MOVED_SINCE, file=source, name=m.change.name, **facts)


def _matrix(lens: Lens) -> Array:
    return np.array(lens.covariance).reshape(len(lens.known), len(lens.known))


def _moved(table: CornerTable, fit: MapFit, off: CornerErrors) -> list[MarkerMotion]:
    """Markers that are at two places, as seen through the lens that was found."""
    views = se3.inverse(fit.cameras)
    sights = whole_sights(table.with_prior(fit.lens).pixels)
    grown = fit.map.size / edges_of(table)
    sights = replace(sights, points=sights.points * grown[sights.marker][:, None, None])
    return find_moved(sights, fit.lens.intrinsics, views, fit.map.poses, off.noise / np.sqrt(2.0))

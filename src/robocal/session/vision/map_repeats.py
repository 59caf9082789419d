"""What `vision compare` finds: the scatter of several maps, and the markers that moved between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal.diagnose.vision_limits import MAPS_CHANCE, MAPS_SCALE, MARKER_MOVED_CHANCE, POSE_RIVAL
from robocal.files.display import listing_text
from robocal.files.map import MapFile, read_map
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.report.sections import Section
from robocal.session.verb_base import VerbResult
from robocal.vision.map_comparison import MapComparison, ShiftTest, compare_maps, find_shifts
from robocal.vision.map_gauge import take_markers
from robocal.vision.maps import MarkerMap

__all__ = ["ComparedMaps", "MapsDocument", "find_scatter"]

FEWEST = 3  # grid: markers that make a map


@record(kw_only=True)
class MapsDocument(Document):
    """maps.json: the maps, by how much each is larger than their mean, the reference marker, the scatter of each marker, chi2 of the
    scatter with its degrees of freedom where all maps state sigma, and the markers that moved."""

    maps: list[str]
    scale: list[float]
    reference: str
    markers: Listing
    chi2: float | None
    dof: int
    moved: Listing
    provenance: Origin


@record
class MarkerShift:
    """A marker that stands elsewhere in one map than in the first."""

    file: str
    test: ShiftTest
    other: str


@record(kw_only=True, eq=False)
class ComparedMaps(VerbResult):
    """Maps that were compared, and the markers that moved."""

    files: tuple[MapFile, ...]
    comparison: MapComparison
    moved: tuple[MarkerShift, ...]

    @property
    def names(self) -> list[str]:
        """What the maps are called."""
        return [f.file.file.stem for f in self.files]

    @cached_property
    def markers(self) -> Listing:
        """A row for each marker, by its distance from the reference."""
        found = self.comparison
        order = np.argsort(found.distance, kind="stable")
        deviation, (aligned, anchored) = 1e3 * found.deviation[order], found.pair_distances
        columns = [
            Column("marker", "", [found.names[i] for i in order.tolist()]),
            Column("distance", "mm", 1e3 * found.distance[order], digits=6, figures=4),
            *(Column(f"sd_{a}", "mm", deviation[:, i], digits=4, figures=3) for i, a in enumerate("xyz")),
        ]
        if found.predicted is not None:
            predicted = 1e3 * found.predicted[order]
            columns += [
                Column(f"predicted_{a}", "mm", predicted[:, i], digits=4, figures=3) for i, a in enumerate("xyz")
            ]
        for name, values in (("apart", aligned), ("apart_from_reference", anchored)):
            columns.append(Column(name, "mm", np.round(1e3 * values.max(axis=0)[order], 9), digits=4, figures=3))
        return Listing(tuple(columns))

    @cached_property
    def shifts(self) -> Listing:
        """A row for each marker that moved."""
        return Listing(
            (
                Column("marker", "", [m.test.name for m in self.moved]),
                Column("map", "", [m.file for m in self.moved]),
                Column("distance", "mm", np.array([1e3 * m.test.distance for m in self.moved]), figures=3),
                Column("turn", "deg", np.degrees(np.array([m.test.turn for m in self.moved])), figures=2),
                Column("or", "", [m.other for m in self.moved]),
            )
        )

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        facts = (("Maps", ", ".join(self.names)), ("Markers", f"{len(self.comparison.names)} in all maps"))
        return {"title": "Maps of the same markers", "kind": "Repeatability", "facts": facts}

    @property
    def document(self) -> MapsDocument:
        """What --json says."""
        found = self.comparison
        return self.document_of(
            MapsDocument, maps=self.names, scale=found.scale.tolist(), reference=found.reference, markers=self.markers, chi2=found.chi2,
            dof=found.dof, moved=self.shifts,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The document, the table and the pictures."""
        from robocal.report.map_scatter import draw_axes, draw_distances

        return {
            "maps.json": json_text(self.document),
            "markers.csv": listing_text(self.markers),
            "distance.svg": draw_distances(self.comparison),
            "axes.svg": draw_axes(self.comparison),
        }

    def details(self) -> Iterator[Section]:
        """The pictures."""
        from robocal.report.repeats_page import compare_pictures

        yield from compare_pictures(self)


def find_scatter(o: Any, command: str = "") -> ComparedMaps:
    """Reads the maps and compares them. Raises InputError."""
    files = tuple(read_map(place) for place in o.maps)
    maps = [f.map for f in files]
    found = compare_maps(maps, o.reference)
    moved = tuple(
        m for f, other in zip(files[1:], found.maps[1:], strict=True) for m in _moved(f, found.maps[0], other)
    )
    said = [r for f in files for r in f.file.remarks]
    said += _remarks(files, maps, found, moved)
    return ComparedMaps(
        files=files,
        comparison=found,
        moved=moved,
        warnings=tuple(said),
        inputs=tuple(f.file for f in files),
        command=command,
    )


def _moved(file: MapFile, first: MarkerMap, other: MarkerMap) -> list[MarkerShift]:
    """Markers that moved from the first map to another, one by one: each by more than the others differ without it."""
    out: list[MarkerShift] = []
    names = list(first.names)
    while len(names) > FEWEST and first.covariance is not None and other.covariance is not None:
        tests = sorted(find_shifts(take_markers(first, names), take_markers(other, names)), key=lambda t: -t.chi2)
        worst, rest = tests[0], [n for n in names if n != tests[0].name]
        left = compare_maps([take_markers(m, rest) for m in (first, other)])
        noise = max((left.chi2 or 0.0) / max(left.dof, 1), 1.0)
        if scipy.special.chdtrc(worst.dof, worst.chi2 / noise) * len(first.names) > MARKER_MOVED_CHANCE:
            break
        alike = [t.name for t in tests[1:] if t.chi2 > worst.chi2 + 2 * noise * np.log(POSE_RIVAL)]
        out.append(MarkerShift(file.file.file.name, worst, alike[0] if alike else ""))
        names = rest
    return out


def _remarks(
    files: Sequence[MapFile], maps: Sequence[MarkerMap], found: MapComparison, moved: Sequence[MarkerShift]
) -> Iterator[Remark]:
    for m in moved:
        away = Quantity(m.test.distance, "m")
        yield Remark.of(Code.MARKER_MOVED_BETWEEN, name=m.test.name, distance=away, file=m.file, other=m.other or None)
    every = dict.fromkeys(n for m in maps for n in m.names)
    if lacking := tuple(n for n in every if n not in found.names):
        yield Remark.of(Code.MAPS_OF_OTHER_MARKERS, count=len(lacking), names=lacking)
    for f, scale in zip(files, found.scale.tolist(), strict=True):
        if abs(scale) > MAPS_SCALE:
            word = "larger" if scale > 0 else "smaller"
            yield Remark.of(Code.MAPS_SCALED, file=f.file.file.name, share=f"{100 * abs(scale):.2g} %", word=word)
    rest = [n for n in found.names if n not in {m.test.name for m in moved}]
    if len(rest) >= FEWEST:
        without = compare_maps([take_markers(m, rest) for m in found.maps])
        if without.chi2 is not None and scipy.special.chdtrc(without.dof, without.chi2) < MAPS_CHANCE:
            yield Remark.of(Code.MAPS_APART, times=float(np.sqrt(without.chi2 / without.dof)))

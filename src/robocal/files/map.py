"""Files of maps of markers, read and written: robocal's own map.yaml and JSON, TagSLAM, MarkerMapper of ArUco, PLY.

robocal: 1
kind: map
dictionary: 36h11
units: {length: mm, angle: deg}
markers:                                  # T_map_marker; z out of the printed side, x right, y up; sigma: x y z, and turns about these axes
  - {id: 60, size: 120, xyz: [6.35, 126.7, 550.5], rotation_vector: [69.3, 69.3, 69.3], sigma: [0.1, 0.1, 0.2, 0.02, 0.02, 0.01]}
covariance: map.covariance.csv            # of all together, in m and rad; the file is read without it where it is not there
size_sigma: 0.2                           # what sizes as they were told could be off by, all alike, and each in percent:
size_scatter: 0.3                         # where sizes were found beside the places
lens: {model: brown, known: [fx, fy], given: [1200, ...], found: [1203.1, ...]}   # numbers that were free; all as given and found
source: what it was made from

The covariance is a table of its own: one row and one column for each of x y z rx ry rz of every
marker, behind them one for the edge of each, where sizes were found, and one for each number of the lens that was free. JSON has it
in itself, in m, rad and px.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from pydantic import FiniteFloat

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import FormatError, look_up
from robocal.files.lens_of_map import MapLensModel, lens_lines, lens_symbols, split_lens
from robocal.files.map_covariance import map_covariance_text, read_map_covariance
from robocal.files.other_maps import mapper_text, ply_map_text, read_mapper, read_ply_map, spaced
from robocal.files.plain import json_text
from robocal.files.schema import FileModel, Name, Triple, UnitsModel, Version, validate
from robocal.files.tagslam import read_tagslam, tagslam_text
from robocal.files.text import InputFile, Source, read_text
from robocal.files.units import Units, number, parse_unit
from robocal.files.yamlio import YamlDocument, parse, quote
from robocal.remarks.remark import Remark
from robocal.vision.maps import MarkerMap

__all__ = ["COVARIANCE_SUFFIX", "MAP_FORMS", "MapFile", "is_map", "map_covariance_text", "map_text", "read_map"]

LIMIT = 32 << 20  # bytes
COVARIANCE_SUFFIX = ".covariance.csv"
EXPECTED = "map.yaml of robocal, tagslam.yaml of TagSLAM, a MarkerMap of ArUco, or a PLY of corners"


@record(eq=False)
class MapFile:
    """The maps of a file, the file, and the format: a key of MAP_FORMS. Several maps are groups of markers whose places to one another the
    file does not say: boards without a pose."""

    maps: tuple[MarkerMap, ...]
    file: InputFile
    form: str

    @property
    def map(self) -> MarkerMap:
        """The one map. Raises FormatError where groups of its markers have no place to one another."""
        if len(self.maps) > 1:
            groups = "; ".join(", ".join(m.names[:3]) + (", ..." if len(m.names) > 3 else "") for m in self.maps[:4])
            raise FormatError(
                f"{len(self.maps)} groups of markers have no place to one another", file=self.file.file, found=groups,
                expected="poses of all of them: vision map with --prior and this file finds them",
            )  # fmt: skip
        return self.maps[0]


# --- robocal's own --------------------------------------------------------------------------------------------------------


class MapMarkerModel(FileModel):
    """One marker of map.yaml."""

    id: int | Name
    size: FiniteFloat
    xyz: Triple
    rotation_vector: Triple
    sigma: list[FiniteFloat] | None = None


BADLY = 0.5  # tolerance: of an edge, as what all may be off by


class MapModel(FileModel):
    """map.yaml as it is written."""

    robocal: Version
    kind: Literal["map"]
    dictionary: str | None = None
    units: UnitsModel
    markers: list[MapMarkerModel]
    covariance: str | list[list[FiniteFloat]] | None = None
    size_sigma: FiniteFloat | None = None
    size_scatter: FiniteFloat | None = None
    lens: MapLensModel | None = None
    source: str = ""


def _read_own(document: YamlDocument, name: str) -> tuple[tuple[MarkerMap, ...], tuple[Remark, ...]]:
    kind = document.data.get("kind")
    document.insist(kind == "map", "this is no map", ("kind",), found=kind, expected="kind: map")
    given = validate(MapModel, document)
    units = Units(
        *(
            parse_unit(
                getattr(given.units, k), si, file=document.path, row=document.row(("units", k)), key=f"units.{k}"
            )
            for k, si in (("length", "m"), ("angle", "rad"))
        )
    )
    document.insist(given.markers, "a map without markers", ("markers",))
    names = tuple(str(m.id) for m in given.markers)
    for i, (id_, m) in enumerate(zip(names, given.markers, strict=True)):
        at = ("markers", i)
        document.insist(id_ not in names[:i], "a marker stands twice", (*at, "id"), found=id_)
        document.insist(m.size > 0, f"marker {id_}: not a size", (*at, "size"), found=m.size, expected="above 0")
        sigma = m.sigma
        if sigma is not None:
            six = len(sigma) == 6 and min(sigma) >= 0
            expected = "six numbers from 0 on: x y z rx ry rz"
            document.insist(
                six, f"marker {id_}: not standard deviations", (*at, "sigma"), found=sigma, expected=expected
            )
    with_sigma = [m.sigma is not None for m in given.markers]
    if any(with_sigma) and not all(with_sigma):
        i = with_sigma.index(False)
        document.fail(
            f"marker {names[i]} has no sigma, others have one", ("markers", i), expected="all of them, or none"
        )
    vector = np.hstack(
        [
            units.length.to_si(np.array([m.xyz for m in given.markers])),
            units.angle.to_si(np.array([m.rotation_vector for m in given.markers])),
        ]
    )
    size = units.length.to_si(np.array([m.size for m in given.markers]))
    scale = np.array([units.length.factor] * 3 + [units.angle.factor] * 3)
    sigma = None if not all(with_sigma) else (np.array([m.sigma for m in given.markers]) * scale).ravel()
    through = lens_symbols(document, given.lens)
    covariance, remarks = read_map_covariance(document, given.covariance, names, sigma, through)
    covariance, lens = (
        (covariance, None) if remarks or given.lens is None else split_lens(covariance, given.lens, len(names))
    )
    made = MarkerMap(names, size, vector, covariance, given.dictionary, given.source or document.path.name)
    for key in ("size_sigma", "size_scatter"):
        value = getattr(given, key)
        document.insist(
            value is None or value >= 0, "not a standard deviation", (key,), found=value, expected="0 or more"
        )
    if given.size_sigma is not None:
        bad = float(units.length.to_si(np.array(given.size_sigma))) > BADLY * size.min(initial=np.inf)
        expected = f"at most half of the smallest marker, in {units.length.name}"
        document.insist(
            not bad, "no marker is known as badly", ("size_sigma",), found=given.size_sigma, expected=expected
        )
    edges = covariance is not None and len(covariance) > 6 * len(names)
    for key in () if edges or remarks else ("size_sigma", "size_scatter"):
        # Today's sizes would count beside those that the places were found with.
        expected = "a covariance with a column for each edge, as robocal vision map writes it; or no size_sigma and size_scatter"
        message = "the covariance does not say what places and sizes share"
        document.insist(getattr(given, key) is None, message, (key,), found=getattr(given, key), expected=expected)
    if edges and covariance is not None:
        both = given.size_sigma is not None and given.size_scatter is not None
        expected = "both beside a covariance that holds edges"
        document.insist(both, "size_sigma or size_scatter is missing", ("covariance",), expected=expected)
        own = 6 * len(names)
        told = float(units.length.to_si(np.array(given.size_sigma))), 1e-2 * float(given.size_scatter or 0.0)
        made = replace(made, covariance=covariance[:own, :own], size_covariance=covariance[own:], size_errors=told)
    return (replace(made, lens=lens),), remarks


def _own_text(known: MarkerMap, beside: str) -> str:
    units = Units()
    lines = [
        "# Places of markers, by robocal: T_map_marker, x right, y up and z out of the printed side.",
        "# sigma: of x y z, and of turns about the axes of the map; of the map as a whole nothing is counted.",
        "robocal: 1",
        "kind: map",
    ]
    if known.family is not None:
        lines.append(f"dictionary: {quote(known.family)}")
    lines += [f"units: {{length: {units.length.name}, angle: {units.angle.name}}}", "markers:"]
    sigma = None if known.covariance is None else np.sqrt(np.diag(known.covariance)).reshape(-1, 6)
    for i, (name, size, vector) in enumerate(zip(known.names, known.size, known.vector, strict=True)):
        parts = [
            f"id: {name if _is_number(name) else json.dumps(name, ensure_ascii=False)}",
            f"size: {number(float(units.length.from_si(size)))}",
            f"xyz: {_list(units.length.from_si(vector[:3]), 6)}",
            f"rotation_vector: {_list(units.angle.from_si(vector[3:]), 8)}",
        ]
        if sigma is not None:
            both = [*units.length.from_si(sigma[i, :3]), *units.angle.from_si(sigma[i, 3:])]
            parts.append(f"sigma: [{', '.join(number(float(f'{v:.6g}')) for v in both)}]")
        lines.append(f"  - {{{', '.join(parts)}}}")
    if known.covariance is not None and beside:
        lines.append(f"covariance: {json.dumps(beside, ensure_ascii=False)}    # of all together, m and rad")
        if known.size_errors is not None:
            shift, scatter = (
                float(f"{v:.6g}") for v in (units.length.from_si(known.size_errors[0]), 100 * known.size_errors[1])
            )
            lines += [
                f"size_sigma: {number(shift)}    # sizes as told: all alike",
                f"size_scatter: {number(scatter)}    # each, in percent",
            ]
        lines += lens_lines(known.lens)
    if known.source:
        lines.append(f"source: {quote(known.source)}")
    return "\n".join(lines) + "\n"


def _is_number(name: str) -> bool:
    return name.isascii() and name.isdigit() and str(int(name)) == name


def _list(values: Array, decimals: int) -> str:
    """To a nanometre, and as fine in angle: JSON has every bit."""
    return f"[{', '.join(number(v) for v in (np.round(values, decimals) + 0.0).tolist())}]"


def _json_text(known: MarkerMap, beside: str) -> str:
    markers = [
        {"id": int(n) if _is_number(n) else n, "size": float(s), "xyz": v[:3], "rotation_vector": v[3:]}
        for n, s, v in zip(known.names, known.size, known.vector.tolist(), strict=True)
    ]
    parts: dict[str, Any] = {"robocal": 1, "kind": "map", "dictionary": known.family}
    parts |= {"units": {"length": "m", "angle": "rad"}, "markers": markers}
    if known.size_errors is not None:
        parts |= {"size_sigma": known.size_errors[0], "size_scatter": 100 * known.size_errors[1]}
    if (lens := known.lens) is not None:
        parts["lens"] = {"model": lens.model, "known": lens.known, "given": lens.before, "after": lens.after}
    parts |= {"covariance": known.joint, "source": known.source}
    return json_text({k: v for k, v in parts.items() if v is not None})


# --- all ------------------------------------------------------------------------------------------------------------------

Write = Callable[[MarkerMap, str], str]
MAP_FORMS: dict[str, Write] = {
    "robocal": _own_text, "json": _json_text, "tagslam": tagslam_text, "markermapper": mapper_text, "ply": ply_map_text,
}  # fmt: skip


def map_text(known: MarkerMap, form: str = "robocal", beside: str = "") -> str:
    """The text of a map in one of MAP_FORMS; `beside` names the table of `map_covariance_text`, where one is written. Raises ModelError
    where the format cannot say it."""
    return look_up(MAP_FORMS, form, "no such format of maps")(known, beside)


def read_map(path: str | os.PathLike[str]) -> MapFile:
    """Reads a map in any of MAP_FORMS. Raises FileError, or FormatError naming line, key and marker."""
    source = read_text(path, limit=LIMIT)
    file = InputFile(source.path, source.sha256)
    if source.text.startswith("ply"):
        return MapFile((read_ply_map(source),), file, "ply")
    if source.text.startswith("<"):
        raise FormatError("this is XML", file=source.path, row=1, expected=EXPECTED)
    document, form = _open(source)
    remarks: tuple[Remark, ...] = ()
    if form == "tagslam":
        maps = read_tagslam(document)
    elif form == "markermapper":
        maps = (read_mapper(document),)
    else:
        maps, remarks = _read_own(document, source.path.name)
    return MapFile(maps, replace(file, remarks=remarks), form)


def is_map(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a map by its form, however wrong it may be. Raises FileError, or FormatError for what is no document at all."""
    source = read_text(path, limit=LIMIT)
    if source.text.startswith(("ply", "<")):
        return True
    document, form = _parse(source)
    return form in ("tagslam", "markermapper") or document.data.get("kind") == "map"


def _open(source: Source) -> tuple[YamlDocument, str]:
    """The document and its format."""
    document, form = _parse(source)
    keys = document.data
    if not form:
        old = "static_objects" in keys
        found = "an older TagSLAM's static_objects" if old else f"the keys {', '.join(list(keys)[:4])}"
        document.fail("this is no map", (), found=found, expected=EXPECTED)
    return document, form


def _parse(source: Source) -> tuple[YamlDocument, str]:
    """The document and its format, empty where it is none of them."""
    if source.text.lstrip().startswith("{"):
        try:
            data = json.loads(source.text)
        except json.JSONDecodeError as error:
            raise FormatError(f"not valid JSON: {error.msg}", file=source.path, row=error.lineno) from None
        except (RecursionError, ValueError):
            raise FormatError("not valid JSON", file=source.path) from None
        document, own = YamlDocument(source.path, source.text, source.sha256, data), "json"
    else:
        document, own = parse(replace(source, text=spaced(source.text))), "robocal"
    keys = document.data
    form = (
        own
        if "robocal" in keys
        else "tagslam"
        if "bodies" in keys
        else "markermapper"
        if "aruco_bc_markers" in keys
        else ""
    )
    return document, form

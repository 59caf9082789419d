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
source: what it was made from

The covariance is a table of its own: one row and one column for each of x y z rx ry rz of every
marker, and behind them one for the edge of each, where sizes were found. JSON has it in itself, in m and rad.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import FiniteFloat

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import FormatError, ModelError, look_up
from robocal.files.csvtable import csv_columns, read_csv
from robocal.files.other_maps import mapper_text, ply_map_text, read_mapper, read_ply_map, spaced
from robocal.files.plain import json_text
from robocal.files.schema import FileModel, Name, Triple, UnitsModel, Version, validate
from robocal.files.tagslam import read_tagslam, tagslam_text
from robocal.files.text import InputFile, Source, read_text
from robocal.files.units import Units, number, parse_unit
from robocal.files.yamlio import YamlDocument, parse, quote
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.vision.maps import MarkerMap

__all__ = ["COVARIANCE_SUFFIX", "MAP_FORMS", "MapFile", "is_map", "map_covariance_text", "map_text", "read_map"]

LIMIT = 32 << 20  # bytes
COVARIANCE_SUFFIX = ".covariance.csv"
EXPECTED = "map.yaml of robocal, tagslam.yaml of TagSLAM, a MarkerMap of ArUco, or a PLY of corners"
SAME_SIGMA = 1e-3  # tolerance: of a sigma as map.yaml has it, with six digits, and as its covariance has it
ROUNDING = 1e-6  # tolerance: of the halves of a covariance, and below 0, of its largest


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
    covariance, remarks = _covariance(document, given.covariance, names, sigma)
    made = MarkerMap(names, size, vector, covariance, given.dictionary, given.source or document.path.name)
    for key in ("size_sigma", "size_scatter"):
        value = getattr(given, key)
        document.insist(
            value is None or value >= 0, "not a standard deviation", (key,), found=value, expected="0 or more"
        )
    if covariance is not None and len(covariance) > 6 * len(names):
        both = given.size_sigma is not None and given.size_scatter is not None
        expected = "both beside a covariance that holds edges"
        document.insist(both, "size_sigma or size_scatter is missing", ("covariance",), expected=expected)
        own = 6 * len(names)
        told = float(units.length.to_si(np.array(given.size_sigma))), 1e-2 * float(given.size_scatter or 0.0)
        made = replace(made, covariance=covariance[:own, :own], size_covariance=covariance[own:], size_told=told)
    return (made,), remarks


def _covariance(
    document: YamlDocument, given: str | list[list[float]] | None, names: Sequence[str], sigma: Array | None
) -> tuple[Array | None, tuple[Remark, ...]]:
    """The covariance that a map states, of its table where that is there, else of its sigmas alone."""
    if given is None:
        return None if sigma is None else np.diag(sigma**2), ()
    if isinstance(given, str):
        plain = given and Path(given).name == given
        document.insist(plain, "not the name of a file beside this one", ("covariance",), found=given)
        document.insist(sigma is not None, "a covariance, but markers without sigma", ("covariance",))
        assert sigma is not None
        place = document.path.parent / given
        if not place.exists():
            facts = {"file": str(document.path), "table": given}
            return np.diag(sigma**2), (Remark.of(Code.MAP_COVARIANCE_MISSING, **facts),)
        matrix = _read_table(place, names)
        where: dict[str, Any] = {"file": place}
    else:
        for i, row in enumerate(given):
            if len(row) != len(given) or len(given) not in (6 * len(names), 7 * len(names)):
                expected = f"{6 * len(names)}, six for each marker, or {7 * len(names)} with edges"
                document.fail("wrong number of values", ("covariance", i), found=len(row), expected=expected)
        document.insist(given, "wrong number of rows", ("covariance",), found=0)
        matrix = np.array(given, dtype=float)
        where = {"file": document.path, "key": "covariance"}
    _check_matrix(matrix, names, where)
    own = np.sqrt(np.diag(matrix)[: 6 * len(names)])
    if sigma is not None and (np.abs(own - sigma) > SAME_SIGMA * np.maximum(own, sigma)).any():
        i = int(np.argmax(np.abs(own - sigma) / np.maximum(own, sigma).clip(1e-30)))
        raise FormatError(
            f"the covariance is of another map than {document.path.name}", found=f"{own[i]:.4g} for {_titles(names)[i]}",
            expected=f"sigma as the map has it, {sigma[i]:.4g}", **where,
        )  # fmt: skip
    return (matrix + matrix.T) / 2, ()


def _check_matrix(matrix: Array, names: Sequence[str], where: dict[str, Any]) -> None:
    """Raises FormatError for what no covariance is. No motion of the whole map is counted in it, so it has directions of variance 0."""
    least = int(np.argmin(np.diag(matrix)))
    if matrix[least, least] < 0:
        raise FormatError("a variance below 0", found=_titles(names)[least], **where)
    size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    uneven = np.abs(matrix - matrix.T) > ROUNDING * size
    if uneven.any():
        i, j = np.argwhere(uneven)[0]
        titles = _titles(names)
        raise FormatError("the covariance is not symmetric", found=f"{titles[i]} with {titles[j]}", **where)
    # Of equal units: each row over its standard deviation.
    root = np.sqrt(np.where(np.diag(matrix) > 0, np.diag(matrix), 1.0))
    values = np.linalg.eigvalsh(matrix / np.outer(root, root))
    if values[0] < -ROUNDING * max(values[-1], 1.0):
        raise FormatError("not a covariance: a variance below 0 in some direction", found=float(values[0]), **where)


def _titles(names: Sequence[str]) -> list[str]:
    """Of places, and behind them of edges, where these are."""
    return [*(f"{n}.{s}" for n in names for s in FRAME_SYMBOLS), *(f"{n}.edge" for n in names)]


def _unit(i: int, names: Sequence[str]) -> str:
    return "rad" if i % 6 > 2 and i < 6 * len(names) else "m"


def _read_table(place: Path, names: Sequence[str]) -> Array:
    table = read_csv(place)
    wanted = _titles(names)
    if len(table.names) == 6 * len(names):
        wanted = wanted[: 6 * len(names)]
    if list(table.names) != wanted or len(table) != len(wanted):
        wrong = next((a for a, b in zip(table.names, wanted, strict=False) if a != b), f"{len(table)} rows")
        expected = f"{len(wanted)} columns and rows, {wanted[0]} to {wanted[-1]}, as the map has its markers"
        raise FormatError("the covariance is of other markers than the map", file=place, found=wrong, expected=expected)
    for i, title in enumerate(wanted):
        si = _unit(i, names)
        if table.units[i] != si:
            raise FormatError("another unit", file=place, column=title, found=table.units[i], expected=si)
    return table.numbers(wanted)


def map_covariance_text(known: MarkerMap) -> str:
    """The table of a map's covariance, m and rad. Raises ModelError where it states none."""
    if known.covariance is None:
        raise ModelError("this map states no covariance", expected="one that was found from images")
    joint = known.joint
    assert joint is not None
    heads = [f"{t} [{_unit(i, known.names)}]" for i, t in enumerate(_titles(known.names)[: len(joint)])]
    return csv_columns(heads, [[f"{v:.12g}" for v in column] for column in joint.T.tolist()])


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
        if known.size_told is not None:
            shift, scatter = (
                float(f"{v:.6g}") for v in (units.length.from_si(known.size_told[0]), 100 * known.size_told[1])
            )
            lines += [
                f"size_sigma: {number(shift)}    # sizes as told: all alike",
                f"size_scatter: {number(scatter)}    # each, in percent",
            ]
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
    if known.size_told is not None:
        parts |= {"size_sigma": known.size_told[0], "size_scatter": 100 * known.size_told[1]}
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

"""Maps of markers of others as corners: MarkerMap of ArUco, PLY.

MarkerMap: corners from the top left clockwise, in m (mInfoType 1).
PLY: four vertices a marker in the same order, with `marker`; faces turn left seen from the printed side.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.errors import FormatError
from robocal.files.images import FAMILIES
from robocal.files.tagslam import marker_numbers, whole
from robocal.files.text import Source
from robocal.files.units import finite, number
from robocal.files.yamlio import Path_, YamlDocument, quote
from robocal.geometry import se3, so3
from robocal.quantities import LARGEST
from robocal.vision.maps import MarkerMap

__all__ = ["mapper_text", "ply_map_text", "read_mapper", "read_ply_map", "spaced"]

SQUARENESS = (
    0.02  # tolerance: how far corners may be from a square, of its edge: tape measures and numbers of a few digits
)


# --- MarkerMap of ArUco ---------------------------------------------------------------------------------------------------


def spaced(text: str) -> str:
    """A FileStorage as YAML of today: its first line and tags are none, and it writes {id:0}; lines stay."""
    if not text.startswith("%YAML:"):
        return text
    text = re.sub(r"^%YAML:[^\n]*", "#", text).replace("!!opencv-matrix", "")
    return re.sub(r"([{,]\s*)(\w+):(?=\S)", r"\1\2: ", text)


def read_mapper(document: YamlDocument) -> MarkerMap:
    """The markers of a MarkerMap in metres."""
    data = document.data
    kind = data.get("aruco_bc_mInfoType")
    if kind != 1:
        found = {0: "0, pixels", -1: "-1, none"}.get(kind, kind) if isinstance(kind, int) else kind
        document.fail("this map is not in metres", ("aruco_bc_mInfoType",), found=found, expected="1, metres")
    given = data["aruco_bc_markers"]
    document.insist(isinstance(given, list) and given, "not a list of markers", ("aruco_bc_markers",), found=given)
    count = data.get("aruco_bc_nmarkers")
    same = count in (None, len(given))
    document.insist(same, "another number of markers", ("aruco_bc_nmarkers",), found=count, expected=len(given))
    names, corners = [], []
    for i, marker in enumerate(given):
        at: Path_ = ("aruco_bc_markers", i)
        document.insist(isinstance(marker, dict), "not a marker", at, found=marker, expected="id, corners")
        id_ = str(whole(document, marker, "id", at))
        document.insist(id_ not in names, "a marker stands twice", (*at, "id"), found=id_)
        rows = marker.get("corners")
        good = isinstance(rows, list) and len(rows) == 4 and all(isinstance(r, list) and len(r) == 3 for r in rows)
        good = good and all(isinstance(v, int | float) and abs(v) < LARGEST for r in rows for v in r)
        document.insist(
            good, f"marker {id_}: not four corners", (*at, "corners"), found=rows, expected="[[x, y, z], ...]"
        )
        names.append(id_)
        corners.append(rows)
    family = None
    word = data.get("aruco_bc_dict")
    if isinstance(word, str):
        short = re.sub(r"^(dict_)?(aruco_|apriltag_?|tag)?", "", word.lower())
        family = "original" if word == "ARUCO" else short if short in FAMILIES else None

    def fail(i: int, share: float) -> None:
        at: Path_ = ("aruco_bc_markers", i, "corners")
        document.fail(
            f"marker {names[i]}: not a square", at, found=_off(share), expected="corners from the top left clockwise"
        )

    size, vector = _squares(np.array(corners, dtype=float), fail)
    return MarkerMap(tuple(names), size, vector, None, family, document.path.name)


def _off(share: float) -> str:
    return f"corners {100 * share:.2g} % of an edge from one"


def _squares(corners: Array, fail: Callable[[int, float], None]) -> tuple[Array, Array]:
    """Edges (M,) and poses (M, 6) of the squares nearest to four corners each (M, 4, 3); `fail` is called with the first that is none,
    and how far its corners are off, in edges."""
    middle = corners.mean(axis=1)
    x = (corners[:, 1] - corners[:, 0] + corners[:, 2] - corners[:, 3]) / 2
    y = (corners[:, 0] - corners[:, 3] + corners[:, 1] - corners[:, 2]) / 2
    size = (np.linalg.norm(x, axis=1) + np.linalg.norm(y, axis=1)) / 2
    flat = ~(size > 0)
    if flat.any():
        fail(int(np.argmax(flat)), 1.0)
    r = so3.project(np.stack([x, y, np.cross(x, y) / size[:, None]], axis=-1))
    vector = se3.to_vector(se3.compose(r, middle))
    made = MarkerMap(tuple(map(str, range(len(corners)))), size, vector)
    off = np.linalg.norm(made.corners - corners, axis=2).max(axis=1) / size
    if (off > SQUARENESS).any():
        i = int(np.argmax(off))
        fail(i, float(off[i]))
    return size, vector


def mapper_text(known: MarkerMap, beside: str = "") -> str:
    """A MarkerMap in metres, as cv::FileStorage reads it; it says nothing of sigma."""
    lines = ["%YAML:1.0", "---"]
    if known.family is not None:
        lines.append(f"aruco_bc_dict: {quote(_mapper_family(known.family))}")
    lines += [f"aruco_bc_nmarkers: {len(known.names)}", "aruco_bc_mInfoType: 1", "aruco_bc_markers:"]
    for id_, corners in zip(marker_numbers(known, "markermapper"), known.corners.tolist(), strict=True):
        rows = ", ".join(f"[ {', '.join(_real(v) for v in corner)} ]" for corner in corners)
        lines.append(f"   - {{ id:{id_}, corners:[ {rows} ] }}")
    return "\n".join(lines) + "\n"


def _mapper_family(family: str) -> str:
    """ArUco's own name of a dictionary; OpenCV's where it has none."""
    if family == "original":
        return "ARUCO"
    if family == "mip_36h12":
        return "ARUCO_MIP_36h12"
    return f"TAG{family}" if "h" in family else FAMILIES.get(family, family)


def _real(value: float) -> str:
    text = number(value)
    return text if any(c in text for c in ".e") else f"{text}."


# --- PLY ------------------------------------------------------------------------------------------------------------------

INK = 40, 40, 40  # colour of a marker whose sigma nobody knows
GOOD, BAD = np.array([30.0, 110, 200]), np.array([220.0, 60, 30])  # colours of the smallest and the largest sigma
PROPERTIES = ("x", "y", "z", "red", "green", "blue", "marker")


def ply_map_text(known: MarkerMap, beside: str = "") -> str:
    """Corners (ASCII, m) with colours by sigma, blue the best known marker and red the least, and a face a marker."""
    ids = marker_numbers(known, "ply")
    colours = np.tile(np.array(INK, dtype=float), (len(ids), 1))
    if known.covariance is not None:
        sigma = np.sqrt(np.diag(known.covariance).reshape(-1, 6)[:, :3].sum(axis=1))
        share = (sigma - sigma.min()) / (float(np.ptp(sigma)) or 1.0)
        colours = GOOD + (BAD - GOOD) * share[:, None]
    head = ["ply", "format ascii 1.0", "comment map of markers by robocal; coordinates in m"]
    if known.family is not None:
        head.append(f"comment dictionary {known.family}")
    head += [f"element vertex {4 * len(ids)}", *(f"property double {a}" for a in "xyz")]
    head += [*(f"property uchar {c}" for c in ("red", "green", "blue")), "property int marker"]
    head += [f"element face {len(ids)}", "property list uchar int vertex_indices", "end_header"]
    rows = []
    for id_, corners, colour in zip(ids, known.corners.tolist(), colours.round().astype(int).tolist(), strict=True):
        tail = f"{' '.join(map(str, colour))} {id_}"
        rows += [f"{' '.join(number(v) for v in corner)} {tail}" for corner in corners]
    faces = [f"4 {4 * i + 3} {4 * i + 2} {4 * i + 1} {4 * i}" for i in range(len(ids))]
    return "\n".join([*head, *rows, *faces]) + "\n"


def read_ply_map(source: Source) -> MarkerMap:
    """The markers of an ASCII PLY whose vertices are corners in m, four a marker one after the other, with the property `marker`."""
    lines = source.text.splitlines()

    def fail(message: str, row: int, **facts: Any) -> FormatError:
        return FormatError(message, file=source.path, row=row, **facts)

    if "end_header" not in lines:
        raise fail("a PLY without end_header", 1, expected="a header in text")
    top = lines.index("end_header")
    head = [line.split() for line in lines[:top]]
    if ["format", "ascii", "1.0"] not in head:
        raise fail("not a PLY in text", 2, expected="format ascii 1.0")
    family = next((w[2] for w in head if w[:2] == ["comment", "dictionary"] and len(w) == 3), None)
    elements = [w for w in head if w[:1] == ["element"]]
    first = elements[0] if elements else []
    if len(first) != 3 or first[1] != "vertex" or not first[2].isdigit():
        raise fail("vertices do not come first", 1, expected="element vertex N")
    begin = head.index(first) + 1
    end = next((i for i in range(begin, top) if head[i][:1] == ["element"]), top)
    names = [w[2] for w in head[begin:end] if w[:1] == ["property"] and len(w) == 3]
    for name in ("x", "y", "z", "marker"):
        if name not in names:
            raise fail("a property is missing", begin + 1, found=name, expected=", ".join(PROPERTIES))
    count = int(first[2])
    body = lines[top + 1 : top + 1 + count]
    if len(body) < count or count == 0 or count % 4:
        raise fail("not four corners a marker", top + 1, found=f"{len(body)} of {count} vertices")
    values = np.empty((count, 4))
    at = [names.index(name) for name in ("x", "y", "z", "marker")]
    for i, line in enumerate(body):
        cells = line.split()
        numbers = [finite(cells[k]) if k < len(cells) else None for k in at]
        if any(v is None or abs(v) >= LARGEST for v in numbers):
            raise fail("not a vertex", top + 2 + i, found=line, expected=", ".join(names))
        values[i] = [float(v) for v in numbers if v is not None]
    marker = values[:, 3].reshape(-1, 4)
    odd = (marker != marker[:, :1]).any(axis=1) | (marker[:, 0] != np.rint(marker[:, 0])) | (marker[:, 0] < 0)
    if odd.any():
        i = int(np.argmax(odd))
        raise fail("four corners of one marker do not follow one another", top + 2 + 4 * i, found=marker[i].tolist())
    ids = [str(int(v)) for v in marker[:, 0]]
    for i, id_ in enumerate(ids):
        if id_ in ids[:i]:
            raise fail("a marker stands twice", top + 2 + 4 * i, found=id_)

    def refuse_shape(i: int, share: float) -> None:
        raise fail(f"marker {ids[i]}: not a square", top + 2 + 4 * i, found=_off(share))

    size, vector = _squares(values[:, :3].reshape(-1, 4, 3), refuse_shape)
    return MarkerMap(tuple(ids), size, vector, None, family, source.path.name)

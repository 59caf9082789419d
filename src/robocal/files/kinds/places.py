"""Columns and keys of a data file for places that stay where they are while the arm moves (socket, plane, sphere, receiver), and for
contacts with them, which need no instrument: a ball in a socket, a ball on a plane, a probe on a sphere.

One place for the whole file (`place`), one per row (`place: COLUMN`, described under `places`), and for contacts also a known distance
between two (`between`). What is measured is that the tool touches, so a row is joint values alone; a column of deviations is read where
there is one (a probe that reports how far it is deflected).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, FiniteFloat

from robocal._types import Array, Ints
from robocal.errors import one_of
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import ColumnModel, DataModel, ScalarModel, Sigma, ValueModel, column_model
from robocal.files.kinds.kind import (
    FULL,
    XYZ,
    Around,
    KindFile,
    KindOutput,
    Part,
    QuantityColumns,
    Values,
    scalar,
    show_scalar,
    unit_rows,
)
from robocal.files.orientation import frame_vector
from robocal.files.schema import FileModel, FrameModel, Name, refuse
from robocal.files.units import UNITS, Units, number
from robocal.files.yamlio import YamlDocument, quote
from robocal.measure.data import Frame, Observations
from robocal.parameters import FRAME_SYMBOLS

__all__ = [
    "PLANE",
    "POINT",
    "SPHERE",
    "PlaceModel",
    "PlacedModel",
    "each_place",
    "frame_keys",
    "frame_line",
    "place_frames",
]

# What a contact leaves, by how many numbers that is.
CONTACTS = {
    1: QuantityColumns("contact", ("deviation",), ("s_contact",)),
    3: QuantityColumns("contact", ("dx", "dy", "dz"), ("sdx", "sdy", "sdz")),
}
OFFSET = QuantityColumns("offset", ("offset",), ())
# The faces of a cube: unit normals that point away from its centre.
FACES = {f"{sign}{axis}": (1 if sign == "+" else -1) * np.eye(3)[i] for i, axis in enumerate("xyz") for sign in "+-"}
NORMAL = ("nx", "ny", "nz")


class PlaceModel(FrameModel):
    """Where something stands in base coordinates; unknown unless stated."""

    name: Name | None = None


def _place(value: Any) -> Any:
    if isinstance(value, dict) and "column" not in value:
        return PlaceModel.model_validate(value)
    return column_model(value)


class PlacedModel(DataModel):
    """Data with something fixed beside the robot: `place` describes it, or says which column names it."""

    place: Annotated[Any, BeforeValidator(_place)] = None
    places: dict[Name, PlaceModel] = Field(default_factory=dict)


def _pair(value: Any) -> Any:
    if not isinstance(value, list) or len(value) != 2 or any(not isinstance(v, str) for v in value):
        refuse("not two places", found=value, expected="[a, b]")
    return value


class BetweenModel(FileModel):
    """Two places a known distance apart."""

    places: Annotated[Any, BeforeValidator(_pair)]
    distance: FiniteFloat
    unit: str | None = None
    sigma: Sigma = None


def frame_of(name: str, given: PlaceModel, free: Sequence[bool], around: Around, at: tuple[str | int, ...]) -> Frame:
    """T_base_place as a frame; what its kind can see of it is free unless stated. Raises FormatError for a name that is
    taken."""
    around.refuse_taken(name, at)
    # Turning a point moves nothing.
    flags = tuple(free) if given.free in (None, True) else given.free_flags(True)
    # Stated by hand it is right to a few centimetres; unknown it is anywhere in reach.
    expected = (0.1, 0.1) if given.given else (3.0, 3.0)
    return Frame(name, frame_vector(given, around.units), flags, "base", expected, given.has_details)


def frame_line(frame: Frame, units: Units, mount: bool = False) -> str:
    """A frame as one line of YAML: its name, what is not zero, and what is free."""
    return f"{quote(frame.name)}: {{{frame_keys(frame, units)}{f', mount: {frame.mount}' if mount else ''}}}"


def frame_keys(frame: Frame, units: Units) -> str:
    """The keys of a frame, without its name and mount."""
    words = []
    for word, unit, part in (("xyz", units.length, frame.value[:3]), ("rotation_vector", units.angle, frame.value[3:])):
        if any(part):
            words.append(f"{word}: [{', '.join(number(unit.from_si(v)) for v in part)}]")
    free = [s for s, f in zip(FRAME_SYMBOLS, frame.free, strict=True) if f]
    shown = f"[{', '.join(free)}]" if 0 < len(free) < 6 else str(bool(free)).lower()
    if frame.prior is not None:
        both = [*units.length.from_si(np.array(frame.prior[:3])), *units.angle.from_si(np.array(frame.prior[3:]))]
        words.append(f"sigma: [{', '.join(number(float(v)) for v in both)}]")
    return ", ".join([*words, f"free: {shown}"])


def place_frames(
    model: PlacedModel, free: Sequence[bool], around: Around, names: Sequence[str] = ()
) -> dict[str, Frame]:
    """The places of a file by name; `names` are those that are needed. Raises FormatError for one that is described
    nowhere while others are."""
    known = model.places or {name: PlaceModel() for name in names}
    for name in names:
        if name not in known:
            around.document.fail("unknown place", ("places",), found=name, **one_of(name, known))
    return {name: frame_of(name, given, free, around, ("places", name)) for name, given in known.items()}


def each_place(
    model: PlacedModel, values: Values, free: Sequence[bool], around: Around
) -> Iterator[tuple[Part, dict[str, Frame]]]:
    """The rows of every place as a part whose options hold it, with all the places of the file."""
    table = around.table
    if not isinstance(model.place, ColumnModel):
        given = model.place or PlaceModel()
        if model.places:
            around.document.fail("several places, and no column that says which", ("place",), expected="place: COLUMN")
        frame = frame_of(given.name or around.name, given, free, around, ("place", "name"))
        yield _part(values, np.arange(len(table)), frame), {frame.name: frame}
        return
    cells = table.texts(model.place.column)
    label = table.label(table.find(model.place.column))
    for row, cell in enumerate(cells):
        if model.places and cell not in model.places:
            raise table.fail("unknown place", row, label, found=cell, **one_of(cell, model.places))
        if any(c in cell for c in ".,;:\"'"):
            raise table.fail("not a usable name", row, label, found=cell, expected="a word without dots or commas")
    frames = place_frames(model, free, around, tuple(dict.fromkeys(cells)))
    for name in dict.fromkeys(cells):
        rows = np.flatnonzero(np.array([c == name for c in cells]))
        yield _part(values, rows, frames[name]), frames


def _part(values: Values, rows: Ints, frame: Frame) -> Part:
    return Part(rows, values.take(rows).with_options({"place": frame}), frame.name)


def between(
    models: Sequence[BetweenModel], frames: Mapping[str, Frame], touched: Mapping[str, int], around: Around
) -> Iterator[Part]:
    """One distance for every pair of places that are a known distance apart, filed under the row that `touched` tells of
    the first: with that it is held out. Raises FormatError for an unknown place."""
    for i, given in enumerate(models):
        at = ("between", i) if len(models) > 1 else ("between",)
        for name in given.places:
            if name not in frames:
                around.document.fail("unknown place", (*at, "places"), found=name, **one_of(name, frames))
        a, b = given.places
        if a == b:
            around.document.fail("the two places are the same", (*at, "places"), found=a, expected="two places")
        if given.distance <= 0:
            around.document.fail("not a distance", (*at, "distance"), found=given.distance, expected="above 0")
        unit = around.units.length
        if given.unit is not None:
            unit = around.document.unit(given.unit, "m", (*at, "unit"), "between.unit")
        if isinstance(given.sigma, FileModel):
            around.document.fail("not a standard deviation", (*at, "sigma"), expected="a number above 0")
        sigma = None if given.sigma is None else np.array([[unit.to_si(given.sigma)]])
        yield Part(
            np.array([touched.get(a, touched.get(b, 0))]),
            Values(np.array([[unit.to_si(given.distance)]]), sigma, options={"ends": (frames[a], frames[b])}),
            group=f"{a}-{b}",
            kind="distance",
            targeted=False,
            nowhere=True,
        )


def _several(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


class ContactModel(PlacedModel):
    """A contact, and how far it may be off: `contact: {sigma, unit}`."""

    contact: ValueModel | None = None


class PointModel(ContactModel):
    """A ball in sockets, or a probe on spheres, some of which may be a known distance apart."""

    between: Annotated[list[BetweenModel], BeforeValidator(_several)] = Field(default_factory=list)


class SphereModel(PointModel):
    """A probe on spheres; the radius is that of the sphere and the probe's ball together."""

    radius: ScalarModel | None = None


class CubeModel(FileModel):
    """A datum cube: the column with the touched face (+x, -x, ...), and its edge."""

    column: str | int
    edge: FiniteFloat


class PlaneModel(ContactModel):
    """A ball on planes; or on the faces of a cube, or on planes of one body by normal and offset."""

    radius: ScalarModel | None = None
    cube: CubeModel | None = None
    normal: ValueModel | None = None
    offset: Annotated[Any, BeforeValidator(lambda v: v if v is None else column_model(v))] = None


def read_point(model: PointModel, table: CsvTable, document: YamlDocument) -> Values:
    """Deviations in m, normally 0: (k, 3) of a point, (k, 1) of a sphere."""
    return CONTACTS[1 if isinstance(model, SphereModel) else 3].deviations(model.contact, table, document)


def read_plane(model: PlaneModel, table: CsvTable, document: YamlDocument) -> Values:
    """Deviations (k, 1) in m, normally 0; normals (k, 3) and offsets (k,) where they differ by row."""
    values = CONTACTS[1].deviations(model.contact, table, document)
    if model.cube is not None and (model.normal is not None or model.offset is not None):
        document.fail("planes are stated twice", ("cube",), expected="cube, or normal and offset")
    extra: dict[str, Array] = {}
    if model.normal is not None:
        names = list(NORMAL) if model.normal.columns is None else model.normal.columns
        if len(names) != 3:
            document.fail("wrong number of columns", ("normal", "columns"), found=len(names), expected="3: nx, ny, nz")
        extra["normal"] = unit_rows(table.numbers(names), table, names, "normal")
    if model.offset is not None:
        stated = ValueModel(columns=[model.offset.column], unit=model.offset.unit)
        extra["offset"] = OFFSET.numbers(stated, table, document)[0][:, 0]
    if model.cube is not None:
        extra["normal"] = _faces(model.cube, table)
    return replace(values, extra=extra)


def _faces(cube: CubeModel, table: CsvTable) -> Array:
    cells = table.texts(cube.column)
    words = [cell if cell[:1] in "+-" else f"+{cell}" for cell in cells]
    if (row := next((i for i, word in enumerate(words) if word not in FACES), None)) is not None:
        label, found = table.label(table.find(cube.column)), cells[row]
        raise table.fail("not a face of a cube", row, label, found=found, **one_of(found, FACES))
    return np.array([FACES[word] for word in words])


def _with_distances(model: PointModel, values: Values, around: Around) -> Sequence[Part]:
    """One part for every place, and one distance for every pair that is a known distance apart."""
    parts, known = zip(*each_place(model, values, XYZ, around), strict=True)
    touched = {part.group: int(part.rows[0]) for part in parts}
    return [*parts, *between(model.between, known[0], touched, around)]


def sphere_parts(model: SphereModel, values: Values, around: Around) -> Sequence[Part]:
    """The same; all spheres share the radius."""
    if model.radius is not None and model.radius.value is not None and model.radius.value <= 0:
        around.document.fail("not a radius", ("radius", "value"), found=model.radius.value, expected="above 0")
    options = {"radius": around.name, **scalar(model.radius, "m", "radius", around)}
    return _with_distances(model, values.with_options(options), around)


def plane_parts(model: PlaneModel, values: Values, around: Around) -> Sequence[Part]:
    """One part for every plane or body."""
    extra = dict(values.extra)
    if model.cube is not None:
        if model.cube.edge <= 0:
            around.document.fail("not a length", ("cube", "edge"), found=model.cube.edge, expected="above 0")
        extra["offset"] = np.full(len(values.value), around.units.length.to_si(model.cube.edge) / 2)
    # A pointed tool is a ball of no size.
    if model.radius is not None and model.radius.value is not None and model.radius.value < 0:
        around.document.fail("not a radius", ("radius", "value"), found=model.radius.value, expected="0 or above")
    shared = replace(values, extra=extra).with_options(scalar(model.radius, "m", "radius", around))
    # A plate shows three of the six, which three depends on where it looks: those that are not seen are dropped.
    return [part for part, _ in each_place(model, shared, FULL, around)]


def write_contact(obs: Observations, units: Units) -> KindOutput:
    """The sigma, and deviations where there are any; normals, offsets and the radius, where they are known."""
    size = obs.value.shape[1]
    quantity = CONTACTS[size]
    made, lines = quantity.columns(obs, units), [quantity.line(obs)]
    if not obs.value.any():
        made, lines = made[size:], [quantity.line(obs, f"unit: {units.length.name}")]
    if "normal" in obs.extra:
        made += tuple((n, UNITS["1"], obs.extra["normal"][:, i]) for i, n in enumerate(NORMAL))
        lines.append("normal: {columns: [nx, ny, nz]}")
    if "offset" in obs.extra:
        made += (("offset", units.length, obs.extra["offset"]),)
        lines.append("offset: offset")
    return KindOutput(made, (*lines, *show_scalar("radius", obs.options, units.length)))


POINT_KEYS = """contact: {{unit: {length}, sigma: 0.02}}    # how well the ball sits
place: place    # the column that names the socket; one socket: {{name: socket, xyz: [...]}}
# places: {{a: {{xyz: [{near}]}}}}    # roughly where they stand; by default unknown
# between: {{places: [a, b], distance: 50, sigma: 0.01, unit: {length}}}    # sockets a known distance apart
"""
POINT = KindFile(PointModel, read_point, write_contact, POINT_KEYS, XYZ, _with_distances, XYZ)
SPHERE_KEYS = """contact: {{unit: {length}, sigma: 0.01}}    # how well the probe touches
place: place    # the column that names the sphere; one sphere: {{name: sphere, xyz: [...]}}
radius: {{name: sphere, value: {ball}, unit: {length}, free: false}}    # sphere and probe together; unknown: free: true
# between: {{places: [a, b], distance: 300, sigma: 0.01, unit: {length}}}    # centres a known distance apart: the scale
"""
SPHERE = KindFile(SphereModel, read_point, write_contact, SPHERE_KEYS, XYZ, sphere_parts, XYZ)
PLANE_KEYS = """contact: {{unit: {length}, sigma: 0.02}}    # how well the ball touches
place: place    # the column that names the plane; one plane: {{name: plate}}
# radius: {{name: ball, value: 5, unit: {length}, free: false}}    # of the ball on the tool; default: the tool's point touches
# cube: {{column: face, edge: 100}}    # faces +x, -x, +y, ... of a datum cube, whose centre is the place
"""
PLANE = KindFile(PlaneModel, read_plane, write_contact, PLANE_KEYS, XYZ, plane_parts, FULL)

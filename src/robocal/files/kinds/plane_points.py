"""Points in the image of a probe: where wires or points of a phantom were seen, in pixels.

image: {columns: [u, v], pixel: [0.08, 0.08]}     the size of a pixel along u and v, where it is known roughly
wires: {G1: {front: [30, 0, 20], back: [30, 40, 20]}}     two points of each wire, in the phantom's frame
points: {bead: [10, 0, 5]}                                points in place of wires
position, orientation                             where the probe is, of a rig whose poses are known
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, FiniteFloat

from robocal.errors import ModelError, one_of
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import ColumnModel, PosedModel, Sigma, ValueModel, column_model
from robocal.files.kinds.kind import Around, KindFile, KindOutput, Part, QuantityColumns, Values
from robocal.files.schema import FileModel, Name, Triple, refuse
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations
from robocal.measure.plane_points import ACROSS, AT, IMAGE, NAMED, PIXEL_SIZES, across

__all__ = ["PLANE_POINTS"]

PIXEL = QuantityColumns(IMAGE, ("u", "v"), (), "px")


def _two(value: Any) -> Any:
    if value is not None and (len(value) != 2 or min(value) <= 0):
        refuse("not the size of a pixel", found=value, expected="two lengths above 0, along u and along v")
    return value


class ImageModel(ValueModel):
    """Where a point is in the image, and how large a pixel is: both are found, unless `free` says otherwise."""

    pixel: Annotated[list[FiniteFloat] | None, AfterValidator(_two)] = None
    free: bool = True


class WireModel(FileModel):
    """A straight wire through two points."""

    front: Triple
    back: Triple


class PointNoiseModel(FileModel):
    """How far a point of the image may be off, as a length."""

    sigma: Sigma = None
    unit: str | None = None


class PlanePointsModel(PosedModel):
    """Points of a phantom in the image plane of a probe."""

    image: ImageModel = ImageModel.model_construct()
    distance: PointNoiseModel = PointNoiseModel.model_construct()
    wire: Annotated[Any, BeforeValidator(column_model)] = None
    wires: dict[Name, WireModel] = Field(default_factory=dict)
    point: Annotated[Any, BeforeValidator(column_model)] = None
    points: dict[Name, Triple] = Field(default_factory=dict)


def read_points(model: PlanePointsModel, table: CsvTable, document: YamlDocument) -> Values:
    """Values (k, 2) of zero in m; image points (k, 2) in px, and which wire or point each shows."""
    given = ValueModel(columns=model.image.columns, unit=model.image.unit)
    if given.unit is None and all(table.unit(c) is None for c in given.columns or PIXEL.names):
        given = given.model_copy(update={"unit": "px"})  # pixels are pixels
    image = PIXEL.numbers(given, table, document)[0]
    document.insist(model.units is not None, "a key is missing", ("units",), expected="units: {length: mm, angle: deg}")
    document.insist(
        model.scale is None or (model.scale.sigma == 0 and not model.scale.free),
        "the sizes of a pixel are found, so the image has no scale of its own: the phantom's list gives it",
        ("scale",),
        expected="no scale; pixel beside free: false where the sizes of a pixel are known",
    )
    key = "points" if model.points else "wires"
    known = model.points or model.wires
    if model.points and model.wires:
        document.fail(
            "wires and points in one file", ("points",), expected="one of them; the others in a file of their own"
        )
    document.insist(
        bool(known), "a key is missing", ("wires",), expected="wires: {name: {front: [...], back: [...]}}, or points"
    )
    asked: ColumnModel = (model.point if model.points else model.wire) or ColumnModel(column=key.removesuffix("s"))
    cells, order = table.texts(asked.column), {name: i for i, name in enumerate(known)}
    for row, cell in enumerate(cells):
        if cell not in order:
            label = table.label(table.find(asked.column))
            raise table.fail(f"unknown {key.removesuffix('s')}", row, label, found=cell, **one_of(cell, order))
    which = np.array([order[c] for c in cells], dtype=float)
    return Values(np.zeros((len(table), 3 if model.points else 2)), None, extra={IMAGE: image, WHICH: which})


WHICH = "which"


def parts(model: PlanePointsModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one image; lengths in the units of the file."""
    document, unit = around.document, around.units.length
    if not model.targets:
        expected = "targets: {phantom: {mount: base, xyz: [...], rotation_vector: [...]}}"
        document.fail("the place of the phantom is not stated", ("targets",), expected=expected)
    which = values.extra[WHICH].astype(int)
    extra = {IMAGE: values.extra[IMAGE], NAMED: values.extra[WHICH]}
    if model.points:
        extra[AT] = unit.to_si(np.array(list(model.points.values())))[which]
    else:
        ends = unit.to_si(np.array([[w.front, w.back] for w in model.wires.values()]))
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        for name, size in zip(model.wires, length, strict=True):
            document.insist(
                size > 0, "the two ends of a wire are one point", ("wires", name), expected="two points of the wire"
            )
        extra |= {AT: ends[which, 0], ACROSS: across(ends[:, 1] - ends[:, 0])[which]}
    sigma = None
    if model.distance.sigma is not None:
        if not isinstance(model.distance.sigma, float):
            document.fail("not a standard deviation", ("distance", "sigma"), expected="a number above 0")
        own = unit if model.distance.unit is None else document.unit(model.distance.unit, "m", ("distance", "unit"))
        sigma = np.full(values.value.shape, own.to_si(model.distance.sigma))
    options: dict[str, object] = {IMAGE: around.name, "names": tuple(model.points or model.wires)}
    if model.image.pixel is not None:
        options["values"] = dict(zip(PIXEL_SIZES, (unit.to_si(v) for v in model.image.pixel), strict=True))
    elif not model.image.free:
        document.fail("a key is missing", (IMAGE, "pixel"), expected="the size of a pixel along u and along v")
    options["free"] = PIXEL_SIZES if model.image.free else ()
    made = replace(values, sigma=sigma, extra=extra, options=options)
    return [Part(np.arange(len(which)), made, kind="plane_targets" if model.points else "")]


def write_points(obs: Observations, units: Units) -> KindOutput:
    """Raises ModelError: the columns of a table are numbers, and rows of this kind have names."""
    raise ModelError("this kind cannot be written to a table", found=obs.kind, expected="another kind")


KEYS = """units: {{length: {length}, angle: {angle}}}
image: {{columns: [u, v]}}    # pixels; pixel: [0.08, 0.08] is their size, where it is known roughly
distance: {{sigma: 0.3}}    # how far a point may be from its wire
wire: wire    # the column that names the wire
wires: {{G1: {{front: [30, 0, 20], back: [30, 40, 20]}}}}    # in the phantom's frame; or point: point and points: {{bead: [10, 0, 5]}}
frame: {{name: image, mount: tool}}
targets: {{phantom: {{mount: base, xyz: [0, 0, 0], prior: {{length: 0.3, angle: 0.2}}}}}}
"""
PLANE_POINTS = KindFile(PlanePointsModel, read_points, write_points, KEYS, parts=parts)

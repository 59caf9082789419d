"""Places that stay where they are while the arm moves: a socket, a plane, a sphere, a receiver.

One for the whole file (`place`), one per row (`place: COLUMN`, described under `places`), and for contacts also a known
distance between two (`between`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, FiniteFloat

from robocal._types import Ints
from robocal.errors import one_of
from robocal.files.datamodel import ColumnModel, DataModel, Sigma, column_model
from robocal.files.kinds.kind import Around, Part, Values
from robocal.files.orientation import frame_vector
from robocal.files.schema import FileModel, FrameModel, Name, refuse
from robocal.files.units import Units, number
from robocal.files.yamlio import quote
from robocal.measure.data import Frame
from robocal.parameters import FRAME_SYMBOLS

__all__ = [
    "BetweenModel",
    "PlaceModel",
    "PlacedModel",
    "between",
    "each_place",
    "frame_keys",
    "frame_line",
    "frame_of",
    "place_frames",
]


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
    return ", ".join([*words, f"free: {shown}"])


def place_frames(
    model: PlacedModel, free: Sequence[bool], around: Around, names: Sequence[str] = ()
) -> dict[str, Frame]:
    """The places of a file by name; `names` are those that are needed. Raises FormatError for one that is described
    nowhere while others are."""
    known: Mapping[str, PlaceModel] = model.places or {name: PlaceModel() for name in names}
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

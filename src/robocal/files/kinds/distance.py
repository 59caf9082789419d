"""Distances: a ballbar from a socket on the base to a ball on the tool, a telescopic bar between two configurations.

A fixed bar has no column of readings; then the length is what counts, known or not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ScalarModel, SecondModel, ValueModel
from robocal.files.kinds.kind import (
    XYZ,
    Around,
    KindFile,
    KindOutput,
    Part,
    QuantityColumns,
    Values,
    scalar,
    show_scalar,
)
from robocal.files.kinds.places import PlaceModel, frame_line
from robocal.files.orientation import frame_vector
from robocal.files.schema import Name
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Frame, Observations

__all__ = ["DISTANCE"]

BAR = QuantityColumns("distance", ("distance",), ("s_distance",))


class EndModel(PlaceModel):
    """One end of a bar: beside the robot, or on its tool."""

    mount: Literal["base", "tool"] = "base"


class DistanceModel(DataModel):
    """Distances between two ends, or of one target between two configurations."""

    distance: ValueModel | None = None
    length: ScalarModel | None = None
    ends: dict[Name, EndModel] = Field(default_factory=dict)
    second: SecondModel | None = None


def read_distance(model: DistanceModel, table: CsvTable, document: YamlDocument) -> Values:
    """Distances (k, 1) in m; zero where a bar of fixed length has no reading."""
    if len(model.ends) not in (0, 2):
        document.fail("a bar has two ends", ("ends",), found=len(model.ends), expected="2")
    if not model.ends and model.second is None:
        document.fail("a key is missing", ("ends",), expected="two ends, or `second`: the other configuration")
    given = model.distance
    if model.length is not None and (given is None or given.columns is None):
        return BAR.deviations(given, table, document)
    values = BAR.values(given, table, document)
    if model.length is None:
        named = (None if given is None else given.columns) or BAR.names
        table.insist(values.value >= 0, named, "a distance below 0", values.value, expected="0 or above, or `length`")
    return values


def parts(model: DistanceModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one bar."""
    ends = tuple(_end(n, e, around) for n, e in model.ends.items())
    if ends and not any(f.mount == "tool" for f in ends):
        around.document.fail("no end of the bar moves with the arm", ("ends",), expected="mount: tool for one end")
    values = values.with_options({"ends": ends} if ends else {}).with_options(
        scalar(model.length, "m", "length", around)
    )
    return [Part(np.arange(len(values.value)), values, targeted=not ends)]


def _end(name: str, given: EndModel, around: Around) -> Frame:
    around.refuse_taken(name, ("ends", name))
    # On the tool a stated place is a part that was made; beside the robot it is where somebody put it.
    loose = not given.given or given.mount == "base"
    flags = XYZ if loose else (False,) * 6
    if given.free is not None:
        flags = XYZ if given.free is True else given.free_flags(True)
    expected = (0.01, 0.05) if given.given and given.mount == "tool" else (0.1, 0.1) if given.given else (3.0, 3.0)
    return Frame(name, frame_vector(given, around.units), flags, given.mount, expected, given.has_details)


def write_distance(obs: Observations, units: Units) -> KindOutput:
    """One column, the ends and the length."""
    ends = obs.options.get("ends", ())
    lines = (
        ["ends:", *(f"  {frame_line(e, units, mount=True)}" for e in ends)] if isinstance(ends, tuple) and ends else []
    )
    lines = [BAR.line(obs), *lines, *show_scalar("length", obs.options, units.length)]
    return KindOutput(BAR.columns(obs, units), tuple(lines))


DISTANCE_KEYS = """distance: {{columns: [distance], unit: {length}, sigma: 0.005}}    # a fixed bar: {{unit: {length}, sigma: 0.005}}
ends:    # a bar between two configurations has no ends, but `second: {{columns: [...]}}` as other kinds have
  socket: {{mount: base, xyz: [{near}], free: true}}    # roughly where it stands
  ball: {{mount: tool, xyz: [0, 0, 0], free: false}}    # where the ball sits on the tool
# length: {{name: bar, value: 300, unit: {length}, free: false}}    # is added to the reading; unknown: free: true
"""
DISTANCE = KindFile(
    "distance", DistanceModel, read_distance, write_distance, DISTANCE_KEYS, XYZ, parts, lengths="distance"
)

"""Columns and keys of a data file for instruments that read ranges, distances and angles.

range         by time of flight from fixed receivers: in seconds or as lengths, one column per receiver or one row each
distance      a ballbar from a socket on the base to a ball on the tool, a telescopic bar between two configurations; a fixed bar
              has no column of readings, then the length is what counts, known or not
bearing       of a theodolite: azimuth turns about the instrument's z axis from its x axis, elevation rises from its xy plane; a zenith
              distance is a quarter turn minus the elevation: convert it before
spherical     of a laser tracker: the same with a range
inclination   of the platform: by how much a sensor's x axis and y axis rise above the horizon
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, FiniteFloat

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, FramedModel, ScalarModel, SecondModel, SigmaModel, ValueModel
from robocal.files.kinds.kind import (
    XYZ,
    Around,
    KindFile,
    KindOutput,
    Part,
    QuantityColumns,
    Values,
    agree_unit,
    refuse_one_sigma,
    scalar,
    show_scalar,
    sigmas,
    whole,
)
from robocal.files.kinds.places import PlacedModel, PlaceModel, each_place, frame_line, place_frames
from robocal.files.orientation import frame_vector
from robocal.files.schema import FileModel, Name, refuse
from robocal.files.units import UNITS, Unit, Units, number
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Frame, Observations

__all__ = ["BEARING", "DISTANCE", "INCLINATION", "RANGE", "SPHERICAL"]

FAR = QuantityColumns("range", ("range",), ("s_range",))
ANGLES = QuantityColumns("bearing", ("azimuth", "elevation"), ("s_azimuth", "s_elevation"), "rad")
TILTS = QuantityColumns("inclination", ("tilt_x", "tilt_y"), ("s_tilt_x", "s_tilt_y"), "rad")
RIGHT = np.pi / 2 + 1e-9  # rad


class BearingModel(FramedModel):
    """Azimuth and elevation of a target."""

    bearing: ValueModel = ValueModel.model_construct()


class SphericalModel(BearingModel):
    """Range, azimuth and elevation of a target; the range has a sigma of its own."""

    range: ValueModel = ValueModel.model_construct()
    zero: ScalarModel | None = None


class InclinationModel(FramedModel):
    """Two angles; how the sensor sits on the platform is its `target`, which way is up the z axis of its `frame` (the base's)."""

    inclination: ValueModel = ValueModel.model_construct()


def read_bearing(model: BearingModel, table: CsvTable, document: YamlDocument) -> Values:
    """Azimuth and elevation (k, 2) in rad."""
    value, sigma, units = ANGLES.numbers(model.bearing, table, document)
    named, elevation = model.bearing.columns or ANGLES.names, value[:, 1]
    found, expected = units[1].from_si(elevation), "elevation above the horizon; a zenith distance is to be converted"
    table.insist(abs(elevation) <= RIGHT, named[1:], "an elevation beyond a quarter turn", found, expected=expected)
    return Values(value, sigma, angle=units[0])


def read_spherical(model: SphericalModel, table: CsvTable, document: YamlDocument) -> Values:
    """Range in m, azimuth and elevation in rad, (k, 3)."""
    far, spread, units = FAR.numbers(model.range, table, document)
    table.insist(far > 0, model.range.columns or FAR.names, "a range must be above 0", units[0].from_si(far))
    turned = read_bearing(model, table, document)
    if (spread is None) != (turned.sigma is None):
        refuse_one_sigma("range" if spread is None else "bearing", document)
    sigma = None if spread is None or turned.sigma is None else np.hstack([spread, turned.sigma])
    return Values(np.hstack([far, turned.value]), sigma, units[0], turned.angle)


def read_inclination(model: InclinationModel, table: CsvTable, document: YamlDocument) -> Values:
    """Inclinations (k, 2) in rad."""
    value, sigma, units = TILTS.numbers(model.inclination, table, document)
    named = model.inclination.columns or TILTS.names
    found, expected = units[0].from_si(value), "-90 to 90 degrees above the horizon"
    table.insist(abs(value) <= RIGHT, named, "an inclination beyond a quarter turn", found, expected=expected)
    return Values(value, sigma, angle=units[0])


def spherical_parts(model: SphericalModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one instrument; the zero of its ranges, where somebody speaks of it."""
    return whole(model, values.with_options(scalar(model.zero, "m", "zero", around)), around)


def write_spherical(obs: Observations, units: Units) -> KindOutput:
    """Three columns and their sigmas."""
    lines = (FAR.line(obs), ANGLES.line(obs), *show_scalar("zero", obs.options, units.length))
    return KindOutput((*FAR.columns(obs, units), *ANGLES.columns(obs, units, 1)), lines)


BEARING_KEYS = """bearing: {{columns: [azimuth, elevation], unit: {angle}, sigma: 0.002}}    # elevation above the horizon
frame: {{name: theodolite, free: true}}    # one data file for each theodolite, with a frame of its own
"""
BEARING = KindFile(BearingModel, read_bearing, ANGLES.write, BEARING_KEYS, XYZ)
SPHERICAL_KEYS = """range: {{columns: [range], unit: {length}, sigma: 0.01}}
bearing: {{columns: [azimuth, elevation], unit: {angle}, sigma: 0.001}}    # elevation above the horizon
frame: {{name: tracker, free: true}}    # where the tracker stands is found from the data
# zero: {{name: prism, value: 0, unit: {length}, free: false}}    # is added to the range; unknown: free: true
"""
SPHERICAL = KindFile(
    SphericalModel, read_spherical, write_spherical, SPHERICAL_KEYS, XYZ, spherical_parts, lengths="range"
)
INCLINATION_KEYS = """inclination: {{columns: [tilt_x, tilt_y], unit: {angle}, sigma: 0.05}}    # of the sensor's x and y above the horizon
# target: {{name: level, free: [rx, ry, rz]}}    # how the sensor sits on the platform, where that is not known
"""
TURNED = (False, False, False, True, True, True)
INCLINATION = KindFile(InclinationModel, read_inclination, TILTS.write, INCLINATION_KEYS, TURNED)


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


def distance_parts(model: DistanceModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one bar."""
    ends = tuple(_end(n, e, around) for n, e in model.ends.items())
    if ends and not any(f.mount == "tool" for f in ends):
        around.document.fail("no end of the bar moves with the arm", ("ends",), expected="mount: tool for one end")
    values = values.with_options(({"ends": ends} if ends else {}) | scalar(model.length, "m", "length", around))
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
    each = [f"  {frame_line(e, units, mount=True)}" for e in ends] if isinstance(ends, tuple) else []
    lines = (BAR.line(obs), *(["ends:", *each] if each else []), *show_scalar("length", obs.options, units.length))
    return KindOutput(BAR.columns(obs, units), lines)


DISTANCE_KEYS = """distance: {{columns: [distance], unit: {length}, sigma: 0.005}}    # a fixed bar: {{unit: {length}, sigma: 0.005}}
ends:    # a bar between two configurations has no ends, but `second: {{columns: [...]}}` as other kinds have
  socket: {{mount: base, xyz: [{near}], free: true}}    # roughly where it stands
  ball: {{mount: tool, xyz: [0, 0, 0], free: false}}    # where the ball sits on the tool
# length: {{name: bar, value: 300, unit: {length}, free: false}}    # is added to the reading; unknown: free: true
"""
DISTANCE = KindFile(
    DistanceModel, read_distance, write_distance, DISTANCE_KEYS, XYZ, distance_parts, lengths="distance"
)


RANGES = QuantityColumns("range", ("range",), ("s_range",))
SOUND = 343.0
SYMBOLS = ("speed", "delay")


def _symbols(value: Any) -> Any:
    parts = value if isinstance(value, list) else [value]
    if any(p not in SYMBOLS for p in parts):
        refuse("not a number of the medium", found=value, expected="speed, delay, or both in a list")
    return tuple(parts)


class MediumModel(FileModel):
    """What the signal runs through: its speed in m/s, a delay as a length, and which of the two is identified."""

    name: Name = "medium"
    speed: FiniteFloat = SOUND
    delay: FiniteFloat = 0.0
    free: Annotated[Any, BeforeValidator(_symbols)] = ()


class RangeModel(PlacedModel):
    """Ranges from receivers: several columns, each named like its receiver, or one with the place beside it."""

    range: ValueModel = ValueModel.model_construct()
    medium: MediumModel = MediumModel.model_construct()


def read_range(model: RangeModel, table: CsvTable, document: YamlDocument) -> Values:
    """Apparent ranges in m (k, number of receivers): a time is multiplied by the nominal speed."""
    if model.medium.speed <= 0:
        document.fail("not a speed", ("medium", "speed"), found=model.medium.speed, expected="m/s, above 0")
    names = ["range"] if model.range.columns is None else model.range.columns
    units = [_unit(model, name, table, document) for name in names]
    factors, given = np.array([u.factor for u in units]), model.range
    value = table.numbers(names) * factors
    table.insist(value > 0, names, "a range must be above 0", value / factors)
    if isinstance(given.sigma, SigmaModel):
        # A sigma column may speak of time or of length on its own.
        spread = [_unit(model, c, table, document, units[0]) for c in given.sigma.columns]
        bare = replace(table, units=(None,) * table.width)
        raw = sigmas(given, bare, [UNITS["1"]] * len(names), "1", document, RANGES.key)
        sigma = None if raw is None else raw * np.array([u.factor for u in spread])
    else:
        sigma = sigmas(given, table, units, "m", document, RANGES.key)
    length = next((u for u in units if u.name in UNITS and UNITS[u.name].si == "m"), None)
    return Values(value, sigma, length)


def _unit(
    model: RangeModel, column: str | int, table: CsvTable, document: YamlDocument, fallback: Unit | None = None
) -> Unit:
    """The unit of a column that may hold times or lengths, as a length."""
    header, stated = table.unit(column), model.range.unit
    label = table.label(table.find(column))
    if header is None and stated is None:
        if fallback is not None:
            return fallback
        document.fail("the unit is missing", ("range", "unit"), column=label, expected="us, s, mm, m, ...")
    told = None if stated is None else document.unit(stated, None, ("range", "unit"))
    found = agree_unit(told, header, None, table, label)
    if found.si not in ("m", "s"):
        expected = "a time or a length"
        document.fail("the unit is of another quantity", ("range", "unit"), found=found.name, expected=expected)
    return found if found.si == "m" else Unit(found.name, "m", found.factor * model.medium.speed)


def range_parts(model: RangeModel, values: Values, around: Around) -> Sequence[Part]:
    """One part for every receiver; they share the medium."""
    medium = model.medium
    numbers = {"speed": medium.speed, "delay": around.units.length.to_si(medium.delay)}
    values = values.with_options({"medium": medium.name, "speed": medium.speed, "values": numbers, "free": medium.free})
    if values.value.shape[1] == 1:
        return [p for p, _ in each_place(model, values, XYZ, around)]
    if model.place is not None:
        expected = "a column per receiver and no place, or one column with `place`"
        around.document.fail("several columns, and a place", ("place",), expected=expected)
    table = around.table
    names = [str(table.label(table.find(c))) for c in model.range.columns]
    if not table.names:
        names = [f"receiver{c}" for c in names]
    frames = place_frames(model, XYZ, around, names)
    every, out = np.arange(len(values.value)), []
    for i, name in enumerate(names):
        sigma = None if values.sigma is None else values.sigma[:, [i]]
        one = replace(values, value=values.value[:, [i]], sigma=sigma).with_options({"place": frames[name]})
        out.append(Part(every, one, group=name))
    return out


def write_range(obs: Observations, units: Units) -> KindOutput:
    """One column; the place is in another."""
    values, free = obs.options.get("values", {}), obs.options.get("free", ())
    assert isinstance(values, dict) and isinstance(free, tuple)
    speed = float(values.get("speed", obs.options.get("speed", SOUND)))
    delay = number(units.length.from_si(values.get("delay", 0.0)))
    medium = f"name: {obs.options['medium']}, speed: {number(speed)}, delay: {delay}, free: [{', '.join(free)}]"
    return KindOutput(RANGES.columns(obs, units), (RANGES.line(obs), f"medium: {{{medium}}}"))


RANGE_KEYS = """range: {{columns: [range], unit: {length}, sigma: 0.2}}    # or times: unit: us; or one column per receiver
place: place    # the column that names the receiver of a row
# places: {{r1: {{xyz: [{near}]}}}}    # roughly where they stand; by default unknown
medium: {{name: air, speed: 343, delay: 0, free: [speed]}}    # m/s; what a time was, or is, multiplied by
"""
RANGE = KindFile(RangeModel, read_range, write_range, RANGE_KEYS, XYZ, range_parts, XYZ, lengths="range")

"""Instruments that read angles: bearings of a theodolite, the spherical coordinates of a laser tracker, and inclinations of the
platform.

Azimuth turns about the instrument's z axis from its x axis, elevation rises from its xy plane. A zenith distance is a
quarter turn minus the elevation: convert it before. Inclinations say by how much a sensor's x axis and y axis rise above the horizon.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import FramedModel, ScalarModel, ValueModel
from robocal.files.kinds.kind import (
    XYZ,
    Around,
    KindFile,
    KindOutput,
    Part,
    QuantityColumns,
    Values,
    refuse_one_sigma,
    scalar,
    show_scalar,
    whole,
)
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["BEARING", "INCLINATION", "SPHERICAL"]

FAR = QuantityColumns("range", ("range",), ("s_range",))
ANGLES = QuantityColumns("bearing", ("azimuth", "elevation"), ("s_azimuth", "s_elevation"), "rad")
TILTS = QuantityColumns("inclination", ("tilt_x", "tilt_y"), ("s_tilt_x", "s_tilt_y"), "rad")
RIGHT = np.pi / 2 + 1e-9  # rad


class BearingModel(FramedModel):
    """Azimuth and elevation of a target."""

    bearing: ValueModel = ValueModel()


class SphericalModel(BearingModel):
    """Range, azimuth and elevation of a target; the range has a sigma of its own."""

    range: ValueModel = ValueModel()
    zero: ScalarModel | None = None


class InclinationModel(FramedModel):
    """Two angles; how the sensor sits on the platform is its `target`, which way is up the z axis of its `frame` (the base's)."""

    inclination: ValueModel = ValueModel()


def read_bearing(model: BearingModel, table: CsvTable, document: YamlDocument) -> Values:
    """Azimuth and elevation (k, 2) in rad."""
    value, sigma, units = ANGLES.numbers(model.bearing, table, document)
    named, elevation = model.bearing.columns or ANGLES.names, value[:, 1]
    table.insist(
        np.abs(elevation) <= RIGHT,
        named[1:],
        "an elevation beyond a quarter turn",
        units[1].from_si(elevation),
        expected="elevation above the horizon; a zenith distance is to be converted",
    )
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
    table.insist(abs(value) <= RIGHT, named, "an inclination beyond a quarter turn", units[0].from_si(value),
                 expected="-90 to 90 degrees above the horizon")  # fmt: skip
    return Values(value, sigma, angle=units[0])


def parts(model: SphericalModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one instrument; the zero of its ranges, where somebody speaks of it."""
    return whole(model, values.with_options(scalar(model.zero, "m", "zero", around)), around)


def write_spherical(obs: Observations, units: Units) -> KindOutput:
    """Three columns and their sigmas."""
    lines = (FAR.line(obs), ANGLES.line(obs), *show_scalar("zero", obs.options, units.length))
    return KindOutput((*FAR.columns(obs, units), *ANGLES.columns(obs, units, 1)), lines)


BEARING_KEYS = """bearing: {{columns: [azimuth, elevation], unit: {angle}, sigma: 0.002}}    # elevation above the horizon
frame: {{name: theodolite, free: true}}    # one data file for each theodolite, with a frame of its own
"""
BEARING = KindFile("bearing", BearingModel, read_bearing, ANGLES.write, BEARING_KEYS, XYZ)
SPHERICAL_KEYS = """range: {{columns: [range], unit: {length}, sigma: 0.01}}
bearing: {{columns: [azimuth, elevation], unit: {angle}, sigma: 0.001}}    # elevation above the horizon
frame: {{name: tracker, free: true}}    # where the tracker stands is found from the data
# zero: {{name: prism, value: 0, unit: {length}, free: false}}    # is added to the range; unknown: free: true
"""
SPHERICAL = KindFile(
    "spherical", SphericalModel, read_spherical, write_spherical, SPHERICAL_KEYS, XYZ, parts, lengths="range"
)
INCLINATION_KEYS = """inclination: {{columns: [tilt_x, tilt_y], unit: {angle}, sigma: 0.05}}    # of the sensor's x and y above the horizon
# target: {{name: level, free: [rx, ry, rz]}}    # how the sensor sits on the platform, where that is not known
"""
TURNED = (False, False, False, True, True, True)
INCLINATION = KindFile("inclination", InclinationModel, read_inclination, TILTS.write, INCLINATION_KEYS, TURNED)

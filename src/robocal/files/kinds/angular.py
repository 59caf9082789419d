"""Instruments that read circles: bearings of a theodolite, and the spherical coordinates of a laser tracker.

Azimuth turns about the instrument's z axis from its x axis, elevation rises from its xy plane. A zenith distance is a
quarter turn minus the elevation: convert it before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import FramedModel, ScalarModel, ValueModel
from robocal.files.kinds.kind import (
    Around,
    KindFile,
    KindOutput,
    Part,
    Values,
    columns,
    quantity,
    refuse_one_sigma,
    scalar,
    section,
    show_scalar,
    whole,
)
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["BEARING", "SPHERICAL"]

ANGLES = ("azimuth", "elevation")
ANGLE_SIGMAS = ("s_azimuth", "s_elevation")
POINT_SEEN = (True, True, True, False, False, False)


class BearingModel(FramedModel):
    """Azimuth and elevation of a target."""

    bearing: ValueModel = ValueModel()


class SphericalModel(BearingModel):
    """Range, azimuth and elevation of a target; the range has a sigma of its own."""

    range: ValueModel = ValueModel()
    zero: ScalarModel | None = None


def read_bearing(model: BearingModel, table: CsvTable, document: YamlDocument) -> Values:
    """Azimuth and elevation (k, 2) in rad."""
    value, sigma, units = quantity(model.bearing, table, document, ("bearing",), ("rad", "rad"), ANGLES)
    named, elevation = model.bearing.columns or ANGLES, value[:, 1]
    table.insist(
        np.abs(elevation) <= np.pi / 2 + 1e-9,
        named[1:],
        "an elevation beyond a quarter turn",
        units[1].from_si(elevation),
        expected="elevation above the horizon; a zenith distance is to be converted",
    )
    return Values(value, sigma, angle=units[0])


def read_spherical(model: SphericalModel, table: CsvTable, document: YamlDocument) -> Values:
    """Range in m, azimuth and elevation in rad, (k, 3)."""
    far, spread, units = quantity(model.range, table, document, ("range",), ("m",), ("range",))
    table.insist(far > 0, model.range.columns or ("range",), "a range must be above 0", units[0].from_si(far))
    turned = read_bearing(model, table, document)
    if (spread is None) != (turned.sigma is None):
        refuse_one_sigma("range" if spread is None else "bearing", document)
    sigma = None if spread is None or turned.sigma is None else np.hstack([spread, turned.sigma])
    return Values(np.hstack([far, turned.value]), sigma, units[0], turned.angle)


def parts(model: SphericalModel, values: Values, around: Around) -> Sequence[Part]:
    """All rows are of one instrument; the zero of its ranges, where somebody speaks of it."""
    options = {} if model.zero is None else scalar(model.zero, "m", "zero", "zero", around)
    return whole(model, replace(values, options=options), around)


def write_bearing(obs: Observations, units: Units) -> KindOutput:
    """Two columns and their sigmas."""
    made = columns(ANGLES, ANGLE_SIGMAS, [units.angle] * 2, obs)
    return KindOutput(made, (section("bearing", ANGLES, ANGLE_SIGMAS, obs),))


def write_spherical(obs: Observations, units: Units) -> KindOutput:
    """Three columns and their sigmas."""
    far = columns(("range",), ("s_range",), [units.length], obs)
    turned = columns(ANGLES, ANGLE_SIGMAS, [units.angle] * 2, obs, 1)
    lines = (section("range", ("range",), ("s_range",), obs), section("bearing", ANGLES, ANGLE_SIGMAS, obs))
    return KindOutput((*far, *turned), (*lines, *show_scalar("zero", obs.options, "zero", units.length)))


BEARING_KEYS = """bearing: {{columns: [azimuth, elevation], unit: {angle}, sigma: 0.002}}    # elevation above the horizon
frame: {{name: theodolite, free: true}}    # one data file for each theodolite, with a frame of its own
"""
BEARING = KindFile("bearing", BearingModel, read_bearing, write_bearing, BEARING_KEYS, POINT_SEEN)
SPHERICAL_KEYS = """range: {{columns: [range], unit: {length}, sigma: 0.01}}
bearing: {{columns: [azimuth, elevation], unit: {angle}, sigma: 0.001}}    # elevation above the horizon
frame: {{name: tracker, free: true}}    # where the tracker stands is found from the data
# zero: {{name: prism, value: 0, unit: {length}, free: false}}    # is added to the range; unknown: free: true
"""
SPHERICAL = KindFile(
    "spherical", SphericalModel, read_spherical, write_spherical, SPHERICAL_KEYS, POINT_SEEN, parts, lengths="range"
)

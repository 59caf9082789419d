"""Inclinations of the platform: two columns, by how much the sensor's x axis and y axis rise above the horizon."""

from __future__ import annotations

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import FramedModel, ValueModel
from robocal.files.kinds.kind import KindFile, KindOutput, Values, columns, quantity, section
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["INCLINATION"]

TILTS, TILT_SIGMAS = ("tilt_x", "tilt_y"), ("s_tilt_x", "s_tilt_y")
RIGHT = 1.5707963267948966 + 1e-9  # rad


class InclinationModel(FramedModel):
    """Two angles; how the sensor sits on the platform is its `target`, which way is up the z axis of its `frame` (the base's)."""

    inclination: ValueModel = ValueModel()


def read_inclination(model: InclinationModel, table: CsvTable, document: YamlDocument) -> Values:
    """Inclinations (k, 2) in rad."""
    value, sigma, units = quantity(model.inclination, table, document, ("inclination",), ("rad", "rad"), TILTS)
    named = model.inclination.columns or TILTS
    table.insist(abs(value) <= RIGHT, named, "an inclination beyond a quarter turn", units[0].from_si(value),
                 expected="-90 to 90 degrees above the horizon")  # fmt: skip
    return Values(value, sigma, angle=units[0])


def write_inclination(obs: Observations, units: Units) -> KindOutput:
    """Two columns and their sigmas."""
    made = columns(TILTS, TILT_SIGMAS, [units.angle] * 2, obs)
    return KindOutput(made, (section("inclination", TILTS, TILT_SIGMAS, obs),))


INCLINATION_KEYS = """inclination: {{columns: [tilt_x, tilt_y], unit: {angle}, sigma: 0.05}}    # of the sensor's x and y above the horizon
# target: {{name: level, free: [rx, ry, rz]}}    # how the sensor sits on the platform, where that is not known
"""
INCLINATION = KindFile(
    "inclination",
    InclinationModel,
    read_inclination,
    write_inclination,
    INCLINATION_KEYS,
    (False, False, False, True, True, True),
)

"""Units convert there and back, and a wrong one names the nearest."""

from __future__ import annotations

import math

import pytest

from robocal.errors import FormatError
from robocal.files.units import UNITS, Units, parse_unit


@pytest.mark.parametrize(
    ("name", "value", "si"),
    [
        ("mm", 1500.0, 1.5),
        ("cm", 150.0, 1.5),
        ("um", 1.5e6, 1.5),
        ("inch", 1.0, 0.0254),
        ("deg", 180.0, math.pi),
        ("mrad", 1.0, 1e-3),
        ("arcsec", 3600.0, math.pi / 180),
        ("degC", 20.0, 293.15),
        ("N m", 2.0, 2.0),
        ("mm/K", 1.0, 1e-3),
        ("deg/(N m)", 180.0, math.pi),
        ("deg/s", 180.0, math.pi),
        ("µm", 1.0, 1e-6),
        ("°", 180.0, math.pi),
    ],
)
def test_to_si_and_back(name, value, si):
    unit = parse_unit(name)
    assert unit.to_si(value) == pytest.approx(si, rel=1e-14)
    assert unit.from_si(unit.to_si(value)) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "si", "words"),
    [
        ("mmm", "m", ["unknown unit", "'mmm'", "'mm'"]),
        ("degrees C", "rad", ["unknown unit", "degree"]),
        ("deg", "m", ["a length", "mm"]),
        ("", "rad", ["missing", "deg"]),
        (None, "m", ["missing"]),
        (3, "m", ["missing"]),
        ("m/foo", None, ["unknown unit"]),
        ("/", None, ["unknown"]),
    ],
)
def test_bad_unit(name, si, words):
    with pytest.raises(FormatError) as info:
        parse_unit(name, si, file="robot.yaml", row=3)
    for word in ["robot.yaml", "row 3", *words]:
        assert word in str(info.value)


def test_display_units():
    units = Units()
    assert (units.of("m").name, units.of("rad").name, units.of("1").name) == ("mm", "deg", "1")
    assert units.of("rad/(N m)").name == "deg/(N m)"
    assert units.of("m/K").from_si(1e-3) == pytest.approx(1.0)
    assert units.of("1/K").factor == 1.0
    assert all(u.factor > 0 for u in UNITS.values())

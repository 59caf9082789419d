"""The parameters of a cable robot: what they are called, in which units, and how far off each may be before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.pulley import Pulleys
from robocal.cables.rail import RAIL
from robocal.parameters import Parameter

__all__ = ["COMMON", "EXPECTED", "PLATFORM", "STRETCH", "SYMBOLS", "WHEEL", "anchor_parameters", "material_parameters"]

SYMBOLS = ("ax", "ay", "az", "bx", "by", "bz", "l0")
WHEEL = ("radius", "nx", "ny", "nz")
STRETCH = "elasticity"
PLATFORM = "platform"  # whose mass and centre of mass are, where load cells tell them
COMMON = "cables"  # whose a number is that all cables have together
UNITS = {"radius": "m", STRETCH: "1/N", "carriage": "m"}
WHEEL_EXPECTED = (0.005, 0.05, 0.05, 0.05)  # m, and what an axis is off that somebody set by eye
RAIL_EXPECTED = (0.1, 0.02, 0.05, 0.05, 0.05)  # m as of an anchor, of a drum's gain, and as of an axis
SOFTER = 0.5  # of itself: what a catalogue knows of a rope's elasticity
# What a tape measure or radio beacons leave, by the thesis; four poses and more improve it a hundredfold.
EXPECTED = 0.1  # tolerance: m


def anchor_parameters(
    segments: Sequence[str], ends: Array, zeros: Array, free: Sequence[str], shared: Mapping[str, str]
) -> list[Parameter]:
    """Those of the ends (p, 6) of segments, the first of which belong to the cables with zeros (m,); a number that is shared stands under
    the name of whose it is, once."""
    rows: dict[str, Parameter] = {}
    for i, segment in enumerate(segments):
        own = (*ends[i].tolist(), *zeros[i : i + 1].tolist())
        for symbol, value in zip(SYMBOLS, own, strict=False):
            name = shared.get(f"{segment}.{symbol}", f"{segment}.{symbol}")
            rows.setdefault(name, Parameter(name, value, "m", symbol in free, expected=EXPECTED))
    return list(rows.values())


def material_parameters(
    segments: Sequence[str], cables: Sequence[str], shared: Mapping[str, str],
    *, pulleys: Pulleys | None = None, rails: Array | None = None, elasticity: ArrayLike | None = None,
) -> list[Parameter]:  # fmt: skip
    """What is known of pulleys and rails of segments, rails (p, 5) in the order of RAIL, and of the stretch of cables; a segment without a
    pulley (radius 0) or a rail (no direction) has none."""
    rows: dict[str, Parameter] = {}

    def put(name: str, value: float, expected: float) -> None:
        whose = shared.get(name, name)
        rows.setdefault(whose, Parameter(whose, value, UNITS.get(name.rpartition(".")[2], "1"), expected=expected))

    wheels = np.zeros((len(segments), 4))
    if pulleys is not None:
        wheels[:, 0], wheels[:, 1:] = pulleys.radius, pulleys.axis
    strains = None if elasticity is None else np.broadcast_to(np.asarray(elasticity, float), len(cables)).tolist()
    for i, (segment, wheel) in enumerate(zip(segments, wheels.tolist(), strict=True)):
        for symbol, value, expected in zip(WHEEL, wheel if wheel[0] != 0 else (), WHEEL_EXPECTED, strict=False):
            put(f"{segment}.{symbol}", value, expected)
        if rails is not None and rails[i, 2:].any():
            for symbol, value, expected in zip(RAIL, rails[i].tolist(), RAIL_EXPECTED, strict=True):
                put(f"{segment}.{symbol}", value, expected)
        if strains is not None and i < len(cables):
            put(f"{cables[i]}.{STRETCH}", strains[i], max(SOFTER * strains[i], 1e-7))
    return list(rows.values())

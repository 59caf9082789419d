"""Numbers of a cable that it may share with others, as parameters: its pulley, its rail, its stretch, and what its drum winds up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.pulley import Pulleys
from robocal.cables.rail import RAIL
from robocal.parameters import Parameter

__all__ = ["BUILD_UP", "DRUM", "GAIN", "STRETCH", "UNITS", "WHEEL", "material_rows"]

WHEEL = ("radius", "nx", "ny", "nz")
STRETCH = "elasticity"
GAIN, BUILD_UP = "gain", "build_up"
UNITS = {"radius": "m", STRETCH: "1/N", "carriage": "m", BUILD_UP: "1/m"}
WHEEL_EXPECTED = (0.005, 0.05, 0.05, 0.05)  # m, and what an axis is off that somebody set by eye
RAIL_EXPECTED = (0.1, 0.02, 0.05, 0.05, 0.05)  # m as of an anchor, of a drum, and as of an axis
SOFTER = 0.5  # of itself: what a catalogue knows of a rope's elasticity
DRUM = 0.02  # of its circumference, with the cable that lies on it
GROWTH = 0.02  # 1/m: 2 mm of cable on a drum of 90 mm


def material_rows(
    segments: Sequence[str], cables: Sequence[str], shared: Mapping[str, str], *, pulleys: Pulleys | None = None,
    rails: Array | None = None, elasticity: ArrayLike | None = None, gain: ArrayLike | None = None, build_up: ArrayLike | None = None,
) -> list[Parameter]:  # fmt: skip
    """What is known of pulleys and rails of segments, rails (p, 5) in the order of RAIL, of the stretch of cables and of their drums, as
    parameters; a segment without a pulley (radius 0) or a rail (no direction) has none."""
    rows: dict[str, Parameter] = {}

    def put(name: str, value: float, expected: float) -> None:
        whose = shared.get(name, name)
        rows.setdefault(whose, Parameter(whose, value, UNITS.get(name.rpartition(".")[2], "1"), expected=expected))

    wheels = np.zeros((len(segments), 4))
    if pulleys is not None:
        wheels[:, 0], wheels[:, 1:] = pulleys.radius, pulleys.axis
    strains, drums, growths = (
        None if v is None else np.broadcast_to(np.asarray(v, float), len(cables)).tolist()
        for v in (elasticity, gain, build_up)
    )
    for i, (segment, wheel) in enumerate(zip(segments, wheels.tolist(), strict=True)):
        for symbol, value, expected in zip(WHEEL, wheel if wheel[0] != 0 else (), WHEEL_EXPECTED, strict=False):
            put(f"{segment}.{symbol}", value, expected)
        if rails is not None and rails[i, 2:].any():
            for symbol, value, expected in zip(RAIL, rails[i].tolist(), RAIL_EXPECTED, strict=True):
                put(f"{segment}.{symbol}", value, expected)
        if strains is not None and i < len(cables):
            put(f"{cables[i]}.{STRETCH}", strains[i], max(SOFTER * strains[i], 1e-7))
        if drums is not None and i < len(cables):
            put(f"{cables[i]}.{GAIN}", drums[i], DRUM)
        if growths is not None and i < len(cables):
            put(f"{cables[i]}.{BUILD_UP}", growths[i], GROWTH)
    return list(rows.values())

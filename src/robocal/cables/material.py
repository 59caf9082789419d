"""Numbers of a cable that it may share with others, as parameters: its pulley, its stretch, and the gain of its drum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal.cables.pulley import Pulleys
from robocal.parameters import Parameter

__all__ = ["DRUM", "GAIN", "STRETCH", "UNITS", "WHEEL", "material_rows"]

WHEEL = ("radius", "nx", "ny", "nz")
STRETCH = "elasticity"
GAIN = "gain"
UNITS = {"radius": "m", STRETCH: "1/N"}
WHEEL_EXPECTED = (0.005, 0.05, 0.05, 0.05)  # m, and what an axis is off that somebody set by eye
SOFTER = 0.5  # of itself: what a catalogue knows of a rope's elasticity
DRUM = 0.02  # of its circumference, with the cable that lies on it


def material_rows(
    cables: Sequence[str],
    pulleys: Pulleys | None,
    elasticity: ArrayLike | None,
    gain: ArrayLike | None,
    shared: Mapping[str, str],
) -> list[Parameter]:
    """What is known of pulleys, of stretch and of drums, as parameters; a cable without a pulley has none."""
    rows: dict[str, Parameter] = {}

    def put(name: str, value: float, expected: float) -> None:
        whose = shared.get(name, name)
        rows.setdefault(whose, Parameter(whose, value, UNITS.get(name.rpartition(".")[2], "1"), expected=expected))

    m, wheels = len(cables), np.zeros((len(cables), 4))
    if pulleys is not None:
        wheels[:, 0], wheels[:, 1:] = pulleys.radius, pulleys.axis
    strains, drums = (
        None if v is None else np.broadcast_to(np.asarray(v, float), m).tolist() for v in (elasticity, gain)
    )
    for i, (cable, wheel) in enumerate(zip(cables, wheels.tolist(), strict=True)):
        for symbol, value, expected in zip(WHEEL, wheel if wheel[0] != 0 else (), WHEEL_EXPECTED, strict=False):
            put(f"{cable}.{symbol}", value, expected)
        if strains is not None:
            put(f"{cable}.{STRETCH}", strains[i], max(SOFTER * strains[i], 1e-7))
        if drums is not None:
            put(f"{cable}.{GAIN}", drums[i], DRUM)
    return list(rows.values())

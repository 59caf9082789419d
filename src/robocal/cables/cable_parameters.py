"""The parameters of a cable robot: what they are called, in which units, and how far off each may be before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robocal._types import Array
from robocal.parameters import Parameter

__all__ = ["COMMON", "EXPECTED", "PLATFORM", "SYMBOLS", "anchor_parameters"]

SYMBOLS = ("ax", "ay", "az", "bx", "by", "bz", "l0")
PLATFORM = "platform"  # whose mass and centre of mass are, where load cells tell them
COMMON = "cables"  # whose a number is that all cables have together
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

"""What a cable robot can do: the components of the twist that its platform has."""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["DEGREES"]

SPATIAL = (0, 1, 2, 3, 4, 5)

# What a robot can do, by plane (`plane` is that of a planar robot): the components of the twist (v, w) that it has.
DEGREES: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "3R3T": {"xy": SPATIAL, "xz": SPATIAL, "yz": SPATIAL},
    "3T": {"xy": SPATIAL[:3], "xz": SPATIAL[:3], "yz": SPATIAL[:3]},
    "1R2T": {"xy": (0, 1, 5), "xz": (0, 2, 4), "yz": (1, 2, 3)},
    "2T": {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)},
}

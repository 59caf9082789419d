"""The measurement kinds that exist: one line each. Its module in this package, of the same name, is loaded when a kind is met."""

from __future__ import annotations

__all__ = ["NAMES"]

NAMES = tuple(
    "bearing current displacement distance elongation inclination joint_torque lengths load pixels plane plane_points plane_targets "
    "point pose position range relative_pose sag sphere spherical swivel torque winches".split()
)

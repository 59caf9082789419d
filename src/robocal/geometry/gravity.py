"""Standard gravity in base axes, z up."""

from __future__ import annotations

__all__ = ["GRAVITY"]

# m/s^2, by definition (3rd CGPM, 1901); where a robot stands it differs by up to 0.3 %.
GRAVITY = (0.0, 0.0, -9.80665)

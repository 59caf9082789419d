"""How large a place is that is visited again, and how far from others; `diagnose.limits` says why."""

__all__ = ["PLACE_APART", "PLACE_DIAMETER", "PLACE_SHARE"]

PLACE_DIAMETER = 0.15
PLACE_APART = 4.0
PLACE_SHARE = 1 / 3

"""How large a place is that is visited again, and how far from others; `diagnose.limits` says why."""

__all__ = ["PLACE_DIAMETER", "PLACE_GAP", "PLACE_SHARE"]

PLACE_DIAMETER = 0.15
PLACE_GAP = 4.0
PLACE_SHARE = 1 / 3

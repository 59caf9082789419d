"""How tensions are chosen by default: the one place for library, command line and Python. Cheap to import."""

from __future__ import annotations

__all__ = ["METHOD", "POWER"]

METHOD = "norm"  # the least sum of squares
POWER = 4.0  # of the p-norm

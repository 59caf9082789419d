"""How large the long statistics are: as they run in CI, or, with ROBOCAL_FULL=1, as large as the figures that are quoted."""

from __future__ import annotations

import os
from typing import TypeVar

T = TypeVar("T")


def size(full: T, usual: T) -> T:
    """The one or the other."""
    return full if os.environ.get("ROBOCAL_FULL") else usual

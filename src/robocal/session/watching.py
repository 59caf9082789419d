"""What long work tells whoever waits, and what becomes of numbers that no computer can handle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from robocal.errors import ModelError
from robocal.progress import Watch

__all__ = ["Watch", "computable"]


@contextmanager
def computable(*names: object) -> Iterator[None]:
    """Numbers that no computer can handle (1e308 mm) are wrong input, whoever stumbles over them. Raises ModelError."""
    try:
        yield
    except np.linalg.LinAlgError:
        found = ", ".join(str(n) for n in names)
        raise ModelError("some numbers are far too large or too small to compute with", key=found) from None

"""The rows of one file, while it is read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.diagnose.check_registry import Context, M_co

__all__ = ["TableContext"]


@dataclass(frozen=True)
class TableContext(Context[M_co]):
    """Beside the data of a file: the joint values of its rows, (m, n), the numbers that it gives these rows, (m,), and its name."""

    joints: NDArray[np.float64] | None = None
    lines: NDArray[np.int64] | None = None
    file: str = ""

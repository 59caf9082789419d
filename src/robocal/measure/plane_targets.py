"""Points in the image plane of a probe, against points: r = R S (u, v) + t - a - y.

As `plane_points`, with value y (k, 3) in m: the points a of a phantom, each of which the image plane is brought to.
"""

from __future__ import annotations

from robocal.measure.plane_points import IMAGE, NUMBERS, ROWS
from robocal.measure.rows import Kind, register

__all__ = ["PLANE_TARGETS"]

PLANE_TARGETS = register(Kind("plane_targets", 3, ROWS, owner=IMAGE, numbers=NUMBERS, views=True, placed=True))

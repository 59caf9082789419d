"""Maps of markers: where square markers are to one another, with what all of that may be off by."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import require
from robocal.geometry import se3
from robocal.vision.sheets import SQUARE

__all__ = ["MarkerMap"]


@record(eq=False)
class MarkerMap:
    """Names (M) of markers, the edges of their black squares (M,) in m, their poses T_map_marker as frame vectors (M, 6), and the
    covariance (6M, 6M) of the small motions (v, w) of each in map axes, p <- p + v and R <- exp(w) R, or None where nobody states it.

    Where sizes were found beside the places, `size_covariance` (M, 7M) is that of each edge with the small motions of all markers, and
    behind these with all edges, m and rad; `size_errors` is what the edges that were told could be off by: all alike (m), and each (of
    itself). Every map of these prints has that error in common.

    A map is known but for where it is as a whole: its covariance is the one in which no motion of all markers together is counted. z of
    a marker points out of its printed side, corners are counted from the top left: 0 (-, +), 1 (+, +), 2 (+, -), 3 (-, -).
    """

    names: tuple[str, ...]
    size: Array
    vector: Array
    covariance: Array | None = None
    family: str | None = None
    source: str = ""
    size_covariance: Array | None = None
    size_errors: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        count = len(self.names)
        require(len(set(self.names)) == count, "a map names a marker twice", found=str(self.names), expected="one each")
        require(self.size.shape == (count,), "other sizes than markers", found=self.size.shape, expected=str((count,)))
        require(
            self.vector.shape == (count, 6),
            "other poses than markers",
            found=self.vector.shape,
            expected=str((count, 6)),
        )

    @property
    def poses(self) -> Array:
        """T_map_marker (M, 4, 4)."""
        return se3.from_vector(self.vector)

    @property
    def joint(self) -> Array | None:
        """The covariance (7M, 7M) of the small motions, and behind them of the edges; (6M, 6M) where sizes were not found."""
        if self.covariance is None or self.size_covariance is None:
            return self.covariance
        across = self.size_covariance[:, : len(self.covariance)]
        return np.block([[self.covariance, across.T], [self.size_covariance]])

    @property
    def corners(self) -> Array:
        """Corners (M, 4, 3) in map axes, m."""
        own = SQUARE * (self.size / 2)[:, None, None]
        poses = self.poses
        return np.asarray(np.einsum("mij,mkj->mki", poses[:, :3, :3], own) + poses[:, None, :3, 3])

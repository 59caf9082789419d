"""Whether a lens that was given bends edges of markers that are straighter without it.

    P(at least k of n) = sum_j>=k C(n, j) / 2^n

Each marker is fitted with the lens and without. Where the lens is right, or bends nothing, no more than half of the fits leave less without
it. A lens that is nearer to the true one than none is not told by this.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._types import Array
from robocal.diagnose.vision_limits import LENS_CONTRADICTED
from robocal.files.image_files import GreyImage
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.target import cells_of
from robocal.vision.marker.fit import fit_marker
from robocal.vision.sightings import BOARD, Sighting

__all__ = ["LensEdges"]

MOST, OF_AN_IMAGE = 60, 6  # grid: markers that are fitted once more, of all images and of one


class LensEdges:
    """Markers that were fitted with a lens (n,) and without: how many, and how many leave less without it."""

    def __init__(self, family: str, lens: Array) -> None:
        self.family, self.lens = family, lens
        self.count = self.worse = 0

    def add(self, image: GreyImage, seen: Sequence[Sighting]) -> None:
        """Some markers of an image, those that are seen largest: there a lens bends most."""
        markers = [s for s in seen if s.marker != BOARD and len(s.corner) == 4]
        for s in sorted(markers, key=lambda s: -float(np.ptp(s.place, axis=0).max()))[:OF_AN_IMAGE]:
            if self.count == MOST:
                return
            cells = cells_of(self.family, s.marker)
            bare = fit_marker(image.levels, s.place, cells)
            if bare is None:
                continue
            bent = fit_marker(image.levels, s.place, cells, self.lens)
            self.count += 1
            self.worse += bent is None or bent.noise > bare.noise

    @property
    def remarks(self) -> list[Remark]:
        """That the lens is contradicted, where chance does not leave so many worse."""
        if not self.count:
            return []
        chance = float(scipy.special.bdtrc(self.worse - 1, self.count, 0.5)) if self.worse else 1.0
        if chance > 2 * float(scipy.special.ndtr(-LENS_CONTRADICTED)):
            return []
        return [Remark.of(Code.LENS_BENDS, count=self.worse, total=self.count)]

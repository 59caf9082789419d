"""How often an image is looked at for markers."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.files import marker_search
from robocal.files.images import family_cells

pytest.importorskip("cv2")


def test_a_second_look_is_for_what_the_first_has_not_found(monkeypatch):
    """Of a sheet whose numbers are known nothing more is looked for where all of them were found."""
    grey = np.full((160, 260), 220, dtype=np.uint8)
    for k, number in enumerate((3, 17)):
        cells = 30 + 190 * np.kron(family_cells("6x6_250", [number])[0], np.ones((9, 9)))
        grey[40:112, 40 + 100 * k : 112 + 100 * k] = cells
    looks = []
    look = marker_search._look
    monkeypatch.setattr(marker_search, "_look", lambda *a, **k: looks.append(1) or look(*a, **k))
    for wanted, count in (((3, 17), 1), ((3, 17, 18), 2), ((), 2)):
        looks.clear()
        found = marker_search.find_markers(grey, "6x6_250", 1, wanted)
        assert sorted(found.ids.tolist()) == [3, 17] and len(looks) == count

"""Dictionaries of markers, as OpenCV has them."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from robocal.errors import MissingExtra, ModelError
from robocal.files.images import FAMILIES, family_cells


@pytest.mark.parametrize("family", FAMILIES)
def test_cells_are_black_and_white_in_a_black_border(family):
    pytest.importorskip("cv2")
    for border in (1, 2):
        cells = family_cells(family, range(4), border)
        assert set(np.unique(cells)) == {0.0, 1.0} and cells.shape[0] == 4 and cells.shape[1] == cells.shape[2]
        inside = np.zeros(cells.shape[1:], bool)
        inside[border:-border, border:-border] = True
        assert not cells[:, ~inside].any() and all(c[inside].any() for c in cells)


def test_names_and_numbers_that_no_dictionary_has():
    pytest.importorskip("cv2")
    assert np.array_equal(family_cells("DICT_APRILTAG_36h11", [5]), family_cells("tag36h11", [5]))
    with pytest.raises(ModelError, match="6x6_250"):
        family_cells("6x6_25", [0])
    with pytest.raises(ModelError, match="0 to 586 of 36h11"):
        family_cells("36h11", [3, 587])


def test_without_opencv_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingExtra, match=r"pip install 'robocal\[vision\]'"):
        family_cells("6x6_250", [0])

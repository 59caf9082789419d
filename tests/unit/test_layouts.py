"""Laws of layouts: what is called the largest fits, and nothing larger does; nothing of a sheet lies upon another part."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.errors import ModelError
from robocal.vision.layouts import MARGIN, PATTERNS, SheetLayout, compose, largest
from robocal.vision.sheets import Sheet

FOOT = 0.02


def count(layout):
    squares = layout.columns * layout.rows
    return {"checkerboard": 0, "charuco": squares // 2}.get(layout.pattern, squares)


def make(layout, size, paper):
    n = count(layout)
    return compose("a", layout, size, paper, FOOT, "own", np.arange(n), np.zeros((n, layout.cells, layout.cells)))


def reach(sheet: Sheet):
    """Left, low, right, high of all that is black."""
    boxes = [(m.x, m.y, m.size, m.size) for m in sheet.markers] + [(x, y, e, e) for x, y, e in sheet.squares]
    boxes += [(c.x, c.y, c.columns * c.square, c.rows * c.square) for c in sheet.checkers]
    at = np.array(boxes)
    return np.concatenate([(at[:, :2] - at[:, 2:] / 2).min(axis=0), (at[:, :2] + at[:, 2:] / 2).max(axis=0)])


@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_largest_fits_and_no_larger(pattern):
    rng = np.random.default_rng(PATTERNS.index(pattern))
    for _ in range(12):
        paper = tuple(np.round(rng.uniform(0.15, 0.6, 2), 3))
        columns, rows = (1, 1) if pattern == "marker" else (int(n) for n in rng.integers(2, 7, 2))
        layout = SheetLayout(pattern, columns, rows, 0 if pattern == "checkerboard" else int(rng.choice([6, 8, 10])))
        size = largest(layout, np.array(paper) - 2 * MARGIN - [0, FOOT])
        sheet = make(layout, size, paper)
        left, low, right, high = reach(sheet)
        white = layout.quiet(size) - 1e-9
        side = max(MARGIN, white) - 1e-9
        assert left >= side - paper[0] / 2 and right <= paper[0] / 2 - side and high <= paper[1] / 2 - side
        assert low >= -paper[1] / 2 + MARGIN + FOOT + white  # the text leaves it white
        assert np.allclose([right - left, high - low], layout.extent(size))
        with pytest.raises(ModelError, match=f"at most {1e3 * size:g} mm"):
            make(layout, size + 0.0005, paper)


def test_markers_stand_apart_by_two_cells():
    for cells in (6, 8, 10):
        sheet = make(SheetLayout("grid", 3, 4, cells), 0.03, (0.21, 0.297))
        places = np.array([(m.x, m.y) for m in sheet.markers])
        far = np.abs(places[:, None] - places[None]).max(axis=2)
        assert np.isclose(far[far > 0].min(), 0.03 * (1 + 2 / cells))
        with pytest.raises(ModelError, match="two cells"):
            make(SheetLayout("grid", 3, 4, cells, pitch=0.03 * (1 + 1.9 / cells)), 0.03, (0.21, 0.297))
    # By rows from the top left; as Kalibr has an AprilGrid, from the bottom left.
    ids = {
        (pattern, m.id): (m.x, m.y)
        for pattern in ("grid", "aprilgrid")
        for m in make(SheetLayout(pattern, 3, 2, 10), 0.03, (0.3, 0.3)).markers
    }
    assert ids["grid", 1][0] > ids["grid", 0][0] and ids["grid", 3][1] < ids["grid", 0][1]
    assert ids["aprilgrid", 1][0] > ids["aprilgrid", 0][0] and ids["aprilgrid", 3][1] > ids["aprilgrid", 0][1]


def test_squares_of_an_aprilgrid_touch_every_corner():
    sheet = make(SheetLayout("aprilgrid", 4, 3, 10), 0.03, (0.3, 0.3))
    corners = {
        (round(x + a * e / 2, 9), round(y + b * e / 2, 9))
        for x, y, e in sheet.squares
        for a in (-1, 1)
        for b in (-1, 1)
    }
    for m in sheet.markers:
        for a in (-1, 1):
            for b in (-1, 1):
                assert (round(m.x + a * m.size / 2, 9), round(m.y + b * m.size / 2, 9)) in corners
    assert len(sheet.squares) == 5 * 4

"""Crossings of a board under a lens that bends its edges, in drawn images."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.simulation.images import Photograph, render
from robocal.vision.camera import image_of
from robocal.vision.checker.crossing import fit_saddles
from robocal.vision.sheets import Checker, Sheet, inner_corners

SIZE, LENS = (640, 480), np.array([330.0, 332.0, 318.0, 241.0, -0.28, 0.07, 0.0, 0.0, 0.0])
BOARD = Checker(10, 8, 0.03)


def test_with_the_lens_crossings_are_where_they_are(rng):
    """Edges of a wide lens are bent: what that costs is gone, and what noise costs is told by sigma."""
    at = np.diag([1.0, -1, -1, 1])
    at[2, 3] = 0.2
    true = image_of(inner_corners(BOARD).reshape(-1, 3) @ at[:3, :3].T + at[:3, 3], LENS)
    for noise, least, most in ((0.0, 0.002, 0.003), (3.0, 0.01, 0.012)):
        how = Photograph(blur=0.8, noise=noise)
        levels = render([(Sheet("b", 0.36, 0.3, (), (BOARD,)), at)], LENS, SIZE, how, 110.0, rng).astype(float)
        left = {}
        for lens in (None, LENS):
            seen = fit_saddles(levels, np.arange(len(true)), true + 0.3, 9, lens)
            assert seen is not None and len(seen.corner) == len(true)
            left[lens is not None] = seen.place - true[seen.corner]
        with_lens, without = (float(np.sqrt(np.mean(left[k] ** 2))) for k in (True, False))
        assert with_lens < least and without > most
        if noise:
            assert np.mean((left[True] / seen.sigma) ** 2) == pytest.approx(1.0, abs=0.4)

"""The views that would say most of a lens beside those that there are, as a list: for a lens that was found, and before one is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.planning.lens_views import NextView, next_views
from robocal.quantities import Column, Listing
from robocal.session.vision.lens_fit import expected_of, plain_lens
from robocal.vision.lens_start import find_focal, flat_places, flat_poses, look_flat
from robocal.vision.lenses import Lens

__all__ = ["further_views", "views_before_a_fit"]

VIEWS = 10  # grid: that are foretold
STATED = 0.1  # px: of a corner, before anything says better; what prints and lenses leave, more than what a corner is known to
EDGES = {(0, 0): "none", (-1, 0): "left", (1, 0): "right", (0, -1): "upper", (0, 1): "lower"}


def further_views(points: Array, poses: Array, lens: Lens, free: Sequence[str], sigma: float) -> Listing:
    """Where the target should be: its middle (px), the share of the image that it fills, its tilt and the edge that lies away; how sure a
    pixel is with each view and those before it. The first row is what the views that there are say."""
    assert lens.size is not None
    columns = [i for i, s in enumerate(lens.kind.symbols) if s in free]
    expected = np.array([expected_of(lens.kind.symbols[i], lens.size[0]) for i in columns])
    now, views = next_views(points, poses, lens.intrinsics, columns, expected, lens.size, sigma, VIEWS)
    return _listing(now, views, lens.size)


def views_before_a_fit(points: Array, pixels: Array, view: Ints, count: int, size: tuple[int, int]) -> Listing | None:
    """The same from corners alone, with places (n, 3) on one flat target in any unit, pixels (n, 2) and the view (n,) of so many that each
    is in; None where no two views say what lens it roughly is."""
    places = flat_places(points)
    if places is None:
        return None
    seen = look_flat(places, pixels, view, np.zeros(len(view), dtype=np.int64))
    lens = plain_lens(size, "brown")
    focal = find_focal(seen, size) or lens.numbers[0]
    lens = Lens.of(lens.model, [focal, focal, *lens.numbers[2:]], size)
    poses = flat_poses(seen, lens.intrinsics)
    if not len(poses):
        return None
    target = np.unique(np.column_stack([places, np.zeros(len(places))]), axis=0)
    return further_views(target, poses, lens, lens.kind.symbols, STATED)


def _listing(now: float, views: Sequence[NextView], size: tuple[int, int]) -> Listing:
    nothing = np.nan
    at = np.array([[(n - 1) * (1 + m) / 2 for n, m in zip(size, v.middle, strict=True)] for v in views]).reshape(-1, 2)
    return Listing((
        Column("view", "", ["now", *(f"+ {k + 1}" for k in range(len(views)))]),
        Column("u", "px", np.append(nothing, at[:, 0]), figures=4, label="middle u [px]"),
        Column("v", "px", np.append(nothing, at[:, 1]), figures=4, label="middle v [px]"),
        Column("fills", "", np.append(nothing, [v.share for v in views]), spec=".0%", label="fills of the image"),
        Column("tilt", "deg", np.append(nothing, [np.degrees(v.tilt) for v in views]), figures=2),
        Column("away", "", ["", *(EDGES[v.away] for v in views)], label="edge away"),
        Column("sure", "px", np.append(now, [v.sure for v in views]), figures=2, label="a pixel is sure to [px]"),
    ))  # fmt: skip

"""A map that begins through a lens which was stated wrong ends where a fit from the truth does."""

from __future__ import annotations

import numpy as np
import pytest
from lens_world import SIZE
from map_rigs import Plan
from session.test_map_requirement import NOISE, cameras, lens, plan

from robocal._record import replace
from robocal.estimate.least_squares import least_squares
from robocal.measure.base import problem as build
from robocal.measure.machine import Rig
from robocal.session.vision.map_requirement import corner_table, predict_map
from robocal.session.vision.marker_places import place_markers
from robocal.vision.lenses import Lens
from robocal.vision.map_views import project_map

WIDE = {"fx": 3.0, "fy": 3.0, "cx": 4.0, "cy": 4.0, "k1": 0.05, "k2": 0.05, "p1": 0.05, "p2": 0.05}


def table_of(seed):
    """Corners of four views through a lens that is drawn from wide priors, and how many views show each marker."""
    rng, stated = np.random.default_rng(seed), lens()
    wide = Lens.of("brown", stated.numbers, SIZE, tuple(WIDE), np.diag(np.square(list(WIDE.values()))))
    views = cameras(4, seed)
    told = predict_map(plan(), views, wide, NOISE, SIZE)
    rig = Plan(told.map, views[told.markers > 0], wide, NOISE, SIZE, told)
    numbers = np.array(wide.intrinsics)
    numbers[: len(WIDE)] += list(WIDE.values()) * rng.normal(size=len(WIDE))
    sights = project_map(rig.there, rig.views, wide.intrinsics, SIZE)
    sights = replace(sights, pixels=rig.seen_through(sights, numbers))
    many = np.bincount(sights.marker, minlength=len(rig.there.names))
    table = rig.noisy(corner_table(rig.there, rig.views, sights, many, NOISE, SIZE), 1.0, rng)
    return table.with_prior(wide), many


# Of the first thirty draws, those whose first start ends elsewhere, at 1.04 to 4.9 times the cost.
@pytest.mark.parametrize("seed", [7, 19, 21, 23])
def test_a_marker_in_one_view_begins_at_the_right_one_of_its_two_tilts(seed):
    table, many = table_of(seed)
    assert (many == 1).any()
    held = int(many.argmax())
    targets = tuple(replace(t, free=(i != held,) * 6) for i, t in enumerate(table.pixels.targets))
    at_truth = replace(table.data, observations=(replace(table.pixels, targets=targets),))
    best = least_squares(build(Rig("map"), at_truth)).cost[0]
    assert least_squares(build(Rig("map"), place_markers(table).data)).cost[0] == pytest.approx(best, abs=1e-3)

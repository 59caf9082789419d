"""The way in two stages beside one estimate: a map from images alone, then the robot with that map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from field_world import LENS, rig

from robocal.errors import ModelError
from robocal.fit.options import Options
from robocal.prove.identify import identify
from robocal.session.two_stages import identify_in_stages, views_of_map

QUICK = Options(leave_one_out=False)


def farthest_anchor(found, truth):
    """The rms error of a coordinate of the anchors, m."""
    names = [n for n in truth.table.names if ".a" in n]
    off = [found.corrected.table[n].value - truth.table[n].value for n in names]
    return float(np.sqrt(np.mean(np.square(off))))


def unseen(found):
    """The mean error of readings of unseen poses, m."""
    return next(s.held_out.mean for s in found.stages if s.unit == "m")


@pytest.mark.slow
def test_a_map_that_a_wrong_lens_bends_is_not_mended_by_the_robot():
    """k1 is off by 0.03, and the lens is told to 0.05: one estimate finds it, two stages keep it."""
    true = np.array(LENS)
    true[4] += 0.03
    model, truth, data = rig(level=False, lens=tuple(true))
    joint, staged = identify(model, data, QUICK), identify_in_stages(model, data, QUICK)
    errors = [farthest_anchor(f, truth) for f in (joint, staged)]
    print(f"anchors off by {1e3 * errors[0]:.1f} mm, in two stages by {1e3 * errors[1]:.1f} mm")
    print(f"unseen readings {1e3 * unseen(joint):.2f} mm, in two stages {1e3 * unseen(staged):.2f} mm")
    assert errors[1] > 3 * errors[0] and unseen(staged) > unseen(joint)
    assert all(p.status == "fixed" for p in staged.parameters if p.name.startswith(("lens.", "m")))


def test_images_that_show_no_map_are_refused_before_anything_is_fitted():
    _, _, data = rig(level=False, count=6)
    with pytest.raises(ModelError, match="one camera"):
        views_of_map(replace(data, observations=data.observations[:1]))
    lengths, seen = data.observations
    free = tuple(replace(t, free=(True,) * 6) for t in seen.targets)
    with pytest.raises(ModelError, match="a map to be found"):
        views_of_map(replace(data, observations=(lengths, replace(seen, targets=free))))
    board = {**seen.extra, "point": seen.extra["point"] * [1.0, 0.5, 1.0]}
    with pytest.raises(ModelError, match="corners of squares"):
        views_of_map(replace(data, observations=(lengths, replace(seen, extra=board))))

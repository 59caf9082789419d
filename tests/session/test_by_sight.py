"""Rows of poses along the line of sight: the residuals of the camera's own axes, turned, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from session.test_pose_pairs import cell

from robocal._record import replace
from robocal.measure.base import problem
from robocal.measure.machine import Rig
from robocal.measure.pose import SIGHT
from robocal.parameters import ParameterTable
from robocal.session.vision.pose_pairs import CAMERA, PosePairs, pair_data


@pytest.mark.parametrize("inhand", [True, False])
def test_rows_are_turned_to_the_line_of_sight(inhand):
    rng, flange, seen, *_ = cell(2, 8, inhand)
    data = pair_data(PosePairs(seen, inhand, flange), flange)
    (obs,) = data.observations
    assert obs.options[SIGHT] is True
    plain = replace(data, observations=(replace(obs, options={}),))
    by, own = (problem(Rig(CAMERA, ParameterTable(), ()), d) for d in (data, plain))
    x = by.start + 0.1 * rng.normal(size=by.start.shape)
    turned, straight = (p.residuals(x)[0].value for p in (by, own))
    for part in (slice(0, 3), slice(3, 6)):
        np.testing.assert_allclose(np.linalg.norm(turned[:, part], axis=1), np.linalg.norm(straight[:, part], axis=1))
    # Along the line of sight is the third number, of both.
    ahead = seen[:, :3, 3] / np.linalg.norm(seen[:, :3, 3], axis=1, keepdims=True)
    for first in (0, 3):
        np.testing.assert_allclose(
            turned[:, first + 2], np.sum(straight[:, first : first + 3] * ahead, axis=1), atol=1e-12
        )
    j, step = by.linearize(x).j, 1e-6
    for k, name in enumerate(by.free):
        move = np.zeros_like(x)
        move[0, by.table.index[name]] = step
        ends = [by.linearize(x + s * move).r for s in (1, -1)]
        np.testing.assert_allclose(j[:, k], (ends[0] - ends[1]) / (2 * step), rtol=1e-5, atol=1e-5 * np.abs(j).max())

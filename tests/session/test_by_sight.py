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
    turned, straight = (p.residuals(x)[0].value[..., None] for p in (by, own))
    j, plainly = (p.linearize(x).j.reshape(8, 6, -1) for p in (by, own))
    ahead = seen[:, :3, 3] / np.linalg.norm(seen[:, :3, 3], axis=1, keepdims=True)
    for one, other in ((turned, straight), (j, plainly)):
        for first in (0, 3):
            here, there = one[:, first : first + 3], other[:, first : first + 3]
            np.testing.assert_allclose(
                np.linalg.norm(here, axis=1), np.linalg.norm(there, axis=1), atol=1e-9 * np.abs(there).max()
            )
            # Along the line of sight is the third number, of both.
            along = np.einsum("mij,mi->mj", there, ahead)
            np.testing.assert_allclose(here[:, 2], along, atol=1e-9 * np.abs(there).max())

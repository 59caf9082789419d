"""Errors of given flange poses are read off what frames leave: place and turn by themselves, and none where there are none."""

from __future__ import annotations

import numpy as np
import pytest
from hand_eye_world import HAND, TABLE, rigid
from lens_world import BOARD, LENS, SIZE, see

from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.prove.decision import decide

NOISE = 0.1  # px


def share_of(place, turn, views=40, seed=1):
    """The share of the robot in views of a board by a camera in the hand, whose poses are off by place (m) and turn (rad)."""
    rng = np.random.default_rng(seed)
    start, pixels = [], []
    while len(start) < views:
        y = rigid(rng.uniform(-1, 1, 3) * (0.6, 0.6, 1.5), [*rng.uniform(-0.05, 0.05, 2), rng.uniform(0.42, 0.6)])
        y[:3, :3] = y[:3, :3] @ np.diag([1.0, -1, -1])
        uv = see(BOARD @ y[:3, :3].T + y[:3, 3], LENS)
        if not ((uv > 5).all() and (uv < np.array(SIZE) - 6).all()):
            continue
        flange = TABLE @ np.linalg.inv(HAND @ y)
        off = rigid(turn * rng.normal(size=3), place * rng.normal(size=3))
        there = np.array(flange)
        there[:3, :3], there[:3, 3] = off[:3, :3] @ flange[:3, :3], flange[:3, 3] + off[:3, 3]
        start.append(se3.to_vector(there))
        pixels.append(uv + NOISE * rng.normal(size=uv.shape))
    value, count = np.concatenate(pixels), len(BOARD)
    obs = Observations(
        "pixels", np.repeat(np.arange(views), count), value, np.full_like(value, NOISE), frame=Frame("camera", free=(True,) * 6, mount="tool"),
        targets=(Frame("board", free=(True,) * 6, mount="base"),), target=np.zeros(len(value), dtype=np.int64),
        extra={"point": np.tile(BOARD, (views, 1))}, options={"camera": "lens", "intrinsics": tuple(LENS.values()), "free": ()},
    )  # fmt: skip
    where = Configurations(tuple(f"v{i}" for i in range(views)), start=np.array(start))
    return decide(Rig("robot", freedom=()), DataSet(where, (obs,)), Options()).share


@pytest.mark.parametrize(("place", "turn"), [(8e-4, 1e-5), (1e-5, 8e-4), (5e-4, 1e-3)])
def test_errors_of_poses_are_told_apart(place, turn):
    share = share_of(place, turn)
    assert share.covariance is not None and share.errors is not None
    assert np.allclose(share.errors, (place, turn), rtol=0.25, atol=1.2e-4), share.errors
    assert share.times < 1.5


def test_a_robot_without_errors_has_none():
    share = share_of(0.0, 0.0)
    assert share.covariance is None and share.errors is None and share.times < 1.2

"""Camera, board and lens of a hand-eye calibration by pixels: the truth lies within 1.96 sigma as often as is told.

Rigs are drawn from what is stated of them: the lens from its prior, every flange pose from errors of the robot, corners from their noise.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from lens_world import BOARD, LENS, SIZE, see, turn

from robocal.fit.options import Options
from robocal.geometry import se3, so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS, ParameterTable
from robocal.prove.decision import decide

COUNT = 200 if os.environ.get("ROBOCAL_FULL") else 40
PRIOR = dict(zip(LENS, [5.0, 5.0, 5.0, 5.0, 0.01, 0.01, 0.0005, 0.0005, 0.0], strict=True))
KNOWN = tuple(s for s, sigma in PRIOR.items() if sigma)
NOISE = 0.15  # px
HAND = np.array([0.03, 0.06, 0.05, 0.02, -0.03, 1.4])
BOARD_AT = np.array([0.5, 0.1, 0.02, 0.0, 0.02, 0.3])


def draw(seed, robot, views=20):
    """A rig (camera in the hand) whose poses are off by `robot` (m, rad), as data."""
    rng = np.random.default_rng(seed)
    lens = {s: v + PRIOR[s] * rng.normal() for s, v in LENS.items()}
    start, pixels = [], []
    while len(start) < views:
        z = rng.uniform(0.35, 0.6)
        seen = se3.compose(
            turn(rng.uniform(-1, 1, 3) * (0.6, 0.6, 2)) @ np.diag([1.0, -1, -1]), [*rng.uniform(-0.1, 0.1, 2), z]
        )
        uv = see(BOARD @ seen[:3, :3].T + seen[:3, 3], lens)
        if (uv < 5).any() or (uv > np.array(SIZE) - 6).any():
            continue
        flange = se3.from_vector(BOARD_AT) @ se3.inverse(se3.from_vector(HAND) @ seen)
        start.append(se3.to_vector(se3.displace(flange, rng.normal(0, robot[0], 3), rng.normal(0, robot[1], 3))))
        pixels.append(uv + rng.normal(0, NOISE, uv.shape))
    value = np.concatenate(pixels)
    m = len(BOARD)
    obs = Observations(
        "pixels", np.repeat(np.arange(views), m), value, np.full_like(value, NOISE), frame=Frame("camera", free=(True,) * 6, mount="tool"),
        targets=(Frame("board", free=(True,) * 6, mount="base"),), target=np.zeros(len(value), dtype=np.int64),
        extra={"point": np.tile(BOARD, (views, 1))},
        options={
            "camera": "lens", "intrinsics": tuple(LENS.values()), "free": KNOWN, "known": KNOWN,
            "covariance": tuple(map(tuple, np.diag([PRIOR[s] ** 2 for s in KNOWN]).tolist())),
        },
    )  # fmt: skip
    where = Configurations(tuple(f"v{i}" for i in range(views)), start=np.array(start))
    return DataSet(where, (obs,)), lens


def miss(seed, robot):
    """What each parameter is off by, in its sigma: names, (n,)."""
    data, lens = draw(seed, robot)
    found = decide(Rig("rig", ParameterTable(), ()), data, Options())
    names, covariance = found.spread
    sigma = dict(zip(names, np.sqrt(np.diag(covariance)), strict=True))
    out = {f"lens.{s}": (found.values[f"lens.{s}"] - lens[s]) / sigma[f"lens.{s}"] for s in KNOWN}
    for name, true in (("camera", HAND), ("board", BOARD_AT)):
        vector = np.array([found.values[f"{name}.{s}"] for s in FRAME_SYMBOLS])
        away = np.append(vector[:3] - true[:3], so3.log(so3.exp(vector[3:]) @ so3.exp(true[3:]).T))
        out |= {f"{name}.{s}": v / sigma[f"{name}.{s}"] for s, v in zip(FRAME_SYMBOLS, away, strict=True)}
    return out


@pytest.mark.slow
@pytest.mark.parametrize("robot", [(0.0, 0.0), (3e-4, 6e-4)], ids=["exact", "off"])
def test_intervals_cover(robot):
    """All 20 numbers together; a Monte Carlo error of the share counts views of one rig as one."""
    off = [miss(seed, robot) for seed in range(COUNT)]
    inside = np.array([[abs(v) < 1.96 for v in one.values()] for one in off])
    share, error = inside.mean(), inside.mean(axis=1).std() / np.sqrt(COUNT)
    print({n: round(float(s), 3) for n, s in zip(off[0], inside.mean(axis=0), strict=True)})
    print(f"{share:.3f} +- {error:.3f}")
    low, high = (0.93, 0.97) if COUNT >= 200 else (0.95 - 3 * error - 0.01, 0.95 + 3 * error)
    assert low <= share <= high

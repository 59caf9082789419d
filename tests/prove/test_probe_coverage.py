"""Image plane, pixels and phantom: the truth lies within 1.96 sigma as often as is told. Rigs are drawn from the stated priors."""

from __future__ import annotations

import os

import numpy as np
import pytest
from probe_world import PIXEL, RIG, draw

from robocal.fit.options import Options
from robocal.geometry import se3, so3
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.decision import decide

COUNT = 200 if os.environ.get("ROBOCAL_FULL") else 30


def miss(seed):
    """What each parameter is off by, in its sigma."""
    data, probe = draw(seed)
    found = decide(RIG, data, Options())
    names, covariance = found.spread
    sigma = dict(zip(names, np.sqrt(np.diag(covariance)), strict=True))
    out = {
        f"image.{s}": (found.values[f"image.{s}"] - v) / sigma[f"image.{s}"]
        for s, v in zip(("su", "sv"), PIXEL, strict=True)
    }
    for name, true in (("image", probe.image), ("phantom", probe.phantom)):
        there = se3.from_vector(np.array([found.values[f"{name}.{s}"] for s in FRAME_SYMBOLS]))
        away = np.append(there[:3, 3] - true[:3, 3], so3.log(there[:3, :3] @ true[:3, :3].T))
        out |= {f"{name}.{s}": v / sigma[f"{name}.{s}"] for s, v in zip(FRAME_SYMBOLS, away, strict=True)}
    return out


@pytest.mark.slow
def test_intervals_cover():
    """Each group by itself; a Monte Carlo error of the share counts the numbers of one rig as one."""
    off = [miss(seed) for seed in range(COUNT)]
    inside = {n: np.array([abs(one[n]) < 1.96 for one in off]) for n in off[0]}
    for group in (
        ("image.x", "image.y", "image.z", "image.rx", "image.ry", "image.rz"),
        ("image.su", "image.sv"),
        ("phantom.",),
    ):
        mine = np.array([v for n, v in inside.items() if n.startswith(group)])
        share, error = mine.mean(), mine.mean(axis=0).std() / np.sqrt(COUNT)
        print(f"{group[0]}: {share:.3f} +- {error:.3f}")
        low, high = (0.93, 0.97) if COUNT >= 200 else (0.95 - 3 * error - 0.02, 0.95 + 3 * error)
        assert low <= share <= high

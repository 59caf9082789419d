"""The motor of the seed's chapter 1, and a thin estimate of a cogging whose orders are known."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from robocal.drives.cogging import Cogging, harmonics

SEED = Path(__file__).parents[2] / "shared" / "data" / "seeds" / "motor-sim.yaml"


@cache
def seed_motor():
    """The file of the seed; skips the test where it is absent."""
    from robocal.files.motor_simulation import read_motor_simulation

    if not SEED.is_file():
        pytest.skip("needs ../shared/data/seeds/motor-sim.yaml")
    return read_motor_simulation(SEED)


def thin_estimate(angles, torques, orders):
    """Least squares of harmonics, offset and friction, (cogging, friction, offset), from one sweep in each direction; the lag is the best of
    a grid."""
    d = np.concatenate([np.ones(len(angles[0])), -np.ones(len(angles[1]))])
    theta, y = np.concatenate(angles), np.concatenate(torques)
    best = None
    for lag in np.radians(np.arange(0.0, 1.5, 0.02)):
        a = np.column_stack([np.ones(len(d)), d, harmonics(theta - d * lag, orders)])
        w = np.linalg.solve(a.T @ a, a.T @ y)
        left = float(((y - a @ w) ** 2).sum())
        if best is None or left < best[0]:
            best = left, lag, w
    _, lag, w = best
    n = len(orders)
    return Cogging(tuple(orders), tuple(w[2 : 2 + n]), tuple(w[2 + n :]), float(lag)), float(w[1]), float(w[0])


def table_error(found, true):
    """The largest difference of two curves, as a share of the true peak; each without its lag."""
    angle = np.linspace(0, 2 * np.pi, 2881)
    return float(np.abs(found.at(angle) - true.at(angle)).max() / np.abs(true.at(angle)).max())

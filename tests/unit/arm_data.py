"""A five-joint arm that is not quite what its drawing says, and instruments that look at it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.arms.conventions import chain
from robocal.geometry import fits
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

DEG = np.pi / 180
FREE = (
    "j2.alpha",
    "j2.theta",
    "j2.d",
    "j3.alpha",
    "j3.theta",
    "j3.d",
    "j3.beta",
    "j4.alpha",
    "j4.theta",
    "j4.d",
    "j5.theta",
)
TOOL = ("tool.x", "tool.y", "tool.z")
TRACKER = Frame("tracker", (1.0, 2.0, 0.3, 0.1, 0.2, 1.0), (True,) * 6)
SIX = ("x", "y", "z", "rx", "ry", "rz")


def arm(free=(*FREE, *TOOL), limits=(-1.5, 1.5)):
    rows = [
        {"r": 0.3},
        {"alpha": -90 * DEG, "theta": -90 * DEG},
        {"d": 0.25},
        {"d": 0.16, "theta": 90 * DEG},
        {"alpha": 90 * DEG, "r": 0.072},
    ]
    made = chain("five", "khalil-hayati", [{**r, "limits": limits} for r in rows], tool=(0.02, 0.01, 0.1, 0, 0, 0))
    return replace(made, table=made.table.with_free(free))


def true_arm(seed=1, size=1e-3, names=FREE, robot=None):
    rng, robot = np.random.default_rng(seed), robot or arm()
    return robot.with_values({n: robot.table[n].value + rng.normal(0, size) for n in names})


def blank(frame):
    """A frame of which nothing is known."""
    return replace(frame, value=tuple(v if not f else 0.0 for v, f in zip(frame.value, frame.free, strict=True)))


def observe(kind, m, sigma, frame=TRACKER, targets=(), target=None):
    d = 3 if kind == "position" else 6
    return Observations(kind, np.arange(m), np.zeros((m, d)), np.full((m, d), sigma), frame, tuple(targets), target)


def measured(
    m=60,
    *,
    seed=3,
    kind="position",
    sigma=2e-5,
    truth=None,
    frame=TRACKER,
    targets=(),
    target=None,
    stated=True,
    noise=1.0,
    known=False,
    q=None,
):
    """What the instrument recorded, its frame and targets forgotten unless `known`."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1, 1, (m, 5)) if q is None else q
    where = Configurations(tuple(f"p{i}" for i in range(m)), q)
    data = synthesise(
        truth or true_arm(), DataSet(where, (observe(kind, m, sigma, frame, targets, target),)), rng, noise=noise
    )
    obs = data.observations[0]
    if not known:
        obs = replace(obs, frame=blank(frame) if frame else None, targets=tuple(blank(t) for t in targets))
    return DataSet(where, (obs if stated else replace(obs, sigma=None),))


def away(found, truth=None, m=200):
    """Largest error of the tool's place relative to the others, where nothing was measured: frames are free, so
    rigidly aligned."""
    q = np.random.default_rng(9).uniform(-1, 1, (m, 5))
    truth = truth or true_arm()
    a, b = found.corrected.pose(q)[:, :3, 3], truth.pose(q)[:, :3, 3]
    t = fits.rigid(a, b)
    return float(np.linalg.norm(a @ t[:3, :3].T + t[:3, 3] - b, axis=1).max())

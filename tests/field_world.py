"""A platform on cables whose camera looks at a flat field of markers: level at one height, or tilted at several."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from prove.machines import hung, lengths

from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.vision.camera import project
from robocal.vision.sheets import SQUARE

LENS = (900.0, 901.0, 642.0, 509.0, -0.18, 0.09, 5e-4, -4e-4, 0.0)
KNOWN = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
SIGMA = (10.0, 10.0, 10.0, 10.0, 0.05, 0.05, 0.05, 0.05)
EYE = se3.compose(np.diag([1.0, -1.0, -1.0]), np.array([0.02, 0.01, -0.1]))
OF_EYE = (0.002,) * 3 + (np.radians(0.3),) * 3
HALF = 75e-3
PLACES = [(x, y) for x in (-1.5, -0.9, -0.3, 0.3, 0.9, 1.5) for y in (-1.0, -0.5, 0.0, 0.5, 1.0)]


def poses(rng, count, level):
    """Platforms over the field: all level at one height, or tilted at several."""
    out = np.zeros((count, 6))
    out[:, :2] = rng.uniform(-1, 1, (count, 2)) * [1.2, 0.9]
    out[:, 2] = 1.4 if level else rng.uniform(0.9, 1.9, count)
    if not level:
        out[:, 3:] = rng.uniform(-0.17, 0.17, (count, 3))
    return out


def rig(level, seed=5, count=60, lens=LENS):
    """A robot on cables whose camera looks at thirty markers on a flat floor; the model, the truth, and what was measured."""
    rng = np.random.default_rng(seed)
    model = hung()
    model = replace(model, table=model.table.with_priors({n: 0.03 for n in model.table.free if ".a" in n}))
    truth = model.with_values({n: model.table[n].value + rng.normal(0, 0.01) for n in model.table.free})
    start = poses(rng, count, level)
    markers = np.array([(x, y, 0.0, 0.0, 0.0, 0.7 * i) for i, (x, y) in enumerate(PLACES)])
    camera = se3.inverse(se3.from_vector(start) @ EYE)
    rows = []
    for p, m in np.ndindex(count, len(markers)):
        t = camera[p] @ se3.from_vector(markers[m])
        points = HALF * SQUARE @ t[:3, :3].T + t[:3, 3]
        uv = project(points, np.array(lens))[0]
        if (points[:, 2] > 0.2).all() and (uv > 8).all() and (uv < [1272, 1016]).all():
            rows.append((p, m))
    view, target = np.repeat(np.array(rows).T, 4, axis=1)
    corner = np.tile(np.arange(4), len(rows))
    seen = Observations(
        "pixels", view, np.zeros((len(view), 2)), np.full((len(view), 2), 0.3),
        Frame("eye", tuple(se3.to_vector(EYE)), (True,) * 6, "tool", prior=OF_EYE),
        tuple(Frame(f"m{i}", tuple(v), (i > 0,) * 6) for i, v in enumerate(markers)), target,
        {"point": HALF * SQUARE[corner]},
        {"camera": "lens", "intrinsics": tuple(lens), "free": KNOWN, "known": KNOWN, "covariance": tuple(map(tuple, np.diag(np.square(SIGMA)).tolist())),
         "print": "print", "print sigma": 0.003},
        group="pixels",
    )  # fmt: skip
    data = synthesise(
        truth, DataSet(Configurations(tuple(map(str, range(count))), start=start), (lengths(model, count), seen)), rng
    )
    observed = data.observations[1]
    stated = replace(observed, options={**observed.options, "intrinsics": LENS})
    return model, truth, replace(data, observations=(data.observations[0], stated))

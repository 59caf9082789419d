"""The chance that the nominal model is the better one, where the scale s of an instrument is not known: no reading of that instrument
tells, held out or not.

    J d - r = J t + C s + noise,    t ~ N(0, b_k^2),    s ~ N(0, sigma^2)             columns in units of their expected errors
    P = sum over b of p(b | d, r) P(2 g^T (d - t) > moved^2 | b, d, r)

d is how far the fit went, t the truth, both counted from nominal; r are the residuals, J and C the columns of what is free and of the
scales (`fit.scale`), g as in `region`. A common factor of all lengths may be the arm's or the marker's. What tells is how far the
lengths stray beside it: so how exactly this machine was made is asked of its own data, b for its lengths and for its angles, on a
grid. An arm that strays by a tenth of a millimetre is not half a percent too long. Hyperparameters: Lindley and Smith, Bayes estimates
for the linear model (1972); MacKay, Bayesian interpolation (1992).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._types import Array
from robocal.diagnose.limits import MADE_BETTER, MADE_WORSE
from robocal.estimate.elimination import triangle
from robocal.fit.fit import Fit
from robocal.fit.scale import InstrumentScales
from robocal.measure.machine import Model

__all__ = ["chance_by_scale"]

GRID = 7  # ways in which lengths, or angles, may be made: a factor of two between two of them


def chance_by_scale(
    model: Model, fit: Fit, scales: InstrumentScales, names: Sequence[str], along: Array, square: float
) -> float:
    """That |e|^2 > |e - d|^2 in the mean over a range, where e are the errors of the `names` (k) that were identified, `along` (k,) is g
    and `square` the mean of |moved|^2."""
    free = fit.total.names[: len(scales.change)]
    at = [free.index(n) for n in names]
    g = np.zeros(len(free))
    g[at] = along * scales.expected[at]
    n, m = len(free), len(scales.names)
    told = scales.root / fit.uncertainty.factor
    reading = told[:, :n] @ scales.change - told[:, -1]
    makings = _makings(model, fit, free)
    # What no making changes comes first, and is reduced once. Not by products: a frame that may be a metre off and is seen to a
    # micron leaves no digit of them.
    changes = np.append((makings != makings[0]).any(axis=0), np.zeros(m, dtype=bool))
    one, other = np.flatnonzero(~changes), np.flatnonzero(changes)
    sigma, ahead = np.append(makings[0], scales.stated)[one], np.append(2 * g, np.zeros(m))
    k, v = len(one), len(other)
    columns = np.column_stack([told[:, one] * sigma, told[:, other], reading])
    root = triangle(np.vstack([columns, np.eye(k, n + m + 1)]))
    makings = makings[:, other]
    prior = np.broadcast_to(np.eye(v, v + 1), (len(makings), v, v + 1))
    scaled = root[k:, k:] * np.insert(makings, v, 1.0, axis=1)[:, None]
    corner = np.asarray(np.linalg.qr(np.concatenate([scaled, prior], axis=1), mode="r"))
    seen, r = corner[:, :v, v], corner[:, :v, :v]
    first = np.linalg.solve(root[:k, :k].T, sigma * ahead[one])
    asked = makings * (ahead[other] - first @ root[:k, k:-1])
    own = np.linalg.solve(np.swapaxes(r, 1, 2), asked[..., None])[..., 0]
    evidence = 0.5 * np.sum(seen**2, axis=1) - np.sum(np.log(np.abs(np.diagonal(r, axis1=1, axis2=2))), axis=1)
    weight = np.exp(evidence - evidence.max())
    mean = 2 * g @ scales.change - root[:k, -1] @ first - np.sum(seen * own, axis=1)
    spread = np.sqrt(first @ first + np.sum(own**2, axis=1))
    chance = np.where(
        spread > 0, scipy.special.ndtr((mean - square) / np.where(spread > 0, spread, 1.0)), mean > square
    )
    return float(weight @ chance / weight.sum())


def _makings(model: Model, fit: Fit, free: Sequence[str]) -> Array:
    """What making may leave of each free name, in units of what is expected, (b, n): of lengths and angles of the machine without a
    stated error each by a factor of the grid."""
    table, made = fit.problem.table, set(model.geometric)
    unit = np.array([table[n].unit if n in made and table[n].prior is None else "" for n in free])
    grid = np.geomspace(MADE_BETTER, MADE_WORSE, GRID)
    one, other = (a.ravel()[:, None] for a in np.meshgrid(grid, grid))
    return np.where(unit == "m", one, np.where(unit == "rad", other, 1.0))

"""What a camera that loses its metre on the way does to frames that were fitted with one scale.

    s_k = s exp(w_k),    w_k = w_k-1 + N(0, q^2),    r = J x + W d + n,    d ~ N(0, q^2),  n ~ N(0, v^2)        whitened

A step d_l changes the scale of all views from l on: its column of W is that of log s in their rows. The walk follows motions as slow as
those that place the frames, so that it does not average out as noise does. q^2, v^2 = argmax restricted likelihood, and

    cov(x) = v^2 (J^T J)^-1 + q^2 G G^T,    G = (J^T J)^-1 J^T W

Source: Patterson and Thompson (1971); the walk: Strasdat, Montiel and Davison, Scale drift-aware large scale monocular SLAM (2010).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.diagnose.vision_limits import ARM_EXPLAINS
from robocal.estimate.elimination import reweight
from robocal.fit.fit import Fit
from robocal.measure.rows import number_names

__all__ = ["scale_walk"]

STEP = 1e-3  # grid: of the logarithm of a scale from view to view, the unit of q
STEPS = 200  # grid: of a walk over more views, each over as many as make so few
RATIOS = np.concatenate([[0.0], np.logspace(-6, 6, 121)])  # grid: of q^2 to v^2
RANK = 1e-10  # tolerance: of the largest singular value: a direction that no row tells


def scale_walk(fit: Fit) -> Array | None:
    """The covariance (n, n) of what was fitted, with the walk of a scale; None where no scale is free, or noise explains what is left."""
    problem, x = fit.problem, fit.solution.x
    seen = [o for o in fit.data.observations if o.kind == "pose" and number_names(o)]
    if len(seen) != 1 or len(problem.terms) != 1 or problem.blocks or number_names(seen[0])[0] not in problem.free:
        return None
    name = number_names(seen[0])[0]
    lin = reweight(problem.linearize(x), problem)
    view = np.repeat(problem.terms[0].configuration[problem.residuals(x)[0].used], 6)
    begins = np.unique(np.linspace(0, view.max() + 1, min(STEPS, int(view.max()) + 1) + 1).astype(int))[1:-1]
    column = lin.j[:, problem.free.index(name)] * float(x[0, problem.table.index[name]])
    wide = np.sqrt(np.diff(np.append(begins, view.max() + 1))) * STEP
    walk = column[:, None] * (view[:, None] >= begins) * wide
    u, size, vt = np.linalg.svd(lin.j * problem.scales, full_matrices=False)
    kept = size > RANK * size[0]
    u, inverse = u[:, kept], vt[kept].T / size[kept] * problem.scales[:, None]
    left, rest = walk - u @ (u.T @ walk), lin.r - u @ (u.T @ lin.r)
    count = max(int(problem.numbers.sum()) - int(kept.sum()), 1)
    modes, told_by, _ = np.linalg.svd(left, full_matrices=False)
    told = (modes.T @ rest) ** 2
    weight = 1 + RATIOS[:, None] * told_by**2
    variance = ((told / weight).sum(axis=1) + max(float(rest @ rest - told.sum()), 0.0)) / count
    likelihood = -0.5 * (np.log(weight).sum(axis=1) + count * np.log(np.maximum(variance, np.finfo(float).tiny)))
    best = int(np.argmax(likelihood))
    if not likelihood[best] - likelihood[0] > ARM_EXPLAINS:
        return None
    shift = inverse @ (u.T @ walk)
    return np.asarray(variance[best] * (inverse @ inverse.T + RATIOS[best] * shift @ shift.T))

"""Covariance, correlation, chi2 and prediction bands, with the right degrees of freedom.

    C = (J^T J + P)^-1,   dof = rows - shared columns - columns of local blocks + prior rows,   as fitted: C chi2 / dof

J is whitened with local blocks eliminated, P the prior information. A direction that neither of them sees (a caller may
keep what cannot be seen) is as uncertain as was expected without data, and costs no degree of freedom. With a robust
loss every row counts with its weight. The *instrument* bars use the stated sigma; the *as fitted* bars scale them by
sqrt(chi2 / dof) when that is above one, because a model that leaves more than the noise deserves no smaller bars.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.identifiability import block_columns, eliminate, triangle
from robocal.estimate.problem import LOSSES, TUNING, Problem
from robocal.estimate.rows import Linear

__all__ = ["Uncertainty", "band", "effective_columns", "uncertainty"]

Array = NDArray[np.float64]
# Singular values below this share of the largest are rounding.
RESOLUTION = 1e-13


@dataclass(frozen=True)
class Uncertainty:
    """Instrument covariance (n, n) of the free columns, chi2, dof, and the factor that turns instrument bars into
    fitted ones."""

    covariance: Array
    chi2: float
    dof: int
    factor: float

    @property
    def sigma_instrument(self) -> Array:
        """Standard deviations if the stated noise is all there is, (n,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def sigma(self) -> Array:
        """Standard deviations as fitted, (n,)."""
        return self.factor * self.sigma_instrument

    @property
    def correlation(self) -> Array:
        """Correlation matrix (n, n)."""
        s = self.sigma_instrument
        return np.asarray(self.covariance / np.outer(s, s))


def uncertainty(problem: Problem, x: Array, *, estimated: bool = False) -> Uncertainty:
    """Of the free columns at a solution x; `estimated` says that sigma was not stated, so chi2 / dof also scales bars
    down."""
    lin = _reweighted(problem.linearize(x), problem)
    n = problem.n
    r = triangle(eliminate(lin, problem.block_size))
    _, info = problem.prior
    # Scaled as in `identifiability`, so that a singular value means the same in both.
    scaled = triangle(np.vstack([r, np.diag(np.sqrt(info))])) * problem.scales
    _, values, vt = np.linalg.svd(scaled) if n else (None, np.zeros(0), np.zeros((0, 0)))
    known = values > RESOLUTION * values.max(initial=0.0)
    inverse = problem.scales[:, None] * vt.T / np.where(known, values, 1.0)
    d = problem.difference(np.atleast_2d(x))[0]
    chi2 = float(lin.r @ lin.r + (d * d) @ info)
    used = block_columns(lin, problem.block_size)
    dof = len(lin.r) + int((info > 0).sum()) - int(known.sum()) - used
    factor = np.sqrt(chi2 / dof) if dof > 0 else 1.0
    # Downweighted residuals are too small to tell that the noise is: they may only enlarge.
    free_scale = estimated and problem.loss == "none"
    return Uncertainty(inverse @ inverse.T, chi2, dof, float(factor if free_scale else max(factor, 1.0)))


def _reweighted(lin: Linear, problem: Problem) -> Linear:
    """Columns times the root of the robust weight, residuals times the weight: what the fit set aside neither informs
    nor enlarges."""
    from robocal.estimate._kernels import robust

    if problem.loss == "none" or not len(lin.r):
        return lin
    kind, tuning = LOSSES[problem.loss], problem.tuning or TUNING[problem.loss]
    slope = np.array([robust(kind, tuning, s)[1] for s in np.bincount(lin.observation, lin.r**2)])
    weight = slope[lin.observation]
    root = np.sqrt(weight)[:, None]
    # chi2 counts what pulls, the influence: a gross row pulls no harder than its loss allows.
    return replace(lin, r=weight * lin.r, j=root * lin.j, jl=root * lin.jl)


def effective_columns(problem: Problem, x: Array) -> float:
    """How many numbers the data determine, trace of (J^T J + P)^-1 J^T J: n without priors, fewer where a prior
    holds."""
    n = problem.n
    _, info = problem.prior
    if not n or not info.any():
        return float(n)
    lin = problem.linearize(x)
    scaled = triangle(eliminate(lin, problem.block_size)) * problem.scales
    full = triangle(np.vstack([scaled, np.diag(np.sqrt(info) * problem.scales)]))
    held = np.linalg.norm(np.linalg.lstsq(full.T, np.diag(np.sqrt(info) * problem.scales), rcond=None)[0]) ** 2
    return n - float(held)


def band(jacobian: Array, covariance: Array) -> Array:
    """Standard deviation of predicted quantities, sqrt of the trace of J C J^T; jacobian (m, d, n), covariance (n, n)
    -> (m,)."""
    variance = np.einsum("mdi,ij,mdj->m", jacobian, covariance, jacobian, optimize=True)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

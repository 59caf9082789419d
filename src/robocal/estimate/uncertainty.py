"""Covariance, correlation, chi2 and prediction bands, with the right degrees of freedom.

    C = (J^T J + P)^-1,   dof = rows - shared columns - columns of local blocks + prior rows,   as fitted: C chi2 / dof

J is whitened with local blocks eliminated, P the prior information. A direction that neither of them sees (a caller may
keep what cannot be seen) is as uncertain as was expected without data, and costs no degree of freedom. The *instrument* bars use the stated sigma; the
*as fitted* bars scale them by
sqrt(chi2 / dof) when that is above one, because a model that leaves more than the noise deserves no smaller bars.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.identifiability import block_columns, eliminate, triangle
from robocal.estimate.problem import Problem

__all__ = ["Uncertainty", "band", "uncertainty"]

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
    lin = problem.linearize(x)
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
    return Uncertainty(inverse @ inverse.T, chi2, dof, float(factor if estimated else max(factor, 1.0)))


def band(jacobian: Array, covariance: Array) -> Array:
    """Standard deviation of predicted quantities, sqrt of the trace of J C J^T; jacobian (m, d, n), covariance (n, n)
    -> (m,)."""
    variance = np.einsum("mdi,ij,mdj->m", jacobian, covariance, jacobian, optimize=True)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

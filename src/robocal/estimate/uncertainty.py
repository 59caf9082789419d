"""Covariance, correlation, chi2 and prediction bands, with the right degrees of freedom.

    C = (J^T J + P)^-1,   dof = rows - shared columns - columns of local blocks + prior rows,   as fitted: C chi2 / dof

J is whitened with local blocks eliminated (their priors are rows of theirs), P the information of stated priors. A
direction that neither of them sees (a caller may keep what cannot be seen) is as uncertain as was expected without data,
and costs no degree of freedom. With a robust loss every row counts with its weight. The *instrument* bars use the
stated sigma; the *as fitted* bars scale them by sqrt(chi2 / dof) when that is above one, because a model that leaves
more than the noise deserves no smaller bars.

Columns that were not fitted still have errors, and hand them to those that were. With H = (J_k^T J_k + P)^-1 of the
kept columns and G = H J_k^T J_d of the dropped ones, the estimate differs from the truth t (counted from nominal) by

    e_k = H J_k^T noise + G t_d - H P t_k,    e_d = -t_d,    cov(e) = C + B S S^T B^T

with B the response to t and S S^T the covariance of the errors expected without data. That is the covariance of what was
done, not of the best that could be done.
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.estimate.elimination import Squares, beside_blocks, eliminate, reducible, reweight, squares, triangle
from robocal.estimate.problem import Problem
from robocal.estimate.schur.system import reduced
from robocal.estimate.solution import Solution
from robocal.estimate.sparse_rows import product
from robocal.estimate.terms import Linear

__all__ = [
    "LEVEL", "Total", "Uncertainty", "band", "effective_columns", "quantile", "radius", "total", "uncertainty", "uneven",
]  # fmt: skip

EPS = float(np.finfo(float).eps)
SHARP = 1e-8  # of the rows: so much the number of columns may be wrong by
LEVEL = 0.95  # of every interval and band
MANY, DEGREE = 200, 24  # radii at once that are worth a polynomial, and its degree
ROOMY = 3  # rows for each number of a block: of fewer, what they leave says little
MOST_KNOWN = 1 - 1e-3  # leverage: of what knows more its residual says nothing


@record
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


def uncertainty(problem: Problem, x: Array, *, estimated: bool = False, known: Squares | None = None) -> Uncertainty:
    """Of the free columns at a solution x; `estimated` says that sigma was not stated, so chi2 / dof also scales bars
    down; `known` are the squares of these columns there, and maybe of more."""
    rows = squares(problem, x) if known is None else known
    n = problem.n
    # Scaled as in `identifiability`, so that a singular value means the same in both.
    own = rows.of(problem.free)
    scaled = (triangle(np.vstack([own, problem.prior_root])) if problem.has_prior.any() else own) * problem.scales
    _, values, vt = np.linalg.svd(scaled) if n else (None, np.zeros(0), np.zeros((0, 0)))
    resolved = values > rows.resolution * values.max(initial=0.0)
    inverse = problem.scales[:, None] * vt.T / np.where(resolved, values, 1.0)
    x = np.atleast_2d(x)
    chi2 = rows.square + float(np.sum((problem.prior_root @ problem.difference(x)[0]) ** 2))
    for i, family in enumerate(problem.families):
        chi2 += 0.0 if family.prior is None else float(np.sum(family.prior.rows(problem.values_of(i, x))[0] ** 2))
    counted = rows.rows - round(problem.repeated)
    dof = counted + int(problem.has_prior.sum()) - int(resolved.sum()) - rows.taken
    factor = np.sqrt(chi2 / dof) if dof > 0 else 1.0
    # Downweighted residuals are too small to tell that the noise is: they may only enlarge.
    free_scale = estimated and problem.loss == "none"
    return Uncertainty(inverse @ inverse.T, chi2, dof, float(factor if free_scale else max(factor, 1.0)))


def effective_columns(problem: Problem, x: Array, ended: Solution | None = None) -> float:
    """How many numbers the data determine, trace of (J^T J + P)^-1 J^T J: n without priors, fewer where a prior
    holds; `ended` is the solution that ended at x, where the caller has it."""
    n = problem.n
    if not problem.has_prior.any():
        return float(n)
    plain, rows = problem.with_loss("none"), int(problem.numbers[problem.in_use].sum())
    known = ended is not None and problem.loss == "none" and problem.even
    if problem.blocks:
        normal = ended.normal if ended is not None and known else plain.normal(np.atleast_2d(x))
        held = _prior_trace(reduced(normal, n, problem.sizes, problem.pairs)[0], rows, problem)
    else:
        a = (
            ended.normal.a[0]
            if ended is not None and known
            else (plain.with_priors(False).normal(np.atleast_2d(x)).a[0] + problem.information)
        )
        held = _prior_trace(a, rows, problem)
    if held is None:
        left = squares(plain, x).root if reducible(problem) else eliminate(problem.linearize(x))
        hold = problem.prior_root * problem.scales
        full = triangle(np.vstack([left * problem.scales, hold]))
        # Where every column is held, the triangle has a full diagonal; elsewhere what nothing sees is held by nothing.
        regular = bool(problem.has_prior.all())
        part = np.linalg.solve(full.T, hold.T) if regular else np.linalg.lstsq(full.T, hold.T, rcond=None)[0]
        held = float(np.linalg.norm(part) ** 2)
    return n - held


def _prior_trace(a: Array, rows: int, problem: Problem) -> float | None:
    """Trace of (J^T J + P)^-1 P by Cholesky, many times faster than QR, from the lower triangle of J^T J + P (n, n) of so many rows;
    None where rounding could be seen: with every column held, it errs by eps over the smallest pivot, and it is compared with the
    number of rows."""
    from robocal.estimate.priors._kernels import held_by

    trace, least = held_by(np.array(a, order="C"), np.ascontiguousarray(problem.prior_root))
    return float(trace) if least * max(rows, 1) > EPS / SHARP else None


def band(jacobian: Array, covariance: Array) -> Array:
    """Standard deviation of predicted quantities, sqrt of the trace of J C J^T; jacobian (m, d, n), covariance (n, n)
    -> (m,)."""
    variance = np.einsum("mdi,ij,mdj->m", jacobian, covariance, jacobian, optimize=True)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


@record
class Total:
    """What an estimate may be off by, over all free names (SI, rotation vectors in their tangent).

    noise (n, n): covariance from measurement noise, zero for what was not fitted; response (n, n): how the estimate's
    error answers to the truth; expected (n,): the errors expected without data; dof of the noise, infinite where it is
    known; root (n, n): S of their covariance S S^T, where a prior is shared by several (None: diagonal).
    """

    names: tuple[str, ...]
    noise: Array
    response: Array
    expected: Array
    dof: float = float("inf")
    root: Array | None = None

    @property
    def hidden(self) -> Array:
        """B S (n, n): a root of what the truth contributes to the covariance."""
        return np.asarray(self.response * self.expected if self.root is None else self.response @ self.root)

    @property
    def covariance(self) -> Array:
        """Of estimate minus truth, (n, n)."""
        return np.asarray(self.noise + self.hidden @ self.hidden.T)

    @property
    def sigma(self) -> Array:
        """Standard deviations (n,)."""
        return np.sqrt(np.diag(self.covariance))


def total(
    problem: Problem,
    kept: tuple[str, ...],
    x: Array,
    *,
    factor: float = 1.0,
    dof: float = np.inf,
    known: Squares | None = None,
) -> Total:
    """What the fit of the `kept` columns may be off by, at its solution x (1, P); the problem has all columns free.

    `factor` multiplies the bars of the noise (`Uncertainty.factor`), `dof` are the degrees of freedom of its estimate, `known`
    the squares of all columns there.
    """
    n, scale = problem.n, problem.scales
    rows = squares(problem, x) if known is None else known
    scaled = rows.of(problem.free) * scale
    some = frozenset(kept)
    chosen = np.array([name in some for name in problem.free], dtype=bool)
    k, d = np.flatnonzero(chosen), np.flatnonzero(~chosen)
    # What the prior says of the kept ones alone, as in their fit.
    hold = problem.with_free(kept).prior_root * scale[k]
    held = bool(hold.any())
    stacked = np.vstack([scaled[:, k], hold]) if held else scaled[:, k]
    u, values, vt = np.linalg.svd(stacked, full_matrices=False)
    told = values > rows.resolution * values.max(initial=0.0)
    root = vt.T / np.where(told, values, 1.0)
    # What is not known at all answers to nothing, and is as uncertain as expected.
    gain = np.where(told, root, 0.0) @ u.T
    noise, response = np.zeros((n, n)), np.zeros((n, n))
    noise[np.ix_(k, k)] = factor**2 * (root @ root.T)
    response[np.ix_(k, d)] = gain[:, :n] @ scaled[:, d]
    response[np.ix_(k, k)] = -gain[:, n:] @ hold if held else 0.0
    response[d, d] = -1.0
    # The prior is part of H already: H = H J^T J H + H P H, and the second part is what the truth contributes.
    if held:
        noise[np.ix_(k, k)] = factor**2 * (gain[:, :n] @ gain[:, :n].T) + root[:, ~told] @ root[:, ~told].T
    both = np.outer(scale, scale)
    shared = None if not np.count_nonzero(problem.spread_root - np.diag(scale)) else problem.spread_root
    return Total(problem.free, noise * both, response * scale[:, None] / scale, np.array(scale), float(dof), shared)


def uneven(
    problem: Problem,
    x: Array,
    label: Ints | None = None,
    lin: Linear | None = None,
    known: Squares | None = None,
    columns: Ints | None = None,
) -> float:
    """How much larger the covariance of the estimate is than even noise would make it: 1 unless significantly more.

    Where a model leaves errors of its own, they may be largest at the poses that decide the fit, and they are the same at
    every visit of a place: configurations with the same `label` (U,) are taken as one. Q = J (J^T J + P)^(-1/2) the basis of what is
    known of the columns, n = |Q|^2, H_u = Q_u Q_u^T the leverage of configuration u, r the residuals in units of their own spread; with
    even noise

        E[1/n sum_u |Q_u^T (I - H_u)^(-1/2) r_u|^2] = 1

    When that is exceeded by three standard deviations, the jackknife's variance (exponent -1) over its value for even
    noise is returned; `lin` is the problem linearised there, `known` its squares, where the caller has them; `columns` says which of `lin`
    are the problem's. Where every configuration has a block of its own, J is what these leave of it; of blocks that have few rows, or
    priors, nothing is said. Sources: Bell and McCaffrey, Bias reduction in standard errors (2002); MacKinnon and White (1985).
    """
    lin = reweight(problem.linearize(x) if lin is None else lin, problem)
    if not problem.n or len(lin.r) <= problem.n:
        return 1.0
    own = lin.jl.shape[1]  # numbers that the block of a configuration takes
    blocks = len(np.unique(lin.local)) if own else 0
    if problem.blocks:
        if (
            not own
            or lin.jm.shape[1]
            or lin.hold is not None
            or (lin.local < 0).any()
            or len(lin.r) < ROOMY * own * blocks
        ):
            return 1.0
        lin = replace(lin, j=beside_blocks(lin)[1])
    at = np.arange(problem.n) if columns is None else columns
    whole = known is not None and not problem.blocks and known.resolution == Squares.resolution
    root = known.of(problem.free) if known is not None and whole else triangle(lin.j[:, at])
    _, values, vt = np.linalg.svd(triangle(np.vstack([root, problem.prior_root]) * problem.scales))
    sure = values > Squares.resolution * values.max(initial=0.0)
    # A direction that is nothing but rounding would have the leverage of rounding.
    turn = np.zeros((lin.j.shape[1], int(sure.sum())))
    turn[at] = problem.scales[:, None] * (vt[sure].T / values[sure])
    q = product(lin.j, turn)
    n = float(np.vdot(q, q))
    if not n:
        return 1.0
    counted = len(lin.r) - problem.repeated - own * blocks
    r = lin.r * np.sqrt(max(counted - n, 0.0) / max(float(lin.r @ lin.r), 1e-300))
    together = lin.configuration if label is None else label[lin.configuration]
    order = np.argsort(together, kind="stable")
    counts = np.unique(together, return_counts=True)[1]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    gentle = jackknife = spread = 0.0
    shares: list[Array] = []
    # Residuals are in units of their own spread, so what all components have in common does not scatter.
    common = n / (len(lin.r) - own * blocks)
    for count in np.unique(counts):
        # Configurations with the same number of rows are treated together.
        rows = order[starts[counts == count][:, None] + np.arange(count)]
        part, left = q[rows], r[rows]
        # Of more rows than columns the other components have no leverage.
        short = part.shape[2] if part.shape[2] < count else count
        turned, full = np.swapaxes(part, 1, 2), short == count
        share = part @ turned if full else turned @ part
        share, seen = _clip(share, left if full else (turned @ left[..., None])[..., 0], full)
        # H and I - H commute: r^T H (I - H)^-k r needs no root of them, and Q^T r has one H already.
        solved = np.linalg.solve(np.eye(short) - share, seen[..., None])[..., 0]
        once = float(np.sum(seen * solved))
        gentle += once - (float(np.sum(seen**2)) if full else 0.0)
        jackknife += float(np.sum(solved**2)) - (once if full else 0.0)
        shares.append(share)
        taken = float(np.sum(np.trace(share, axis1=1, axis2=2)))
        spread += 2 * (float(np.vdot(share, share)) - 2 * common * taken + len(rows) * short * common**2)
        spread += 2 * len(rows) * max(count - own - short, 0) * common**2
    if gentle / n <= 1 + 3 * np.sqrt(spread) / n:
        return 1.0
    even = sum(
        float(np.sum(np.trace(np.linalg.inv(np.eye(h.shape[1]) - h), axis1=1, axis2=2) - h.shape[1])) for h in shares
    )
    return max(jackknife / even, 1.0)


def _clip(share: Array, seen: Array, full: bool) -> tuple[Array, Array]:
    """Leverages H (U, k, k), none above `MOST_KNOWN`, and what is seen through them, (U, k): residuals, or where not `full` Q^T r."""
    # No eigenvalue is beyond the largest sum of a row (Gershgorin).
    if np.linalg.norm(share, np.inf, axis=(1, 2)).max(initial=0.0) < MOST_KNOWN:
        return share, seen
    try:
        np.linalg.cholesky(MOST_KNOWN * np.eye(share.shape[1]) - share)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(share)
        turned = np.swapaxes(vectors, 1, 2)
        # |Q^T V f(w) V^T r|^2 = sum over components of (1 - w) f(w)^2 t^2, because Q Q^T = V (1 - w) V^T.
        less = np.sqrt(np.minimum(1.0, MOST_KNOWN / np.maximum(values, MOST_KNOWN)))
        along = (turned @ seen[..., None])[..., 0] * (1.0 if full else less)
        return vectors * np.minimum(values, MOST_KNOWN)[:, None, :] @ turned, (vectors @ along[..., None])[..., 0]
    return share, seen


def quantile(dof: float = np.inf, level: float = LEVEL) -> float:
    """Half the width of a two-sided interval in standard deviations: Student's t, normal for infinite dof."""
    return float(scipy.special.stdtrit(min(dof, 1e9), 0.5 + level / 2)) if dof > 0 else float("inf")


def radius(covariance: Array, dof: float = np.inf, level: float = LEVEL) -> Array:
    """Radius of the ball that holds the error with this probability; covariance (..., d, d) -> (...).

    |e|^2 is matched by g chi2_h with the same mean and variance: g = tr(V^2) / tr(V), h = tr(V)^2 / tr(V^2); with
    estimated noise by g h F(h, dof). Source: Box, Some theorems on quadratic forms (1954).
    """
    first = np.trace(covariance, axis1=-2, axis2=-1)
    second = np.sum(covariance * np.swapaxes(covariance, -1, -2), axis=(-2, -1))
    h = np.where(second > 0, first**2 / np.where(second > 0, second, 1.0), 1.0)

    def quantile(h: Array) -> Array:
        known = (
            scipy.special.fdtri(h, max(dof, 1.0), level) if np.isfinite(dof) else scipy.special.chdtri(h, 1 - level) / h
        )
        return np.asarray(known)

    # It is smooth in h, which lies between 1 and d: of many a polynomial gives ten digits and more at a twentieth of the price.
    f = (
        quantile(h)
        if h.size < MANY
        else np.polynomial.Chebyshev.interpolate(quantile, DEGREE, (1, 1 + covariance.shape[-1]))(h)
    )
    return np.asarray(np.sqrt(np.maximum(first, 0.0) * f))

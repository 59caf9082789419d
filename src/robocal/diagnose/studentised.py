"""How far every row is from a fit that does not know it, in robust standard deviations.

    D^2 = r^T (I -+ H)^-1 r,    H = J (J^T J + P)^-1 J^T        r and J whitened, a block per row and unit

Minus for a row that the fit used: a gross row bends the fit towards itself, and its leverage H undoes that: D is its
distance from the fit to all others. Plus for a row that the fit did not see: its prediction is uncertain too. The
scale of a sensor group in one unit is the largest of three, each right for Gaussian noise: from the median and from the upper
quartile of D, which a fifth of gross rows hardly moves, and the rms of the rows within reach, which says how heavy the tails
of the others are (what geometry leaves of a real arm is not Gaussian). A row is strange beyond six times that (where
few rows had to tell the scale, as far as is as unlikely then), and far, so that it is set aside, there too where the stated noise
stands. Where the scale is what a model leaves, nobody knows its tails, and far is twice that: poses at which a real arm errs most
are told, and fitted. Where what is left is of the size of rounding, no scale of a row is below what its own digits leave:
of seven digits, joints beyond 100 degrees are rounded ten times more coarsely. References: Cook and Weisberg, Residuals and influence in
regression (1982); Huber, Robust statistics (1981), chapter 5.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.diagnose.limits import GROSS_DISTANCE, GROSS_TAILS, ROUNDING_MARGIN
from robocal.estimate.problem import Problem
from robocal.estimate.terms import ProblemTerm, spread
from robocal.fit.noise import assess, quantile, tau_of, under
from robocal.measure.base import Rows
from robocal.measure.data import DataSet

__all__ = ["StudentisedResiduals", "far_from", "studentise"]

EFFICIENCY = 0.37  # of the median as a scale: so much of the degrees of freedom it knows
ALONE = 1e-4  # tolerance: 1 - leverage: a prediction from the others would be a hundred times less certain than the row
LONELY = 0.1  # tolerance: the same, far from that
# tolerance: of the smallest pivot: nothing of such a matrix is open, its inverse is right to seven digits, and a few times cheaper.
CLEAR = 1e-9
CHUNK = 2000
# Of the largest number measured, or of one: what a file's digits and a converged iteration resolve; less is no gross error.
RESOLUTION = 1e-7


@record
class StudentisedResiduals:
    """Of the rows of every term: distance (m,) in robust standard deviations, in the unit in which it is farthest relative
    to its limit; whether it is `outlying`, and `far`; leverage (m,); and the chance that the farthest of all rows is as far."""

    distance: tuple[Array, ...]
    outlying: tuple[Bools, ...]
    far: tuple[Bools, ...]
    leverage: tuple[Array, ...]
    chance: tuple[Array, ...]


@record
class _Part:
    """Rows of one term in one unit."""

    term: int
    size: int
    inside: Bools
    square: Array  # D^2
    leverage: Array
    error: Array
    least: Array  # standard deviation that rounding leaves


def studentise(problem: Problem, x: Array, modelled: Collection[tuple[str, str]] = ()) -> StudentisedResiduals:
    """Of all rows, at a solution x (1, P) of the problem; rows without weight or set aside were not seen by it. `modelled` are
    the sensor groups and units whose noise is what a model leaves."""
    x, weight = np.atleast_2d(x), problem.first_weight
    groups: dict[tuple[str, str], list[_Part]] = {}
    rows = [_white(term, x) for term in problem.bound_terms]
    weights = [np.where(t.used, weight[t.configuration], 0.0) for t in problem.terms]
    inverse = _inverse(problem, weights, [(j, own) for _, j, own in rows])
    for number, (term, w, (r, j, own)) in enumerate(zip(problem.terms, weights, rows, strict=True)):
        assert isinstance(term, Rows)
        for part, unit in _parts(term, number, r, j, inverse[np.ix_(own, own)], w > 0):
            groups.setdefault((term.group, unit), []).append(part)
    shape = [len(t.configuration) for t in problem.terms]
    distance, leverage = [np.zeros(m) for m in shape], [np.zeros(m) for m in shape]
    chance = [np.ones(m) for m in shape]
    strange, far = ([np.zeros(m, dtype=bool) for m in shape] for _ in range(2))
    many = sum(shape)
    for key, parts in groups.items():
        scale, known = _scale(parts)
        least = np.concatenate([p.least[p.inside] for p in parts])
        coarse = bool(len(least)) and float(np.median(least)) <= ROUNDING_MARGIN * scale
        for p in parts:
            d = np.sqrt(p.square) / (np.maximum(scale, p.least) if coarse else scale)
            odds = np.where(p.error, scipy.special.fdtrc(p.size, known, d**2 / p.size), 1.0)
            more = odds <= chance[p.term]
            distance[p.term][more], leverage[p.term][more] = d[more], p.leverage[more]
            chance[p.term][more] = odds[more]
            # As unlikely as six standard deviations are where the scale is known.
            if problem.terms[p.term].reading:
                least_odds = scipy.special.chdtrc(p.size, GROSS_DISTANCE**2)
                beyond = odds < least_odds
                strange[p.term] |= beyond
                limit = GROSS_TAILS * np.sqrt(p.size * scipy.special.fdtri(p.size, known, 1 - least_odds))
                far[p.term] |= beyond & (d > limit) if key in modelled else beyond
    return StudentisedResiduals(
        tuple(distance), tuple(strange), tuple(far), tuple(leverage), tuple(np.minimum(c * many, 1.0) for c in chance)
    )


def far_from(data: DataSet, problem: Problem, x: Array, configurations: Ints) -> StudentisedResiduals:
    """How far rows are from a model that was fitted to some configurations, by the robust noise of its own; `data` has the sigma that
    was stated."""
    tau = tau_of(assess(data, problem.with_loss("huber"), x, configurations, float(problem.n)))
    return studentise(under(problem, data, tau), x, tau)


def _white(term: ProblemTerm, x: Array) -> tuple[Array, Array, Ints]:
    """Residuals (m, d) of a term, its whitened Jacobian over its own columns (m, d, k), and which these are (k,); rows that were set
    aside too."""
    assert isinstance(term, Rows)
    r, narrow, _ = term.evaluate(x, np.zeros(1, dtype=np.int64), 0, len(term.configuration))
    own, at = np.unique(term.columns, return_inverse=True)
    j = spread(narrow[0], at, len(own))
    j /= term.sigma[..., None]
    return r[0], j, own


def _inverse(problem: Problem, weight: list[Array], rows: list[tuple[Array, Ints]]) -> Array:
    """(J^T J + P)^-1 over the free columns, by the rows of every term, (m, d, k), with its columns, and what they weigh, (m,)."""
    a = problem.prior_root.T @ problem.prior_root
    for w, (j, own) in zip(weight, rows, strict=True):
        for first in range(0, len(j), CHUNK):
            inside, some = w[first : first + CHUNK], j[first : first + CHUNK]
            if not (inside == 1).all():
                some = some[inside > 0] * np.sqrt(inside[inside > 0])[:, None, None]
            some = some.reshape(some.shape[0] * some.shape[1], len(own))
            a[np.ix_(own, own)] += some.T @ some
    # Columns differ by orders of magnitude: unit diagonal before the inverse.
    size = np.sqrt(np.where(np.diag(a) > 0, np.diag(a), 1.0))
    both = np.outer(size, size)
    a = a / both
    try:
        sure = bool(np.diag(np.linalg.cholesky(a)).min(initial=1.0) ** 2 > CLEAR)
    except np.linalg.LinAlgError:
        sure = False
    return np.asarray((np.linalg.inv(a) if sure else np.linalg.pinv(a, hermitian=True)) / both)


def _parts(
    term: Rows, number: int, r: Array, jacobian: Array, inverse: Array, inside: Bools
) -> list[tuple[_Part, str]]:
    m = len(term.configuration)
    span = RESOLUTION * float(np.abs(term.value).max(initial=1.0))
    squares, levers = np.empty((2, len(term.parts), m))
    for first in range(0, m, CHUNK):
        last = min(first + CHUNK, m)
        j = jacobian[first:last]
        white = r[first:last] / term.sigma[first:last]
        sign = np.where(inside[first:last], -1.0, 1.0)[:, None, None]
        for p, (start, stop, _) in enumerate(term.parts):
            own = j[:, start:stop]
            # One product of all rows is faster than one for each.
            flat = own.reshape(own.shape[0] * own.shape[1], own.shape[2])
            hat = (flat @ inverse).reshape(own.shape) @ own.transpose(0, 2, 1)
            trace = np.einsum("maa->m", hat)
            squares[p, first:last] = _square(np.eye(stop - start) + sign * hat, white[:, start:stop], trace)
            levers[p, first:last] = trace / (stop - start)
    out = []
    for p, (start, stop, unit) in enumerate(term.parts):
        error = np.linalg.norm(r[:, start:stop], axis=1) > span
        least = _rounding(term, start, stop)
        out.append((_Part(number, stop - start, inside, squares[p], levers[p], error, least), unit))
    return out


def _square(matrix: Array, white: Array, trace: Array) -> Array:
    """D^2 = r^T M^-1 r, (m,); a row that alone decides a direction has no residual there, and says nothing about itself. No
    eigenvalue of M = I -+ H lies below 1 less the trace of H."""
    if (trace < 1 - LONELY).all():
        return np.asarray(np.einsum("ma,ma->m", white, np.linalg.solve(matrix, white[..., None])[..., 0]))
    values, vectors = np.linalg.eigh(matrix)
    turned = np.einsum("mab,ma->mb", vectors, white)
    sees = values > ALONE
    return np.asarray(np.sum(np.where(sees, turned**2 / np.where(sees, values, 1.0), 0.0), axis=1))


def _rounding(term: Rows, start: int, stop: int) -> Array:
    """Root mean square of what rounding leaves of these components of every row, (m,), whitened."""
    if term.rounding is None:
        return np.zeros(len(term.configuration))
    return np.asarray(np.sqrt(np.mean((term.rounding / term.sigma)[:, start:stop] ** 2, axis=1)))


def _scale(parts: list[_Part]) -> tuple[float, float]:
    """The robust standard deviation of D, at least one, and the degrees of freedom that know it."""
    own = np.concatenate([p.square[p.inside] / p.size for p in parts])
    if not len(own):
        return 1.0, 1.0
    # Rows of different size share a scale: each D^2 is compared with its own quantiles.
    many = [np.count_nonzero(p.inside) for p in parts]

    def scale_at(level: float) -> float:
        return quantile(own * np.repeat([p.size / scipy.special.chdtri(p.size, 1 - level) for p in parts], many), level)

    robust = max(1.0, scale_at(0.5), scale_at(0.75))
    near = own[own < robust * GROSS_DISTANCE**2]
    square = max(robust, float(near.mean()) if len(near) else 1.0)
    dof = sum(float(np.sum(p.size * (1 - np.minimum(p.leverage[p.inside], 1.0)))) for p in parts)
    return float(np.sqrt(square)), max(EFFICIENCY * dof, 1.0)

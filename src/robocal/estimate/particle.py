"""A particle filter that refines the Kalman filter's answer where the noise is not Gaussian.

    q(x) = prior(x) prod_u g_u(x),  g_u Gaussian, linearised at the filter's answer;  particles are drawn from q, widened
    log w <- log w + log l_u(x) - log g_u(x)   for one configuration u after the other

The filter has replaced every configuration's likelihood l_u by a Gaussian g_u. The particle filter puts the true ones
back, one by one, so it starts near the answer and not in a prior that no number of particles fills. l_u is
exp(-1/2 sum rho): a robust loss is a heavy-tailed density (Cauchy: Student's t), and the weighted mean is its posterior
mean. Weights are logarithms until they are normalised by their largest, so nothing underflows. When fewer than half of
the particles count, they are resampled systematically and roughened: shrunk to their mean and scattered by as much
(Liu and West), which a Metropolis test accepts or refuses, so that roughening adds no spread of its own. Another hill of the density,
far from the filter's answer, is not found. Sources:
Gordon, Salmond and Smith, Novel approach to nonlinear / non-Gaussian Bayesian state estimation (1993); Kitagawa (1996)
for systematic resampling; Gilks and Berzuini, Following a moving target (2001).
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.estimate.losses import LOSSES, TUNING
from robocal.estimate.problem import Problem
from robocal.progress import Watch, tell

__all__ = ["Cloud", "density", "effective", "normalise", "particles", "systematic"]

WIDER = 3.0  # particles start with 1 + WIDER / sqrt(n) times the filter's covariance: tails are heavier than it knows
ENOUGH = 0.5  # of the particles must count, else they are resampled
ROUGH = 0.6  # part of the spread that roughening draws anew
MOVES = 6  # roughening steps after each resampling, and at the end
CHUNK = 256  # particles that are evaluated at once
NOTHING = -1e200  # the logarithm of no weight at all: finite, so that differences of logarithms stay numbers


@record
class Cloud:
    """Particles x (B, P) of equal weight, their mean (1, P) and covariance (n, n); how often they were resampled, how many
    counted at worst, and the share of roughening steps that was accepted."""

    x: Array
    mean: Array
    covariance: Array
    resampled: int
    fewest: float
    accepted: float


def normalise(log_weights: Array) -> Array:
    """Weights that sum to one from logarithms (B,); the largest is taken out first, so that none underflows to all zero.
    Raises ModelError when no particle has a weight."""
    top = float(np.max(log_weights))
    if not top > NOTHING / 2:
        raise ModelError("no particle explains the measurements", found="all weights zero or not a number")
    w = np.exp(log_weights - top)
    return np.asarray(w / w.sum())


def effective(log_weights: Array) -> float:
    """How many particles count, 1 / sum w^2 of the normalised weights."""
    w = normalise(log_weights)
    return float(1.0 / (w @ w))


def systematic(weights: Array, rng: np.random.Generator, count: int | None = None) -> Ints:
    """Indices drawn in proportion to weights (B,) that sum to one: one random number, count equally spaced points.

    Every particle i is drawn floor(count w_i) or ceil(count w_i) times, count w_i on average.
    """
    count = len(weights) if count is None else count
    points = (rng.random() + np.arange(count)) / count
    edges = np.cumsum(weights)
    return np.minimum(np.searchsorted(edges / edges[-1], points, side="right"), len(weights) - 1)


def density(problem: Problem, x: Array) -> Array:
    """log l_u(x) = -1/2 sum rho(|r_i / sigma_i|^2) of every configuration, up to a constant: x (B, P) -> (B, U); NOTHING
    where the residual is not finite."""
    loss, tuning = problem.loss, problem.tuning or TUNING[problem.loss]
    weight = problem.first_weight
    out = np.zeros((len(x), problem.configurations))
    for first in range(0, len(x), CHUNK):
        some = slice(first, first + CHUNK)
        for r, term in zip(problem.residuals(x[some]), problem.terms, strict=True):
            white = r.white if r.value.ndim == 3 else r.white[None]
            s = np.einsum("bmd,bmd->bm", white, white)
            rho = _rho(loss if term.reading else "none", tuning, s) * weight[r.configuration]
            # Rows of one configuration are added up by a product with its incidence.
            order = np.argsort(r.configuration, kind="stable")
            edge = np.flatnonzero(np.diff(r.configuration[order], prepend=-1))
            out[some, r.configuration[order][edge]] -= 0.5 * np.add.reduceat(rho[:, order], edge, axis=1)
    return np.where(np.isfinite(out), out, NOTHING)


def _rho(loss: str, tuning: float, s: Array) -> Array:
    """The robust cost of a squared whitened norm, as `_kernels.robust`, for arrays."""
    c2, kind = tuning * tuning, LOSSES[loss]
    if kind == 1:
        return np.where(s <= c2, s, 2.0 * tuning * np.sqrt(s) - c2)
    if kind == 2:
        return np.asarray(c2 * np.log1p(s / c2))
    if kind == 3:
        return np.where(s >= c2, c2 / 3.0, c2 / 3.0 * (1.0 - (1.0 - np.minimum(s / c2, 1.0)) ** 3))
    return s


def particles(
    problem: Problem, x: Array, rng: np.random.Generator, *, count: int = 1000, watch: Watch | None = None
) -> Cloud:
    """The posterior of a problem by particles, starting from a filter's or a fit's answer x (1, P).

    Raises ModelError for local blocks (they have no place among the particles), where the data and priors leave a
    direction free, and where no particle lies within the bounds.
    """
    if problem.blocks:
        raise ModelError("the particle filter knows no local blocks", found=f"{problem.blocks} blocks", expected="lm")
    x = np.atleast_2d(x)
    n = problem.n
    seen = _Linearised(problem, x)
    root, centre, wider = seen.root, seen.centre, seen.wider
    step = centre + np.sqrt(wider) * scipy.linalg.solve_triangular(root, rng.standard_normal((n, count))).T
    log_w = np.zeros(count)
    value, ratio = seen(step)
    if problem.has_bounds and not (ratio[:, 0] > NOTHING / 2).any():
        message = "the measurements pull the answer beyond its bounds, where no particle may go"
        raise ModelError(message, expected="wider bounds, or lm")
    done, resampled, fewest, taken = 0, 0, float(count), 0.0
    while True:
        # As many further configurations as leave enough particles that count.
        path = log_w[:, None] + np.cumsum(ratio[:, done:], axis=1)
        w = np.exp(path - path.max(axis=0))
        counting = w.sum(axis=0) ** 2 / (w**2).sum(axis=0)
        poor = np.flatnonzero(counting < ENOUGH * count)
        stop = done + (int(poor[0]) + 1 if len(poor) else ratio.shape[1] - done)
        log_w = log_w + ratio[:, done:stop].sum(axis=1)
        done = stop
        fewest = min(fewest, effective(log_w))
        index = systematic(normalise(log_w), rng)
        step, value, ratio = step[index], value[index], ratio[index]
        log_w = np.zeros(count)
        resampled += 1
        for _ in range(MOVES):
            step, value, ratio, share = _roughen(seen, step, value, ratio, done, rng)
            taken += share
        tell(watch, "particles", done=done, total=ratio.shape[1])
        if done == ratio.shape[1]:
            break
    mean = step.mean(axis=0)
    away = step - mean
    cloud, centre = problem.retract(np.repeat(x, count, axis=0), step), problem.retract(x, mean[None])
    return Cloud(cloud, centre, away.T @ away / max(count - 1, 1), resampled, fewest, taken / (MOVES * resampled))


class _Linearised:
    """The two densities between which the particles move, as functions of tangent steps (B, n) from one x (1, P)."""

    def __init__(self, problem: Problem, x: Array) -> None:
        self.problem, self.x = problem, x
        self.root, self.centre = _gaussian(problem, x)
        self.wider = 1.0 + WIDER / np.sqrt(max(problem.n, 1))
        lin = problem.linearize(x)
        slope = problem.slopes(lin.r**2, lin)
        self.configuration, self.j, self.r = lin.configuration, np.sqrt(slope)[:, None] * lin.j, np.sqrt(slope) * lin.r
        self.order = np.argsort(lin.configuration, kind="stable")
        self.edge = np.flatnonzero(np.diff(lin.configuration[self.order], prepend=-1))

    def __call__(self, step: Array) -> tuple[Array, Array]:
        """log q - its maximum, widened as the particles were drawn (B,), and what each configuration then changes: log l_u
        - log g_u; the first column turns the widened q into prior times all g. (B, 1 + U)"""
        away = (step - self.centre) @ self.root.T
        full = -0.5 * np.einsum("bi,bi->b", away, away)
        x = self.problem.retract(np.repeat(self.x, len(step), axis=0), step)
        exact = density(self.problem, x)[:, self.configuration[self.order][self.edge]]
        linear = step @ self.j.T + self.r
        gauss = -0.5 * np.add.reduceat(linear[:, self.order] ** 2, self.edge, axis=1)
        first = full - full / self.wider
        if self.problem.has_bounds:
            lower, upper = self.problem.bounds
            value = x[:, self.problem.index]
            first = np.where(((value < lower) | (value > upper)).any(axis=1), NOTHING, first)
        return full / self.wider, np.column_stack([first, exact - gauss])


def _gaussian(problem: Problem, x: Array) -> tuple[Array, Array]:
    """Square root R (n, n) of the information and mean (n,) of the Gaussian posterior, linearised at x."""
    normal = problem.normal(x)
    a = np.tril(normal.a[0]) + np.tril(normal.a[0], -1).T
    try:
        root = np.linalg.cholesky(a).T
    except np.linalg.LinAlgError:
        message = "the measurements and priors leave a direction free, and particles would fill it"
        raise ModelError(message, expected="fewer free parameters, or priors") from None
    return root, scipy.linalg.solve_triangular(root, scipy.linalg.solve_triangular(root, -normal.g[0], trans="T"))


def _roughen(
    seen: _Linearised, step: Array, value: Array, ratio: Array, done: int, rng: np.random.Generator
) -> tuple[Array, Array, Array, float]:
    """One shrunk and scattered step of every particle, tested against the density reached so far; the share accepted.

    x' = m + a (x - m) + b L e with a^2 + b^2 = 1 leaves N(m, L L^T) as it is, so only the ratio of the density to that
    Gaussian is tested.
    """
    n = step.shape[1]
    mean = step.mean(axis=0)
    away = step - mean
    cov = away.T @ away / len(step)
    # Copies of a few particles span too little; the linearised posterior keeps the rest alive.
    inverse = scipy.linalg.solve_triangular(seen.root, np.eye(n))
    lower = np.linalg.cholesky(0.9 * cov + 0.1 * inverse @ inverse.T)
    a, b = np.sqrt(1 - ROUGH**2), ROUGH
    new = mean + a * away + b * rng.standard_normal(step.shape) @ lower.T
    new_value, new_ratio = seen(new)

    def target(s: Array, v: Array, c: Array) -> Array:
        z = scipy.linalg.solve_triangular(lower, (s - mean).T, lower=True)
        return np.asarray(v + c[:, :done].sum(axis=1) + 0.5 * np.einsum("ib,ib->b", z, z))

    accept = np.log(rng.random(len(step))) < target(new, new_value, new_ratio) - target(step, value, ratio)
    value, pick = np.where(accept, new_value, value), accept[:, None]
    return np.where(pick, new, step), value, np.where(pick, new_ratio, ratio), float(accept.mean())

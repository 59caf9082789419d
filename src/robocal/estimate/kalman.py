"""The extended Kalman filter on the same problem as least squares, one configuration after the other.

    S = H P H^T + I,  K = P H^T S^-1,  x <- x (+) K (-r - H e),  P <- (I - K H) P

r and H are whitened, so the measurement noise is the identity. e is the step from the prior to the current iterate
(zero in the first pass: the plain EKF; more passes are the iterated EKF). It is computed in square-root information
form, P^-1 = R^T R and R <- QR of (R, H), which holds from the vaguest prior to the last digit of a good instrument. A
local block enters at its prior, is updated with its configuration's rows and marginalised. Under a robust loss an
observation weighs what its innovation, measured with its *predicted* spread, deserves. An estimate beyond a bound is
projected onto it in the metric of P. `stack_filter` is the recursion of Attia and Ammari (2019, equations 4.2 to 4.9): all
rows at once, P grows by Q before each pass. Sources: Bierman, Factorization Methods (1977); Bell and Cathey, The
iterated Kalman filter update as a Gauss-Newton method (1993); Simon and Chia, Kalman filtering with state equality
constraints (2002).
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._record import field, record
from robocal._types import Array
from robocal.errors import ModelError
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Linear
from robocal.estimate.trail import Trail, keep
from robocal.progress import Watch, tell

__all__ = ["Filtered", "kalman", "stack_filter"]


@record
class Filtered:
    """Where the filter ended: x (1, P), covariance of the free columns (n, n); `history` are the costs (half the sum of
    squares) that the passes of `stack_filter` began with, and the last; `within` whether it stopped at a greatest error."""

    x: Array
    covariance: Array
    history: Array = field(default_factory=lambda: np.zeros(0))
    within: bool = False


def kalman(
    problem: Problem,
    x: Array | None = None,
    *,
    covariance: Array | None = None,
    local_sigma: float = 1.0,
    passes: int = 1,
    watch: Watch | None = None,
    trail: Trail | None = None,
) -> Filtered:
    """Filters the configurations of a problem in order, starting from x (1, P) with covariance (n, n); `trail` hears of every one.

    The default covariance is that of the priors, or of the expected errors where no prior is stated; a local block starts at its
    prior, or anywhere within `local_sigma` of x where none is stated. Raises
    ModelError when a local block is seen from several configurations: it could not be marginalised.
    """
    x = problem.start if x is None else np.atleast_2d(np.asarray(x, float))
    if len(problem.families) > 1:
        raise ModelError("the filter knows one family of local blocks", found="two", expected="lm")
    n, size = problem.n, problem.sizes[0][1]
    root = _beforehand(problem) if covariance is None else _root(covariance)
    if any(f.prior is not None for f in problem.families):
        # What has a prior starts at its mean.
        x = np.concatenate([x[:, : len(problem.table)], problem.start[:, len(problem.table) :]], axis=1)
    block_of = {configuration: block for block, configuration in _owners(problem).items()}
    vague = np.eye(size) / local_sigma
    big = np.zeros((size + n, size + n))
    taken = 0
    if trail is not None:
        trail.add(0, x[0], _covariance(root))
    for configuration in range(problem.configurations):
        big[:size, :size] = _local(problem, block_of[configuration], vague) if configuration in block_of else vague
        big[size:, size:] = root
        moved = np.zeros(size + n)
        weight: Array | None = None
        for _ in range(passes):
            lin = problem.linearize(x, np.array([configuration]))
            if not len(lin.r):
                break
            blocks = np.unique(lin.local[lin.local >= 0])
            if len(blocks) > 1:
                raise ModelError("the filter takes one local block per configuration", found=f"{len(blocks)} blocks")
            h = np.hstack([lin.jl, lin.j])
            if weight is None:
                weight = np.sqrt(_weights(problem, lin, h, big))
            rows = np.vstack([big, weight[:, None] * h])
            right = np.concatenate([np.zeros(len(big)), weight * (h @ moved - lin.r)])
            r = np.asarray(np.linalg.qr(np.column_stack([rows, right]), mode="r"))
            target = scipy.linalg.solve_triangular(r[: size + n, : size + n], r[: size + n, -1])
            if problem.has_bounds:
                target[size:] = _within(problem, x, target[size:], moved[size:], r[size : size + n, size : size + n])
            step = target - moved
            local = np.zeros((1, problem.blocks, size))
            if size:
                local[0, blocks] = step[:size]
            x = problem.retract(x, step[None, size:], local)
            moved = target
            root = r[size : size + n, size : size + n]
        if weight is not None:
            taken += 1
            if trail is not None and trail.wants(taken):
                trail.add(taken, x[0], _covariance(root))
        every = problem.configurations
        tell(watch, "filter", configuration=configuration, configurations=every, done=configuration + 1, total=every)
    known = _covariance(root)
    if trail is not None and trail.at[-1] != taken:
        trail.add(taken, x[0], known, last=True)
    return Filtered(x, known)


def _covariance(root: Array) -> Array:
    """P (n, n) of R with R^T R = P^-1."""
    inverse = scipy.linalg.solve_triangular(root, np.eye(len(root))) if len(root) else root
    return np.asarray(inverse @ inverse.T)


def stack_filter(
    problem: Problem,
    x: Array | None = None,
    *,
    covariance: Array,
    process: Array,
    noise: Array | float = 1.0,
    passes: int = 100,
    tolerance: float | None = None,
    watch: Watch | None = None,
    trail: Trail | None = None,
) -> Filtered:
    """The recursion of the seed: every pass takes all rows at once, linearised where the last one ended.

        P <- P + Q,  K = P J^T (J P J^T + R)^-1,  x <- x (+) K (-r(x)),  P <- (I - K J) P

    The innovation is y - h(x): with J relinearised, equation 4.8 as printed would subtract J X a second time. `noise`
    is the variance of each whitened row, () or (N,): R / sigma^2. It stops where the greatest error is within a `tolerance` (m).
    Raises ModelError for local blocks, a robust loss, or bounds.
    """
    if problem.blocks or problem.loss != "none" or problem.has_bounds:
        expected = "the sequential filter (ekf)"
        raise ModelError("the stacked filter knows no local blocks, robust loss or bounds", expected=expected)
    x = problem.start if x is None else np.atleast_2d(np.asarray(x, float))
    p: Array = np.array(covariance, dtype=np.float64)
    history, within = [], False
    for count in range(passes + 1):
        lin = problem.linearize(x)
        history.append(0.5 * float(lin.r @ lin.r))
        keep(trail, count, x[0])
        tell(watch, "iterate", iteration=count, cost=history[-1], active=1)
        within = tolerance is not None and bool(problem.greatest_error(x)[0] <= tolerance)
        if within or count == passes or not np.isfinite(history[-1]):
            break
        j = lin.j / np.sqrt(noise)[..., None] if np.ndim(noise) else lin.j / np.sqrt(noise)
        r = lin.r / np.sqrt(noise)
        # The same gain from the side of the parameters, which are fewer than the rows.
        p = np.asarray(np.linalg.inv(np.linalg.inv(p + process) + j.T @ j), dtype=np.float64)
        p = 0.5 * (p + p.T)
        x = problem.retract(x, -(p @ (j.T @ r))[None])
    return Filtered(x, p, np.array(history), within)


def _root(covariance: Array) -> Array:
    """R with R^T R = P^-1, upper triangular."""
    try:
        lower = np.linalg.cholesky(np.asarray(covariance, float))
    except np.linalg.LinAlgError:
        raise ModelError("the filter's covariance must be positive definite", key="covariance") from None
    # P = L L^T, so P^-1 = L^-T L^-1, and R = L^-1 up to a rotation from the left.
    return np.asarray(np.linalg.qr(scipy.linalg.solve_triangular(lower, np.eye(len(lower)), lower=True), mode="r"))


def _beforehand(problem: Problem) -> Array:
    """R (n, n), R^T R the information before any row: of the stated priors, and of the expected error where none is stated."""
    prior, vague = problem.prior_root, np.diag(1.0 / problem.scales)
    if not np.count_nonzero(prior - np.diag(np.diag(prior))):
        return np.where(problem.has_prior, prior, vague)
    return np.asarray(np.linalg.qr(np.vstack([prior, vague[~problem.has_prior]]), mode="r"))


def _local(problem: Problem, block: int, vague: Array) -> Array:
    """R (l, l) of a local block before its rows: its prior, and `vague` where that says nothing."""
    prior = problem.families[0].prior
    if prior is None:
        return vague
    own = prior.root[block]
    silent = ~(own != 0).any(axis=0)
    return np.asarray(np.linalg.qr(np.vstack([own, vague[silent]]), mode="r"))


def _owners(problem: Problem) -> dict[int, int]:
    """The configuration that each local block belongs to. Raises ModelError where one is seen from several."""
    owner: dict[int, int] = {}
    for term in problem.terms:
        for block, configuration in {
            (int(b), int(u)) for b, u in zip(term.local[0], term.configuration, strict=True) if b >= 0
        }:
            if owner.setdefault(block, configuration) != configuration:
                message = "the filter needs every local block to belong to one configuration"
                raise ModelError(message, found=f"block {block}")
    return owner


def _weights(problem: Problem, lin: Linear, h: Array, root: Array) -> Array:
    """rho'(s) of every row's observation, s the innovation's square over its predicted variance (H P H^T + I)_ii."""
    if problem.loss == "none":
        return np.ones(len(lin.r))
    a = scipy.linalg.solve_triangular(root, h.T, trans="T")
    return problem.slopes(lin.r**2 / (1.0 + np.einsum("ij,ij->j", a, a)), lin)


def _within(problem: Problem, x: Array, target: Array, moved: Array, root: Array) -> Array:
    """The step from the prior, projected onto the bounds that it would cross: the nearest point in the metric of P."""
    lower, upper = problem.bounds
    here = x[0, problem.index] - moved  # values at the prior, so that value = here + step
    low, high = lower - here, upper - here
    held = np.zeros(problem.n, dtype=bool)
    for _ in range(problem.n):
        new = (target < low) | (target > high)
        if not (new & ~held).any():
            break
        held |= new
        inverse = scipy.linalg.solve_triangular(root, np.eye(problem.n))
        p = inverse @ inverse.T
        goal = np.clip(target, low, high)[held]
        target = target + p[:, held] @ np.linalg.solve(p[np.ix_(held, held)], goal - target[held])
    return np.clip(target, low, high)

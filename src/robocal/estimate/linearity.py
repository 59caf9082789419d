"""How linear a problem is: what one linear step promises, what it leaves, and how curved the model is within its sigmas.

    promised  r + J d      what the linear equation says of the step d = -J^+ r
    left      r(x (+) d)   what the model says of it
    neglected r(x (+) d) - r - J d      the second-order terms and beyond: E_2, E_3, ... of Attia and Ammari (2019, eq. 3.10)

The step is of minimum norm in expected errors, exact null directions cut. The curvature of a direction h of one standard
deviation is |r(x + h) - 2 r(x) + r(x - h)| over |J h|^2, whitened: half of it is what the linear model is wrong by, in
standard deviations, one sigma away from the answer. Source: Bates and Watts, Relative curvature measures of
nonlinearity (1980).
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.estimate.elimination import triangle
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Linear

__all__ = ["Curvature", "Step", "curvature", "one_step", "rows_triangle"]

# Singular values below this share of the largest are exact null directions, as in `identifiability`.
STRUCTURAL = 1e-9
CHUNK = 2000  # rows at once: a second copy of all of them would be as large as the Jacobian
LOOKS = (
    (300, 0.1),
    (3000, 0.5),
)  # grid: numbers that are looked at, and of the largest curvature there what may be it among all


@record
class Step:
    """One linear step from x, rms per component of the rows in one SI unit: the residual before, promised and left, the
    neglected terms, and their share of the step's effect |r(x (+) d) - r - J d| / |J d|; `noise` is the sigma in use."""

    unit: str
    before: float
    promised: float
    left: float
    neglected: float
    share: float
    noise: float


@record
class Curvature:
    """The largest relative curvature over the directions of the covariance, and the parameter that such a direction
    moves most."""

    value: float
    parameter: str


def rows_triangle(lin: Linear, used: Bools) -> Array:
    """R (n + 1, n + 1) of the columns and the residuals of the rows that are used, (N,)."""
    wide = lin.j.shape[1] + 1
    r = np.zeros((0, wide))
    for first in range(0, max(len(used), 1), CHUNK):
        every = slice(first, first + CHUNK)
        some = every if used[every].all() else first + np.flatnonzero(used[every])
        r = triangle(np.vstack([r, np.column_stack([lin.j[some], lin.r[some]])]), CHUNK + wide)
    return r


def one_step(
    problem: Problem,
    x: Array,
    unit: str = "m",
    lin: Linear | None = None,
    known: Array | None = None,
    columns: Ints | None = None,
) -> Step | None:
    """The linear step of a problem from x (1, P), its priors included where they are on; None with local blocks, without
    free columns, or where nothing is measured in this unit. `lin` is all of its rows linearised there and `known` their `rows_triangle`,
    where the caller has them; `columns` says which of `lin` are the problem's."""
    mine = np.concatenate([_rows(t.scale[t.used], t.parts, unit).ravel() for t in problem.terms])
    if problem.blocks or not problem.n:
        return None
    lin = problem.with_weights(None).linearize(x) if lin is None else lin
    used = problem.in_use[lin.configuration]
    mine &= used
    if not mine.any():
        return None
    root = problem.prior_root
    away = problem.difference(np.atleast_2d(x))[0]
    scales = problem.scales
    r = rows_triangle(lin, used) if known is None else known
    r = triangle(np.vstack([r, np.column_stack([root, root @ away])]) * np.append(scales, 1.0))
    d = -scales * (np.linalg.pinv(r[:-1, :-1], rcond=STRUCTURAL) @ r[:-1, -1])
    sigma = 1.0 / np.concatenate([t.scale[t.used].ravel() for t in problem.terms])
    first = lin.r * sigma
    step = np.zeros(lin.j.shape[1])
    step[np.arange(problem.n) if columns is None else columns] = d
    effect = (lin.j @ step) * sigma
    moved = problem.retract(np.atleast_2d(x), d[None])
    after = np.concatenate([res.value[res.used].ravel() for res in problem.residuals(moved)])
    beyond = after - first - effect
    size = _rms(effect[mine])
    before, promised, left, neglected = (_rms(v[mine]) for v in (first, first + effect, after, beyond))
    share = neglected / size if size > 0 else 0.0
    return Step(unit, before, promised, left, neglected, share, _rms(sigma[mine]))


def curvature(problem: Problem, x: Array, covariance: Array) -> Curvature | None:
    """The largest curvature of the whitened residuals at a solution x (1, P) with this covariance (n, n); None with local
    blocks or without free columns."""
    if problem.blocks or not problem.n or not np.isfinite(covariance).all():
        return None
    scale = problem.scales
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    steps = (vectors * np.sqrt(np.maximum(values, 0.0))).T * scale
    x = np.atleast_2d(x)
    # A part of many rows says along which steps the curvature may be the largest: few rows of most, more of those that are left.
    among, numbers = np.arange(len(steps)), int(problem.numbers.sum())
    for enough, share in LOOKS:
        if numbers >= 2 * enough and len(among) > 1:
            rough = _bends(problem, x, steps[among], numbers // enough)
            among = among[rough >= share**2 * rough.max()]
    size = _bends(problem, x, steps[among])
    if not len(size) or not size.max() > 0:
        return Curvature(0.0, problem.free[int(np.argmax(np.abs(steps[0] / scale)))])
    where = among[int(size.argmax())]
    return Curvature(float(np.sqrt(size.max())), problem.free[int(np.argmax(np.abs(steps[where] / scale)))])


def _bends(problem: Problem, x: Array, steps: Array, step: int = 1) -> Array:
    """Squares of the second differences of all whitened residuals along steps (k, n) from x (1, P), (k,)."""
    n, start = len(steps), np.repeat(x, len(steps), axis=0)
    there = np.concatenate([x, problem.retract(start, steps), problem.retract(start, -steps)])
    counted, size = problem.in_use, np.zeros(n)
    for term, rows, r in problem.residual_pieces(there, step):
        # The scale of what was set aside is zero.
        scaled = term.scale[rows] * counted[term.configuration[rows], None]
        bend = (r[1 : 1 + n] + r[1 + n :] - 2 * r[0]) * scaled
        size += np.einsum("bmd,bmd->b", bend, bend)
    return size


def _rows(scale: Array, parts: tuple[tuple[int, int, str], ...], unit: str) -> Bools:
    out = np.zeros(scale.shape, dtype=bool)
    for start, stop, name in parts:
        out[:, start:stop] = name == unit
    return out


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))

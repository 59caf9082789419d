"""Which rows do not belong to the others: a generalised ESD test on studentised residuals.

    D_i^2 = r_i^T (I - H_ii)^-1 r_i,    H = J (J^T J)^-1 J^T    with r and J whitened, one block per observation

A gross error bends the fit towards itself; the leverage H undoes that. The farthest observation is set aside, the fit
and its scale are updated without it, and so on: outliers cannot hide each other. With stated noise D^2 is chi2_d; where
the noise was estimated, D^2 / d over the mean square of the others is F(d, dof - d). The largest k for which the
k-th step was significant after Bonferroni's correction gives the outliers. References: Rosner, Percentage points for a
generalized ESD many-outlier procedure (1983); Cook and Weisberg, Residuals and influence in regression (1982).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.estimate.problem import Problem
from robocal.measure.data import DataSet
from robocal.measure.rows import Rows

if TYPE_CHECKING:
    from robocal.calibrate.fit import Fit

__all__ = ["Outlier", "find_outliers"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SURE = 0.01  # chance of naming any row of a data set without outliers
SHARE = 0.2  # at most this share of the observations is set aside
MOST = 200
ALONE = 1e-4  # 1 - leverage: a prediction from the others would be a hundred times less certain than the row
QUIET = 5  # steps without a significant row after which the search ends


@dataclass(frozen=True)
class Outlier:
    """An observation that does not belong to the others: where it stands, how many standard deviations it is away from a
    fit without it, and the chance that the farthest of all rows would be (corrected for their number)."""

    configuration: str
    group: str
    kind: str
    target: str
    source: str
    row: int | None
    distance: float
    p_value: float
    leverage: float


@dataclass(frozen=True)
class _Rows:
    """Whitened residuals and Jacobians of observations with d numbers each."""

    term: int
    index: Ints  # (m,) row of the term
    r: Array  # (m, d)
    j: Array  # (m, d, n)
    group: int


def find_outliers(data: DataSet, found: Fit) -> tuple[Outlier, ...]:
    """The outliers among the rows of a fit, the farthest first."""
    problem, x = found.problem.with_loss("none"), found.solution.x
    parts = _collect(problem, x)
    if not parts or problem.block_size:
        return ()
    estimated = {g.name for g in found.groups if g.stated is None or g.tau > 0}
    groups = [t.group for t in problem.terms]
    free = np.array([groups[p.term] in estimated for p in parts])
    steps = _search(problem, x, parts, free)
    last = max((i for i, s in enumerate(steps) if s[2] < SURE), default=-1)
    named = [(part, i) for part, i, _ in steps[: last + 1]]
    out = []
    for (part, i), (distance, p, leverage) in zip(named, _judge(problem, x, parts, free, named), strict=True):
        term = problem.terms[parts[part].term]
        assert isinstance(term, Rows)
        row = int(parts[part].index[i])
        name = data.configurations.ids[int(term.unit[row])]
        source, line = _where(data, problem, parts[part].term, row)
        out.append(Outlier(name, term.group, term.kind, term.target, source, line, distance, p, leverage))
    return tuple(sorted(out, key=lambda o: -o.distance))


def _collect(problem: Problem, x: Array) -> list[_Rows]:
    weight = np.ones(problem.units) if problem.weights is None else problem.weights[0]
    names = sorted({t.group for t in problem.terms})
    out = []
    for number, term in enumerate(problem.bound_terms):
        m, _ = term.scale.shape
        r, narrow, _ = term.evaluate(np.atleast_2d(x), np.zeros(1, dtype=np.int64), 0, m)
        j = np.zeros((*r.shape[1:], problem.n))
        for i, column in enumerate(term.columns):
            j[..., column] += narrow[0, ..., i]
        used = np.flatnonzero(weight[term.unit] > 0)
        out.append(
            _Rows(number, used, (r[0] * term.scale)[used], (j * term.scale[..., None])[used], names.index(term.group))
        )
    return out


class _Linear:
    """The linear fit of what has not been set aside."""

    def __init__(self, problem: Problem, x: Array, parts: list[_Rows]) -> None:
        info = problem.prior[1]
        self.parts, self.n = parts, problem.n
        self.a, self.b = np.diag(info), info * problem.difference(np.atleast_2d(x))[0]
        for p in parts:
            self.a = self.a + np.einsum("mdi,mdj->ij", p.j, p.j, optimize=True)
            self.b = self.b + np.einsum("mdi,md->i", p.j, p.r)
        # Columns differ by orders of magnitude: unit diagonal before the inverse.
        self.size = np.sqrt(np.where(np.diag(self.a) > 0, np.diag(self.a), 1.0))
        self.away = [np.zeros(len(p.r), dtype=bool) for p in parts]

    def remove(self, part: int, i: int) -> None:
        p = self.parts[part]
        self.away[part][i] = True
        self.a = self.a - p.j[i].T @ p.j[i]
        self.b = self.b - p.j[i].T @ p.r[i]

    def solve(self) -> tuple[Array, list[Array], int]:
        """Inverse information, residuals of all rows, and degrees of freedom."""
        both = np.outer(self.size, self.size)
        inverse = np.linalg.pinv(self.a / both, hermitian=True) / both
        dx = inverse @ self.b
        left = sum(int((~w).sum()) * p.r.shape[1] for p, w in zip(self.parts, self.away, strict=True))
        return inverse, [p.r - p.j @ dx for p in self.parts], left - self.n

    def spread(self, residual: list[Array], part: int, dof: int) -> tuple[float, float]:
        """Sum of squares of one instrument's rows, and the degrees of freedom that are theirs."""
        same = [q for q, p in enumerate(self.parts) if p.group == self.parts[part].group]
        count = [
            sum(int((~self.away[q]).sum()) * self.parts[q].r.shape[1] for q in some)
            for some in (same, range(len(self.parts)))
        ]
        return sum(float(np.sum(residual[q][~self.away[q]] ** 2)) for q in same), max(
            count[0] * dof / max(count[1], 1), 1.0
        )


def _chance(square: float, d: int, spread: float, own: float, free: bool) -> tuple[float, float]:
    """The chance of a row this far out, and its distance in standard deviations of the others."""
    if not free:
        return float(special.chdtrc(d, square)), float(np.sqrt(square))
    scale = max(spread / own, 1e-300)
    return float(special.fdtrc(d, own, square / d / scale)), float(np.sqrt(square / scale))


def _search(problem: Problem, x: Array, parts: list[_Rows], free: NDArray[np.bool_]) -> list[tuple[int, int, float]]:
    """Steps (part, row, corrected chance), in the order in which rows were set aside."""
    fit = _Linear(problem, x, parts)
    many = sum(len(p.r) for p in parts)
    steps: list[tuple[int, int, float]] = []
    quiet = 0
    while len(steps) < min(MOST, int(SHARE * many)) and quiet < QUIET:
        inverse, residual, dof = fit.solve()
        if dof <= 2 * max(p.r.shape[1] for p in parts):
            break
        found: list[tuple[float, float, int, int]] = []
        for k, p in enumerate(parts):
            i, square = _farthest(p, residual[k], fit.away[k], inverse)
            if i >= 0:
                total, own = fit.spread(residual, k, dof)
                d = p.r.shape[1]
                # Its own square is no part of what the others scatter by.
                chance, distance = _chance(square, d, total - square, max(own - d, 1.0), bool(free[k]))
                found.append((chance, -distance, k, i))
        if not found:
            break
        chance, _, k, i = min(found)
        corrected = min(chance * (many - len(steps)), 1.0)
        steps.append((k, i, corrected))
        quiet = 0 if corrected < SURE else quiet + 1
        fit.remove(k, i)
    return steps


def _farthest(p: _Rows, residual: Array, away: NDArray[np.bool_], inverse: Array) -> tuple[int, float]:
    """The row with the largest D^2, and D^2; -1 where none is left."""
    rows = np.flatnonzero(~away)
    if not len(rows):
        return -1, 0.0
    j, r, d = p.j[rows], residual[rows], p.r.shape[1]
    rest = np.eye(d) - np.einsum("mai,ij,mbj->mab", j, inverse, j, optimize=True)
    values, vectors = np.linalg.eigh(rest)
    # A row that alone decides a direction has no residual there, and says nothing about itself. All but alone: without
    # it, only what was held at nominal would decide, and that is not known well enough to accuse a measurement.
    turned = np.einsum("mab,ma->mb", vectors, r)
    square = np.sum(np.where(values > ALONE, turned**2 / np.where(values > ALONE, values, 1.0), 0.0), axis=1)
    best = int(np.argmax(square))
    return int(rows[best]), float(square[best])


def _judge(
    problem: Problem, x: Array, parts: list[_Rows], free: NDArray[np.bool_], named: list[tuple[int, int]]
) -> list[tuple[float, float, float]]:
    """Of every outlier (part, row): distance from the fit without all of them, chance of the farthest row, leverage."""
    fit = _Linear(problem, x, parts)
    for part, i in named:
        fit.remove(part, i)
    inverse, residual, dof = fit.solve()
    many = sum(len(p.r) for p in parts)
    out = []
    for part, i in named:
        j, r = parts[part].j[i], residual[part][i]
        reach = j @ inverse @ j.T
        square = float(r @ np.linalg.solve(np.eye(len(r)) + reach, r))
        total, own = fit.spread(residual, part, max(dof, 1))
        chance, distance = _chance(square, len(r), total, own, bool(free[part]))
        hat = np.trace(np.linalg.solve(np.eye(len(r)) + reach, reach)) / len(r)
        out.append((distance, min(chance * many, 1.0), float(hat)))
    return out


def _where(data: DataSet, problem: Problem, term: int, row: int) -> tuple[str, int | None]:
    """File and row number of a row of a term; terms follow the observations in order, one or more for each."""
    at = 0
    for obs in data.observations:
        taken = 0
        while taken < len(obs) and at < len(problem.terms):
            made = problem.terms[at]
            assert isinstance(made, Rows)
            if at == term:
                line = None if obs.rows is None else int(obs.rows[made.index[row]])
                return obs.source, line
            taken += len(made.index)
            at += 1
    return "", None

"""Generalised least squares in place of local blocks.

A pose that was measured with a covariance C and then enters h lengths is a local block under a prior. To first order it is an
error that those lengths share, r + J_p e with e ~ N(m - p, C), and leaves them the information

    W = (D^-1 + J_p C J_p^T)^-1,   D = diag(1 / sigma^2)

A pass fits the shared columns to all configurations with W taken at one linearisation point; the blocks then follow one by one,
and the next pass begins where they went. What the last pass moved is what the one before it was wrong by, which says whether the
result is that of the free blocks. Reference: Fuller, Measurement error models (1987), section 3.2.

"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.estimate.losses import Loss
from robocal.estimate.problem import Problem
from robocal.estimate.solution import Solution
from robocal.estimate.terms import Normal, ProblemTerm

__all__ = ["ENOUGH", "Correlated", "Generalised", "correlate_rows", "generalised_least_squares"]

WHITE = "1"  # the unit of numbers that were whitened
CHUNK = 1 << 17  # numbers of a Jacobian at once


class Correlated:
    """The numbers (row times d + column) `order` (U, h) of a term, whose residual at the linearisation is `offset` larger (1 or B,
    U, h) and has the information W, `info` (1 or B, U, h, h). Whitened by V, V^T V = W, they are h numbers without unit."""

    lever: Array | None = None
    touches = (False, False)

    view = None

    def __init__(self, term: ProblemTerm, order: Ints, offset: Array, info: Array, used: Bools) -> None:
        self.term, self.order, self.offset, self.info, self.used = term, order, offset, info, used
        self.group, self.kind, self.reading, self.columns = term.group, term.kind, term.reading, term.columns
        self.parts = ((0, order.shape[1], WHITE),)
        self.scale = np.repeat(used[:, None], order.shape[1], axis=1).astype(float)
        self.configuration = np.ascontiguousarray(term.configuration[order[:, 0] // term.scale.shape[1]])
        self.pairs, self.pair = np.zeros((0, 2), dtype=np.int64), np.full(len(order), -1, dtype=np.int64)
        self.local = self.pair, self.pair

    @property
    def plain(self) -> Correlated:
        return self

    def bind(self, column_of: Ints) -> Correlated:
        return Correlated(self.term.bind(column_of), self.order, self.offset, self.info, self.used)

    def without(self, rows: Bools) -> Correlated:
        return Correlated(self.term, self.order, self.offset, self.info, self.used & ~rows)

    def join(self, some: object) -> Correlated:
        raise NotImplementedError  # it shares no view

    def hold(self, family: int) -> Correlated:
        return Correlated(self.term.hold(family), self.order, self.offset, self.info, self.used)

    @cached_property
    def root(self) -> Array:
        """V, (1 or B, U, h, h)."""
        values, vectors = np.linalg.eigh(self.info)
        return np.asarray(np.sqrt(np.maximum(values, 0.0))[..., None] * np.swapaxes(vectors, -1, -2))

    def _numbers(self, x: Array, which: Ints) -> tuple[Array, Array]:
        """Residuals (B, N) and Jacobians (B, N, k) of all numbers of the term."""
        r, jac, _ = self.term.evaluate(x, which, 0, len(self.term.scale))
        shape = len(x), self.term.scale.size
        return np.ascontiguousarray(r.reshape(shape)), np.ascontiguousarray(jac.reshape(*shape, jac.shape[3]))

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        part = slice(first, first + rows)
        r, jac = self._numbers(x, which)
        order, root, offset = self.order[part], self.root[:, part], self.offset[:, part]
        if len(root) > 1:
            root, offset = root[which], offset[which]
        e = r[:, order] + offset
        none = np.zeros((len(x), len(order), order.shape[1], 0))
        return (root @ e[..., None])[..., 0], root @ jac[:, order], none

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        from robocal.estimate.generalised._kernels import accumulate_correlated

        if loss.kind != 0:
            return False
        many = max(1, CHUNK // max(1, self.term.scale.size * len(self.columns)))
        shared = len(self.info) == 1
        for lo in range(0, len(x), many):
            part = slice(lo, lo + many)
            r, jac = self._numbers(x[part], which[part])
            offset, info = (self.offset, self.info) if shared else (self.offset[which[part]], self.info[which[part]])
            accumulate_correlated(
                r, jac, self.order, offset, info, self.used, weight if len(weight) == 1 else weight[part], self.configuration,
                self.columns, out.cost[part], out.g[part], out.a[part],
            )  # fmt: skip
        return True


ENOUGH = 0.01  # of sigma
PASSES = 3


@record
class Generalised:
    """Where generalised least squares ended: x (B, P) with the blocks where they follow, `covariance` (B, n, n) of the free
    columns, `moved` (B,) the largest move of the last pass in sigma, `exact` (B,) whether that is at most `ENOUGH`; x of the others
    is that of the free blocks."""

    x: Array
    covariance: Array
    moved: Array
    exact: Bools
    passes: int


@record
class _Shared:
    """The numbers of configurations that have equally many, `order` (U, h), of the block `block` (U,), with S = root root^T."""

    order: Ints
    block: Ints
    info: Array
    root: Array


def correlate_rows(problem: Problem, x: Array | None = None) -> Problem:
    """The problem without its local blocks, which stay where x (B, P) has them: rows that touched one are correlated, linearised
    in the blocks there.

    Raises ModelError where blocks are of two families, have no prior that with the rows tells where they are, or are touched by
    several sensors, and for a robust loss.
    """
    x = problem.start if x is None else np.atleast_2d(np.asarray(x, float))
    term = _touching(problem)
    _, _, offset, shared = _linearise(problem, term, x)
    held = problem.with_fixed_blocks(0)
    here = problem.terms.index(term)
    free, alone = held.terms[here], term.local[0] >= 0
    parts: list[ProblemTerm] = [free.without(alone)] if (term.used & ~alone).any() else []
    for s in shared:
        every = np.ones(len(s.order), dtype=np.bool_)
        parts.append(Correlated(free, s.order, np.ascontiguousarray(offset[:, s.order]), s.info, every))
    return replace(held, terms=(*held.terms[:here], *parts, *held.terms[here + 1 :]))


def generalised_least_squares(problem: Problem, x: Array | None = None, *, passes: int = PASSES) -> Generalised:
    """Fits the shared columns by generalised least squares from x (B, P), the table's values by default, until a pass moves
    nothing by more than `ENOUGH` sigma; where `passes` are not enough, the free blocks are fitted, and `exact` says so.

    Raises ModelError as `correlate_rows` does.
    """
    x = problem.start if x is None else np.atleast_2d(np.asarray(x, float))
    moved, before, count = np.full(len(x), np.inf), None, 0
    while count < max(1, passes) and not (moved <= ENOUGH).all():
        found = least_squares(correlate_rows(problem, x), x)
        covariance = _covariance(problem, found)
        if before is not None:
            sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
            moved = np.abs((found.x - before)[:, problem.index] / sigma).max(axis=1, initial=0.0)
        before, count = found.x, count + 1
        x = follow(problem, found.x)
    exact = np.asarray((moved <= ENOUGH) | (not problem.n))
    if not exact.all():
        free = least_squares(problem, x)
        x = np.where(exact[:, None], x, free.x)
    return Generalised(x, covariance, moved, exact, count)


def follow(problem: Problem, x: Array) -> Array:
    """x (B, P) with every block where its prior and its rows want it, one linear step from where it is."""
    from robocal.estimate.generalised._kernels import place

    term = _touching(problem)
    r, jloc, _, shared = _linearise(problem, term, x)
    family = problem.families[0]
    off, hold = family.prior.rows(problem.values_of(0, x)) if family.prior else (np.zeros(0), np.zeros(0))
    step = np.zeros((len(x), family.count, family.size))
    pull = np.ascontiguousarray(np.einsum("bloi,blo->bli", hold, off))
    for s in shared:
        place(r, jloc, np.ascontiguousarray(term.scale.ravel()), s.order, s.block, hold, pull, s.root, step)
    return problem.retract(x, np.zeros((len(x), problem.n)), step)


def _touching(problem: Problem) -> ProblemTerm:
    """The one term that touches blocks."""
    terms = [t for t in problem.terms if any(t.touches)]
    if problem.loss != "none":
        raise ModelError("generalised least squares knows no robust loss", found=problem.loss, expected="none")
    if len(problem.families) != 1 or len(terms) != 1:
        found = f"{len(problem.families)} families, {len(terms)} sensors"
        message = "generalised least squares needs one family of local blocks, touched by one sensor"
        raise ModelError(message, found=found, expected="maximum likelihood with free blocks")
    if problem.families[0].prior is None:
        raise ModelError("generalised least squares needs a prior of the local blocks", expected="with_local_prior")
    return terms[0]


def _linearise(problem: Problem, term: ProblemTerm, x: Array) -> tuple[Array, Array, Array, list[_Shared]]:
    """Residuals (B, N), Jacobians by the blocks (B, N, l), J_p (m - p) (B, N), and what is shared, at x (B, P)."""
    from robocal.estimate.generalised._kernels import marginal

    d = term.scale.shape[1]
    none = term.bind(np.full(x.shape[1], -1, dtype=np.int64))
    r, _, jloc = none.evaluate(x, np.arange(len(x)), 0, len(term.scale))
    jloc = np.ascontiguousarray(jloc.reshape(len(x), len(term.scale) * d, -1))
    prior = problem.families[0].prior
    assert prior is not None
    away, hold = prior.rows(problem.values_of(0, x))
    hold = np.ascontiguousarray(hold)
    back = -(np.linalg.pinv(hold) @ away[..., None])[..., 0] if away.any() else -away  # to the prior's mean, (B, L, l)
    block = np.repeat(term.local[0], d)
    offset = np.einsum("bnl,bnl->bn", jloc, back[:, np.maximum(block, 0)])
    counted = term.scale.ravel() > 0
    shared = []
    scale = np.ascontiguousarray(term.scale.ravel())
    for blocks, order in _orders(np.repeat(term.configuration, d), block, counted):
        info = np.empty((len(x), *order.shape, order.shape[1]))
        root = np.empty((len(x), len(order), jloc.shape[2], jloc.shape[2]))
        at = marginal(jloc, scale, order, blocks, hold, info, root)
        if at >= 0:
            message = "a local block is told neither by its prior nor by its rows"
            raise ModelError(message, found=int(blocks[at]), expected="a prior")
        shared.append(_Shared(order, blocks, info, root))
    return np.ascontiguousarray(r.reshape(len(x), -1)), jloc, offset, shared


def _orders(configuration: Ints, block: Ints, counted: Bools) -> list[tuple[Ints, Ints]]:
    """The blocks and the numbers (U, h) that touch each, for every count h that there is; what is set aside is left out."""
    some = np.flatnonzero(counted & (block >= 0))
    some = some[np.argsort(block[some], kind="stable")]
    if len(np.unique(np.column_stack([block, configuration])[some], axis=0)) != len(np.unique(block[some])):
        expected = "maximum likelihood with free blocks"
        raise ModelError("a local block belongs to several configurations", expected=expected)
    blocks, first, count = np.unique(block[some], return_index=True, return_counts=True)
    alike = [(count == h, np.arange(h)) for h in np.unique(count)]
    return [(blocks[mine], some[first[mine][:, None] + each]) for mine, each in alike]


def _covariance(problem: Problem, found: Solution) -> Array:
    """Inverses of the Gauss-Newton matrices (B, n, n); infinite where one is not positive definite."""
    a = np.tril(found.normal.a)
    a = (a + np.swapaxes(np.tril(a, -1), 1, 2)) * np.outer(problem.scales, problem.scales)
    try:
        return np.asarray(np.linalg.inv(a) * np.outer(problem.scales, problem.scales))
    except np.linalg.LinAlgError:
        return np.full_like(a, np.inf)

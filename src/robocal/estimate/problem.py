"""A least-squares problem: everything that a solver may see.

    cost(x) = 1/2 sum_i w_i rho(|r_i(x) / sigma_i|^2) + 1/2 |R (x - mu)|^2 + 1/2 sum_b |R_b (x_b - mu_b)|^2

x (B, P) stacks B parameter vectors of a table, followed by local blocks (one pose or one point each) of at most two families
(`families.py`). The solver moves in the tangent space: n free columns, L blocks of l and M of q; R and R_b are roots of stated
priors. Terms give residuals and Jacobians for many rows at once; whitening, robust weights, priors, bounds and elimination happen
here, once. `normal` feeds the iteration, `linearize` feeds rank, EKF and reports; a law test keeps them equal. Reference: Triggs
et al., Bundle adjustment, a modern synthesis (2000), sections 4 to 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import cached_property, record, replace
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.estimate.evaluation import CHUNK, evaluate_all, evaluate_pieces, greatest_length
from robocal.estimate.independent_columns import independent_groups
from robocal.estimate.losses import LOSSES, TUNING, Loss, slopes
from robocal.estimate.priors import add_shared
from robocal.estimate.terms import Linear, Normal, ProblemTerm, Residuals, pieces, whiten_rows
from robocal.estimate.unknowns import Unknowns
from robocal.parameters import ParameterTable

__all__ = ["Problem"]

NOTHING = np.empty((0, 0))
# What is worked out of a problem once, by what it depends on: rows (and columns), names and free columns, values and priors.
_OF_ROWS = frozenset({"bound_terms", "_summed", "_bare", "numbers", "aside", "pairs"})
_OF_LAYOUT = frozenset({"sizes", "places", "_ones", "_kernels", "_moves"})
_OF_COLUMNS = _OF_LAYOUT | {"_layout"}
_OF_TABLE = frozenset(
    "_start bounds has_bounds has_prior _any_prior prior_informs prior_root spread_root scales preference _pull _soft".split()
)
_OTHER_FREE = _OF_LAYOUT | {"_bare", "numbers", "aside", "pairs", "_start"}
_OTHER_TERMS = _OF_COLUMNS | _OF_TABLE | {"pairs", "apart"}
_OTHER_TABLE = _OF_ROWS | _OF_COLUMNS
_OTHER_WEIGHTS = _OTHER_TABLE | _OF_TABLE | {"apart"}


@cache
def _straight(kind: int, tuning: float, batch: int) -> Loss:
    """A loss whose curvature counts in none of so many problems."""
    return Loss(kind, tuning, np.zeros(batch, dtype=np.bool_))


@cache
def _names_of_results(same: frozenset[str]) -> tuple[str, ...]:
    """What is worked out of a problem, but for the `same`."""
    every = {**vars(Unknowns), **vars(Problem)}
    return tuple(n for n, v in every.items() if isinstance(v, cached_property) and n not in same)


def _check_loss(loss: str) -> str:
    if loss not in LOSSES:
        raise ModelError("unknown loss", found=loss, expected=", ".join(LOSSES))
    return loss


@record(kw_only=True)
class Problem(Unknowns):
    """Terms over unknowns; immutable, `with_...` gives another problem."""

    terms: tuple[ProblemTerm, ...]
    configurations: int = 0
    weights: Array | None = None
    loss: str = "none"
    tuning: float | None = None

    def __post_init__(self) -> None:
        _check_loss(self.loss)

    @cached_property
    def bound_terms(self) -> tuple[ProblemTerm, ...]:
        """The terms with Jacobians for the free columns."""
        return tuple(t.bind(self.column_of) for t in self.terms)

    @cached_property
    def _summed(self) -> tuple[ProblemTerm, ...]:
        """The bound terms, those that look through one view as one."""
        out: list[ProblemTerm] = []
        for view, group in groupby(self.bound_terms, lambda t: t.view):
            some = list(group)
            out += some if view is None or len(some) == 1 else [some[0].join(some)]
        return tuple(out)

    @cached_property
    def _bare(self) -> tuple[ProblemTerm, ...]:
        """The terms without Jacobians."""
        nothing = np.full(len(self.table), -1, dtype=np.int64)
        return tuple([t.bind(nothing) for t in self.terms])

    def with_free(self, names: Sequence[str]) -> Problem:
        """The same rows with other free columns (in table order)."""
        wanted, known = set(names), self.table.index
        for name in wanted:
            _ = name in known or self.table[name]
        free = tuple([n for n in self.table.names if n in wanted])
        return self if free == self.free else self._with(_OTHER_FREE, free=free)

    def with_weights(self, weights: Array | None) -> Problem:
        """The same rows with one weight per configuration, (U,) or (B, U); leave-one-out and bootstrap are weights."""
        some = None if weights is None else np.ascontiguousarray(np.atleast_2d(weights), dtype=float)
        return self._with(_OTHER_WEIGHTS, weights=some)

    def without(self, rows: Sequence[Bools]) -> Problem:
        """The same problem with these rows of every term, (m,) each, set aside."""
        return self.with_terms([t.without(r) for t, r in zip(self.terms, rows, strict=True)])

    def with_terms(self, terms: Sequence[ProblemTerm]) -> Problem:
        """The same problem with other terms of the same rows: their noise, or which of them count."""
        return self._with(_OTHER_TERMS, terms=tuple(terms))

    def with_loss(self, loss: str, tuning: float | None = None) -> Problem:
        """The same rows with a robust loss."""
        return self._with(_OTHER_WEIGHTS, loss=_check_loss(loss), tuning=tuning)

    def with_table(self, table: ParameterTable) -> Problem:
        """The same rows over a table with the same names and other values, priors or bounds."""
        return self._with(_OTHER_TABLE, table=table)

    def with_priors(self, priors: bool) -> Problem:
        """The same problem, where stated priors count or do not."""
        return self._with(_OTHER_TABLE, priors=priors)

    def _with(self, same: frozenset[str], **changes: Any) -> Problem:
        """Another problem of which `same`, what was worked out of this one, is the same."""
        _ = self._soft
        made = object.__new__(Problem)
        made.__dict__.update(self.__dict__, **changes)
        for name in _names_of_results(same):
            made.__dict__.pop(name, None)
        return made

    def soften(self, x: Array, width: float) -> Problem:
        """The problem with every free column held at x (1, P), so many times as softly as its expected error."""
        known, key = self._soft, (width, x.tobytes())
        if width not in known:
            held = self.table.with_priors({n: width * float(s) for n, s in zip(self.free, self.scales, strict=True)})
            first = known[width] = self.with_table(held).with_priors(True)
            _ = first.scales, first.has_prior, first._any_prior, held.scales
            _ = first.bounds, first.has_bounds, first._pull
        if key not in known:
            table = known[width].table.with_values(x[0, : len(self.table)])
            known[key] = known[width]._with(_OF_TABLE - {"_start"}, table=table)
            _ = known[key]._start
        # Everything that such a table says is known from the first time.
        made = self._with(_OTHER_TABLE, table=known[key].table, priors=True)
        made.__dict__.update({name: known[key].__dict__[name] for name in _OF_TABLE if name in known[key].__dict__})
        return made

    @cached_property
    def _soft(self) -> dict[object, Problem]:
        return {}

    def with_local_prior(
        self, sigma: ArrayLike | None = None, covariance: ArrayLike | None = None, family: int = 0
    ) -> Problem:
        """The same problem with a prior of every local block of a family around its start; see `Family.with_prior`."""
        made = list(self.families)
        made[family] = made[family].with_prior(sigma, covariance)
        return replace(self, families=tuple(made))

    def with_fixed_blocks(self, family: int) -> Problem:
        """The same problem, where the blocks of a family stay where x has them: they take part in no step and have no prior."""
        made = list(self.families)
        made[family] = replace(made[family], axes=(), prior=None)
        return replace(self, families=tuple(made), terms=tuple(t.hold(family) for t in self.terms))

    # --- evaluation ---------------------------------------------------------------------------------------------------------

    def normal(self, x: Array, which: Ints | None = None, curved: Bools | None = None) -> Normal:
        """Cost, gradient and Gauss-Newton matrix at x (B, P); `which` (B,) tells the problems of the batch when only
        some are asked, `curved` (B,) those in which the curvature of the loss counts in the matrix (none)."""
        batch = len(x)
        accumulate, accumulate_blocks, add_block_priors = self._kernels
        plan, cut, wide, tuning, pairs = self._plan
        which = np.arange(batch) if which is None else which
        out = Normal.zeros(batch, self.n, *self.sizes, pairs)
        straight = self.loss == "none"
        weight = self._weight(which)
        for term, kind, each, touches, part in plan:
            loss = _straight(kind, tuning, batch) if curved is None or straight else Loss(kind, tuning, curved)
            if term.accumulate(x, which, weight, loss, part.start, out):
                continue
            whole = ((0, batch, 0, len(term.scale)),)
            for lo, hi, first, some in whole if batch * each <= CHUNK else pieces(term, batch, wide, CHUNK):
                mine, values, these, heavy, bent = out, x, which, weight, loss.curved
                if hi - lo < batch:
                    mine, values, these, bent = out.take(slice(lo, hi)), x[lo:hi], which[lo:hi], bent[lo:hi]
                    heavy = self._weight(these)
                r, jac, jloc = term.evaluate(values, these, first, some)
                pull = np.zeros((hi - lo, some)) if touches else NOTHING
                accumulate(
                    r, jac, term.scale, heavy, term.configuration, term.columns, kind, tuning, bent, first, mine.cost, mine.g,
                    mine.a, pull,
                )  # fmt: skip
                if touches:
                    accumulate_blocks(
                        r, jac, jloc, cut if term.touches[0] else 0, term.scale, pull, term.columns, *term.local, term.pair, kind, tuning,
                        bent, first, mine.gl, mine.al, mine.asl, mine.gm, mine.am, mine.asm, mine.cross[:, part],
                    )  # fmt: skip
        if self._any_prior:
            add_shared(self._pull, self.difference(x), out)
        for i, family in enumerate(self.families):
            if family.prior is not None:
                here, axes = np.ascontiguousarray(x[:, self.places[i]]), np.array(family.axes, dtype=np.int64)
                g, a, _ = out.of_family(i)
                add_block_priors(here, family.start, family.prior.root, axes, out.cost, g, a)
        return out

    @cached_property
    def _plan(self) -> tuple[list[tuple[ProblemTerm, int, int, bool, slice]], int, int, float, int]:
        """What every evaluation asks: of each term the number of its loss, the size of its Jacobian, whether its rows touch blocks and
        which pairs are its; the columns of a block of the first family, and of both, the tuning, and how many pairs there are."""
        (_, cut), (_, second) = self.sizes
        plan, pairs = [], 0
        for term in self._summed:
            loss, part = LOSSES[self.loss if term.reading else "none"], slice(pairs, pairs + len(term.pairs))
            plan.append((term, loss, term.scale.size * (len(term.columns) + cut + second), any(term.touches), part))
            pairs = part.stop
        return plan, cut, cut + second, self.tuning or TUNING[self.loss], pairs

    @cached_property
    def _kernels(self) -> tuple[Callable[..., None], ...]:  # an import costs as much as a small kernel
        from robocal.estimate._kernels import accumulate, accumulate_blocks
        from robocal.estimate.priors._kernels import add_block_priors

        return accumulate, accumulate_blocks, add_block_priors

    @cached_property
    def pairs(self) -> Ints:
        """The pairs of blocks of both families that rows touch, (K, 2), in the order of `Normal.cross`."""
        return np.concatenate([np.zeros((0, 2), dtype=np.int64), *(t.pairs for t in self.terms)])

    @cached_property
    def independent(self) -> Ints:
        """Groups of free columns of which no row touches two, (E, s)."""
        return independent_groups(self.bound_terms, self.bounds, self.prior_root)

    @cached_property
    def numbers(self) -> Ints:
        """How many numbers that count were measured at each configuration, (U,)."""
        out = np.zeros(self.configurations, dtype=np.int64)
        for t in self.terms:
            out += np.bincount(t.configuration[t.used], minlength=self.configurations) * t.scale.shape[1]
        return out

    @property
    def first_weight(self) -> Array:
        """The weight of every configuration in the first problem of the batch, (U,)."""
        return np.asarray(self._weight(np.zeros(1, dtype=np.int64))[0])

    @property
    def in_use(self) -> Bools:
        """Which configurations have a weight, (U,)."""
        return np.asarray(self.first_weight > 0)

    @property
    def repeated(self) -> float:
        """How many numbers tell nothing of their own: of configurations with a weight below one, what it lacks of one, of those
        numbers that a pose of their own does not take."""
        if self.weights is None:
            return 0.0
        weight = self.first_weight
        if not ((weight > 0) & (weight < 1)).any():
            return 0.0
        posed = next((f.size for f in self.families[:1] if f.count == self.configurations), 0)
        return float(
            np.sum(np.maximum(self.numbers - posed, 0) * np.where(weight > 0, np.maximum(1 - weight, 0.0), 0.0))
        )

    @cached_property
    def aside(self) -> float:
        """Which share of the rows counts for nothing: those that were set aside."""
        rows = sum(len(t.used) for t in self.terms)
        return sum(int((~t.used).sum()) for t in self.terms) / max(rows, 1)

    def slopes(self, square: Array, lin: Linear) -> Array:
        """The robust weight rho' of every row's observation from the squares of whitened rows (N,); one for constraints."""
        if self.loss == "none" or not len(square):
            return np.ones(len(square))
        each = self.slope(np.asarray(np.bincount(lin.observation, square), float))
        return np.where(lin.reading, each[lin.observation], 1.0)

    def slope(self, square: Array, reading: bool = True) -> Array:
        """The robust weight rho' of observations from the squares of their whitened lengths (m,)."""
        return slopes(self.loss, self.tuning, square) if reading else np.ones(len(square))

    def _weight(self, which: Ints) -> Array:
        if self.weights is None:
            return self._ones
        return self.weights if len(self.weights) == 1 else self.weights[which]

    @cached_property
    def _ones(self) -> Array:
        return np.ones((1, max(self.configurations, 1)))

    def residuals(self, x: Array, own: Ints | None = None) -> list[Residuals]:
        """Unwhitened residuals of every term at x: (m, d) for one x (P,) or (1, P), else (B, m, d); (m, d) of each row at the one of x
        that is its configuration's, own (U,), where that is told: NaN where it is below 0."""
        x = np.atleast_2d(x)
        out = []
        for term in self._bare:
            value = evaluate_all(term.plain, x, own)
            apart = None if term.plain is term else evaluate_all(term, x, own)
            where = term.scale, term.configuration
            out.append(
                Residuals(value, *where, term.group, term.kind, term.parts, term.used, term.lever, term.reading, apart)
            )
        return out

    def residual_pieces(self, x: Array, step: int = 1) -> Iterator[tuple[ProblemTerm, slice, Array]]:
        """The same of many vectors, (B, rows, d), some rows at a time: all of them, or one piece of every `step`."""
        for term in self._bare:
            for rows, r in evaluate_pieces(term, x, step):
                yield term, rows, r

    def greatest_error(self, x: Array, unit: str = "m") -> Array:
        """max |y - h(x)| (B,) at x (B, P), of the readings in a unit that count: of whole observations, of a position the distance, of a
        pose its place, of a range and angles the place that they tell. Raises ModelError where no reading is in it.

        Source: the identification algorithm of the RV-2AJ article, equation 14 (docs/references.md).
        """
        return greatest_length(self.residuals(np.atleast_2d(x)), self.in_use, len(np.atleast_2d(x)), unit)

    def linearize(self, x: Array, configurations: Ints | None = None) -> Linear:
        """Whitened r and dense J at one x (P,) or (1, P), of the rows that count, of the given configurations or of all with positive
        weight; priors of shared columns are left out, those of local blocks are rows of theirs."""
        x = np.atleast_2d(x)
        weight = self.first_weight
        chosen = self.in_use if configurations is None else np.isin(np.arange(len(weight)), configurations)
        blocks = [self.values_of(i, x) for i in range(len(self.families))]
        return whiten_rows(self.bound_terms, x, self.n, self.families, blocks, weight, chosen)

"""The errors of measurements that were not fitted, for any split.

    1 fit       every round fits its own configurations: all rounds as one batch, each with weights of its own
    2 profile   frames that only held-out rows can see (a new marker, a new placement) are fitted to those rows, with
                everything shared frozen
    3 errors    of the held-out rows; profiled ones are enlarged by sqrt(N / (N - p)) for the p numbers that N numbers
                had to give for step 2

Rows that see nothing but such frames (two sockets a known distance apart) take no part in step 2: they stay evidence.
What a round does not see at all must not stay where a fit to everything has put it, for held-out rows had a say in that:
such a round begins at its own baseline, and stays there in unseen directions. Where it is a frame that is left open (a
plane touched at two points), held-out rows that meet the frame prove nothing.
`unseen` keeps the columns and the noise of one fit to everything; a `trial` asks for them anew from the configurations of a
round, which is stricter and costs a whole fit for each.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.limits import FRAME_MOVES, FRAME_SEEN
from robocal.estimate.choosing.choice import OBSERVABLE, choose
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.fit.baseline import frame_names
from robocal.fit.fit import near
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import errors
from robocal.measure.machine import Model
from robocal.prove.split import Split

__all__ = [
    "Unseen", "alike", "collect", "empty", "local_names", "merge", "profile", "proves_nothing", "terms_of", "unseen",
]  # fmt: skip

CHUNK = 256
AT_ONCE = 1 << 19  # grid: numbers of normal equations that are looked at together
# Of what was expected: a direction that rows tell less of does not move in a fit, whatever is there to be found.
OPEN = 1e-2


@record
class Unseen:
    """Errors by SI unit in the order of `evidence.errors`, each (N,), NaN where a row was never held out or proves
    nothing; `profiled` (K,) tells the rounds in which frames were fitted to held-out rows, `x` (K, P) where each ended."""

    value: dict[str, Array]
    profiled: Bools
    x: Array | None = None
    converged: bool = True  # every round


def unseen(
    problem: Problem, x: Array, split: Split, units: Sequence[str], local: Sequence[str] = (), home: Array | None = None
) -> Unseen:
    """Exact, non-linear errors of every held-out row: all rounds in one batch, each started from x (1, P).

    `units` are the SI units in which errors are wanted, `local` the parameters that may be profiled: those of frames.
    `home` (K, P) is where a round begins that does not see every direction.
    """
    x = np.atleast_2d(x)
    ends, converged = np.repeat(x, len(split), axis=0), True
    out, profiled = empty(problem, x, units), np.zeros(len(split), dtype=bool)
    weight = np.ones(problem.configurations) if problem.weights is None else problem.weights[0]
    for names, rounds in alike(problem, split, local):
        shared = [n for n in problem.free if n not in names]
        for first in range(0, len(rounds), CHUNK):
            some = rounds[first : first + CHUNK]
            part = problem.with_free(shared).with_weights(split.fit[some] * weight)
            start = np.repeat(x, len(some), axis=0)
            factor = np.ones((len(some), len(problem.terms)))
            found = start
            if shared:
                solved = least_squares(part, start, trust=True)
                found = solved.x
                ended = np.array([r.converged for r in solved.reasons])
                again = np.flatnonzero(_open(part, solved.normal.a))
                if home is not None and len(again):
                    own = part.with_weights(split.fit[some[again]] * weight)
                    once_more = least_squares(own, near(own, home[some[again]]))
                    found[again] = once_more.x
                    ended[again] = [r.converged for r in once_more.reasons]
                converged &= bool(ended.all())
                proves_nothing(problem, x, part, solved.normal.a, [n for n in local if n in shared], factor)
            if names:
                profiled[some] = True
                for b, k in enumerate(some):
                    found[b], factor[b] = profile(problem, found[b : b + 1], split.held_out[k], names)
            mine = None
            if problem.blocks:
                profiled[some] = True
                found, mine, placed = own_poses(problem, found, split.held_out[some])
                converged &= placed
            collect(out, problem, found, factor, split, some, mine)
            ends[some] = found
    return Unseen(out, profiled, ends, converged)


def _open(problem: Problem, a: Array, known: float = OPEN, at: Ints | None = None) -> Bools:
    """Which problems leave a direction open, (B,), by their Gauss-Newton matrices (lower triangles, (B, n, n); of the columns `at` of
    wider ones): known to less than this share of what was expected."""
    both, each = np.outer(problem.scales, problem.scales), np.arange(problem.n)
    out, many = np.zeros(len(a), dtype=bool), max(1, AT_ONCE // max(both.size, 1))
    for some in (slice(lo, lo + many) for lo in range(0, len(a), many)):  # what is scaled stays in the cache
        scaled = (a[some] if at is None else a[some, at[:, None], at]) * both
        # Rounding must not pass for knowledge.
        least = np.maximum(known**2, 1e-13 * scaled[:, each, each].max(axis=1, initial=0.0))
        scaled[:, each, each] -= least[:, None]
        try:
            np.linalg.cholesky(scaled)  # of the lower triangles: positive definite, all of them, is the ordinary case
        except np.linalg.LinAlgError:
            out[some] = ~(np.linalg.eigvalsh(scaled)[:, 0] > 0)
    return out


def proves_nothing(problem: Problem, x: Array, part: Problem, a: Array, local: Sequence[str], factor: Array) -> None:
    """Takes the factor (rounds, terms) from terms that see a frame which their round leaves open and all rows do not."""
    if not local:
        return
    frames = part.with_free(local)
    at = part.column_of[frames.index]
    scale = np.outer(frames.scales, frames.scales)
    rounds = np.flatnonzero(_open(frames, a, OBSERVABLE, at))
    if not len(rounds):
        return
    sees, _ = terms_of(problem, frames.free)
    whole = np.tril(problem.with_free(frames.free).normal(x).a[0]) * scale
    for b in rounds:
        own = np.tril(a[b][at[:, None], at]) * scale
        values, vectors = np.linalg.eigh(own)  # of the lower triangle
        loose = vectors[:, values < OBSERVABLE**2]
        full = whole + np.tril(whole, -1).T
        missed = loose[:, np.einsum("ik,ij,jk->k", loose, full, loose) > FRAME_SEEN**2]
        factor[b, sees[(np.abs(missed) > FRAME_MOVES).any(axis=1)].any(axis=0)] = np.nan


def empty(problem: Problem, x: Array, units: Sequence[str]) -> dict[str, Array]:
    """Errors that nobody has told yet, by unit, in the order of `evidence.errors`."""
    seen = problem.residuals(x)
    return {u: np.full(len(errors(seen, u)[0]), np.nan) for u in units}


def collect(
    out: dict[str, Array],
    problem: Problem,
    x: Array,
    factor: Array,
    split: Split,
    rounds: Ints,
    own: Array | None = None,
) -> None:
    """Puts what the rounds miss where it belongs; `factor` (rounds, terms), `own` (rounds, U)."""
    own = np.ones((len(rounds), problem.configurations)) if own is None else own
    turn = np.full(len(split) + 1, -1)  # the last is that of what no round holds out
    turn[rounds] = np.arange(len(rounds))
    mine = turn[split.round_of]
    residuals = problem.residuals(x, mine)
    # A round that had nothing to learn from knows nothing.
    able = np.asarray(split.fit[rounds].any(axis=1))
    for unit, values in out.items():
        misses, at = errors(residuals, unit)
        term = np.concatenate(
            [np.full(len(r.configuration), i) for i, r in enumerate(residuals) for *_, u in r.parts if u == unit]
        )
        rows = np.flatnonzero(mine[at] >= 0)
        b = mine[at[rows]]
        values[rows] = np.where(able[b], misses[rows] * factor[b, term[rows]] * own[b, at[rows]], np.nan)


def terms_of(problem: Problem, names: Sequence[str]) -> tuple[Bools, Bools]:
    """Which terms see each parameter at all, by structure, (names, terms), and which of these see anything else but the
    things that the parameters belong to, (terms,): only such rows can place a frame for the machine."""
    every = problem.with_free(problem.table.names)
    row_of = {n: i for i, n in enumerate(names)}
    owners = {n.rpartition(".")[0] for n in names}
    out, anchors = np.zeros((len(names), len(problem.terms)), dtype=bool), np.zeros(len(problem.terms), dtype=bool)
    for t, term in enumerate(every.bound_terms):
        # The pose of a configuration is the machine's, known or not.
        anchors[t] = bool(any(term.touches)) or term.reading
        for column in np.unique(term.columns):
            name = every.free[column]
            anchors[t] |= name.rpartition(".")[0] not in owners
            if name in row_of:
                out[row_of[name], t] = True
    return out, anchors


def alike(problem: Problem, split: Split, local: Sequence[str]) -> list[tuple[tuple[str, ...], Ints]]:
    """The rounds, put together where the same parameters are met in held-out rows alone."""
    if not len(local) or not len(split):
        return [((), np.arange(len(split)))] if len(split) else []
    sees, anchors = terms_of(problem, local)
    rows, used = np.zeros((2, len(problem.terms), problem.configurations))
    for t, term in enumerate(problem.terms):
        rows[t, term.configuration] = 1
        used[t, term.configuration[term.used]] = 1  # gross rows place nothing
    held, fit = rows @ split.held_out.T > 0, used @ split.fit.T > 0  # (terms, K)
    alone = (sees @ held) & ~((sees & anchors) @ fit)  # (names, K)
    patterns, which = np.unique(alone, axis=1, return_inverse=True)
    return [
        (tuple(n for n, yes in zip(local, patterns[:, i], strict=True) if yes), np.flatnonzero(which.ravel() == i))
        for i in range(patterns.shape[1])
    ]


def profile(problem: Problem, x: Array, held: Bools, names: tuple[str, ...]) -> tuple[Array, Array]:
    """x (P,) with these parameters fitted to held-out configurations, and the factor of their errors by term, (terms,)."""
    sees, anchors = terms_of(problem, names)
    touching = np.asarray(sees.any(axis=0))
    nothing = np.ones(len(problem.terms))
    weighted = problem.with_weights(held[None].astype(float))
    for used in (touching & anchors, touching):
        some = replace(weighted, terms=tuple(t for t, u in zip(problem.terms, used, strict=True) if u))
        numbers = int(some.numbers[held].sum())
        kept = choose(some.with_free(names), x).basis if numbers else ()
        if len(kept) == len(names):
            break
    if not kept:
        return x[0], nothing
    # As many numbers as parameters are always met: they say nothing.
    factor = np.sqrt(numbers / (numbers - len(kept))) if numbers > len(kept) else np.nan
    return least_squares(some.with_free(kept), x).x[0], np.where(used, factor, nothing)


def local_names(model: Model, problem: Problem) -> tuple[str, ...]:
    """The parameters that may be profiled: free ones that are not the robot's."""
    return tuple(n for n in frame_names(model, problem) if n not in model.table)


def merge(rounds: Sequence[Unseen]) -> Unseen:
    """The errors of several rounds, each row from the round that held it out."""
    value = {}
    for unit in rounds[0].value:
        parts = np.stack([r.value[unit] for r in rounds])
        value[unit] = np.where(np.isnan(parts).all(axis=0), np.nan, np.nansum(parts, axis=0))
    return Unseen(value, np.concatenate([r.profiled for r in rounds]), converged=all(r.converged for r in rounds))

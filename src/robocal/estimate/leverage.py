"""What the fit of local blocks and shared columns takes of the numbers that each group of sensors measured.

    own = tr(D^-1 D_g),    shared = tr(S^-1 (A_g - B_g^T W - W^T B_g + W^T D_g W)),    W = D^-1 B,    S = A - B^T W + P

D (per block), B and A are what the rows say of blocks, of both, and of shared columns, robust weights applied; with g those of one group
and unit alone. Their sums are the diagonals of projections on the blocks' columns, and on what these leave of the shared ones. No Jacobian
of all columns is formed, but with two families of blocks.
"""

from __future__ import annotations

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.estimate.elimination import beside_blocks, reweight
from robocal.estimate.problem import Problem
from robocal.estimate.schur.system import invert_blocks
from robocal.estimate.terms import ProblemTerm, spread

__all__ = ["leverages"]

EPS = float(np.finfo(float).eps)
CLEAR = 1e-9  # tolerance: of what a column was: columns that data determine, for sure
HERE = np.zeros(1, dtype=np.int64)
Key = tuple[str, str]  # sensor group and unit


def leverages(problem: Problem, x: Array, configurations: Ints) -> dict[Key, tuple[float, float, int]]:
    """How many numbers local blocks and how many shared columns take of the rows of each sensor group and unit that count, of some
    configurations, at x (1, P); and how many numbers these are."""
    x = np.atleast_2d(x)
    if problem.sizes[1][1]:
        return _row_by_row(problem, x, configurations)
    chosen = np.zeros(len(problem.first_weight), dtype=bool)
    chosen[configurations] = True
    groups = _sums(problem, x, chosen)
    (count, size), n = problem.sizes[0], problem.n
    d, b, a = np.zeros((count, size, size)), np.zeros((count, size, n)), problem.prior_root.T @ problem.prior_root
    for said in groups.values():
        d, b, a = d + said.d, b + said.b, a + said.a
    family = problem.families[0] if problem.families else None
    if family is not None and family.prior is not None:
        root = family.prior.rows(problem.values_of(0, x))[1][0]
        d = d + np.swapaxes(root, 1, 2) @ root
    inverse = invert_blocks(d)
    w = inverse @ b
    rows = count * size, n
    a -= b.reshape(rows).T @ w.reshape(rows)
    covariance = _invert(a, problem.scales)
    wide = (w.reshape(rows) @ covariance).reshape(w.shape)
    inner = wide @ np.swapaxes(w, 1, 2)
    return {
        key: (
            float(np.sum(inverse * said.d)),
            float(np.sum(covariance * said.a) - 2 * np.sum(wide * said.b) + np.sum(inner * said.d)),
            said.count,
        )
        for key, said in groups.items()
    }


@record
class _GroupSums:
    """What so many numbers of one group and unit say of blocks, d (L, l, l), of both, b (L, l, n), and of shared columns, a (n, n)."""

    d: Array
    b: Array
    a: Array
    count: int = 0


def _sums(problem: Problem, x: Array, chosen: Bools) -> dict[Key, _GroupSums]:
    """Of every group and unit: what measures one unit alone says it in its normal equations."""
    units: dict[str, dict[str, None]] = {}
    for term in problem.terms:
        units.setdefault(term.group, {}).update({unit: None for *_, unit in term.parts})
    bare = tuple(replace(f, prior=None) for f in problem.families)
    rest = replace(problem, families=bare, priors=False, weights=np.where(chosen, problem.first_weight, 0.0)[None])
    out: dict[Key, _GroupSums] = {}
    for group, told in units.items():
        if len(told) == 1:
            some = tuple(t for t in problem.terms if t.group == group)
            made, (unit,) = replace(rest, terms=some).normal(x), told
            count = sum(int((chosen[t.configuration] & t.used).sum()) * t.scale.shape[1] for t in some)
            both = np.swapaxes(made.asl[0], 1, 2).reshape(*problem.sizes[0], problem.n)
            out[group, unit] = _GroupSums(_whole(made.al[0]), both, _whole(made.a[0]), count)
    for term in problem.bound_terms if len(units) > len({group for group, _ in out}) else ():
        if len(units[term.group]) > 1:
            _add(problem, term, x, chosen, out)
    return out


def _whole(lower: Array) -> Array:
    """Symmetric matrices (..., n, n) of their lower triangles."""
    low = np.tril(lower)
    return np.asarray(low + np.swapaxes(np.tril(lower, -1), -1, -2))


def _add(problem: Problem, term: ProblemTerm, x: Array, chosen: Bools, groups: dict[Key, _GroupSums]) -> None:
    """Adds the rows of a bound term that count."""
    keep, weight = chosen[term.configuration] & term.used, problem.first_weight
    (count, size), n = problem.sizes[0], problem.n
    value, narrow, local = (v[0] for v in term.evaluate(x, HERE, 0, len(keep)))
    scale = term.scale * np.sqrt(np.where(keep, weight[term.configuration], 0.0))[:, None]
    slope = problem.slope(np.sum((value * scale) ** 2, axis=1), term.reading)
    scale = scale * np.sqrt(slope)[:, None]
    free, at = np.unique(term.columns, return_inverse=True)
    j = spread(narrow, at, len(free)) * scale[..., None]
    jl, block = local[..., :size] * scale[..., None], term.local[0]
    inside = np.flatnonzero(keep & (block >= 0))
    order = inside[np.argsort(block[inside], kind="stable")]
    begins = np.flatnonzero(np.append(True, np.diff(block[order]) != 0)) if len(order) else order
    touched = block[order[begins]]
    for start, stop, unit in term.parts:
        own = j[:, start:stop].reshape(len(j) * (stop - start), len(free))
        key = term.group, unit
        if key not in groups:
            groups[key] = _GroupSums(np.zeros((count, size, size)), np.zeros((count, size, n)), np.zeros((n, n)))
        said = groups[key] = replace(groups[key], count=groups[key].count + int(keep.sum()) * (stop - start))
        said.a[np.ix_(free, free)] += own.T @ own
        if not len(order) or not size:
            continue
        left = np.swapaxes(jl[order, start:stop], 1, 2)
        said.d[touched] += np.add.reduceat(left @ jl[order, start:stop], begins, axis=0)
        both = np.add.reduceat(left @ j[order, start:stop], begins, axis=0)
        said.b[touched[:, None, None], np.arange(size)[:, None], free] += both


def _invert(square: Array, scale: Array) -> Array:
    """The inverse of a symmetric matrix (n, n), without what it does not determine of columns of these scales (n,)."""
    if not len(square):
        return square
    both = np.outer(scale, scale)
    scaled = square * both
    low, failed = scipy.lapack.dpotrf(scaled, lower=1, clean=1)
    own = np.diag(scaled)
    # Each pivot beside what its column was: rounding of it is less, however differently well columns are known.
    if not failed and (np.diag(low) ** 2 > CLEAR * own).all():
        half, failed = scipy.lapack.dpotri(low, lower=1)
        # No eigenvalue lies below one over the trace of the inverse: none would be left out.
        if not failed and np.trace(half) * own.sum() * len(own) * EPS < 1:
            return np.asarray((np.tril(half) + np.tril(half, -1).T) * both)
    values, vectors = np.linalg.eigh(scaled)
    known = values > len(values) * EPS * values[-1]
    return np.asarray((vectors[:, known] / values[known]) @ vectors[:, known].T * both)


def _row_by_row(problem: Problem, x: Array, configurations: Ints) -> dict[Key, tuple[float, float, int]]:
    """The same from the diagonals of U1 U1^T and of M J (J^T M J + P)^-1 J^T M, M = I - U1 U1^T, U1 what the blocks' columns span."""
    lin = reweight(problem.linearize(x, configurations), problem)
    own, left = beside_blocks(lin)
    covariance = _invert(problem.prior_root.T @ problem.prior_root + lin.j.T @ left, problem.scales)
    each = np.stack([own, np.einsum("ri,ri->r", left @ covariance, left)])
    chosen = np.zeros(len(problem.first_weight), dtype=bool)
    chosen[configurations] = True
    out: dict[Key, tuple[float, float, int]] = {}
    end = 0
    for term in problem.terms:
        first, shape = end, (2, int((chosen[term.configuration] & term.used).sum()), term.scale.shape[1])
        end += shape[1] * shape[2]
        for start, stop, unit in term.parts:
            taken = each[:, first:end].reshape(shape)[..., start:stop].sum(axis=(1, 2))
            one, two, many = out.get((term.group, unit), (0.0, 0.0, 0))
            out[term.group, unit] = one + float(taken[0]), two + float(taken[1]), many + shape[1] * (stop - start)
    return out

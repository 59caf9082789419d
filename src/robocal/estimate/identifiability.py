"""What the data can tell: rank, the columns to keep, and the combinations in which the others hide.

The whitened Jacobian is scaled column by column with the error expected of that parameter without data (or its stated
prior), and divided by the noise as fitted. A singular value s of that matrix then says: the data know this
combination to 1 / s of what was expected. A combination is *seen* when s exceeds SEEN = 1, so the decision is
relative to the measurement noise and never to machine precision. Columns are kept by QR with pivoting on the same
matrix; what is left over is dropped and stays at its nominal value. Which of several columns that say the same is kept
is then a matter of preference (`Parameter.preference`): a kept column is exchanged for a preferred one wherever nothing
that was seen is lost by it. References: Pashkevich, Computer-aided generation
of complete irreducible models (2011); Gautier and Khalil (1990) for base parameters; Borm and Menq (1991), Driels and
Pathre (1990), Nahvi and Hollerbach (1996), Sun and Hollerbach (2008) for the observability indices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.problem import Problem
from robocal.estimate.rows import Linear
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = [
    "SEEN",
    "Combination",
    "Identifiability",
    "analyse",
    "block_columns",
    "block_ranks",
    "eliminate",
    "observability",
    "triangle",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
# With s = 1 the expected error of a column and the standard deviation with which it would be estimated are equal:
# below,
# freeing it adds more variance than the bias that it removes.
SEEN = 1.0
# Exactly dependent to first order, in units of the largest singular value of the column-normalised matrix.
STRUCTURAL = 1e-9
ROUNDING = 1e-12
NAMED = 6  # partners that are named
# Of what is known of a parameter, from data: 1 - 1/4, so its sigma is half of what was expected.
CLAIM = 0.75
# What a column contributes to the imitation of another, relative to the largest contribution: below, it is no partner.
PARTNER = 0.05


@dataclass(frozen=True)
class Combination:
    """A dropped parameter and what takes its place: `name` by one unit looks like the kept parameters by `partners`
    units (SI)."""

    name: str
    partners: tuple[tuple[str, float], ...]

    @property
    def remark(self) -> Remark:
        """What is said of it."""
        if not self.partners:
            return Remark.of(Code.NO_EFFECT, parameter=self.name)
        shown = tuple(name for name, _ in self.partners[:NAMED])
        more = len(self.partners) - len(shown)
        return Remark.of(Code.CANNOT_BE_TOLD, parameter=self.name, partners=shown, more=more or None)


@dataclass(frozen=True)
class Identifiability:
    """Rank relative to noise, structural rank, kept and dropped names, singular values (scaled, descending), indices
    O1 to O5.

    `share` (n,) is the part of each parameter's knowledge that comes from data: 1 - (posterior / expected sigma)^2,
    all the others being unknown too. `posterior` (n, n) is that posterior covariance in SI.
    """

    names: tuple[str, ...]
    rank: int
    structural_rank: int
    kept: tuple[str, ...]
    dropped: tuple[str, ...]
    combinations: tuple[Combination, ...]
    singular_values: Array
    condition: float
    indices: dict[str, float]
    share: Array
    posterior: Array

    @property
    def identified(self) -> tuple[str, ...]:
        """The parameters that the data, with everything else unknown too, narrow to half of what was expected."""
        return tuple(n for n, s in zip(self.names, self.share, strict=True) if s >= CLAIM)


def eliminate(lin: Linear, size: int) -> Array:
    """J (N', n) with local blocks projected out: rows of Q2^T J, where Q2 spans what the blocks' columns leave free."""
    return _without_blocks(lin, size)[0]


def block_columns(lin: Linear, size: int) -> int:
    """How many columns of local blocks the rows determine: the sum of the blocks' own ranks, what they cost in degrees
    of freedom."""
    return _without_blocks(lin, size)[1]


def block_ranks(lin: Linear, size: int, blocks: int) -> Ints:
    """How many of its own columns the rows of each local block determine, (blocks,)."""
    out = np.zeros(blocks, dtype=np.int64)
    for block in np.unique(lin.local[lin.local >= 0]):
        s = np.linalg.svd(lin.jl[lin.local == block], compute_uv=False)
        out[block] = int((s > STRUCTURAL * s.max(initial=0.0)).sum()) if size else 0
    return out


def _without_blocks(lin: Linear, size: int) -> tuple[Array, int]:
    if not size or not (lin.local >= 0).any():
        return lin.j, 0
    parts = [lin.j[lin.local < 0]]
    rank = 0
    counts = np.unique(lin.local[lin.local >= 0], return_counts=True)[1]
    order = np.argsort(lin.local, kind="stable")
    order = order[lin.local[order] >= 0]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    for count in np.unique(counts):
        # Blocks with the same number of rows are factored together.
        rows = order[starts[counts == count][:, None] + np.arange(count)]
        u, s, _ = np.linalg.svd(lin.jl[rows], full_matrices=True)
        # A block that its rows do not determine takes away only what they say of it.
        spans = np.zeros((len(rows), count), dtype=bool)
        spans[:, : s.shape[1]] = s > STRUCTURAL * s.max(axis=1, keepdims=True, initial=0.0)
        rank += int(spans.sum())
        left = np.swapaxes(u, 1, 2) @ lin.j[rows]
        parts.append(left[~spans])
    return np.concatenate(parts), rank


def triangle(j: Array, chunk: int = 20_000) -> Array:
    """R (n, n) with R^T R = J^T J, by QR in chunks of rows: rank decisions are taken on R, never on J^T J."""
    r: Array = np.zeros((0, j.shape[1]))
    for first in range(0, max(len(j), 1), chunk):
        r = np.asarray(np.linalg.qr(np.vstack([r, j[first : first + chunk]]), mode="r"))
    if len(r) < j.shape[1]:
        r = np.vstack([r, np.zeros((j.shape[1] - len(r), j.shape[1]))])
    return r


def _pivot(r: Array, tolerance: float) -> tuple[list[int], list[int]]:
    """Kept and left columns of R by pivoted Gram-Schmidt; among equals the first column wins."""
    work = r.copy()
    n = r.shape[1]
    kept: list[int] = []
    left = list(range(n))
    # A small handicap for later columns makes ties between exactly equal columns go to the first, on every machine.
    favour = 1.0 - 1e-7 * np.arange(n)
    while left:
        norms = np.linalg.norm(work[:, left], axis=0)
        best = int(np.argmax(norms * favour[left]))
        if norms[best] <= tolerance:
            break
        q = work[:, left[best]] / norms[best]
        kept.append(left.pop(best))
        for _ in range(2):
            work[:, left] -= np.outer(q, q @ work[:, left])
    return kept, left


def _preferred(
    scaled: Array, kept: list[int], left: list[int], preference: Ints, sure: set[int], tolerance: float
) -> tuple[list[int], list[int]]:
    """Kept and left columns after every exchange of a kept column for a preferred one that says the same.

    An exchange stands when the column taken in is seen beside the others, and what the new set does not explain of any
    column left out stays below the tolerance, as before. So the data never decide for a worse set, nor for more columns.
    """
    kept, left = list(kept), list(left)
    for wanted in sorted(left, key=lambda i: -int(preference[i])):
        rivals = [k for k in kept if preference[k] < preference[wanted] and k not in sure]
        if not rivals or np.linalg.norm(scaled[:, wanted]) <= tolerance:
            continue
        share = np.linalg.lstsq(scaled[:, kept], scaled[:, wanted], rcond=None)[0]
        effect = dict(zip(kept, np.abs(share) * np.linalg.norm(scaled[:, kept], axis=0), strict=True))
        for rival in sorted(rivals, key=lambda k: (preference[k], -effect[k])):
            if effect[rival] < PARTNER * max(effect.values()):
                continue
            new = [*(k for k in kept if k != rival), wanted]
            rest = [rival, *(k for k in left if k != wanted)]
            q, r = np.linalg.qr(scaled[:, new])
            missed = scaled[:, rest] - q @ (q.T @ scaled[:, rest])
            if abs(r[-1, -1]) > tolerance and np.linalg.norm(missed, axis=0).max() <= tolerance:
                kept, left = new, rest
                break
    return kept, left


def _singular(matrix: Array) -> Array:
    return np.asarray(np.linalg.svd(matrix, compute_uv=False)) if matrix.shape[1] else np.zeros(0)


def observability(values: Array, poses: int) -> dict[str, float]:
    """O1 to O5 of singular values (descending) of the scaled Jacobian of so many poses."""
    if not len(values) or values[-1] <= 0:
        return dict.fromkeys(("O1", "O2", "O3", "O4", "O5"), 0.0)
    return {
        "O1": float(np.exp(np.log(values).mean()) / np.sqrt(poses)),
        "O2": float(values[-1] / values[0]),
        "O3": float(values[-1]),
        "O4": float(values[-1] ** 2 / values[0]),
        "O5": float(1 / np.sum(1 / values)),
    }


def analyse(
    problem: Problem, x: Array, *, noise: float = 1.0, always: Sequence[str] = (), seen: float = SEEN
) -> Identifiability:
    """What the free columns of a problem mean at x; `noise` multiplies the stated sigma (sqrt(chi2 / dof) when the
    model leaves more).

    Parameters with a stated prior are kept (the prior holds them where the data do not), and so are those named in
    `always`.
    """
    lin = problem.linearize(x)
    r = triangle(eliminate(lin, problem.block_size))
    names, scale = problem.free, problem.scales
    n = len(names)
    scaled = r * scale / noise
    _, values, vt = np.linalg.svd(scaled) if n else (None, np.zeros(0), np.zeros((0, 0)))
    norms = np.linalg.norm(scaled, axis=0)
    # A column that is nothing but rounding counts as zero.
    unit = scaled / np.where(norms > ROUNDING * norms.max(initial=0.0), norms, np.inf)
    ones = _singular(unit)
    structural = int((ones > STRUCTURAL * max(ones.max(initial=0.0), 1e-300)).sum())
    _, info = problem.prior
    sure = {i for i in range(n) if info[i] > 0 or names[i] in always}
    # Without noise everything is above it; then only what rounding lets through counts.
    tolerance = max(seen, STRUCTURAL * norms.max(initial=0.0))
    kept, left = _pivot(scaled, tolerance)
    kept, left = _preferred(scaled, kept, left, problem.preference, sure, tolerance)
    kept += [i for i in left if i in sure]
    left = [i for i in left if i not in sure]
    kept.sort()
    combinations = tuple(_hiding(scaled, scale, names, kept, i) for i in sorted(left))
    final = _singular(scaled[:, kept])
    # (S^T S + I)^-1 from the singular values: squaring S would lose what is known to better than 1e-8 of what was
    # expected.
    posterior = (vt.T / (1.0 + values**2)) @ vt
    return Identifiability(
        names,
        int((values > seen).sum()),
        structural,
        tuple(names[i] for i in kept),
        tuple(names[i] for i in sorted(left)),
        combinations,
        values,
        float(final[0] / final[-1]) if len(final) and final[-1] > 0 else float("inf"),
        observability(final, len(np.unique(lin.unit))),
        1.0 - np.diag(posterior),
        posterior * np.outer(scale, scale),
    )


def _hiding(scaled: Array, scale: Array, names: tuple[str, ...], kept: list[int], column: int) -> Combination:
    """The kept parameters that imitate a dropped one."""
    target = scaled[:, column]
    if not kept or np.linalg.norm(target) < 1e-6 * max(np.linalg.norm(scaled[:, kept], axis=0).max(), 1.0):
        return Combination(names[column], ())
    part = scaled[:, kept]
    c = np.linalg.lstsq(part, target, rcond=1e-10)[0]
    # A partner counts when its share of the imitation is visible.
    effect = np.abs(c) * np.linalg.norm(part, axis=0)
    counts = effect > PARTNER * effect.max()
    chosen = sorted(np.flatnonzero(counts), key=lambda i: -effect[i])
    partners = tuple((names[kept[i]], float(c[i] * scale[kept[i]] / scale[column])) for i in chosen)
    return Combination(names[column], partners)

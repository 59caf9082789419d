"""What the data can tell: rank, the columns to keep, and the combinations in which the others hide.

The whitened Jacobian is scaled column by column with the error expected of that parameter without data (or its stated
prior), and divided by the noise as fitted. A singular value s of that matrix then says: the data know this
combination to 1 / s of what was expected. A combination is *seen* when s exceeds SEEN = 1, so the decision is
relative to the measurement noise and never to machine precision. Columns are kept by QR with pivoting on the same
matrix with the stated priors as further rows, which count like any others: a prior on one column also keeps those that
hide behind it. What is left over is dropped and stays at its nominal value. Which of several columns that say the same is kept
is then a matter of preference (`Parameter.preference`): a kept column is exchanged for a preferred one wherever nothing
that was seen is lost by it. References: Pashkevich, Computer-aided generation
of complete irreducible models (2011); Gautier and Khalil (1990) for base parameters; Borm and Menq (1991), Driels and
Pathre (1990), Nahvi and Hollerbach (1996), Sun and Hollerbach (2008) for the observability indices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.elimination import squares
from robocal.estimate.problem import Problem
from robocal.estimate.rows import Linear
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = [
    "SEEN",
    "Combination",
    "Identifiability",
    "analyse",
    "observability",
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
FEW = 3  # of the same part, that are named one by one
FAMILIES = ("the free poses", "the free targets")  # of local blocks, as people call them
ALIKE = 0.05  # of a share: parts that differ by less are the same
# Of what is known of a parameter, from data: 1 - 1/4, so its sigma is half of what was expected.
CLAIM = 0.75
# What a column contributes to the imitation of another, relative to the largest contribution: below, it is no partner.
PARTNER = 0.05


@dataclass(frozen=True)
class Combination:
    """A dropped parameter and what takes its place: `name` by one unit looks like the kept parameters by `partners`
    units (SI), or, without partners, like the local blocks of these `families`."""

    name: str
    partners: tuple[tuple[str, float], ...]
    families: tuple[str, ...] = ()

    @property
    def remark(self) -> Remark:
        """What is said of it."""
        if not self.partners and self.families:
            return Remark.of(Code.CANNOT_BE_TOLD, parameter=self.name, partners=self.families, more=None)
        if not self.partners:
            return Remark.of(Code.NO_EFFECT, parameter=self.name)
        shown, more = together(self.partners)
        return Remark.of(Code.CANNOT_BE_TOLD, parameter=self.name, partners=shown, more=more or None)


def together(partners: Sequence[tuple[str, float]]) -> tuple[tuple[str, ...], int]:
    """At most `NAMED` names for partners, and how many are left unnamed. Where there are more, those of many owners that take
    the same part are one name: a map that shifts as a whole is `x of m1 to m84 (84)`."""
    if len(partners) <= NAMED:
        return tuple(name for name, _ in partners), 0
    groups: list[tuple[str, float, list[str]]] = []
    for name, share in partners:
        owner, _, symbol = name.rpartition(".")
        for other, size, owners in groups:
            if owner and symbol == other and abs(share - size) <= ALIKE * abs(size):
                owners.append(owner)
                break
        else:
            groups.append((symbol, share, [owner]))
    shown: list[str] = []
    counted = 0
    for symbol, _, owners in groups:
        ends = sorted(owners, key=lambda owner: (len(owner), owner))
        whole = [f"{symbol} of {ends[0]} to {ends[-1]} ({len(owners)})"] if len(owners) > FEW else []
        names = (whole or [f"{owner}.{symbol}" if owner else symbol for owner in owners])[: NAMED - len(shown)]
        shown += names
        counted += len(owners) if whole and names else len(names)
    return tuple(shown), len(partners) - counted


@dataclass(frozen=True)
class Identifiability:
    """Rank relative to noise, structural rank, kept and dropped names, singular values (scaled, descending), indices
    O1 to O5.

    `share` (n,) is the part of each parameter's knowledge that comes from data: 1 - (posterior / expected sigma)^2,
    all the others being unknown too. `posterior` (n, n) is that posterior covariance in SI. `root` (n, n) is R with R^T R =
    J^T J, at x (1, P), of the problem as it was given.
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
    root: Array
    x: Array

    @property
    def identified(self) -> tuple[str, ...]:
        """The parameters that the data, with everything else unknown too, narrow to half of what was expected."""
        return tuple(n for n, s in zip(self.names, self.share, strict=True) if s >= CLAIM)


def _pivot(r: Array, tolerance: Array) -> tuple[list[int], list[int]]:
    """Kept and left columns of R by pivoted Gram-Schmidt; tolerance (n,) is what each has to exceed. Among equals the first
    column wins."""
    work = r.copy()
    n = r.shape[1]
    kept: list[int] = []
    left = list(range(n))
    # A small handicap for later columns makes ties between exactly equal columns go to the first, on every machine.
    favour = 1.0 - 1e-7 * np.arange(n)
    while left:
        norms = np.linalg.norm(work[:, left], axis=0)
        seen = norms > tolerance[left]
        if not seen.any():
            break
        best = int(np.argmax(np.where(seen, norms * favour[left], -1.0)))
        q = work[:, left[best]] / norms[best]
        kept.append(left.pop(best))
        for _ in range(2):
            work[:, left] -= np.outer(q, q @ work[:, left])
    return kept, left


def _preferred(
    scaled: Array, kept: list[int], left: list[int], preference: Ints, sure: set[int], tolerance: Array
) -> tuple[list[int], list[int]]:
    """Kept and left columns after every exchange of a kept column for a preferred one that says the same.

    An exchange stands when the column taken in is seen beside the others, and what the new set does not explain of any
    column left out stays below the tolerance, as before. So the data never decide for a worse set, nor for more columns.
    """
    kept, left = list(kept), list(left)
    for wanted in sorted(left, key=lambda i: -int(preference[i])):
        rivals = [k for k in kept if preference[k] < preference[wanted] and k not in sure]
        if not rivals or np.linalg.norm(scaled[:, wanted]) <= tolerance[wanted]:
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
            if abs(r[-1, -1]) > tolerance[wanted] and (np.linalg.norm(missed, axis=0) <= tolerance[rest]).all():
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
    problem: Problem,
    x: Array,
    *,
    noise: float = 1.0,
    always: Sequence[str] = (),
    seen: float = SEEN,
    lin: Linear | None = None,
) -> Identifiability:
    """What the free columns of a problem mean at x; `noise` multiplies the stated sigma (sqrt(chi2 / dof) when the
    model leaves more).

    Rank, singular values, indices and shares speak of the data in units of what is expected; what is kept is seen by data and
    stated priors together. So what has a prior is always kept, unless that is so wide that it says nothing
    (`Parameter.believed`), and so are the names in `always`. `lin` is the problem linearised at x, where somebody has it.
    """
    # What is weighed down by a loss says as much as anything else of what could be seen.
    root = squares(problem.with_loss("none"), x, lin).root
    r = root / noise
    names, scale = problem.free, problem.scales
    n = len(names)
    scaled = r * scale
    _, values, vt = np.linalg.svd(r @ problem.expected_root) if n else (None, np.zeros(0), np.zeros((0, 0)))
    norms = np.linalg.norm(scaled, axis=0)
    # A column that is nothing but rounding counts as zero.
    unit = scaled / np.where(norms > ROUNDING * norms.max(initial=0.0), norms, np.inf)
    ones = _singular(unit)
    structural = int((ones > STRUCTURAL * max(ones.max(initial=0.0), 1e-300)).sum())
    kept, left, told = _selected(problem, r, always, seen)
    combinations = _absorbed(problem, x, tuple(_hiding(told, scale, names, kept, i) for i in left))
    final = _singular(scaled[:, kept])
    # (S^T S + I)^-1 from the singular values: squaring S would lose what is known to better than 1e-8 of what was
    # expected.
    posterior = problem.expected_root @ (vt.T / (1.0 + values**2)) @ vt @ problem.expected_root.T
    return Identifiability(
        names,
        int((values > seen).sum()),
        structural,
        tuple(names[i] for i in kept),
        tuple(names[i] for i in left),
        combinations,
        values,
        float(final[0] / final[-1]) if len(final) and final[-1] > 0 else float("inf"),
        observability(final, int((problem.numbers[problem.counted] > 0).sum())),
        1.0 - np.diag(posterior) / scale**2,
        posterior,
        root,
        np.atleast_2d(x),
    )


def _selected(problem: Problem, r: Array, always: Sequence[str], seen: float) -> tuple[list[int], list[int], Array]:
    """Kept and left columns in order, and the scaled matrix of data and stated priors that says so."""
    told = np.vstack([r, problem.prior_root]) * problem.scales if problem.stated.any() else r * problem.scales
    # Without noise everything is above it; then only what rounding lets through counts.
    least = max(seen, STRUCTURAL * float(np.linalg.norm(r * problem.scales, axis=0).max(initial=0.0)))
    # Its own row, of length one and nobody else's, keeps what has a prior; rounding must not say otherwise.
    held = problem.believed
    tolerance = np.where(held, 0.0, least)
    sure = {i for i, name in enumerate(problem.free) if held[i] or name in always}
    kept, left = _preferred(told, *_pivot(told, tolerance), problem.preference, sure, tolerance)
    kept += [i for i in left if i in sure]
    return sorted(kept), sorted(i for i in left if i not in sure), told


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


def _absorbed(problem: Problem, x: Array, found: tuple[Combination, ...]) -> tuple[Combination, ...]:
    """The same, where what moves the rows and yet has no partners is told to be what local blocks take up."""
    if not problem.blocks or all(c.partners for c in found):
        return found
    moves = np.sqrt(np.diag(problem.with_loss("none").normal(np.atleast_2d(x)).a[0])) * problem.scales
    felt = dict(zip(problem.free, moves > 1e-6 * max(moves.max(initial=0.0), 1.0), strict=True))
    names = tuple(name for name, family in zip(FAMILIES, problem.families, strict=False) if family.size)
    return tuple(c if c.partners or not felt[c.name] else replace(c, families=names) for c in found)

"""Which of the free columns are kept, and the combinations in which the others hide.

Columns are kept by QR with pivoting on the whitened Jacobian, scaled column by column with the error expected without data, with
the stated priors as further rows; of columns that say the same, the preferred one. See `identifiability`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.estimate.elimination import squares
from robocal.estimate.problem import Problem
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["OBSERVABLE", "PARTNER", "STRUCTURAL", "Choice", "Combination", "choose", "chosen", "together"]

# With s = 1 the expected error of a column and the standard deviation with which it would be estimated are equal: below, freeing
# it adds more variance than the bias that it removes.
OBSERVABLE = 1.0  # tolerance: see above
# Exactly dependent to first order, in units of the largest singular value of the column-normalised matrix.
STRUCTURAL = 1e-9  # tolerance: see above
NAMED = 6  # partners that are named
FEW = 3  # of the same part, that are named one by one
FAMILIES = ("the free poses", "the free targets")  # of local blocks, as people call them
ALIKE = 0.05  # of a share: parts that differ by less are the same
# What a column contributes to the imitation of another, relative to the largest contribution: below, it is no partner.
PARTNER = 0.05


@record
class Combination:
    """A dropped parameter and what takes its place: `name` by one unit looks like the kept parameters by `partners`
    units (SI), or, without partners, like the local blocks of these `families`."""

    name: str
    partners: tuple[tuple[str, float], ...]
    families: tuple[str, ...] = ()

    @property
    def remark(self) -> Remark:
        """What is said of it."""
        shown, more = together(self.partners) if self.partners else (self.families, 0)
        if not shown:
            return Remark.of(Code.NO_EFFECT, parameter=self.name)
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


@record
class Choice:
    """The columns `at` of a problem at x (1, P) that are kept, the others `left`, and the scaled matrix of data and stated priors
    that says so; `loose` names those of the others that data would place by nothing but what was fitted."""

    problem: Problem
    x: Array
    scaled: Array
    at: tuple[int, ...]
    left: tuple[int, ...]
    loose: tuple[str, ...] = ()

    @property
    def basis(self) -> tuple[str, ...]:
        """The names that are kept."""
        return tuple(self.problem.free[i] for i in self.at)

    @property
    def dropped(self) -> tuple[str, ...]:
        """The names that are left where they are."""
        return tuple(self.problem.free[i] for i in self.left)

    @cached_property
    def combinations(self) -> tuple[Combination, ...]:
        """What takes the place of every dropped name."""
        names, kept = self.problem.free, list(self.at)
        if not self.left:
            return ()
        shares = np.linalg.lstsq(self.scaled[:, kept], self.scaled[:, list(self.left)], rcond=1e-10)[0]
        found = tuple(
            _hiding(self.scaled, self.problem.scales, names, kept, i, c)
            for i, c in zip(self.left, shares.T, strict=True)
        )
        return _attribute_to_blocks(self.problem, self.x, found)


def choose(problem: Problem, x: Array) -> Choice:
    """Which free columns of a problem are kept at x; see `identifiability.analyse`."""
    # What is weighed down by a loss says as much as anything else of what could be seen.
    return chosen(problem, x, squares(problem.with_loss("none"), x).root)


def chosen(problem: Problem, x: Array, r: Array, seen: float = OBSERVABLE) -> Choice:
    """The same from a root r (n, n) of what the data say."""
    scaled = r * problem.scales
    told = np.vstack([r, problem.prior_root]) * problem.scales if problem.has_prior.any() else scaled
    # Without noise everything is above it; then only what rounding lets through counts.
    least = max(seen, STRUCTURAL * float(np.linalg.norm(scaled, axis=0).max(initial=0.0)))
    # Its own row, of length one and nobody else's, keeps what has a prior; rounding must not say otherwise.
    held = problem.prior_informs
    tolerance = np.where(held, 0.0, least)
    sure = set(np.flatnonzero(held).tolist())
    kept, left = _exchange_for_preferred(told, *_pivot(told, tolerance), problem.preference, sure, tolerance)
    kept += [i for i in left if i in sure]
    return Choice(problem, np.atleast_2d(x), told, tuple(sorted(kept)), tuple(sorted(i for i in left if i not in sure)))


def _pivot(r: Array, tolerance: Array) -> tuple[list[int], list[int]]:
    """Kept and left columns of R by pivoted Gram-Schmidt; tolerance (n,) is what each has to exceed. Among equals the first
    column wins."""
    from robocal.estimate.choosing._kernels import pivot

    order = np.arange(r.shape[1])
    count = pivot(np.array(r.T, order="C"), tolerance, order)
    return order[:count].tolist(), order[count:].tolist()


def _shares(kept: Array, asked: Array, parts: tuple[Array, Array] | None) -> Array:
    """What the kept columns have of those asked, (k, a), by least squares; `parts` are Q and R of the kept ones, where they are known."""
    q, r = np.linalg.qr(kept) if parts is None else parts
    pivots = np.abs(np.diag(r))
    if len(r) and pivots.min() > STRUCTURAL * pivots.max():
        return np.asarray(np.linalg.solve(r, q.T @ asked))
    return np.asarray(np.linalg.lstsq(kept, asked, rcond=None)[0], float)


def _exchange_for_preferred(
    scaled: Array, kept: list[int], left: list[int], preference: Ints, sure: set[int], tolerance: Array
) -> tuple[list[int], list[int]]:
    """Kept and left columns after every exchange of a kept column for a preferred one that says the same.

    An exchange stands when the column taken in is seen beside the others, and what the new set does not explain of any
    column left out stays below the tolerance, as before. So the data never decide for a worse set, nor for more columns.
    """
    kept, left = list(kept), list(left)
    size = np.linalg.norm(scaled, axis=0)
    shares: Array | None = None
    parts: tuple[Array, Array] | None = None
    asked = sorted(left, key=lambda i: -int(preference[i]))
    for number, wanted in enumerate(asked):
        rivals = [k for k in kept if preference[k] < preference[wanted] and k not in sure]
        if not rivals or size[wanted] <= tolerance[wanted]:
            continue
        if shares is None:
            shares = _shares(scaled[:, kept], scaled[:, asked], parts)
        effect = dict(zip(kept, np.abs(shares[:, number]) * size[kept], strict=True))
        for rival in sorted(rivals, key=lambda k: (preference[k], -effect[k])):
            if effect[rival] < PARTNER * max(effect.values()):
                continue
            new = [*(k for k in kept if k != rival), wanted]
            rest = [rival, *(k for k in left if k != wanted)]
            q, r = np.linalg.qr(scaled[:, new])
            missed = scaled[:, rest] - q @ (q.T @ scaled[:, rest])
            if abs(r[-1, -1]) > tolerance[wanted] and (np.linalg.norm(missed, axis=0) <= tolerance[rest]).all():
                kept, left, shares, parts = new, rest, None, (q, r)
                break
    return kept, left


def _hiding(scaled: Array, scale: Array, names: tuple[str, ...], kept: list[int], column: int, c: Array) -> Combination:
    """The kept parameters that imitate a dropped one by their shares c (k,) in it."""
    target = scaled[:, column]
    if not kept or np.linalg.norm(target) < 1e-6 * max(np.linalg.norm(scaled[:, kept], axis=0).max(), 1.0):
        return Combination(names[column], ())
    part = scaled[:, kept]
    # A partner counts when its share of the imitation is visible.
    effect = np.abs(c) * np.linalg.norm(part, axis=0)
    counts = effect > PARTNER * effect.max()
    chosen = sorted(np.flatnonzero(counts), key=lambda i: -effect[i])
    partners = tuple((names[kept[i]], float(c[i] * scale[kept[i]] / scale[column])) for i in chosen)
    return Combination(names[column], partners)


def _attribute_to_blocks(problem: Problem, x: Array, found: tuple[Combination, ...]) -> tuple[Combination, ...]:
    """The same, where what moves the rows and yet has no partners is told to be what local blocks take up."""
    if not problem.blocks or all(c.partners for c in found):
        return found
    moves = np.sqrt(np.diag(problem.with_loss("none").normal(np.atleast_2d(x)).a[0])) * problem.scales
    felt = dict(zip(problem.free, moves > 1e-6 * max(moves.max(initial=0.0), 1.0), strict=True))
    names = tuple(name for name, family in zip(FAMILIES, problem.families, strict=False) if family.size)
    return tuple(c if c.partners or not felt[c.name] else replace(c, families=names) for c in found)

"""What moved between two calibrations, or between a calibration and the truth: the statistics, whatever the machine is.

    d = x_2 - x_1,    C = cov(d) = C_1 + C_2 + (H_2 - H_1) (H_2 - H_1)^T
    W = S^-1 V L^-1 V^T S^-1,    V L V^T = S^-1 C S^-1 where L < DRIFT_OBSERVABLE        (W = C^-1 where no S is given)
    Q = d^T W d  ~  r F(r, nu)  without a change,    Q - Q_T  ~  (r - k) F  where T (n, k) alone changed

C_i is noise, H_i a root of what numbers that were not fitted contribute: what both runs hide alike cancels. S are the errors
expected without data: a direction that is not known to better than half of them was seen by neither run, and is not tested. T are
tangents of common causes: one parameter, the numbers of one part, or motions of the base that may differ. Where many causes are
looked at, chances are those of the most conspicuous of all: Holm's for single parameters, Bonferroni's for parts, and a part
that was named is free while the next is looked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array
from robocal.diagnose.limits import DRIFT_OBSERVABLE, DRIFT_PART_CHANCE
from robocal.geometry import so3
from robocal.parameters import ParameterTable

__all__ = [
    "POWER", "ROUNDING", "TINY", "Difference", "Known", "SingleStep", "name_parts", "smallest_named", "step_between", "tail",
]  # fmt: skip

ROUNDING = 1e-14
TINY = 1e-30
FLAT = 1e-12  # of the largest eigenvalue: where the numbers of one part are not told apart
POWER = 0.95  # of naming the smallest change that is reported


@record
class Known:
    """What a calibration knows: names, values (n,) and covariance (n, n), SI; `hidden` (n, h) is a root of what numbers that were held
    contribute, the same truth in every calibration of the machine (None: nothing)."""

    names: tuple[str, ...]
    values: Array
    covariance: Array
    hidden: Array | None = None

    @property
    def whole(self) -> Array:
        """The covariance of estimate minus truth (n, n), what was held included."""
        return self.covariance if self.hidden is None else self.covariance + self.hidden @ self.hidden.T

    def take(self, names: Sequence[str]) -> tuple[Array, Array, Array]:
        """Values, covariance and hidden root of some names."""
        at = [self.names.index(n) for n in names]
        hidden = np.zeros((len(at), 0)) if self.hidden is None else self.hidden[at]
        return self.values[at], self.covariance[np.ix_(at, at)], hidden


class SingleStep(NamedTuple):
    """The step of one parameter with its standard deviation, its two-sided chance, and the same for the most conspicuous of all."""

    name: str
    step: float
    sigma: float
    chance: float
    chance_of_all: float


@record(eq=False)
class Difference:
    """The step d (n,) of named parameters with its covariance (n, n), the degrees of freedom of that, and errors expected without
    data (n,), None where every direction counts as seen; `detectable` is the largest part of their variance that counts so."""

    names: tuple[str, ...]
    step: Array
    covariance: Array
    dof: float = np.inf
    expected: Array | None = None
    detectable: float = DRIFT_OBSERVABLE

    @classmethod
    def between(cls, first: Known, second: Known, names: Sequence[str]) -> Difference:
        """Of two calibrations in names that both know."""
        (x, a, h), (y, b, k) = first.take(names), second.take(names)
        # What both hide alike cancels; where they hide different things, each counts by itself.
        hidden = k - h if h.shape == k.shape else np.hstack([h, k])
        return cls(tuple(names), y - x, a + b + hidden @ hidden.T + TINY * np.eye(len(names)))

    @cached_property
    def at(self) -> dict[str, int]:
        """Of every name, where it is."""
        return {n: i for i, n in enumerate(self.names)}

    def find(self, names: Sequence[str]) -> list[int]:
        """Where those of some names are that both know."""
        return [self.at[n] for n in names if n in self.at]

    @cached_property
    def _observable(self) -> tuple[Array, int]:
        if self.expected is None:
            return np.asarray(np.linalg.inv(self.covariance)), len(self.step)
        values, vectors = np.linalg.eigh(self.covariance / np.outer(self.expected, self.expected))
        able = (values > ROUNDING) & (values < self.detectable)
        root = vectors[:, able] / np.sqrt(values[able]) / self.expected[:, None]
        return np.asarray(root @ root.T), int(able.sum())

    @property
    def weight(self) -> Array:
        """W (n, n)."""
        return self._observable[0]

    @property
    def rank(self) -> int:
        """The number of directions that are tested."""
        return self._observable[1]

    @cached_property
    def square(self) -> float:
        """Q."""
        return float(self.step @ self.weight @ self.step)

    @property
    def chance(self) -> float:
        """Of so large a difference without any change."""
        return tail(self.square, self.rank, self.dof)

    @property
    def sigma(self) -> Array:
        """Standard deviations (n,) of the step."""
        return np.sqrt(np.diag(self.covariance))

    def single_steps(self) -> Iterator[SingleStep]:
        """Of every parameter that anything is known of: its step by itself, and its chance after looking at all of them: the k-th smallest
        of m times m - k + 1, never less than the one before (Holm)."""
        some = np.flatnonzero(self.sigma > 0)
        step, sigma, running = self.step[some], self.sigma[some], 0.0
        chances = 2 * scipy.special.stdtr(min(self.dof, 1e9), -np.abs(step) / sigma)
        of_all = np.ones(len(some))
        for k, i in enumerate(np.argsort(chances)):
            of_all[i] = running = max(running, min(1.0, float(chances[i]) * (len(some) - k)))
        return map(SingleStep, (self.names[i] for i in some), *(v.tolist() for v in (step, sigma, chances, of_all)))

    def given(self, known: Sequence[int]) -> Difference:
        """Conditioned on some steps being zero."""
        if not known:
            return self
        rest = [i for i in range(len(self.step)) if i not in set(known)]
        c = self.covariance
        gain = np.linalg.solve(c[np.ix_(known, known)], c[np.ix_(known, rest)]).T
        step = self.step[rest] - gain @ self.step[list(known)]
        return Difference(
            tuple(self.names[i] for i in rest), step, c[np.ix_(rest, rest)] - gain @ c[np.ix_(known, rest)], self.dof
        )

    def only(self, at: Sequence[int]) -> Difference:
        """Of some of the numbers alone."""
        expected = None if self.expected is None else self.expected[list(at)]
        names = tuple(self.names[i] for i in at)
        part = self.covariance[np.ix_(at, at)]
        return Difference(names, self.step[list(at)], part, self.dof, expected, self.detectable)

    def columns(self, rates: Sequence[Mapping[str, float]]) -> Array:
        """Tangents (n, k) of motions, each the rates of parameters by name."""
        return np.array([[r.get(n, 0.0) for r in rates] for n in self.names]).reshape(len(self.names), len(rates))

    def own(self, at: Sequence[int]) -> Array:
        """Tangents (n, k) of some numbers by themselves."""
        return np.eye(len(self.names))[:, list(dict.fromkeys(at))]

    def beside(self, tangents: Array) -> tuple[Array, Array]:
        """P d (n,) and P (n, n): what weighs d where tangents (n, k) are free to change."""
        w = self.weight
        if tangents.shape[1]:
            t = w @ tangents
            # A robot in a plane has motions of its base that none of its numbers shows.
            w = w - t @ np.linalg.pinv(tangents.T @ t, hermitian=True, rcond=ROUNDING) @ t.T
        return np.asarray(w @ self.step), np.asarray(w)

    def change(self, at: list[int], tangents: Array) -> tuple[Array, Array, float]:
        """Estimate (k,) of a change of the numbers `at` alone, its covariance, and the chance of as much; tangents are free."""
        u, p = self.beside(tangents)
        covariance = np.linalg.pinv(p[np.ix_(at, at)], hermitian=True, rcond=FLAT)
        estimate = covariance @ u[at]
        chance = tail(max(float(estimate @ u[at]), 0.0), len(at), np.inf) if at else 1.0
        return estimate, np.asarray(covariance), chance

    def explained(self, at: list[int], tangents: Array) -> float:
        """How much of Q a change of the numbers `at` explains; tangents (n, k) are free."""
        estimate, covariance, _ = self.change(at, tangents)
        return float(estimate @ np.linalg.pinv(covariance, hermitian=True, rcond=FLAT) @ estimate)

    def causes(self, tangents: Array) -> tuple[Array, Array, Array]:
        """Of every column of tangents (n, k) as the only cause: its size (k,), the standard deviation of that, and the Q that it leaves;
        infinite standard deviations where a cause shows in no direction that was seen."""
        norm = np.einsum("nk,nk->k", tangents, self.weight @ tangents)
        shows = norm > 0
        safe = np.where(shows, norm, 1.0)
        size = np.where(shows, tangents.T @ (self.weight @ self.step) / safe, 0.0)
        sigma = np.where(shows, 1 / np.sqrt(safe), np.inf)
        return size, sigma, np.maximum(self.square - np.where(shows, size**2 * norm, 0.0), 0.0)


def tail(square: float, rank: int, dof: float) -> float:
    """The chance of a Q of rank r, or more, without a change; 1 where nothing is tested."""
    if not rank:
        return 1.0
    return float(
        scipy.special.chdtrc(rank, square) if not np.isfinite(dof) else scipy.special.fdtrc(rank, dof, square / rank)
    )


def step_between(first: ParameterTable, second: ParameterTable, names: Sequence[str]) -> Array:
    """The step from one table to the other, (n,), rotation vectors in their tangent."""
    step = {n: second[n].value - first[n].value for n in names}
    for t in first.turns:
        turn = first.names[t : t + 3]
        if not all(n in second for n in turn):
            continue
        w = so3.log(so3.exp(np.array([second[n].value for n in turn])) @ so3.exp(first.values[t : t + 3]).T)
        step.update({n: float(v) for n, v in zip(turn, w, strict=True) if n in step})
    return np.array([step[n] for n in names])


def name_parts(
    difference: Difference, free: Array, parts: Mapping[str, Sequence[str]], symbols: int, known: Sequence[str] = ()
) -> tuple[str, ...]:
    """The parts whose parameters changed, beside those that are known, the most conspicuous first: named while chance would show as
    much less than DRIFT_PART_CHANCE times in one comparison of all. Tangents `free` (n, k) may change too; a part has so many `symbols`."""
    at = {part: difference.find(names) for part, names in parts.items()}
    out = list(known)
    while len(out) < len(parts):
        tangents = np.hstack([free, difference.own([i for part in out for i in at[part]])])
        taken = {i for part in out for i in at[part]}
        rest = [part for part in parts if part not in out and at[part] and not set(at[part]) <= taken]
        if not rest or len(difference.step) - tangents.shape[1] <= symbols:
            break
        changes = [difference.change(at[part], tangents) for part in rest]
        best = int(np.argmax([difference.explained(at[part], tangents) for part in rest]))
        if len(parts) * changes[best][2] >= DRIFT_PART_CHANCE:
            break
        out.append(rest[best])
    return tuple(out[len(known) :])


def smallest_named(covariance: Array, direction: Array, parts: int) -> tuple[float, float]:
    """Changes of a part's k numbers, of this covariance (k, k), along a unit direction (k,) and across it, at worst, that would be
    named among so many parts with a chance of POWER; k is 2 or more."""
    k = len(direction)
    level = float(scipy.special.chdtri(k, DRIFT_PART_CHANCE / parts))
    need = float(scipy.special.chndtrinc(level, k, 1 - POWER))
    weight = np.linalg.pinv(covariance, hermitian=True, rcond=FLAT)
    across = np.linalg.svd(direction[None])[2][1:]
    least = float(np.linalg.eigvalsh(across @ weight @ across.T)[0])
    along = max(float(direction @ weight @ direction), TINY)
    return float(np.sqrt(need / along)), float(np.sqrt(need / max(least, TINY)))

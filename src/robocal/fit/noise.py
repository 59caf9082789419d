"""What the noise is: stated, or as fitted.

    sigma_i^2 = s_i^2 + tau^2,   tau >= 0 such that chi2 = dof in the group

A stated sigma s_i stands as long as chi2 / dof is not significantly above one. When the model leaves more than that
(a 0.01 mm tracker on a robot that geometry explains to 0.4 mm), tau is the model's own error; without it the few rows
with the smallest s_i would decide the fit. Where no sigma is stated, s_i = 0 and tau is estimated. Reference: Mandel
and Paule (1970), Birge (1932) for the ratio.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.estimate.leverage import leverages
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Residuals
from robocal.measure.base import Rows, kind_of
from robocal.measure.data import DataSet, Observations

__all__ = [
    "NoiseGroup", "Tau", "apply_noise", "assess", "by_observation", "median", "noise_dof", "owners", "quantile", "same_tau", "tau_of",
    "under",
]  # fmt: skip

Known = TypeVar("Known", bound=np.generic)
Key = tuple[str, str]  # (sensor group, SI unit)
Tau = Mapping[Key, float]
LEAST = 1e-9  # of its rows, that a group keeps as degrees of freedom
CHANCE = 1e-3  # that residuals of the stated noise are taken for larger
MEDIAN = 0.454936  # of a squared standard normal
# Below this no instrument measures; it only keeps noise-free data from dividing by zero.
FLOOR = {"m": 1e-12, "rad": 1e-12, "px": 1e-9}


@record
class NoiseGroup:
    """Rows of one instrument that share a unit: stated sigma (rms, or None), tau, chi2 against the stated sigma, dof,
    rms residual."""

    name: str
    kind: str
    unit: str
    n: int
    dof: float
    chi2: float | None
    rms: float
    stated: float | None
    tau: float

    @property
    def sigma(self) -> float:
        """The standard deviation in use, per component."""
        return float(np.hypot(self.stated or 0.0, self.tau))

    @property
    def sigma_source(self) -> str:
        """Where sigma comes from: stated, estimated, or stated and enlarged by what the model leaves."""
        if self.stated is None:
            return "estimated"
        return "stated" if self.tau == 0 else "stated, with model error added"


def tau_of(groups: Iterable[NoiseGroup]) -> Tau:
    """What is added to the stated sigma of every group, where anything is."""
    return {(g.name, g.unit): g.tau for g in groups if g.tau > 0}


def same_tau(new: Tau, old: Tau, share: float) -> bool:
    """Whether the same groups have a tau as before, each within this share of what it was."""
    return set(new) == set(old) and all(abs(new[k] - old[k]) <= share * old[k] for k in new)


def noise_dof(groups: Iterable[NoiseGroup], dof: float) -> float:
    """Degrees of freedom of the noise: infinite where every sigma is stated and stands."""
    return np.inf if all(g.stated is not None and g.tau == 0 for g in groups) else max(float(dof), 1.0)


def apply_noise(data: DataSet, tau: Tau) -> DataSet:
    """The same data with sigma^2 = s^2 + tau^2."""
    return DataSet(data.configurations, tuple(replace(o, sigma=_noisy(o, tau)) for o in data.observations))


def _noisy(obs: Observations, tau: Tau) -> Array | None:
    """The sigma (k, d) of some observations with that; None where none is stated and nothing added."""
    kind = kind_of(obs)
    s = np.zeros((len(obs), kind.size)) if obs.sigma is None else np.array(obs.sigma)
    touched = obs.sigma is not None
    for start, stop, unit in kind.parts:
        extra = tau.get((obs.label, unit), 0.0)
        if extra > 0:
            s[:, start:stop] = np.hypot(s[:, start:stop], extra)
            touched = True
    return s if touched else None


def assess(stated: DataSet, problem: Problem, x: Array, configurations: Ints, columns: float) -> list[NoiseGroup]:
    """The groups at a solution x fitted to `configurations` with `columns` free parameters; `stated` is the data with its
    stated sigma."""
    chosen = np.zeros(problem.configurations, dtype=bool)
    chosen[configurations] = True
    unstated = {obs.label for obs in stated.observations if obs.sigma is None}
    # A fit that resists outliers must not let them decide what the noise is.
    resistant = problem.loss != "none"
    rows: dict[Key, list[list[Array]]] = {}
    # What visits of one place have in common is fitted by fewer numbers, and costs as much of the others.
    lost = problem.repeated
    columns *= 1.0 if not lost else 1 + lost / max(float(problem.numbers[chosen].sum()) - lost, 1.0)
    in_use: dict[Key, tuple[Residuals, int, int]] = {}
    kinds: dict[str, str] = {}
    keep = [np.flatnonzero(chosen[t.configuration] & t.used) for t in problem.terms]
    total = sum(len(k) * t.scale.shape[1] for k, t in zip(keep, problem.terms, strict=True))
    paid = _paid(problem, x, configurations, columns) if problem.blocks and total else {}
    for r, some, (own, term) in zip(problem.residuals(x), keep, owners(stated, problem), strict=True):
        kinds.setdefault(r.group, r.kind)
        given = stated.observations[own].sigma
        value, plain = (r.value if r.independent is None else r.independent)[some], r.value[some]
        sigma = np.zeros_like(value) if r.group in unstated or given is None else given[term.index[some]]
        for start, stop, unit in r.parts:
            in_use[r.group, unit] = r, start, stop
            rows.setdefault((r.group, unit), []).append([a[:, start:stop].ravel() for a in (value, sigma, plain)])
    groups = []
    for (name, unit), parts in rows.items():
        value, sigma, plain = parts[0] if len(parts) == 1 else (np.concatenate(p) for p in zip(*parts, strict=True))
        if not len(value):
            continue
        taken = paid.get((name, unit), columns * len(value) / total)
        dof = max(len(value) - taken, LEAST * len(value))
        rms = float(np.sqrt(np.mean(plain**2)))
        if name in unstated:
            # Without a degree of freedom residuals are zero whatever the noise: what was assumed stays.
            spread = _spread(value, dof, resistant) if dof >= 1 else _rms_sigma(*in_use[name, unit])
            tau = max(spread, FLOOR.get(unit, 1e-12))
            chi2, given_rms = None, None
        else:
            white = value / sigma
            tau = _solve(value, sigma, dof, resistant) if dof >= 1 and _exceeds(white, dof, resistant) else 0.0
            chi2, given_rms = float(np.sum(white**2)), float(np.sqrt(np.mean(sigma**2)))
        groups.append(NoiseGroup(name, kinds[name], unit, len(value), dof, chi2, rms, given_rms, tau))
    return groups


def _rms_sigma(r: Residuals, start: int, stop: int) -> float:
    return float(np.sqrt(np.mean((1 / r.scale[r.used, start:stop]) ** 2)))


def _paid(problem: Problem, x: Array, configurations: Ints, columns: float) -> dict[Key, float]:
    """How many degrees of freedom the rows of every sensor group and unit pay for what was fitted to some configurations: for local
    blocks and for shared columns as they take of them. Lengths hardly say where a platform is that a camera sees, and know nothing of
    its markers.
    """
    taken = leverages(problem, x, configurations)
    whole, numbers = (sum(t[i] for t in taken.values()) for i in (1, 2))
    return {
        key: own + columns * (shared / whole if whole > 0 else many / numbers)
        for key, (own, shared, many) in taken.items()
    }


def median(values: Array) -> float:
    """As `numpy.median` of (n,), which takes longer to look at its arguments than for a few hundred numbers."""
    n = len(values)
    parted = np.partition(values, ((n - 1) // 2, n // 2, n - 1))
    return float(parted[-1] if np.isnan(parted[-1]) else (parted[(n - 1) // 2] + parted[n // 2]) / 2)


def quantile(values: Array, level: float) -> float:
    """As `numpy.quantile` of (n,), linear between two of them; it too takes longer to look at its arguments."""
    at = level * (len(values) - 1)
    low = int(at)
    parted = np.partition(values, (low, min(low + 1, len(values) - 1)))
    below, above = parted[low], parted[min(low + 1, len(values) - 1)]
    return float(below + (at - low) * (above - below))


def _spread(value: Array, dof: float, resistant: bool) -> float:
    """Standard deviation with dof degrees of freedom; resistant: from the median of squares, which outliers do not
    move."""
    if resistant:
        return float(np.sqrt(median(value**2) / MEDIAN * len(value) / dof))
    return float(np.sqrt(value @ value / dof))


def _exceeds(whitened: Array, dof: float, resistant: bool) -> bool:
    """Whether whitened residuals are significantly larger than one."""
    if resistant:
        # The median of n squares scatters by 2.33 / sqrt(n) of itself, the mean by 1.41 / sqrt(n).
        return bool(_spread(whitened, dof, True) ** 2 > 1 - scipy.special.ndtri(CHANCE) * 2.33 / np.sqrt(dof))
    return bool(whitened @ whitened > scipy.special.chdtri(dof, CHANCE))


def _solve(value: Array, sigma: Array, dof: float, resistant: bool) -> float:
    """tau with r / sqrt(s^2 + tau^2) of spread one; where sigma differs by row, by bisection on a falling function."""
    if sigma.min() == sigma.max():
        # One sigma for all rows: nothing is to be searched.
        return float(np.sqrt(max(_spread(value, dof, resistant) ** 2 - float(sigma[0]) ** 2, 0.0)))
    low, high = 0.0, _spread(value, dof, resistant) + float(sigma.max())
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _spread(value / np.sqrt(sigma**2 + middle**2), dof, resistant) > 1:
            low = middle
        else:
            high = middle
    return high


def owners(data: DataSet, problem: Problem) -> Iterator[tuple[int, Rows]]:
    """The terms of a problem, each with the number of the observations that it belongs to; terms follow the observations in
    order, one or more for each."""
    terms = iter(problem.terms)
    for number, obs in enumerate(data.observations):
        taken = 0
        while taken < len(obs):
            term = next(terms)
            assert isinstance(term, Rows)
            taken += len(term.index)
            yield number, term


def by_observation(data: DataSet, problem: Problem, values: Sequence[NDArray[Known]]) -> tuple[NDArray[Known], ...]:
    """What is known of the rows of terms, (m,) each, for the rows of observations, (k,) each."""
    kind = values[0].dtype if values else np.dtype(bool)
    out: tuple[NDArray[Known], ...] = tuple(np.zeros(len(o), dtype=kind) for o in data.observations)
    for (own, term), value in zip(owners(data, problem), values, strict=True):
        out[own][term.index] = value
    return out


def under(problem: Problem, stated: DataSet, tau: Tau) -> Problem:
    """The problem of `stated` with sigma^2 = s^2 + tau^2, as `apply_noise` has it: nothing else of it is made again."""
    sigma = [_noisy(obs, tau) for obs in stated.observations]
    return problem.with_terms([t.under(sigma[own]) for own, t in owners(stated, problem)])

"""Errors that a person understands, and the verdict that follows from them.

The error of an observation is the length of its residual in metres (and, for poses, its angle in radians). The
verdict compares the identified model with the baseline, the nominal model with instrument frames and tool fitted, on
configurations that were not used for fitting.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.diagnose.limits import MEAN_RIVAL, PROOF_PLACES, UNEXPLAINED_MOST, UNEXPLAINED_SHARE, UNEXPLAINED_SIGMA
from robocal.diagnose.verdict import Verdict
from robocal.prove.split import Split
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = [
    "bootstrap_gain",
    "constant_errors",
    "judge",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
DRAWN = 1 << 17  # grid: numbers of a bootstrap at once: more would leave the cache
MANY = 1000  # grid: configurations: four thousand draws know the ends of their mean less well than its expansion
RULED = 0.2  # tolerance: skewness and excess kurtosis of a mean: beyond, its expansion is no better than draws
ROUNDING = 1e-12  # tolerance: of the largest error, or of a metre, a radian, a pixel


def constant_errors(values: Array, configurations: Ints, split: Split, used: NDArray[np.bool_] | None = None) -> Array:
    """What predicting the mean of the fitted measurements misses, for held-out ones; NaN for those never held out.

    values (N, d) measured at `configurations` (N,); `used` (N,) are those of which the mean is taken. Infinite where a
    round has nothing to take the mean of.
    """
    out = np.full(len(values), np.nan)
    mine = split.round_of[configurations]
    for first in range(0, len(split), 256):
        seen = split.fit[first : first + 256, configurations].astype(np.float64)
        if used is not None:
            seen *= used
        count = seen.sum(axis=1)
        mean = (seen @ values) / np.maximum(count, 1.0)[:, None]
        rows = np.flatnonzero((mine >= first) & (mine < first + 256))
        k = mine[rows] - first
        out[rows] = np.where(count[k] > 0, np.linalg.norm(values[rows] - mean[k], axis=1), np.inf)
    return out


def bootstrap_gain(
    before: Array, after: Array, configurations: Ints, seed: int, draws: int = 4000
) -> tuple[float, float, float]:
    """Mean reduction of the error and its paired bootstrap 95 % interval; whole configurations are drawn.

    Of n draws the percentiles are too narrow twice over: resampling divides by n where n - 1 is unbiased, and they are those
    of a normal mean where t with n - 1 degrees of freedom holds. Both ends are moved out by t_975(n-1) / z_975 sqrt(n / (n - 1)).
    Of MANY configurations the percentiles are not drawn but expanded, unless a few rule the mean.
    Source: Hesterberg, What teachers should know about the bootstrap (2015), section 5.3.
    """
    gain = before - after
    labels, inverse = np.unique(configurations, return_inverse=True)
    total: Array = np.bincount(inverse, weights=gain).astype(np.float64)
    count = np.bincount(inverse).astype(float)
    n = len(labels)
    ends = _expanded(total) if n >= MANY and bool((count == 1).all()) else None
    low, high = _drawn(total, count, seed, draws) if ends is None else ends
    mean = float(gain.mean())
    if n < 2:
        return mean, -np.inf, np.inf
    wide = float(special.stdtrit(n - 1, 0.975) / special.ndtri(0.975) * np.sqrt(n / (n - 1)))
    return mean, mean - wide * float(mean - low), mean + wide * float(high - mean)


def _drawn(total: Array, count: Array, seed: int, draws: int) -> tuple[float, float]:
    """The 2.5 and 97.5 % points of resampled means, by so many draws."""
    rng, n = np.random.default_rng(seed), len(total)
    means, even, each = np.empty(draws), bool((count == 1).all()), max(1, DRAWN // max(n, 1))
    for first in range(0, draws, each):
        some = slice(first, min(first + each, draws))
        draw = rng.integers(0, n, (some.stop - first, n))
        drawn = float(n) if even else count[draw].sum(axis=1)
        means[some] = total[draw].sum(axis=1) / drawn
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def _expanded(values: Array) -> tuple[float, float] | None:
    """The points to which those draws tend, from the first four cumulants of the values (Cornish and Fisher 1938); None where
    the last term kept is no longer small: a few values rule the mean."""
    n, away = len(values), values - values.mean()
    spread = float(np.sqrt(np.mean(away**2)))
    if not 0 < spread < np.inf:
        return None
    skew, tail = float(np.mean(away**3)) / spread**3 / np.sqrt(n), (float(np.mean(away**4)) / spread**4 - 3) / n
    if abs(skew) > RULED or abs(tail) > RULED:
        return None
    z = special.ndtri(np.array([0.025, 0.975]))
    points = z + skew * (z**2 - 1) / 6 + tail * (z**3 - 3 * z) / 24 - skew**2 * (2 * z**3 - 5 * z) / 36
    low, high = values.mean() + spread / np.sqrt(n) * points
    return float(low), float(high)


def judge(
    before: Array,
    after: Array,
    constant: Array | None,
    configurations: Ints,
    *,
    blind: bool,
    converged: bool,
    seed: int,
    kind: str,
    stated: float | None = None,
    unit: str = "m",
    everything: tuple[Array, Array, NDArray[np.bool_]] | None = None,
    located: Array | None = None,
) -> Verdict:
    """The verdict from unseen errors of the baseline and of the identified model, (N,) each, in `unit`; `kind` names
    how they were held out, `blind` whether nothing was seen above the noise. `constant` is what predicting the mean misses of
    those that have one, `located` what the identified model misses of the same (None: `after`). `everything` are both errors of
    all rows, and which of them are told, where gross ones were left out."""
    if blind:
        return Verdict("refused", (Remark.of(Code.RANK_ZERO),))
    if not np.isfinite(after).all():
        return Verdict("refused", (Remark.of(Code.NOT_FINITE),))
    there = after if located is None else located
    if constant is not None and len(constant) and len(there):
        if there.mean() >= MEAN_RIVAL * constant.mean():
            shown = {"after": Quantity(float(there.mean())), "constant": Quantity(float(constant.mean()))}
            return Verdict("refused", (Remark.of(Code.NO_BETTER_THAN_MEAN, **shown),))
        unexplained = float(np.mean(there**2) / np.mean(constant**2))
        rms = float(np.sqrt(np.mean(there**2)))
        noise = Quantity(stated) if stated else None
        told = Remark.of(Code.UNEXPLAINED, explained=1 - unexplained, rms=Quantity(rms), stated=noise)
        if unexplained > UNEXPLAINED_MOST and rms > UNEXPLAINED_SIGMA * (stated or 0.0):
            return Verdict("refused", (told,))
    else:
        told, unexplained, rms = None, 0.0, 0.0
    gain, low, high = bootstrap_gain(before, after, configurations, seed)
    if np.abs(before - after).max() <= ROUNDING * max(1.0, float(np.abs(before).max())):
        # Two models that are one: what differs is how the computer rounds.
        gain = low = high = 0.0

    def span(code: Code) -> Remark:
        ends = (Quantity(low, unit), Quantity(high, unit)) if np.isfinite([low, high]).all() else (None, None)
        aside, otherwise = None, None
        if everything is not None:
            first, second, told = everything
            aside = int(told.sum()) - len(before)
            otherwise = Quantity(float((first - second)[told].mean()), unit)
        amounts = {"gain": Quantity(gain, unit), "low": ends[0], "high": ends[1]}
        return Remark.of(code, **amounts, how=kind, aside=aside, otherwise=_finite(otherwise))

    if not converged:
        return Verdict("not_improved", (Remark.of(Code.NOT_CONVERGED), span(Code.GAIN_ANYWAY)))
    if len(np.unique(configurations)) < PROOF_PLACES:
        return Verdict("not_improved", (Remark.of(Code.FEW_UNSEEN, least=PROOF_PLACES), span(Code.GAIN_ANYWAY)))
    if low > 0:
        return Verdict("improved", (span(Code.GAIN_PROVEN),))
    if told is not None and unexplained > UNEXPLAINED_SHARE and rms > UNEXPLAINED_SIGMA * (stated or 0.0):
        # Nobody should hear that the nominal model may be as good as can be.
        return Verdict("refused", (told, span(Code.GAIN_ANYWAY)))
    return Verdict("not_improved", (span(Code.GAIN_NOT_PROVEN),))


def _finite(value: Quantity | None) -> Quantity | None:
    """None where a row is so far off that no mean with it is a number."""
    return value if value is not None and np.isfinite(value.value) else None

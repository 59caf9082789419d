"""Errors that a person understands, and the gain that follows from them.

The error of an observation is the length of its residual in metres (and, for poses, its angle in radians). The
verdict compares the identified model with the baseline, the nominal model with instrument frames and tool fitted, on
configurations that were not used for fitting.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Ints
from robocal.prove.split import Split
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["Evidence", "Gain", "bootstrap_gain", "constant_errors"]

AT_ONCE = 1 << 17  # grid: numbers of a bootstrap at once: more would leave the cache
KEPT = 1 << 24  # grid: numbers of one that are kept for the next
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
    ends = _cornish_fisher(total) if n >= MANY and bool((count == 1).all()) else None
    low, high = _drawn(total, count, seed, draws) if ends is None else ends
    mean = float(gain.mean())
    if n < 2:
        return mean, -np.inf, np.inf
    wide = float(scipy.special.stdtrit(n - 1, 0.975) / scipy.special.ndtri(0.975) * np.sqrt(n / (n - 1)))
    return mean, mean - wide * float(mean - low), mean + wide * float(high - mean)


def _drawn(total: Array, count: Array, seed: int, draws: int) -> tuple[float, float]:
    """The 2.5 and 97.5 % points of resampled means, by so many draws."""
    n, even, first = len(total), bool((count == 1).all()), 0
    means = np.empty(draws)
    for draw in _kept(n, seed, draws) if draws * n <= KEPT else _parts(n, seed, draws):
        some = slice(first, first + len(draw))
        drawn = float(n) if even else count[draw].sum(axis=1)
        means[some] = total[draw].sum(axis=1) / drawn
        first += len(draw)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def _parts(n: int, seed: int, draws: int) -> Iterator[Ints]:
    """Which of n are drawn, (., n), some draws at once."""
    rng, each = np.random.default_rng(seed), max(1, AT_ONCE // max(n, 1))
    for first in range(0, draws, each):
        yield rng.integers(0, n, (min(each, draws - first), n))


@lru_cache(maxsize=1)
def _kept(n: int, seed: int, draws: int) -> tuple[Ints, ...]:
    """The same as small numbers: every trial of a study, and every group that is asked, draws alike."""
    small = np.min_scalar_type(max(n - 1, 0))
    return tuple([part.astype(small) for part in _parts(n, seed, draws)])


def _cornish_fisher(values: Array) -> tuple[float, float] | None:
    """The points to which those draws tend, from the first four cumulants of the values (Cornish and Fisher 1938); None where
    the last term kept is no longer small: a few values rule the mean."""
    n, away = len(values), values - values.mean()
    spread = float(np.sqrt(np.mean(away**2)))
    if not 0 < spread < np.inf:
        return None
    skew, tail = float(np.mean(away**3)) / spread**3 / np.sqrt(n), (float(np.mean(away**4)) / spread**4 - 3) / n
    if abs(skew) > RULED or abs(tail) > RULED:
        return None
    z = scipy.special.ndtri(np.array([0.025, 0.975]))
    points = z + skew * (z**2 - 1) / 6 + tail * (z**3 - 3 * z) / 24 - skew**2 * (2 * z**3 - 5 * z) / 36
    low, high = values.mean() + spread / np.sqrt(n) * points
    return float(low), float(high)


@record
class Gain:
    """The reduction of the error on unseen measurements, as it is reported, whether it is proven, and where it holds, if known;
    `status` is the verdict where it is."""

    remark: Remark
    proven: bool
    region: str | None = None
    status: str = "improved"


@record
class Evidence:
    """Unseen errors of the baseline and of the identified model, (N,) each, in `unit`, by configuration (or whatever the bootstrap
    draws as a whole).

    `kind` names how they were held out, `blind` whether nothing was seen above the noise. `constant` is what predicting the mean
    misses of those that have one, `located` what the identified model misses of the same (None: `after`). `everything` are both
    errors of all rows, and which of them count, where gross ones were left out. `what` has these errors, where it is not the tool;
    `mixed`: of several kinds.
    """

    before: Array
    after: Array
    constant: Array | None
    configurations: Ints
    blind: bool
    converged: bool
    seed: int
    kind: str
    stated: float | None = None
    unit: str = "m"
    everything: tuple[Array, Array, NDArray[np.bool_]] | None = None
    located: Array | None = None
    what: str | None = None
    mixed: bool = False

    @property
    def there(self) -> Array:
        """Errors of the identified model where predicting the mean has one to compare with."""
        return self.after if self.located is None else self.located

    @cached_property
    def residual_share(self) -> tuple[float, float]:
        """Share of the variance that the model leaves, and the rms that is left; nothing where there is no mean to predict."""
        if self.constant is None or not len(self.constant) or not len(self.there):
            return 0.0, 0.0
        square = np.mean(self.there**2)
        return float(square / np.mean(self.constant**2)), float(np.sqrt(square))

    @cached_property
    def gain(self) -> Gain:
        """The reduction of the mean error with its 95 % interval."""
        gain, low, high = bootstrap_gain(self.before, self.after, self.configurations, self.seed)
        if np.abs(self.before - self.after).max() <= ROUNDING * max(1.0, float(np.abs(self.before).max())):
            # Two models that are one: what differs is how the computer rounds.
            gain = low = high = 0.0
        finite = np.isfinite([low, high]).all()
        ends = (Quantity(low, self.unit), Quantity(high, self.unit)) if finite else (None, None)
        aside, otherwise = None, None
        if self.everything is not None:
            first, second, counted = self.everything
            aside = int(counted.sum()) - len(self.before)
            mean = float((first - second)[counted].mean())
            # A row may be so far off that no mean with it is a number.
            otherwise = Quantity(mean, self.unit) if np.isfinite(mean) else None
        code = Code.GAIN_PROVEN if low > 0 else Code.GAIN_NOT_PROVEN
        amounts = {"gain": Quantity(gain, self.unit), "low": ends[0], "high": ends[1]}
        told = {"what": self.what, **amounts, "how": self.kind, "aside": aside, "otherwise": otherwise}
        if self.what and self.mixed:  # other means stand beside it: whose this is, is said with its own numbers
            told |= {"what": f"all {self.what}"}
            told |= {
                k: Quantity(float(v.mean()), self.unit) for k, v in (("before", self.before), ("after", self.after))
            }
        return Gain(Remark.of(code, **told), bool(low > 0))

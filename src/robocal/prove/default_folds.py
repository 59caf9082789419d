"""Whether a held-out fifth is likely to lose a gain that folds would keep: few places, and a gain that scatters from place to place.

    z = mean g_p / (sd g_p / sqrt(n)),    g_p gain of place p in the fit to everything, n places held out

g_p compares baseline and fit where both were fitted, so nothing is chosen by what was held out. Below FOLDS_SIGMA a fifth proves such a
gain too rarely; folds hold out every place once, and have the scatter of all of them.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose.limits import FOLDS_PLACES, FOLDS_SIGMA, HOLD_OUT_SHARE
from robocal.fit.baseline import Baseline
from robocal.fit.estimators import can_batch
from robocal.fit.fit import Fit
from robocal.fit.misfit import errors
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.measure.data import DataSet
from robocal.prove.judge import units_of

__all__ = ["likely_lost"]


def likely_lost(data: DataSet, base: Baseline, whole: Fit, options: Options) -> bool:
    """Whether folds are the better default for these data."""
    label = places(data.configurations)
    count = len(np.unique(label))
    if count > FOLDS_PLACES or not can_batch(options) or options.reselect:
        return False
    unit = units_of(base.problem)[0]
    before, where = errors(base.problem.residuals(base.x), unit)
    after, _ = errors(whole.problem.residuals(whole.solution.x), unit)
    gain = _means(before - after, label[where])
    if len(gain) < 2:
        return False
    scatter = float(gain.std(ddof=1)) / np.sqrt(max(HOLD_OUT_SHARE * count, 1.0))
    return bool(0 < gain.mean() < FOLDS_SIGMA * scatter)


def _means(values: Array, label: Ints) -> Array:
    """The mean of the values of every label."""
    number = np.unique(label, return_inverse=True)[1]
    return np.asarray(np.bincount(number, values) / np.bincount(number))

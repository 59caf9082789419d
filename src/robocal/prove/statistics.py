"""Errors in few numbers: their statistic, the rounds of a k-fold, every stage of an identification, the check of the bands.

The same classes stand in result.json, in the units that are shown.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal._record import field, record, replace
from robocal.quantities import Amount, DisplayUnit, Share

__all__ = ["Coverage", "Fold", "Stages", "Statistic", "rms"]


def rms(values: NDArray[np.float64]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


@record
class Statistic:
    """Errors in one number each; profiled: local parameters were refitted on these data."""

    mean: Amount
    rms: Amount
    p95: Amount
    max: Amount
    n: int
    profiled: bool = False

    @classmethod
    def of(cls, values: NDArray[np.float64], profiled: bool = False) -> Statistic | None:
        """The statistic of some errors, None of none."""
        if not len(values):
            return None
        p95, most = float(np.percentile(values, 95)), float(values.max())
        return cls(float(values.mean()), rms(values), p95, most, len(values), profiled)


@record
class Fold:
    """One round in which everything was held out once: mean errors, baseline and identified."""

    name: str
    n: int
    before: Amount
    after: Amount
    profiled: bool = False


@record(kw_only=True)
class Stages:
    """The error of one quantity at every stage: baseline (before) and identified (after), on fitted and on unseen configurations;
    constant is predicting the mean."""

    unit: DisplayUnit
    before: Statistic | None = None
    after: Statistic | None = None
    held_out: Statistic | None = None
    held_out_before: Statistic | None = None
    leave_one_out: Statistic | None = None
    leave_one_out_before: Statistic | None = None
    constant: Statistic | None = None
    k_fold: Statistic | None = None
    k_fold_before: Statistic | None = None
    folds: tuple[Fold, ...] = field(default_factory=tuple)
    all_rows: Stages | None = None  # the same with the gross rows that no mean above counts; None where there are none

    @property
    def without_before(self) -> Stages:
        """The same where there is no model to compare with."""
        every = None if self.all_rows is None else self.all_rows.without_before
        return replace(
            self,
            before=None,
            held_out_before=None,
            leave_one_out_before=None,
            k_fold_before=None,
            folds=(),
            all_rows=every,
        )


@record
class Coverage:
    """How many of n held-out measurements lay in their bands of this level: component by component, and as a whole."""

    quantity: str  # position | orientation | pixels
    level: float
    components: Share
    whole: Share
    n: int

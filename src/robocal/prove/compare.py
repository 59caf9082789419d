"""Several estimators on the same data and the same split, side by side.

Every method identifies as it would alone: start, noise and selection are its own, only the held-out configurations are the
same. Below 25 configurations nothing is held out and every method is refitted without each configuration in turn; above,
leave-one-out is told where it costs little (see `estimators.batched`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal.diagnose.limits import HOLD_OUT_PLACES
from robocal.errors import ModelError
from robocal.fit.estimators import describe_end, estimator
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch, tell
from robocal.prove.identify import Identification, identify
from robocal.prove.results import RowTable
from robocal.prove.statistics import Statistic

__all__ = ["DEFAULT", "MethodComparison", "MethodEntry", "compare", "entry_beside"]

DEFAULT = ("lm", "ekf", "particle", "pinv", "lse", "ekf-100")


@record
class MethodEntry:
    """One method: its errors (m, or the first unit that was measured), its verdict, the parameter that ends farthest from
    the reference in the reference's sigmas, the seconds that the whole identification took, and what it leaves of every row;
    `failed` says why there is nothing."""

    method: str
    title: str
    verdict: str = ""
    reason: str = ""
    stopped: bool = False  # without converging
    after: Statistic | None = None
    held_out: Statistic | None = None
    leave_one_out: Statistic | None = None
    k_fold: Statistic | None = None
    farthest: str = ""
    sigmas: float | None = None
    seconds: float | None = None
    failed: str = ""
    rows: RowTable | None = None


@record
class MethodComparison:
    """The methods; the first is the reference. `before`, `held_out_before`, `leave_one_out_before` are the frames-only
    model, `constant` predicting the mean."""

    unit: str
    methods: tuple[MethodEntry, ...]
    before: Statistic | None
    held_out_before: Statistic | None
    leave_one_out_before: Statistic | None
    constant: Statistic | None
    k_fold_before: Statistic | None = None

    @property
    def reference(self) -> str:
        """The first method that found anything."""
        return next(e.method for e in self.methods if not e.failed)


def compare(
    model: Model,
    data: DataSet,
    methods: Sequence[str],
    options: Options | None = None,
    *,
    known: tuple[Identification[Model], float] | None = None,
    watch: Watch | None = None,
) -> MethodComparison:
    """Identifies with every method in turn; a method that cannot is told as failed. `known` is an identification that was
    done already, with its seconds. Raises ModelError for an unknown name, and when no method works."""
    # The bootstrap is told of the chosen method alone, and not every method knows it.
    options = replace(options or Options(), bootstrap=None)
    for name in methods:
        estimator(name)
    few = len(np.unique(places(data.configurations))) < HOLD_OUT_PLACES
    # With a fifth held out the proof is the same for all; leave-one-out is a gift where it is cheap.
    if few and options.leave_one_out is None and options.folds is None:
        options = replace(options, leave_one_out=True)

    def time_identification(own: Options) -> tuple[Identification[Model], float]:
        """An identification and its seconds; what is known is not done again, unless it lacks leave-one-out."""
        same = known is not None and known[0].options.method == own.method
        if known and same and (own.leave_one_out is not True or known[0].stages[0].leave_one_out is not None):
            return known
        clock = time.perf_counter()
        made: Identification[Model] = identify(model, data, own, watch)
        return made, time.perf_counter() - clock

    first: Identification[Model] | None = None
    entries = []
    for name in dict.fromkeys(methods):
        tell(watch, "compare", what=name)
        title = estimator(name).title
        try:
            found, seconds = time_identification(replace(options, method=name))
        except (ModelError, np.linalg.LinAlgError) as error:
            entries.append(MethodEntry(name, title, failed=str(error)))
            continue
        first = first or found
        entries.append(_entry(found, first, title, seconds))
    if first is None:
        raise ModelError("none of these methods can identify this", key="--compare", found=entries[0].failed)
    s = first.stages[0]
    return MethodComparison(
        s.unit, tuple(entries), s.before, s.held_out_before, s.leave_one_out_before, s.constant, s.k_fold_before
    )


def entry_beside(
    name: str, title: str, found: Identification[Model], reference: Identification[Model], seconds: float
) -> MethodEntry:
    """An identification that came about in another way, beside the reference. It may have fewer rows, so that these do not stand there."""
    return replace(_entry(found, reference, title, seconds), method=name, rows=None)


def _entry(found: Identification[Model], reference: Identification[Model], title: str, seconds: float) -> MethodEntry:
    farthest, sigmas = _farthest(found, reference) if found is not reference else ("", None)
    s = found.stages[0]
    reason, stopped = describe_end(found.options.method, found.reason)
    return MethodEntry(
        found.options.method, title, found.verdict.status, reason, stopped, after=s.after, held_out=s.held_out,
        leave_one_out=s.leave_one_out, k_fold=s.k_fold, farthest=farthest, sigmas=sigmas, seconds=round(seconds, 3), rows=found.rows,
    )  # fmt: skip


def _farthest(found: Identification[Model], reference: Identification[Model]) -> tuple[str, float | None]:
    """The parameter whose value differs most, in sigmas of the reference; those that it did not fit have none."""
    ours = {p.name: p for p in found.parameters}
    away = {
        p.name: abs(ours[p.name].delta - p.delta) / p.sigma
        for p in reference.parameters
        if p.sigma and p.name in ours and np.isfinite(ours[p.name].delta)
    }
    if not away:
        return "", None
    name = max(away, key=lambda n: away[n])
    return name, away[name]

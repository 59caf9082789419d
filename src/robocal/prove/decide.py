"""What is decided of a machine from its measurements: the model that is handed back, what was proven of it, and the verdict.

1 split    fit and held-out configurations, in one round or several
2 gross    rows that belong to no others are set aside (see `gross`)
3 start    closed form for frames and targets, refined together: the baseline
4 fit      what is seen above the noise, on the fit configurations (see `fit`)
5 judge    paired comparison with the baseline on configurations that were not used
6 refit    once more on everything, for the model that is handed back

Whatever can change the status of the verdict is here. What is told beside it (see `identify`) is not: a study of thousands of
identifications asks for the status and for the errors of what was not used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal.diagnose.gross import set_aside
from robocal.diagnose.late import Late, late, punctual
from robocal.diagnose.limits import HOLD_OUT_PLACES, HOLD_OUT_SHARE
from robocal.diagnose.motions import lacking
from robocal.diagnose.numbers import Held, held_number, questioned
from robocal.diagnose.scale import Scale, scale_of, scaled
from robocal.diagnose.segments.find import Segment, find_segments, refused_by
from robocal.diagnose.verdict import Verdict
from robocal.errors import ModelError
from robocal.estimate.uncertainty import Total
from robocal.fit.baseline import Baseline, known_baseline, renoised
from robocal.fit.fit import Fit, fit, posed_again
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.fit.starts.own import placed
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine
from robocal.prove.bands import total_of
from robocal.prove.judge import unseen_of, verdict
from robocal.prove.prove import Proven, prove
from robocal.prove.region import Holds, qualified
from robocal.prove.split import make_split
from robocal.prove.statistics import Statistic
from robocal.prove.zeros import with_zeros

__all__ = ["Decision", "decide"]

Array = NDArray[np.float64]
M = TypeVar("M", bound=Machine)
Watch = Callable[[dict[str, object]], None]


@dataclass(frozen=True)
class Decision(Generic[M]):
    """A fit to all measurements but gross rows, which `data` marks, from `start` (1, P), the baseline beside it, and what was
    proven; the options are those that were used."""

    model: M
    data: DataSet
    options: Options
    start: Array
    base: Baseline
    whole: Fit
    proven: Proven

    @cached_property
    def off(self) -> Total:
        """What the parameters may be off by."""
        return total_of(self.whole)

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters at the solution."""
        return dict(zip(self.whole.problem.table.names, map(float, self.whole.solution.x[0]), strict=False))

    @cached_property
    def corrected(self) -> M:
        """The model with what was found."""
        return self.model.with_values({n: v for n, v in self.values.items() if n in self.model.table})

    @cached_property
    def scale(self) -> Scale | None:
        """Of the fitted lengths, all together."""
        return scale_of(self.model, self.whole, self.off)

    @cached_property
    def held_number(self) -> Held | None:
        """The stated number that the data contradict most."""
        return held_number(self.model, self.whole)

    @cached_property
    def late(self) -> Late | None:
        """Readings of a moving arm that belong to another moment than its joint values."""
        return late(self.model, self.whole)

    @cached_property
    def moved(self) -> tuple[Segment, ...]:
        """What stood elsewhere for a part of the file."""
        return find_segments(self.model, self.data, self.values)

    @cached_property
    def _judged(self) -> Verdict:
        proven = self.proven
        found = verdict(
            self.model,
            self.data,
            proven.base,
            proven.part,
            self.whole,
            proven.proofs,
            self.options,
            self.base.converged,
        )
        few = lacking(self.model, self.whole)
        return found if few is None else found.refused(few)

    def verdict(self, holds: Holds | None = None) -> Verdict:
        """Whether the model improved; where the correction `holds` is said of an improvement, and changes no status."""
        found = punctual(questioned(scaled(self._judged, self.scale), self.held_number), self.late)
        return refused_by(self.moved, qualified(found, holds))

    def unseen(self, unit: str) -> tuple[Statistic, Statistic] | None:
        """The errors, before and after, of what was held out, or else left out one by one; None where nothing was."""
        proofs = self.proven.proofs
        for name in ("held_out", "leave_one_out"):
            before, after = unseen_of(proofs[name], unit) if name in proofs else (None, None)
            if before is not None and after is not None:
                return before, after
        return None


def decide(model: M, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Decision[M]:
    """Fits a model to data and proves it; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if not data.observations or not len(data.configurations):
        raise ModelError("the data set holds no measurement")
    _numbers(data)
    data = placed(model, data)
    count = len(np.unique(places(data.configurations)))
    if options.hold_out is None:
        options = replace(
            options, hold_out=HOLD_OUT_SHARE if count >= HOLD_OUT_PLACES and options.folds is None else 0.0
        )
    assert options.hold_out is not None
    split = make_split(data, options.hold_out, folds=options.folds, blocks=options.blocks, seed=options.seed)
    everyone = np.arange(len(data.configurations))
    clean, by = set_aside(model, data, everyone, watch), (options.loss, options.tuning)
    begun = known_baseline(model, clean, everyone, *by, watch)
    start = posed_again(begun.problem, begun.x)
    whole = fit(model, clean, everyone, options, start, watch)
    if (likelier := with_zeros(model, whole)) is not None:
        return decide(likelier, data, options, watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    base = renoised(model, (clean, begun), whole.data, everyone, *by)
    proven = prove(model, data, clean, split, options, base, whole, watch)
    return Decision(model, clean, options, start, base, whole, proven)


def _numbers(data: DataSet) -> None:
    for obs in data.observations:
        for what, bad in (
            ("a measurement is not a finite number", ~np.isfinite(obs.value).all(axis=-1)),
            ("a sigma must be above zero", np.zeros(len(obs)) if obs.sigma is None else ~(obs.sigma > 0).all(axis=-1)),
        ):
            if bad.any():
                first = obs.configuration[np.flatnonzero(bad)[0]]
                raise ModelError(what, key=obs.label, found=f"configuration {data.configurations.ids[first]}")

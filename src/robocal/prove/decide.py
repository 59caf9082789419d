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

from dataclasses import replace
from typing import TypeVar

import numpy as np

from robocal.diagnose.gross import set_aside
from robocal.diagnose.limits import HOLD_OUT_PLACES, HOLD_OUT_SHARE
from robocal.errors import ModelError
from robocal.fit.baseline import fit_baseline, renew_baseline
from robocal.fit.fit import fit, search_poses_again
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.fit.starts.own import place_configurations
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch
from robocal.prove.decision import Decision
from robocal.prove.joint_zeros import with_zeros
from robocal.prove.prove import prove
from robocal.prove.split import make_split

__all__ = ["decide"]

M = TypeVar("M", bound=Model)


def decide(model: M, data: DataSet, options: Options | None = None, watch: Watch | None = None) -> Decision[M]:
    """Fits a model to data and proves it; see the module for the steps. Raises ModelError when nothing is free, nothing was
    measured, or a measurement is no number."""
    options = options or Options()
    if not data.observations or not len(data.configurations):
        raise ModelError("the data set holds no measurement")
    _numbers(data)
    data = place_configurations(model, data)
    count = len(np.unique(places(data.configurations)))
    if options.hold_out is None:
        options = replace(
            options, hold_out=HOLD_OUT_SHARE if count >= HOLD_OUT_PLACES and options.folds is None else 0.0
        )
    assert options.hold_out is not None
    split = make_split(data, options.hold_out, folds=options.folds, blocks=options.blocks, seed=options.seed)
    everyone = np.arange(len(data.configurations))
    clean, by = set_aside(model, data, everyone, watch), (options.loss, options.tuning)
    begun = fit_baseline(model, clean, everyone, *by, watch)
    start = search_poses_again(begun.problem, begun.x)
    whole = fit(model, clean, everyone, options, start, watch)
    if (likelier := with_zeros(model, whole)) is not None:
        return decide(likelier, data, options, watch)
    # The baseline deserves the same noise: with unstated or far too small sigmas a few rows or the angles would rule it.
    base = renew_baseline(model, (clean, begun), whole.data, everyone, *by)
    proven = prove(model, data, clean, split, options, base, whole, watch)
    return Decision(model, clean, base, whole, options, watch, start=start, proven=proven)


def _numbers(data: DataSet) -> None:
    for obs in data.observations:
        for what, bad in (
            ("a measurement is not a finite number", ~np.isfinite(obs.value).all(axis=-1)),
            ("a sigma must be above zero", np.zeros(len(obs)) if obs.sigma is None else ~(obs.sigma > 0).all(axis=-1)),
        ):
            if bad.any():
                first = obs.configuration[np.flatnonzero(bad)[0]]
                raise ModelError(what, key=obs.label, found=f"configuration {data.configurations.ids[first]}")

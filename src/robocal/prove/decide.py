"""What is decided of a machine from its measurements: the model that is handed back, what was proven of it, and the verdict.

1 split    fit and held-out configurations, in one round or several
2 gross    rows that belong to no others are set aside (see `gross`)
3 start    closed form for frames and targets, refined together: the baseline
4 fit      what is seen above the noise, on the fit configurations (see `fit`)
5 judge    paired comparison with the baseline on configurations that were not used
6 refit    once more on everything, for the model that is handed back

Whatever can change the status of the verdict is here. What is told beside it (see `identify`) is not: a study of thousands of
identifications asks for the status and for the errors of what was not used.

A joint's zero that may be lost, where a length that looks like it moved as no making leaves it.

A joint that lost its zero may be off by any angle, a length by what making leaves. What looks alike is kept by the effect of its
expected error, often the length; once that has moved by more than ZERO_CHANGE times its own, the zero is the likelier cause, and the
one that a controller takes: it is expected to be off by ZERO_LOST, and the fit is made again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from robocal.diagnose.gross import set_aside
from robocal.diagnose.limits import HOLD_OUT_PLACES, HOLD_OUT_SHARE, ZERO_CHANGE, ZERO_LOST, ZERO_SIGMA
from robocal.errors import ModelError
from robocal.fit.baseline import fit_baseline, renew_baseline
from robocal.fit.fit import fit, search_poses_again
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.fit.starts.own import place_configurations
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch
from robocal.prove.bands import total_of
from robocal.prove.decision import Decision
from robocal.prove.prove import prove
from robocal.prove.split import make_split

__all__ = ["decide"]
if TYPE_CHECKING:
    from robocal.fit.fit import Fit


def with_zeros(model: M, fit: Fit) -> M | None:
    """The model with those zeros expected to be lost that look like what moved too far; None where there are none."""
    table, x = fit.problem.table, fit.solution.x[0]
    own = set(fit.problem.free) & (set(model.geometric) - model.anywhere)
    change = {n: abs(float(x[table.index[n]]) - model.table[n].value) for n in own}
    far = {n for n in own if change[n] > ZERO_CHANGE * model.table[n].scale}
    if not far:
        return None
    # A zero with a stated prior is where its owner says.
    moving = model.mechanism
    if moving is None:
        return None
    zeros = {z.parameter: model.table[z.parameter] for z in moving.open_zeros}
    lost = {
        n: ZERO_LOST[z.unit]
        for n, z in zeros.items()
        if z.prior is None and z.unit in ZERO_LOST and z.scale < ZERO_LOST[z.unit]
    }
    alike = {c.name: far & {n for n, _ in c.partners} for c in fit.identifiability.combinations if c.name in lost}
    if not any(alike.values()):
        return None
    off = total_of(fit)
    sigma = dict(zip(off.names, off.sigma, strict=True))
    likely = {name: lost[name] for name, like in alike.items() if any(change[n] > ZERO_SIGMA * sigma[n] for n in like)}
    if not likely:
        return None
    return model.with_table(model.table.with_expected(likely))


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

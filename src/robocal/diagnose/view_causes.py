"""Why a view does not belong to the others: what the model predicts of its points from the configurations of other views.

A view fits a configuration where the median error of its points is of the size of the noise, and a fraction of what it is at its own.
Two views that fit each other's are exchanged. One that fits another's alone has the wrong number, or its joint values are another's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import replace
from robocal._types import Array, Ints
from robocal.diagnose.camera_changes import half_turn, half_turns_open, turn_views
from robocal.diagnose.limits import EXPLAINED_CLEARLY, VIEW_FITS
from robocal.estimate.problem import Problem
from robocal.fit.noise import median, owners
from robocal.measure.base import kind_of, predict_rows
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity, Remark

__all__ = ["VIEW_ALONE", "VIEW_ELSEWHERE", "VIEW_EXCHANGED", "causes_of_views"]

VIEW_EXCHANGED = declare(
    "view-exchanged",
    "views {view} and {partner} of {instrument} fit each other's place: exchanged (error {stated:.3g} to {left:.3g})",
    "Exchange the joint values of the two, or the numbers of their images.",
)
VIEW_ELSEWHERE = declare(
    "view-elsewhere",
    "view {view} of {instrument} fits the place of view {partner} (error {stated:.3g} to {left:.3g})",
    "Give the view the joint values of its own moment, or leave it out.",
)
VIEW_ALONE = declare(
    "view-alone",
    "view {view} of {instrument} is off as a whole: its joint values or its image are of another moment, or something moved",
    "Leave the view out, or measure it again.",
)
POINTS = 9  # grid: points of a view that are looked at
MOST = 50  # grid: views that are looked at
PLACES = 500  # grid: places at which a view is tried


def causes_of_views(
    model: Model, data: DataSet, own: int, views: Sequence[Ints], problem: Problem, x: Array
) -> list[Remark]:
    """The likeliest cause of every one of some views, rows (n,) each, of the observations `own`."""
    obs, ids = data.observations[own], data.configurations.ids
    here = [int(obs.configuration[rows[0]]) for rows in views]
    tried = views[:MOST] if obs.value.ndim == 2 else ()
    places = np.unique(np.append(np.unique(obs.configuration)[:PLACES], here[:MOST]).astype(np.int64))
    noise = _noise(data, own, problem, x) if tried else 0.0
    stated: dict[int, float] = {}
    fits: dict[
        int, dict[int, float]
    ] = {}  # of every view the places that it fits, the best first, each with what it leaves
    for rows, c in zip(tried, here, strict=False):
        some = rows[np.unique(np.linspace(0, len(rows) - 1, POINTS).astype(np.int64))]
        error = _errors(model, data, obs, some, places, problem, x)
        stated[c] = float(error[np.searchsorted(places, c)])
        good = [i for i in np.argsort(error) if error[i] <= min(VIEW_FITS * noise, stated[c] / EXPLAINED_CLEARLY)]
        if good:
            fits[c] = {int(places[i]): float(error[i]) for i in good}
    # A pose that is visited again is as good a place: partners are two of which each fits where the other is.
    partner: dict[int, int] = {}
    for c, found in fits.items():
        mutual = [to for to in found if to not in partner and c in fits.get(to, ())]
        if mutual and c not in partner:
            partner |= {c: mutual[0], mutual[0]: c}
    out = []
    for c in here:
        names = {"view": ids[c], "instrument": obs.label}
        if c not in fits:
            out.append(Remark.of(VIEW_ALONE, **names))
            continue
        to = partner.get(c, next(iter(fits[c])))
        code = VIEW_EXCHANGED if c in partner else VIEW_ELSEWHERE
        before, after = (Quantity(e, kind_of(obs).parts[0][2]) for e in (stated[c], fits[c][to]))
        out.append(Remark.of(code, partner=ids[to], stated=before, left=after, **names))
    return out


def _noise(data: DataSet, own: int, problem: Problem, x: Array) -> float:
    """The median error of the rows of one instrument that were used."""
    start, stop, _ = kind_of(data.observations[own]).parts[0]
    pairs = zip(owners(data, problem), problem.residuals(x), strict=True)
    errors = [np.linalg.norm(r.value[t.used, start:stop], axis=1) for (o, t), r in pairs if o == own]
    every = np.concatenate(errors)
    return median(every) if len(every) else 0.0


def _errors(
    model: Model, data: DataSet, obs: Observations, rows: Ints, places: Ints, problem: Problem, x: Array
) -> Array:
    """The median error of some rows if they were seen from each of some configurations, (C,)."""
    start, stop, _ = kind_of(obs).parts[0]
    there = replace(obs.take(np.tile(rows, len(places))), configuration=np.repeat(places, len(rows)))
    labels = [there]
    if half_turns_open(obs) and (turn := half_turn(obs)) is not None:
        # At a wrong place half a turn may have been undone, or not, by chance.
        labels.append(turn_views(there, turn, np.ones(len(data.configurations), dtype=np.bool_)))
    each = [(predict_rows(model, data, o, problem.table, x) - o.value)[:, start:stop] for o in labels]
    medians = [np.median(np.linalg.norm(off, axis=1).reshape(len(places), -1), axis=1) for off in each]
    return np.asarray(np.min(medians, axis=0))

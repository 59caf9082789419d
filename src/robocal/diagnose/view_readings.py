"""Views beside readings of another configuration, of a machine whose poses are found from both: an image beside other lengths.

    e_ij = rms over sensors s of (h_s(X_i) - y_js) / sigma_s,    X_i the pose that the views of configuration i alone give

A view is where it belongs where e_ii is of the size of most. One that is not, and fits the readings of another configuration j, belongs
there; two that fit each other's are exchanged. Where it fits none, a view that is where it belongs may fit what stands beside it:
readings that were taken twice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array
from robocal.diagnose.check_registry import Context, Finding, Machines, When, check, doubt
from robocal.diagnose.exchanged_views import VIEWS_EXCHANGED, far_views, places_of_views, readings_of_views
from robocal.estimate.least_squares import least_squares
from robocal.fit.noise import owners
from robocal.fit.pose_search import search_single_poses
from robocal.measure.base import Rows, kind_of
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.remarks.english import declare
from robocal.remarks.remark import Number, Quantity

__all__ = ["READINGS_OF_ANOTHER", "VIEW_OF_ANOTHER"]

VIEW_OF_ANOTHER = declare(
    "view-of-another",
    "the view {view} of {instruments} stands beside the readings of another configuration: it fits those of {partner} to {left:.3g} rms, "
    "and its own to {stated:.3g}",
    "Give the image the readings of its own moment in {files}, or leave it out.",
)

READINGS_OF_ANOTHER = declare(
    "readings-of-another",
    "the readings beside the view {view} of {instruments} are those of {partner}: the view there fits them to {left:.3g} rms, {view} to "
    "{stated:.3g}",
    "Give {view} the readings of its own moment in {files}, or leave it out.",
)


@check("view-readings", When.FIT, order=16, needs=("data", "fit"), machines=Machines.POSED)
def views_of_others(context: Context[Model]) -> Iterator[Finding]:
    """Every view that fits the readings of another configuration."""
    data = context.need_data
    seeing = [i for i, o in enumerate(data.observations) if kind_of(o).views]
    labels = tuple(dict.fromkeys(data.observations[i].label for i in seeing))
    error = _errors(context, data, seeing)
    if error is None:
        return
    ids = data.configurations.ids
    files = tuple(dict.fromkeys(data.observations[i].source.replace("\\", "/").rpartition("/")[2] for i in seeing))
    for i, j, mutual in places_of_views(error):
        amounts = {"stated": Quantity(float(error[i, i]), "m"), "left": Quantity(float(error[i, j]), "m")}
        said: dict[str, Number] = {"view": ids[i], "partner": ids[j], "instruments": labels, "files": files}
        if mutual:
            yield doubt(VIEWS_EXCHANGED, **said, every=None, **amounts)
        else:
            yield doubt(VIEW_OF_ANOTHER, **said, **amounts)
    rest = (o for k, o in enumerate(data.observations) if k not in seeing)
    read = tuple(dict.fromkeys(o.source.replace("\\", "/").rpartition("/")[2] for o in rest))
    for i, j in readings_of_views(error):
        amounts = {"stated": Quantity(float(error[i, i]), "m"), "left": Quantity(float(error[j, i]), "m")}
        yield doubt(READINGS_OF_ANOTHER, view=ids[i], partner=ids[j], instruments=labels, files=read, **amounts)


def _errors(context: Context[Model], data: DataSet, seeing: list[int]) -> Array | None:
    """What readings of configuration j leave at the pose that views alone give of i, rms (U, U); NaN where one of them is not known. None
    where views have no other readings beside them."""
    fit = context.need_fit
    terms = list(owners(data, fit.problem))
    beside = [t for i, t in terms if i not in seeing and t.scale.shape[1] == 1 and t.touches[0]]
    if not seeing or not beside:
        return None
    alone = fit.problem.with_terms([t.with_every_row() for _, t in terms])
    alone = alone.without([np.full(len(t.index), i not in seeing) for i, t in terms])
    alone = alone.with_free(()).with_loss("huber")
    x = least_squares(alone, fit.solution.x, max_iterations=30, cost_tolerance=1e-6).x
    error = _leave(context, data, terms, beside, seeing, x)
    # A pose that the readings have drawn away may have ended in another valley of its view.
    off = far_views(np.diag(error))
    return error if not off.any() else _leave(context, data, terms, beside, seeing, search_single_poses(alone, x, off))


def _leave(
    context: Context[Model],
    data: DataSet,
    terms: Sequence[tuple[int, Rows]],
    beside: Sequence[Rows],
    seeing: Sequence[int],
    x: Array,
) -> Array:
    """The same of poses at x (1, P)."""
    count = len(data.configurations)
    seen = np.zeros(count, dtype=bool)
    for i in seeing:
        seen[data.observations[i].configuration] = True
    square, many = np.zeros((count, count)), np.zeros((count, count))
    for number, term in terms:
        if term not in beside:
            continue
        obs = data.observations[number]
        word = next((w for w in context.model.parts if w in obs.extra), None)
        sensor = np.zeros(len(term.index)) if word is None else obs.extra[word][term.index]
        predicted = term.predict(x)[:, 0]
        for s in np.unique(sensor):
            mine = np.flatnonzero(sensor == s)
            here, there = np.full(count, np.nan), np.full(count, np.nan)
            here[term.configuration[mine]], there[term.configuration[mine]] = predicted[mine], term.value[0, mine, 0]
            off = here[:, None] - there[None]
            ok = np.isfinite(off)
            square[ok] += off[ok] ** 2
            many += ok
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(seen[:, None] & (many > 0), np.sqrt(square / many), np.nan)

"""Half turns of a target that looks the same after them, undone view by view where the data file asks for it (`half_turns: undo`).

    labels = signs by the votes of `camera_changes`,    of every camera as it is or all of it turned, whichever leaves least
    a view is turned where the median error of its points is smaller so, with frames fitted to all views by a robust loss

Of one camera nothing tells a board from the same board turned in every view; then most views stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from robocal._record import replace
from robocal._types import Array, Bools
from robocal.diagnose.camera_changes import half_turn, turn_views
from robocal.diagnose.camera_views import ViewSearch, thin
from robocal.fit.baseline import fit_baseline
from robocal.geometry import se3
from robocal.measure.base import predict_rows
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, freedom_of
from robocal.measure.pixels import HALF_TURNS
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["half_turns_open", "undo_half_turns"]

POINTS = 9  # grid: points of a view that tell its label
Turned = dict[int, Bools]  # configurations (U,) that are turned, by number of the observations


def half_turns_open(obs: Observations) -> bool:
    """Whether a view may count its target from either end, and the data file says so."""
    return bool(obs.options.get(HALF_TURNS))


def undo_half_turns(model: Model, data: DataSet) -> tuple[DataSet, Turned]:
    """The data with half turns undone, and which configurations (U,) were turned in each of the observations that ask for it."""
    asked = [i for i, o in enumerate(data.observations) if half_turns_open(o)]
    turns = {i: t for i in asked if (t := half_turn(data.observations[i])) is not None}
    if not turns:
        return data, {}
    search = ViewSearch(model, data, tuple(turns))
    marked = [{i: m for i, (_, m) in c.turned.items()} for c in search.turns(tuple(turns))]
    some = marked or [{i: np.zeros(len(data.configurations), dtype=np.bool_) for i in turns}]
    if not all(_may_turn(data.observations[i]) for i in turns):
        some = [*some, *({i: ~m for i, m in each.items()} for each in some)]
    read = [{i: partial(turn_views, turn=turns[i], views=m) for i, m in each.items()} for each in some]
    left = [float(search.fit(change).left.sum()) for change in read] if len(read) > 1 else [0.0]
    chosen = some[int(np.argmin(left))]
    if freedom_of(model) is None:
        chosen = _settle(model, _turn(data, chosen, turns), chosen, turns)
    return _turn(data, chosen, turns), chosen


def _settle(model: Model, made: DataSet, turned: Turned, turns: Mapping[int, Array]) -> Turned:
    """Which views are turned by the frames that most of the views tell, where `made` has the labels of `turned`; of all of them and
    none by what the data file states of the target."""
    every = np.arange(len(made.configurations))
    few = DataSet(made.configurations, tuple(thin(o, every, POINTS) for o in made.observations))
    out = {}
    if all(_may_turn(made.observations[i]) for i in turned):
        # A free tool would take the turn of a target that hangs on it.
        model = model.with_table(model.table.with_free(()))
    with np.errstate(all="ignore"):
        base = fit_baseline(model, few, every, "tukey")
        for i, mine in turned.items():
            obs = few.observations[i]
            other = turn_views(obs, turns[i], np.ones(len(every), dtype=np.bool_))
            as_is, around = (
                _errors(predict_rows(model, few, o, base.problem.table, base.x), o, len(every)) for o in (obs, other)
            )
            out[i] = mine ^ (around < as_is)
    values = dict(zip(base.problem.table.names, map(float, base.x[0]), strict=False))
    if all(_stated_around(made.observations[i], values, turn) for i, turn in turns.items()):
        return {i: ~mine for i, mine in out.items()}
    return out


def _may_turn(obs: Observations) -> bool:
    """Whether the target may be turned as a whole, as it is where nobody knows how it stands."""
    return all(all(t.free[3:]) for t in obs.targets)


def _stated_around(obs: Observations, values: Mapping[str, float], turn: Array) -> bool:
    """Whether the target is stated nearer to where it would be found with half a turn in every view."""
    for t in obs.targets:
        if _may_turn(obs) and any(t.value):
            stated = se3.from_vector(t.value)[:3, :3]
            found = se3.from_vector([values[f"{t.name}.{s}"] for s in FRAME_SYMBOLS])[:3, :3]
            return bool(np.trace(stated.T @ found) < np.trace(stated.T @ found @ turn[:3, :3]))
    return False


def _turn(data: DataSet, turned: Turned, turns: Mapping[int, Array]) -> DataSet:
    seen = [turn_views(o, turns[i], turned[i]) if i in turned else o for i, o in enumerate(data.observations)]
    return replace(data, observations=tuple(seen))


def _errors(predicted: Array, obs: Observations, count: int) -> Array:
    """The median error of the points of so many configurations; not a number where none was seen."""
    off = np.linalg.norm(predicted - obs.value, axis=1)
    out = np.full(count, np.nan)
    for c in np.unique(obs.configuration):
        out[c] = np.median(off[obs.configuration == c])
    return out

"""Half turns of a target that looks the same after them, undone view by view where the data file asks for it (`half_turns: undo`).

    labels    by the votes of `camera_changes`, camera by camera
    a view    is turned where the median error of its points is smaller so, with frames fitted to all views of its camera by a robust loss
    all views of a camera may be turned where the target is free: nothing but what is stated of it, or another camera, says which way it is.
              Where the target is known, |mean of R_T R_X R_Y^T| is greater of the right labels: T the machine's pose, X the target's, Y the
              target's in the camera

Without any of these most views stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools
from robocal.diagnose.camera_changes import ViewPoses, half_turn, half_turns_open, turn_views, turned_views, view_poses
from robocal.diagnose.camera_views import carriers
from robocal.diagnose.view_blocks import subsample_views
from robocal.fit.baseline import fit_baseline
from robocal.geometry import se3
from robocal.measure.base import predict_rows
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, freedom_of
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["undo_half_turns"]

POINTS = 9  # grid: points of a view that tell its label
FEWEST = 3  # grid: views that vote


def undo_half_turns(model: Model, data: DataSet) -> tuple[DataSet, dict[int, Bools]]:
    """The data with half turns undone, and which configurations (U,) were turned in each of the observations that ask for it."""
    asked = [i for i, o in enumerate(data.observations) if half_turns_open(o)]
    if not asked:
        return data, {}
    seen, turned = list(data.observations), dict[int, Bools]()
    targets: dict[str, Array] = {}  # how each stands that is free, as the first camera has it
    carrier = carriers(model, data)
    for i in asked:
        obs = data.observations[i]
        turn = half_turn(obs)
        if turn is None or carrier is None:
            continue
        found = _Labels(obs, turn, _vote(obs, turn, carrier))
        if not freedom_of(model):
            found = found.settle(model, data, targets)
        seen[i], turned[i] = turn_views(obs, turn, found.turned), found.turned
    return replace(data, observations=tuple(seen)), turned


def _vote(obs: Observations, turn: Array, carrier: Array) -> Bools:
    """Which configurations (U,) are turned against most of the others, or against a target that is known."""
    views, out = view_poses(obs), np.zeros(len(carrier), dtype=np.bool_)
    if len(views.configuration) < FEWEST:
        return out
    mine = turned_views(views, turn, carrier[views.configuration])
    if not _may_turn(obs):
        one, other = (_concentration(obs, views, turn, some, carrier) for some in (mine, ~mine))
        mine = ~mine if other > one else mine
    out[views.configuration[mine]] = True
    return out


def _may_turn(obs: Observations) -> bool:
    """Whether the target may be turned as a whole: nobody says how it stands."""
    return all(all(t.free[3:]) for t in obs.targets)


def _concentration(obs: Observations, views: ViewPoses, turn: Array, turned: Bools, carrier: Array) -> float:
    """How well the views agree on how the camera stands, where the target is as stated: the norm of the mean of rotations."""
    y = np.where(turned[:, None, None], views.pose @ turn, views.pose)[:, :3, :3]
    x = se3.from_vector(obs.targets[0].value)[:3, :3] if obs.targets else np.eye(3)
    t = carrier[views.configuration][:, :3, :3]
    t = t.swapaxes(1, 2) if obs.frame is not None and obs.frame.mount == "tool" else t
    return float(np.linalg.norm((t @ x @ y.swapaxes(1, 2)).mean(axis=0)))


@record(eq=False)
class _Labels:
    """The views of one camera that count their target from its other end, as configurations (U,)."""

    obs: Observations
    turn: Array
    turned: Bools

    def settle(self, model: Model, data: DataSet, targets: dict[str, Array]) -> _Labels:
        """The same by the frames that most of the views tell; `targets` has how free ones stand, and learns of another."""
        if _may_turn(self.obs):
            # A free tool would take the turn of a target that hangs on it.
            model = model.with_table(model.table.with_free(()))
        where = np.unique(self.obs.configuration)
        few = DataSet(
            data.configurations, (subsample_views(turn_views(self.obs, self.turn, self.turned), where, POINTS),)
        ).take(where)
        obs, every = few.observations[0], np.ones(len(where), dtype=np.bool_)
        with np.errstate(all="ignore"):
            base = fit_baseline(model, few, np.arange(len(where)), "tukey")
            as_is, around = (
                _errors(predict_rows(model, few, o, base.problem.table, base.x), o, len(where))
                for o in (obs, turn_views(obs, self.turn, every))
            )
        turned = self.turned.copy()
        turned[where[around < as_is]] ^= True
        values = dict(zip(base.problem.table.names, map(float, base.x[0]), strict=False))
        return replace(self, turned=~turned if self._stands_around(values, targets) else turned)

    def _stands_around(self, values: Mapping[str, float], targets: dict[str, Array]) -> bool:
        """Whether the target stands nearer to where it should be with half a turn in every view."""
        if not _may_turn(self.obs) or len(self.obs.targets) != 1:
            return False
        (target,) = self.obs.targets
        found = se3.from_vector([values[f"{target.name}.{s}"] for s in FRAME_SYMBOLS])[:3, :3]
        stated = se3.from_vector(target.value)[:3, :3] if any(target.value) else found
        known = targets.setdefault(target.name, stated)
        return bool(np.trace(known.T @ found) < np.trace(known.T @ found @ self.turn[:3, :3]))


def _errors(predicted: Array, obs: Observations, count: int) -> Array:
    """The median error of the points of so many configurations; not a number where none was seen."""
    off = np.linalg.norm(predicted - obs.value, axis=1)
    out = np.full(count, np.nan)
    for c in np.unique(obs.configuration):
        out[c] = np.median(off[obs.configuration == c])
    return out

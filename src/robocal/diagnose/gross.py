"""Gross rows: found before anything is judged, and set aside for baseline, noise, fit and proof alike.

    1 nominal   frames, targets and tool are fitted to the nominal robot, robustly; rows beyond six robust sigma of what is left
                do not pull at the next stage (a dropped beam, a wrong point: metres away)
    2 free      everything free is fitted robustly (Huber, then Tukey at six sigma), softly held as where the noise is assessed;
                every row is then compared with a fit without it (`studentise`), and those that are far by the robust sigma of their sensor
                group and unit are set aside; the fit is repeated without them until the same rows stay out

Of many rows both stages begin on a part (`thin`); the last robust fit, and what is said of every row, are of all of them.
A row that was set aside at one stage comes back at the next one where it fits. Where every sigma is stated, the soft fit by which
the noise is assessed is looked at first: if it leaves no more than that, and no row near six sigma, no robust fit would set one aside.
Constraints (a known distance between sockets) are never gross: nothing read them. Rows stay in the data, unused: they weigh nothing,
and are predicted like all others.

The leak, and how it is closed. A fit may set aside what does not fit it among the rows that it is fitted to; if it were asked
which *held-out* rows are gross, it would dismiss its own failures. So each round of a proof looks for gross rows among
the rows that it fits, and knows no others; and a held-out row is left out of the comparison only where neither the baseline nor
the identified model, each fitted without that row and measured by its own robust scale, comes near it (`neither`). What one
of the two explains, counts. In k-fold and leave-one-out, which keep the columns and noise of the fit to everything, the fit
without a row is that of `studentise`: by deletion where it was used, as it is where it was set aside.
Sources: Tukey's biweight, Holland and Welsch (1977); Rousseeuw and Leroy, Robust regression and outlier detection (1987).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.agreed_views import agreed_views
from robocal.diagnose.drawn_poses import restore_poses
from robocal.diagnose.limits import GROSS_DISTANCE
from robocal.diagnose.rounding import add_rounding
from robocal.diagnose.studentised import StudentisedResiduals, far_from, studentise
from robocal.diagnose.view_blocks import join_views
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import effective_columns
from robocal.fit.baseline import Baseline, baseline, frame_names
from robocal.fit.fit import Fit, chosen_weights, search_poses_again
from robocal.fit.noise import Tau, assess, by_observation, owners, same_tau, tau_of, under
from robocal.fit.pose_search import search_costly_poses
from robocal.fit.soft_fit import NEAR, find_noise, recall_rounds, soften, tries_noise
from robocal.fit.subsample import subsample
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, freedom_of
from robocal.progress import Watch, tell

__all__ = ["Sifted", "neither", "set_aside", "share", "sift"]

ROUNDS = 8  # grid
AGREED = 0.5  # tolerance: of the noise, its parts multiplied: where views agree on something else, clearly better
SETTLED = 0.05  # tolerance: of a robust sigma: so well it need be known here
# tolerance: standard deviations: a robust fit and a plain one of such noise predict no row so differently that it would be six
CALM = 5.0
LEVER = 0.9  # tolerance: leverage of a row from which on it does, for the others hardly know it


@record
class _GrossSearch:
    """Data, and the configurations whose rows are fitted."""

    model: Model
    data: DataSet
    configurations: Ints

    def problem_at(self, tau: Tau, used: Sequence[Bools], loss: str, tuning: float | None = None) -> Problem:
        noisy = under(self.whole_problem, self.data, tau)
        aside = [~used[own][term.index] for own, term in owners(self.data, noisy)]
        return noisy.without(aside).with_loss(loss, tuning)

    @cached_property
    def whole_problem(self) -> Problem:
        """The problem with every row and the sigma that was stated."""
        every = mark_used(self.data, [np.ones(len(o), dtype=bool) for o in self.data.observations])
        return build(self.model, every).with_weights(chosen_weights(len(self.data.configurations), self.configurations))

    def noise(self, problem: Problem, x: Array, columns: float) -> Tau:
        """tau of every group, from medians."""
        return tau_of(assess(self.data, problem.with_loss("huber"), x, self.configurations, columns))


@record
class Sifted:
    """The data with gross rows marked, and how far every row is from a soft fit of everything free: the problem of that fit,
    where it ended, x (1, P), and the farness of its rows."""

    data: DataSet
    problem: Problem
    x: Array
    away: StudentisedResiduals


def set_aside(model: Model, data: DataSet, configurations: Ints, watch: Watch | None = None) -> DataSet:
    """The data with the gross rows among those of some configurations marked as not used."""
    every = mark_used(data, [np.ones(len(o), dtype=bool) for o in data.observations])
    if (found := _fit_within_noise(model, every, configurations)) is None:
        return sift(model, data, configurations, watch).data
    tell(watch, "gross")
    return add_rounding(model, every, *found)


def _fit_within_noise(model: Model, data: DataSet, configurations: Ints) -> tuple[Problem, Array] | None:
    """The problem of data with every row, and where a soft fit of everything free ends, x (1, P), if it leaves the stated noise and no
    row that may be gross; None where one may, and where a look at few rows would not tell: of many rows some are far by chance, and
    poses of their own follow a gross one."""
    if not tries_noise(model, data):
        return None
    start = baseline(model, data, configurations)[1]
    fitted = chosen_weights(len(data.configurations), configurations)
    made = build(model, data).with_weights(fitted)
    tau, x = find_noise(
        made, data, configurations, start, start, recall_rounds(model, data, configurations, start), little=True
    )
    if tau:
        return None
    soft = soften(made, start)
    away = studentise(soft, x)
    for term, d, h in zip(soft.terms, away.distance, away.leverage, strict=True):
        mine = fitted[0, term.configuration] > 0
        if (d[mine] > CALM).any() or (h[mine] > LEVER).any():
            return None
    return made, x


def sift(model: Model, data: DataSet, configurations: Ints, watch: Watch | None = None) -> Sifted:
    """The data with the gross rows among those of some configurations marked as not used; see the module. Rows of others
    are not judged."""
    tell(watch, "gross")
    search = _GrossSearch(model, data, configurations)
    some, own = subsample(model, data, configurations)
    few = search if some is data else _GrossSearch(model, some, own)
    start, tau, near = _nominal(few, data)
    x = start = search_poses_again(few.whole_problem, start)
    for loss, tuning in (("huber", None), ("tukey", GROSS_DISTANCE)):
        x, tau = _fit_until_stable(few, start, x, tau, near, loss, tuning)
        if loss == "huber" and freedom_of(model):
            # One pose in a wrong valley makes good rows gross there.
            every = tuple(np.ones(len(o), dtype=bool) for o in few.data.observations)
            mine = np.isin(np.arange(len(few.data.configurations)), own)
            x = search_costly_poses(few.problem_at(tau, every, loss), x, mine)
    used = near
    if few.data is not data:
        # A part of many rows says about where the fit ends. All of them say where it does, and are judged by that.
        used = tuple(np.ones(len(o), dtype=bool) for o in data.observations)
        x, tau = _fit_until_stable(search, start, x, tau, used, "tukey", GROSS_DISTANCE)
    # No row is gross for being rounded more coarsely than the others.
    known = add_rounding(model, data, search.problem_at(tau, used, "none"), x, None if few.data is data else few.data)
    if known is not data:
        data, search = known, replace(search, data=known)
    every = tuple(np.ones(len(o), dtype=bool) for o in data.observations)
    for _ in range(ROUNDS):
        soft = soften(search.problem_at(tau, used, "none"), start)
        there, away = x, studentise(soft, x, tau)
        far = join_views(data, by_observation(data, soft, away.far))
        x, far = restore_poses(data, search.problem_at(tau, every, "none"), x, tau, far)
        now = tuple(
            ~(f & np.isin(o.configuration, configurations)) for f, o in zip(far, data.observations, strict=True)
        )
        if all((a == b).all() for a, b in zip(now, used, strict=True)):
            break
        used = now
        x, tau = _fit_until_stable(search, start, x, tau, used, "none", None)
    return Sifted(mark_used(data, used), soft, there, away)


def _nominal(search: _GrossSearch, whole: DataSet) -> tuple[Array, Tau, tuple[Bools, ...]]:
    """Where frames stand when gross rows of a part of the `whole` do not pull, the robust noise there, and the rows that are near."""
    every = tuple(np.ones(len(o), dtype=bool) for o in search.data.observations)
    made, x = baseline(search.model, search.data, search.configurations, whole=whole)
    frames = frame_names(search.model, made)
    tau: Tau = {}
    made = search.problem_at(tau, every, "huber")
    for _ in range(ROUNDS):
        new = search.noise(made, x, float(len(frames)))
        if tau and same_tau(new, tau, SETTLED):
            break
        tau, made = new, search.problem_at(new, every, "huber")
        if frames:
            x = least_squares(made.with_free(frames), x).x
    there = search.problem_at(tau, every, "none").with_free(frames)
    far = join_views(search.data, by_observation(search.data, there, studentise(there, x, tau).far))
    x, far = restore_poses(search.data, there, x, tau, far)
    agreed = agreed_views(search.model, search.data, search.configurations, made, x)
    if agreed is not None:
        own = search.noise(search.problem_at(tau, every, "huber"), agreed[0], float(len(frames)))
        if np.prod([own.get(k, t) for k, t in tau.items()]) < AGREED * np.prod(list(tau.values())):
            return agreed[0], own, (agreed[1],)
        far = (far[0] | ~agreed[1],)
    return x, tau, tuple(~f for f in far)


def _fit_until_stable(
    search: _GrossSearch, start: Array, x: Array, tau: Tau, used: tuple[Bools, ...], loss: str, tuning: float | None
) -> tuple[Array, Tau]:
    """A soft fit of everything free, and its robust noise, until they agree."""
    for _ in range(ROUNDS):
        made = search.problem_at(tau, used, loss, tuning)
        soft = soften(made, start)
        ended = least_squares(soft, x, cost_tolerance=NEAR)
        x = ended.x
        before, tau = tau, search.noise(made, x, effective_columns(soft, x, ended))
        if same_tau(tau, before, SETTLED):
            break
    return x, tau


def neither(model: Model, data: DataSet, base: Baseline, found: Fit, configurations: Ints) -> tuple[Bools, ...]:
    """Rows of every term that neither the baseline nor the identified model comes near, both fitted to some configurations."""
    frames = frame_names(model, base.problem)
    one = far_from(data, base.problem.with_free(frames), base.x, configurations).outlying
    if not any(a.any() for a in one):
        return one
    other = far_from(data, found.problem, found.solution.x, configurations)
    both = by_observation(data, found.problem, [a & b for a, b in zip(one, other.far, strict=True)])
    whole = join_views(data, both)
    return tuple(whole[own][term.index] for own, term in owners(data, found.problem))


def mark_used(data: DataSet, used: Iterable[Bools]) -> DataSet:
    """The data with these rows used, observation by observation."""
    each = (replace(o, used=None if u.all() else u) for o, u in zip(data.observations, used, strict=True))
    return DataSet(data.configurations, tuple(each))


def share(data: DataSet) -> float:
    """Which share of the rows is set aside."""
    rows = sum(len(o) for o in data.observations)
    return sum(int((~o.used).sum()) for o in data.observations if o.used is not None) / max(rows, 1)

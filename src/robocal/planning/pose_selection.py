"""Which poses to measure, and how many: before anything is measured, or after some was.

1 candidates   inside the joint limits and the region that robot and instrument allow, or a given list
2 linearise    at the nominal model, or at the one fitted to what was measured (see `design`)
3 choose       greedily, then by exchange (see `robocal.estimate.selection`)
4 foretell     the accuracy at test poses against the number of poses, and when more are hardly worth it
5 doubt        the same design at models that are off as far as expected

The foretold accuracy is that of the model's parameters under the noise that is stated: what no parameter describes
(gears, bending) is not in it, unless poses measured before have shown it as noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from robocal._record import field, record
from robocal._types import Array, Ints
from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.estimate.criteria import Criterion
from robocal.estimate.selection import Design, Pool
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.planning.candidates import Region, Template, draw, margins
from robocal.planning.design import Blocks, blocks, choose_best, criterion_and_blocks, predict_sigma, sum_information
from robocal.planning.route import short_path, travel
from robocal.progress import Watch

__all__ = ["Forecast", "Plan", "PlanOptions", "plan"]

AHEAD = 5  # poses looked ahead to say that more are hardly worth it
BEYOND = 15  # poses foretold beyond the design
MOST = 60  # poses, when nobody says how many
RANDOM = 12  # random sets to compare with
DOUBTS = 6  # perturbed models
# What poses (m, n) would tell at a model with these values.
Linearise = Callable[[Array, Mapping[str, float] | None], Blocks]


@record
class PlanOptions:
    """What is wanted: how many poses (None: enough), by which criterion, from how many candidates, judged at how many
    test poses.

    `accuracy` (m) is the required mean predicted error; `worth` the share by which AHEAD further poses must lower
    it to be worth measuring.
    """

    count: int | None = None
    criterion: str = "I"
    candidates: int = 5000
    tests: int = 200
    accuracy: float | None = None
    worth: float = 0.05
    seed: int = 0
    region: Region = field(default_factory=Region)
    task: Region | None = None


@record
class Forecast:
    """Foretold error (m, three axes together) at the test poses after so many poses: mean and 95 % of each, and of
    random poses as many."""

    count: Ints
    mean: Array
    p95: Array
    random: Array

    def enough(self, worth: float, accuracy: float | None) -> int | None:
        """The least number of poses that reaches the accuracy, or without one after which AHEAD more lower the mean by
        less than `worth`; None when none does."""
        if accuracy is not None:
            good = np.flatnonzero(self.mean <= accuracy)
        else:
            good = np.flatnonzero(self.mean[:-AHEAD] - self.mean[AHEAD:] < worth * self.mean[:-AHEAD])
        # Without a pose nothing was gained yet.
        good = good[self.count[good] > 0]
        return int(self.count[good[0]]) if len(good) else None


@record
class Plan:
    """The chosen poses (count, n) in the order of their worth, and `path`, an order that is short to travel; forecast,
    what is enough, mean errors at perturbed models, the value of the criterion that no set of this size exceeds (None
    where that is not known), and the candidates and tests that it rests on."""

    q: Array
    names: tuple[str, ...]
    path: Ints
    design: Design
    forecast: Forecast
    enough: int | None
    limit: float | None
    uncertainty: Array
    candidates: Array
    tests: Array
    parameters: tuple[str, ...]
    criterion: str
    template: Template
    measured: int


def plan(
    model: Chain,
    template: Template,
    options: PlanOptions | None = None,
    *,
    listed: tuple[tuple[str, ...], Array] | None = None,
    tests: Array | None = None,
    measured: DataSet | None = None,
    values: Mapping[str, float] | None = None,
    watch: Watch | None = None,
) -> Plan:
    """Plans measurements with the template's instruments (the rows of one configuration).

    `listed` are names and joint values (m, n) to choose from, `tests` (t, n) poses to predict (default: others of the
    region); `measured` counts as done, `values` are parameters to linearise at. Raises ModelError for what cannot be
    planned.
    """
    options = options or PlanOptions()
    _plannable(template, listed is not None)
    rng = np.random.default_rng(options.seed)
    columns = {} if measured is None else measured.configurations.columns
    at = model if values is None else model.with_values({n: v for n, v in values.items() if n in model.table})
    if watch:
        watch({"stage": "drawing candidates"})
    if listed is None:
        q = draw(at, template, options.region, options.candidates, rng, columns=columns, edges=True)
        names = tuple(f"p{i + 1:05d}" for i in range(len(q)))
    else:
        names, q = listed
        if options.region != Region():
            inside = np.min([*margins(at, template, options.region, q, columns).values()], axis=0) >= 0
            names, q = tuple(n for n, i in zip(names, inside, strict=True) if i), q[inside]
    for key, poses in (("candidates", q), ("tests", q if tests is None else tests)):
        if not len(poses):
            raise ModelError("there are no poses", key=key, expected="at least one inside the region")
    if tests is None:
        tests = draw(at, template, options.task or options.region, options.tests, rng, columns=columns)
    judged = tests

    def linearise(q: Array, values: Mapping[str, float] | None) -> Blocks:
        return blocks(model, template, q, judged, measured=measured, values=values, columns=columns)

    b = linearise(q, values)
    count, path_to = _how_many(b, options, watch)
    design, criterion, seen = choose_best(b, options.criterion, count, watch)
    ranked = design.chosen
    forecast = _forecast(b, ranked, _further(seen, criterion, ranked), rng)
    enough = (path_to or forecast).enough(options.worth, options.accuracy)
    if watch:
        watch({"stage": "asking how good it could be"})
    best = Pool(seen.candidates, criterion, seen.known).limit(count)
    if watch:
        watch({"stage": "trying perturbed models"})
    doubts = _doubts(model, linearise, q[ranked], values or {}, rng)
    middle = np.linalg.norm(q[ranked] - q.mean(axis=0), axis=1)
    path = short_path(travel(model, q[ranked]), int(np.argmin(middle)))
    return Plan(
        q[ranked], tuple(names[i] for i in ranked), path, design,
        forecast, enough, best, doubts, q, tests, b.names, options.criterion, template,
        0 if measured is None else len(measured.configurations),
    )  # fmt: skip


def _plannable(template: Template, listed: bool) -> None:
    for obs in template:
        if obs.second is not None:
            raise ModelError("this kind compares two configurations, and poses are planned one by one", found=obs.kind)
        if kind_of(obs).contact and not listed:
            message, expected = (
                "the machine has to touch something, so poses cannot be drawn",
                "a list of poses that touch it",
            )
            raise ModelError(message, found=obs.kind, expected=f"{expected} (--candidates)")
        if kind_of(obs).contact and len(template) > 1:
            places = ", ".join(o.label for o in template)
            message = "a pose touches one place, so one place is planned for at a time"
            raise ModelError(message, found=places, expected="one place")


def _how_many(b: Blocks, options: PlanOptions, watch: Watch | None) -> tuple[int, Forecast | None]:
    """As many poses as are asked for, or as are enough."""
    if options.count is not None:
        return options.count, None
    most = min(MOST, len(b.candidates))
    criterion, seen = criterion_and_blocks(b, options.criterion, most)
    chosen = np.array(Pool(seen.candidates, criterion, seen.known, watch=watch).greedy(most), dtype=np.int64)
    forecast = _forecast(b, chosen, [], None)
    return forecast.enough(options.worth, options.accuracy) or most, forecast


def _further(b: Blocks, criterion: Criterion, ranked: Ints) -> list[int]:
    """The poses that would come next."""
    left = np.setdiff1d(np.arange(len(b.candidates)), ranked)
    free = np.zeros(len(b.candidates), dtype=bool)
    free[left] = True
    pool = Pool(b.candidates, criterion, sum_information(b, list(ranked)), free)
    return pool.greedy(min(BEYOND, len(left)))


def _forecast(b: Blocks, ranked: Ints, further: list[int], rng: np.random.Generator | None) -> Forecast:
    order = [*(int(i) for i in ranked), *further]
    error = np.array([predict_sigma(b.tests, sum_information(b, order[:k])) for k in range(len(order) + 1)])
    at_random = np.full(len(error), np.nan)
    if rng is not None:
        sets = [rng.permutation(len(b.candidates))[: len(order)] for _ in range(RANDOM)]
        counts = range(len(order) + 1)
        every = [[predict_sigma(b.tests, sum_information(b, list(s[:k]))).mean() for k in counts] for s in sets]
        at_random = np.median(every, axis=0)
    return Forecast(np.arange(len(error)), error.mean(axis=1), np.quantile(error, 0.95, axis=1), np.asarray(at_random))


def _doubts(
    model: Chain, linearise: Linearise, q: Array, values: Mapping[str, float], rng: np.random.Generator
) -> Array:
    """The mean foretold error of a design at models that are off as far as is expected, (DOUBTS,)."""
    out = []
    geometric = [p for p in model.table.rows if p.free and p.name in set(model.geometric)]
    for _ in range(DOUBTS):
        moved = {p.name: values.get(p.name, p.value) + p.scale * rng.standard_normal() for p in geometric}
        b = linearise(q, {**values, **moved})
        out.append(predict_sigma(b.tests, sum_information(b, list(range(len(q))))).mean())
    return np.array(out)

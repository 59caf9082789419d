"""Frames that have two places: a marker, a camera, an image plane or a phantom that moved at some configuration, or never was where a
file has it.

    g_i = C_i^T r,   A_i = C_i^T C_i,   X_i = C_i^T J        of configuration i, local poses projected out of all of them
    s = sum_{i >= k} g_i,   I = sum A_i - (sum X_i) H (sum X_i)^T,   H = (J^T J + P)^-1,   gain(k) = s^T I^-1 s

C are the six columns of a frame, J those that were fitted, P the priors, r what the fit leaves. The score test asks every frame at every
configuration k at once; for a frame that the fit could not move freely the first configuration is asked too. The best is fitted
with two places, and the fall of the cost is what counts. It follows chi2 with six degrees of freedom, enlarged by what single views gain
(their median), and by serial correlation; see also `frame_orders`. Source: Rao (1948), as `stated_numbers`; Andrews, Econometrica (1993).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose import limits
from robocal.diagnose.frame_orders import order_proves
from robocal.diagnose.frame_search import BestStep, FrameSearch
from robocal.diagnose.serial import correlation_factor
from robocal.diagnose.zero_steps import step_of_zero
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.fit.frames_alike import frames_of
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, sensor_zeros
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["FrameStep", "find_frame_steps"]

LATER = "later"  # what the second place of a frame is called
DENSE = 40_000_000  # grid: numbers of a Jacobian beyond which nothing is looked for
MOST = 3  # grid: steps that are looked for
RIVALS = 4  # grid: of the frames that gain as much, how many are fitted


@record
class FrameStep:
    """A frame, the configuration from which on it stands elsewhere (None: it never stood where it was stated), how far (m, rad), the
    chance that nothing moved, how far the fitted numbers are off by it in their sigma, and other frames that explain as much."""

    frame: str
    first: int | None
    shift: float
    turn: float
    chance: float
    bias: float
    share: float  # of the cost
    rivals: tuple[str, ...] = ()


def find_frame_steps(
    model: Model, data: DataSet, fitted: Problem, x: Array, sigma: Mapping[str, float]
) -> list[FrameStep]:
    """The frames of data, as they were fitted at x (1, P), that have two places, and a zero of a sensor that has, named in place of a
    frame; `sigma` are standard deviations of what was fitted."""
    if fitted.sizes[1][1] > 0 or not fitted.n:
        return []
    search = _StepSearch(model, data, fitted, x, sigma)
    return list(search.find()) if search.worthwhile else []


class _StepSearch:
    """The data as far as frames of them are known to have two places, their problem, and where it ends, x (1, P)."""

    def __init__(self, model: Model, data: DataSet, fitted: Problem, x: Array, sigma: Mapping[str, float]) -> None:
        self.model, self.sigma = model, sigma
        self.data = DataSet(data.configurations, tuple(_count_again(o) for o in data.observations))
        self.values = dict(zip(fitted.table.names, x[0].tolist(), strict=False))
        made = build(model, self.data, values=self.values).with_weights(fitted.weights)
        self.problem = made.with_free(list(fitted.free)).with_loss("huber")
        self.x = _placed(self.problem, fitted, x)
        frames = {n: [f"{n}.{s}" for s in FRAME_SYMBOLS] for n in frames_of(self.data)}
        self.frames = {n: own for n, own in frames.items() if all(s in self.problem.table.index for s in own)}
        self.zeros, self.origin = {n: [n] for n in sensor_zeros(model)}, {n: n for n in self.frames}

    @property
    def worthwhile(self) -> bool:
        """Whether there are frames to ask, a configuration that tells all numbers of one or of a zero, and not too many numbers."""
        wide, told = self.problem.n + 6 * len(self.frames), self.problem.numbers
        least = min(map(len, (*self.frames.values(), *self.zeros.values())), default=0)
        return bool(self.frames) and int(told.max(initial=0)) >= least and int(told.sum()) * wide <= DENSE

    def find(self) -> Iterator[FrameStep]:
        """Steps one by one, each in the data that have those before."""
        for k in range(MOST):
            look = FrameSearch(self.model, self.data, self.problem, self.x, {**self.frames, **self.zeros})
            odds, steps = _Odds(look), self._candidates(look)
            if steps and steps[0].name in self.zeros:
                yield from self._of_zero(look, odds, steps[0])
                return
            if not steps or odds.chance(steps[0].gain) > limits.FRAME_CHANCE:
                return
            found = self._fit(look, odds, steps, f"{LATER} {k}")
            if found is None:
                return
            yield found

    def _candidates(self, look: FrameSearch) -> list[BestStep]:
        """The best step of every unit, that which gains most first."""
        known = frames_of(self.data)
        loose = {n for n in self.frames if all(known[n].free) and known[n].prior is None}
        steps = [s for n in look.units if (s := look.best(n, n in self.frames and n not in loose)) is not None]
        # A frame that has two places already has a third one by its later name alone.
        steps = [s for s in steps if s.first is None or f"{s.name} {LATER}" not in self.frames]
        return sorted(steps, key=lambda s: -s.gain)

    def _of_zero(self, look: FrameSearch, odds: _Odds, one: BestStep) -> Iterator[FrameStep]:
        """A zero that gains more than any frame, where it steps."""
        if one.first is None:
            return
        u = look.units[one.name]
        sums = u.g[u.views], u.a[u.views], u.x[u.views], u.xh[u.views]
        shift, bias, serial = step_of_zero(one.name, sums, u.views >= one.first, self.problem.free, self.sigma)
        chance = odds.chance(one.gain / serial, 1)
        if chance < limits.FRAME_CHANCE and order_proves(
            u.gains, u.views, self.data.configurations, odds.spread > limits.FRAME_SCATTER
        ):
            yield FrameStep(one.name, one.first, shift, 0.0, chance, bias, 0.0)

    def _fit(self, look: FrameSearch, odds: _Odds, steps: Sequence[BestStep], later: str) -> FrameStep | None:
        """The frame whose two places leave least, fitted; the search goes on from there."""
        rivals = [s for s in steps if s.name in self.frames and s.gain > limits.SEGMENT_RIVAL * steps[0].gain][:RIVALS]
        base = least_squares(self.problem, self.x, max_iterations=30, cost_tolerance=1e-6)
        made = [_refit(self.model, self.data, self.problem, base.x, s, f"{s.name} {later}") for s in rivals]
        trials = sorted((t for t in made if t is not None), key=lambda t: t.cost)
        if not trials:
            return None
        best, u = trials[0], look.units[trials[0].step.name]
        gain = 2 * (float(base.cost[0]) - best.cost)
        chance, share = odds.chance(gain / best.serial), gain / max(2 * float(base.cost[0]), 1e-300)
        slow = odds.spread > limits.FRAME_SCATTER and share < limits.FRAME_SHARE
        stated = best.step.first is None
        if chance > limits.FRAME_CHANCE or not (
            stated or order_proves(u.gains, u.views, self.data.configurations, slow)
        ):
            return None
        name = self.origin[best.step.name]
        near = [t for t in trials[1:] if 2 * (t.cost - best.cost) < limits.SEGMENT_ALIKE * odds.spread]
        alike = tuple(n for n in dict.fromkeys(self.origin[t.step.name] for t in near) if n != name)
        self.data, self.problem, self.x = best.data, best.problem, best.x
        if not stated:
            self.origin[best.later] = name
            self.frames[best.later] = [f"{best.later}.{s}" for s in FRAME_SYMBOLS]
        bias = _bias(best, alike, self.values, self.sigma)
        return FrameStep(name, best.step.first, best.shift, best.turn, chance, bias, share, alike)


class _Odds:
    """How likely a gain is by chance, after all that was tried."""

    def __init__(self, look: FrameSearch) -> None:
        self.spread, self.views = look.dispersion(), float(sum(len(u.views) for u in look.units.values()))

    def chance(self, gain: float, q: int = len(FRAME_SYMBOLS)) -> float:
        """Of so much in q numbers."""
        dof = max(self.views - q, 1.0)
        return float(scipy.special.fdtrc(q, dof, max(gain, 0.0) / (self.spread * q))) * self.views


def _bias(best: _TwoPlaces, alike: Sequence[str], values: Mapping[str, float], sigma: Mapping[str, float]) -> float:
    """How far the fitted numbers are off in their sigma. A frame that was fitted where one of its two places is, is right."""
    own = {f"{n}.{s}" for n in (best.step.name, *alike) for s in FRAME_SYMBOLS}
    away = {n: s for n, s in sigma.items() if s > 0 and n in best.values}
    most = max((abs(best.values[n] - values[n]) / s for n, s in away.items() if n not in own), default=0.0)
    if best.step.first is None:
        return most
    each = []
    for name in (best.step.name, best.later):
        pairs = [(f"{best.step.name}.{s}", f"{name}.{s}") for s in FRAME_SYMBOLS]
        each.append(max((abs(best.values[b] - values[a]) / away[a] for a, b in pairs if a in away), default=0.0))
    return max(most, min(each))


def _count_again(obs: Observations) -> Observations:
    """The same, where rows that were set aside as gross count again, for there may be a reason for all of them. Readings without a frame
    are no matter of frames; and an image that was set aside as a whole, those beside it were not, is none of several from a row on."""
    if obs.used is None or (obs.frame is None and not obs.targets):
        return obs
    where, place = np.unique(obs.configuration, return_inverse=True)
    off = np.bincount(place, ~obs.used) > limits.VIEW_FAR * np.bincount(place)
    ends = np.flatnonzero(np.diff(off, prepend=False, append=False)).reshape(-1, 2)
    alone = np.zeros(len(where), dtype=bool)
    for a, b in ends:
        alone[a:b] = b - a < limits.SEGMENT_VIEWS
    lone = alone[place]
    return replace(obs, used=~lone if lone.any() else None)


def _placed(made: Problem, fitted: Problem, x: Array) -> Array:
    """The start of a problem of the same configurations, with every block where the fit has left it."""
    out = np.array(made.start)
    for there, here in zip(made.places, fitted.places, strict=True):
        out[:, there] = x[:, here]
    return out


@record(eq=False)
class _TwoPlaces:
    """A fit in which a frame has two places."""

    step: BestStep
    later: str
    data: DataSet
    problem: Problem
    x: Array
    cost: float
    serial: float
    shift: float
    turn: float

    @property
    def values(self) -> Mapping[str, float]:
        """All numbers by name."""
        return dict(zip(self.problem.table.names, self.x[0].tolist(), strict=False))


def _refit(model: Model, data: DataSet, before: Problem, x: Array, step: BestStep, name: str) -> _TwoPlaces | None:
    """The fit with the two places of a step, the second of another name, begun where the one was; None where no row can have the second."""
    values = dict(zip(before.table.names, x[0].tolist(), strict=False))
    own, later = ([f"{n}.{s}" for s in FRAME_SYMBOLS] for n in (step.name, name))
    split, moved = data, own
    if step.first is not None:
        split = _split(data, step.name, name, step.first, tuple(values[n] for n in own))
        values |= {b: values[a] for a, b in zip(own, later, strict=True)}
        moved = later
    free = dict.fromkeys((*before.free, *moved))
    bare = build(model, split, values=values)
    if not all(n in bare.table.index for n in moved):
        return None
    made = bare.with_weights(before.weights).with_free(list(free)).with_loss("huber")
    if step.first is None:
        made = made.with_table(made.table.with_priors(dict.fromkeys(own)))
    found = least_squares(made, _placed(made, before, x), max_iterations=50, cost_tolerance=1e-6)
    there = dict(zip(made.table.names, found.x[0].tolist(), strict=False))
    away = _away([there[n] for n in moved], [(there if step.first is not None else values)[n] for n in own])
    look = FrameSearch(model, split, made, found.x, {step.name: moved})
    u = look.units[step.name]
    size = np.sqrt(np.einsum("iqq->q", u.a))
    serial = correlation_factor(u.g[u.views] / np.where(size > 0, size, 1.0)) if len(u.views) > 1 else 1.0
    return _TwoPlaces(step, name, split, made, found.x, float(found.cost[0]), serial, *away)


def _away(here: Sequence[float], there: Sequence[float]) -> tuple[float, float]:
    """How far two frames are apart (m, rad)."""
    from robocal.geometry import se3

    shift, turn = se3.displacement(*(se3.from_vector(np.array(v)) for v in (there, here)))
    return float(np.linalg.norm(shift)), float(np.linalg.norm(turn))


def _split(data: DataSet, name: str, later: str, first: int, value: tuple[float, ...]) -> DataSet:
    """The data in which a frame has another name from a configuration on."""
    out: list[Observations] = []
    for obs in data.observations:
        late = obs.configuration >= first
        if obs.frame is not None and obs.frame.name == name:
            other = replace(obs.frame, name=later, value=value, free=(True,) * 6, prior=None)
            rows = np.flatnonzero(late)
            out += [obs.take(np.flatnonzero(~late))] if not late.all() else []
            out += [replace(obs.take(rows), frame=other)] if len(rows) else []
            continue
        own = [i for i, t in enumerate(obs.targets) if t.name == name]
        if own and late.any():
            target = np.zeros(len(obs), dtype=np.int64) if obs.target is None else np.array(obs.target)
            target[late & (target == own[0])] = len(obs.targets)
            second = replace(obs.targets[own[0]], name=later, value=value, free=(True,) * 6, prior=None)
            obs = replace(obs, targets=(*obs.targets, second), target=target)
        out.append(obs)
    return DataSet(data.configurations, tuple(out))

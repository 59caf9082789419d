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

from collections.abc import Mapping, Sequence

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
    data = DataSet(data.configurations, tuple(_count_again(o) for o in data.observations))
    values = dict(zip(fitted.table.names, x[0].tolist(), strict=False))
    free, out = list(fitted.free), []
    before = build(model, data, values=values).with_weights(fitted.weights).with_free(free).with_loss("huber")
    frames = {n: [f"{n}.{s}" for s in FRAME_SYMBOLS] for n in frames_of(data)}
    frames = {n: own for n, own in frames.items() if all(s in before.table.index for s in own)}
    zeros, origin = {n: [n] for n in sensor_zeros(model)}, {n: n for n in frames}
    if not frames or int(before.numbers.sum()) * (fitted.n + 6 * len(frames)) > DENSE:
        return []
    at = _placed(before, fitted, x)
    for k in range(MOST):
        look = FrameSearch(model, data, before, at, {**frames, **zeros})
        spread = look.dispersion()
        known = frames_of(data)
        loose = {n for n in frames if all(known[n].free) and known[n].prior is None}
        steps = [s for n in look.units if (s := look.best(n, n in frames and n not in loose)) is not None]
        # A frame that has two places already has a third one by its later name alone.
        steps = [s for s in steps if s.first is None or f"{s.name} {LATER}" not in frames]
        tried = float(sum(len(u.views) for u in look.units.values()))
        steps = sorted(steps, key=lambda s: -s.gain)
        if steps and (one := steps[0]).name in zeros and one.first is not None:
            u = look.units[one.name]
            sums = u.g[u.views], u.a[u.views], u.x[u.views], u.xh[u.views]
            shift, bias, serial = step_of_zero(one.name, sums, u.views >= one.first, before.free, sigma)
            chance = _chance(one.gain / serial, spread, tried, look, 1)
            if chance < limits.FRAME_CHANCE and order_proves(
                u.gains, u.views, data.configurations, spread > limits.FRAME_SCATTER
            ):
                out.append(FrameStep(one.name, one.first, shift, 0.0, chance, bias, 0.0))
        if not steps or steps[0].name in zeros or _chance(steps[0].gain, spread, tried, look) > limits.FRAME_CHANCE:
            break
        rivals = [s for s in steps if s.name in frames and s.gain > limits.SEGMENT_RIVAL * steps[0].gain][:RIVALS]
        base = least_squares(before, at, max_iterations=30, cost_tolerance=1e-6)
        made = [_refit(model, data, before, base.x, s, f"{s.name} {LATER} {k}") for s in rivals]
        trials = sorted((t for t in made if t is not None), key=lambda t: t.cost)
        if not trials:
            break
        best = trials[0]
        gain = 2 * (float(base.cost[0]) - best.cost)
        chance = _chance(gain / best.serial, spread, tried, look)
        if chance > limits.FRAME_CHANCE:
            break
        name = origin[best.step.name]
        near = [t for t in trials[1:] if 2 * (t.cost - best.cost) < limits.SEGMENT_ALIKE * spread]
        alike = tuple(n for n in dict.fromkeys(origin[t.step.name] for t in near) if n != name)
        bias = _bias(best, alike, values, sigma)
        share = gain / max(2 * float(base.cost[0]), 1e-300)
        u = look.units[best.step.name]
        slow = spread > limits.FRAME_SCATTER and share < limits.FRAME_SHARE
        if best.step.first is not None and not order_proves(u.gains, u.views, data.configurations, slow):
            break
        out.append(FrameStep(name, best.step.first, best.shift, best.turn, chance, bias, share, alike))
        data, before, at = best.data, best.problem, best.x
        if best.step.first is None:
            continue
        origin[best.later] = name
        frames[best.later] = [f"{best.later}.{s}" for s in FRAME_SYMBOLS]
    return out


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


def _chance(gain: float, spread: float, tried: float, look: FrameSearch, q: int = len(FRAME_SYMBOLS)) -> float:
    """Of so much by chance in q numbers, after all that was tried."""
    dof = max(float(sum(len(u.views) for u in look.units.values())) - q, 1.0)
    return float(scipy.special.fdtrc(q, dof, max(gain, 0.0) / (spread * q))) * tried


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

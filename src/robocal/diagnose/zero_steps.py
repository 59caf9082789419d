"""The zero of a sensor that steps at a configuration, by its score alone: a reading shows all of the step.

d = -s / I,    what was fitted changes by -H X^T d        with s, I, X, H of `frame_steps`
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.check_registry import Context
from robocal.diagnose.segments.find import Segment
from robocal.diagnose.segments.posed import ZERO
from robocal.diagnose.serial import correlation_factor
from robocal.fit.noise import owners
from robocal.measure.data import Observations
from robocal.measure.machine import Model

__all__ = ["fitted_beside", "segment_of_zero", "step_of_zero"]


def step_of_zero(
    name: str, sums: tuple[Array, Array, Array, Array], late: Bools, free: Sequence[str], sigma: Mapping[str, float]
) -> tuple[float, float, float]:
    """By how much a zero steps, how far the fitted numbers are off by it in their sigma, and the factor of serial correlation; sums
    g (m, 1), A (m, 1, 1), X and X H (m, 1, n) of its configurations, of which those of the second place are `late`."""
    g, own, across, _ = sums
    s, a, x, xh = (v[late].sum(axis=0) for v in sums)
    step = -float(s[0] / max(float((a - xh @ x.T)[0, 0]), 1e-300))
    change = -step * xh[0]
    moved = dict(zip(free, change.tolist(), strict=True))
    here = moved.pop(name, 0.0)
    each = [abs(v) / sigma[n] for n, v in moved.items() if sigma.get(n, 0.0) > 0]
    if sigma.get(name, 0.0) > 0:  # right where one of its two places is
        each.append(min(abs(here), abs(here + step)) / sigma[name])
    left = g + own[:, 0] * step * late[:, None] + across @ change  # what the step does not explain
    size = np.sqrt(own[:, 0])
    return step, max(each, default=0.0), correlation_factor(left / np.where(size > 0, size, 1.0))


def segment_of_zero(context: Context[Model], zero: str, first: int, shift: float, chance: float) -> Segment | None:
    """The rows of a zero that steps at a configuration, as their file has them; None where several files have rows of it."""
    fit = context.need_fit
    found: list[Segment] = []
    for (number, term), r in zip(owners(fit.data, fit.problem), context.residuals, strict=True):
        obs = fit.data.observations[number]
        sensor = _rows_of(context.model, obs, zero)
        mine = sensor & (obs.configuration >= first)
        if not mine.any():
            continue
        others = ~sensor[term.index] & term.used
        left = float(np.sqrt(np.mean(r.value[others, 0] ** 2))) if others.any() else np.inf
        known = np.arange(len(obs)) if obs.rows is None else obs.rows
        rows = int(known[mine].min()), int(known[mine].max())
        ends = int(np.flatnonzero(mine).min()), int(np.flatnonzero(mine).max())
        size = abs(shift)
        found.append(
            Segment(
                obs.source,
                obs.label,
                *ends,
                rows,
                rows,
                ZERO,
                zero,
                size,
                None,
                size / left,
                chance,
                int(mine.sum()),
                None,
            )
        )
    return found[0] if len(found) == 1 else None


def fitted_beside(context: Context[Model], zero: str, first: int) -> float:
    """Which share of the rows on either side of a step of a zero was fitted, the smaller one: what was set aside bends nothing."""
    late, used = [], []
    for obs in context.need_fit.data.observations:
        mine = _rows_of(context.model, obs, zero)
        late.append(obs.configuration[mine] >= first)
        used.append(np.ones(int(mine.sum()), dtype=bool) if obs.used is None else obs.used[mine])
    after, fitted = np.concatenate(late), np.concatenate(used)
    return min((float(fitted[some].mean()) for some in (after, ~after) if some.any()), default=0.0)


def _rows_of(model: Model, obs: Observations, zero: str) -> Bools:
    """Which rows (k,) read the sensor of a zero."""
    owner = zero.rpartition(".")[0]
    word = next((w for w, names in model.parts.items() if w in obs.extra and owner in names), None)
    if word is None:
        return np.zeros(len(obs), dtype=bool)
    return np.asarray(obs.extra[word].astype(np.int64) == model.parts[word].index(owner))

"""How large the noise of a measured pose is where nobody states it, as the residuals r of a fit show it.

    log sigma_g^2 = (n_g log f s_g^2 + d log s^2) / (n_g + d),    s_g^2 = sum r_g^2 / n_g,    n_g = sum (1 - h)
    d = min(PRIOR, 2 / t),    t = ((log s_a^2 - log s_b^2)^2 / 2 - 1 / n_a - 1 / n_b)_+        g: across the view, along it, tilt, roll

A camera is not as sure along its view as across it. Each group has its own noise as far as its n_g numbers tell it: h is how much of a
number the fit took for its unknowns, most of those it trusts most. s^2 is of both groups a, b of metres or radians. t is by how much logs
of noise differ beyond chance: where one group is far from the other, it says little of it. Where residuals follow one another, as errors
of a robot do on its way, f is what that takes from them (`diagnose/serial`), else 1. Source: Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004).

Beside a moving robot the times of the views scatter as well. With v_i what a second does to the numbers of view i,

    t_i = v_i' S^-1 r_i / v_i' S^-1 v_i,    var t_i = q + 1 / v_i' S^-1 v_i,    sigma_ic^2 = sigma_c^2 + m_i q v_ic^2

and m_i = (sum w)^2 / sum w^2, w = v_ic^2 / sigma_c^2, is as how many numbers one late view counts. q and S are found in turns, by the
mean of t_i^2 as that of noise. Source: Paule and Mandel, J. Res. NBS 87 (1982).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.serial import correlation_factor
from robocal.estimate.problem import Problem

__all__ = ["log_noise", "read_noise"]

GROUPS = ((0, 1), (2,), (3, 4), (5,))  # across the view, along it, tilt, roll
PRIOR = 10.0  # grid: numbers that a group's own noise must outweigh, where groups seem alike
RANK, LEAST = 1e-10, 1e-3  # tolerance: of the largest singular value, and of what a fit leaves of a number
CLEAR = 4.0  # tolerance: standard deviations of a correlation of neighbours, beyond chance
TURNS, HALVINGS = 8, 60  # grid: of q and S in turns, and of an interval
TINY = float(np.finfo(float).tiny)
LATEST = 1.0  # grid: s, by which times of views may scatter


def log_noise(problem: Problem, x: Array) -> float:
    """-2 log likelihood of measured poses under noise of every group's own, but for a constant: less where the axes are those of noise."""
    left, used, spare = _left(problem, x)
    every = [np.sum(left[used][:, g] ** 2) / np.sum(spare[used][:, g]) for g in GROUPS]
    return float(sum(np.sum(spare[used][:, g]) * np.log(max(v, TINY)) for g, v in zip(GROUPS, every, strict=True)))


def read_noise(problem: Problem, x: Array, late: str | None = None) -> Array:
    """The noise (k, 6) of measured poses; `late` names the delay of their clock, where they were taken on the way."""
    left, used, spare = _left(problem, x)
    spare = spare[used]
    if late is None or late not in problem.free:
        return np.broadcast_to(_by_group(left[used], spare), left.shape)
    speed = _speeds(problem, x, late)
    own, r, v = _by_group(left[used], spare), left[used], speed[used]
    q = 0.0
    for _ in range(TURNS):
        told = np.sum((v / own) ** 2, axis=1)
        late_by = np.sum(v * r / own**2, axis=1) / np.maximum(told, 1e-12)
        q = _scatter(late_by, told)
        share = q * told / (1 + q * told)
        rest = r - v * (late_by * share)[:, None]
        own = _by_group(rest, spare * (1 - share.sum() / r.size))
    weight = (speed / own) ** 2
    count = weight.sum(axis=1) ** 2 / np.maximum(np.sum(weight**2, axis=1), 1e-12)
    return np.asarray(np.sqrt(own**2 + q * count[:, None] * speed**2))


def _left(problem: Problem, x: Array) -> tuple[Array, Bools, Array]:
    """What a fit left of poses (k, 6), which are used, (k,), and how much of every number it left, 1 - h; all but nothing of those that
    it was told by alone."""
    residuals = problem.residuals(x)
    left, used = (np.concatenate([getattr(r, n) for r in residuals]) for n in ("value", "used"))
    u, size, _ = np.linalg.svd(problem.linearize(x).j * problem.scales, full_matrices=False)
    taken = np.sum(u[:, size > RANK * size.max(initial=0.0)] ** 2, axis=1)
    spare = np.ones(left.shape)
    spare[used] = np.maximum(1 - taken, LEAST).reshape(-1, left.shape[1])
    return left, used, spare


def _by_group(left: Array, spare: Array) -> Array:
    """The noise (6,) of residuals (k, 6), of which a fit left so much."""
    out = np.empty(6)
    for pair in (GROUPS[:2], GROUPS[2:]):
        square = np.array([float(np.sum(left[:, group] ** 2)) for group in pair])
        count = np.array([float(np.sum(spare[:, group])) for group in pair])
        own, common = np.log(np.maximum(square / count, TINY)), np.log(max(square.sum() / count.sum(), TINY))
        apart = max(0.0, float((own[0] - own[1]) ** 2 / 2 - (1 / count).sum()))
        numbers = min(PRIOR, 2 / max(apart, TINY))
        own += np.log([_repeated(left[:, group]) for group in pair])
        for group, log in zip(pair, (count * own + numbers * common) / (count + numbers), strict=True):
            out[list(group)] = max(float(np.sqrt(np.exp(log))), TINY)
    return out


def _repeated(left: Array) -> float:
    """By how much residuals (k, g) that follow one another say less than as many of noise."""
    white = left / np.maximum(np.sqrt(np.mean(left**2, axis=0)), np.finfo(float).tiny)
    alike = float((white[1:] * white[:-1]).mean()) * np.sqrt(white[1:].size)
    return correlation_factor(white) if alike > CLEAR else 1.0


def _speeds(problem: Problem, x: Array, late: str) -> Array:
    """What a second does to the numbers of every row, (k, 6)."""
    alone = problem.with_free((late,))
    parts = []
    for term in alone.bound_terms:
        j = term.evaluate(x, np.zeros(1, dtype=np.int64), 0, len(term.configuration))[1]
        parts.append(j[0][..., term.columns >= 0].sum(axis=-1))
    return np.concatenate(parts)


def _scatter(late_by: Array, told: Array) -> float:
    """q with mean of t^2 / (q + 1 / told) one, by bisection; nought where noise explains t (k,) alone."""
    low, high = 0.0, LATEST**2
    noise = 1 / np.maximum(told, 1e-12)
    if np.mean(late_by**2 / noise) <= 1:
        return 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.mean(late_by**2 / (middle + noise)) > 1 else (low, middle)
    return high

"""Brings a simulated arm to touch: joint values at which a contact leaves no more than its noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Observations

__all__ = ["span", "touch"]

ROUNDS, STEPS = 30, 40


def span(truth: Chain, near: Array) -> tuple[Array, Array]:
    """Lower and upper joint values (n,): the limits, or the range of `near` (m, n) where there are none."""
    low, high = truth.limits.T
    return np.where(np.isfinite(low), low, near.min(axis=0)), np.where(np.isfinite(high), high, near.max(axis=0))


def touch(truth: Chain, blank: Observations, near: Array, rng: np.random.Generator) -> Array:
    """Joint values at which the contact leaves noise of its sigma, (k, n): Gauss-Newton from random starts within the
    joint limits, or the range of `near` where there are none. Raises ModelError when the arm hardly reaches."""
    assert blank.sigma is not None
    k, n = len(blank), near.shape[1]
    low, high = span(truth, near)
    wanted = blank.sigma * rng.standard_normal(blank.value.shape)
    out, left = np.empty((k, n)), np.arange(k)
    for _ in range(ROUNDS):
        q = rng.uniform(low, high, (len(left), n))
        for _ in range(STEPS):
            r, jac = _slope(truth, blank.take(left), q)
            gap = wanted[left] - r
            step = np.einsum("mji,mj->mi", jac, np.linalg.solve(
                jac @ np.swapaxes(jac, 1, 2) + 1e-6 * np.eye(r.shape[1]), gap[..., None])[..., 0])  # fmt: skip
            size = np.abs(step).max(axis=1, keepdims=True)
            q = np.clip(q + step * np.minimum(1.0, 0.3 / np.maximum(size, 1e-12)), low, high)
        done = np.abs(_values(truth, blank.take(left), q) - wanted[left]).max(axis=1) < 1e-9
        out[left[done]] = q[done]
        left = left[~done]
        if not len(left):
            return out
    raise ModelError(
        "the simulated arm hardly reaches what it should touch", found=f"{len(left)} of {k} contacts failed",
        expected="wider joint limits",
    )  # fmt: skip


def _values(truth: Chain, blank: Observations, q: Array) -> Array:
    """What the kind would read at joint values (k, n), (k, d)."""
    bare = replace(blank, configuration=np.arange(len(q)), sigma=None)
    made = synthesise(truth, DataSet(Configurations(tuple(map(str, range(len(q)))), q), (bare,)))
    return made.observations[0].value


def _slope(truth: Chain, blank: Observations, q: Array) -> tuple[Array, Array]:
    """The reading (k, d) and its derivative by the joints (k, d, n), by differences of 1 um or urad."""
    k, n = q.shape
    h = 1e-6
    many = np.concatenate([q[None], q[None] + h * np.eye(n)[:, None]]).reshape(-1, n)
    value = _values(truth, blank.take(np.tile(np.arange(k), n + 1)), many).reshape(n + 1, k, -1)
    return value[0], np.moveaxis((value[1:] - value[0]) / h, 0, -1)

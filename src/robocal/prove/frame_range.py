"""Where a correction holds, of a machine that stands where its own lengths say: its poses from lengths, in the middle of its frame.

    dp = -L^+ (dl/dtheta) dx,    d = -L^+ (l(theta) - l(theta_0))

L is the gradient of the lengths by the platform's pose, dx what the parameters may be off by, theta_0 those of the baseline. Where the
lengths hardly tell the pose, it is left out. Zeros that every power-up sets anew belong to the measurement, as frames do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.diagnose.limits import FRAME_FLAT, FRAME_RANGE, SINGULAR_BELOW
from robocal.diagnose.motions import ABSOLUTE
from robocal.estimate.problem import Problem
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.measure.machine import Mechanism, Model
from robocal.prove.bands import dense
from robocal.prove.decision import Decision

__all__ = ["FRAME", "frame_is_known", "poses_within", "shape_of_lengths"]

FRAME = f"inner {100 * FRAME_RANGE:.0f} % of the frame"
TINY = 1e-12  # tolerance: of a column that is none


def poses_within(moving: Mechanism, measured: Array, count: int) -> Array:
    """Frame vectors (count, 6) without turn, drawn from the box of the frame's points, FRAME_RANGE as wide about its middle; across a flat
    frame from where poses were `measured` (U, 6)."""
    points = moving.frame_points
    low, high = points.min(axis=0), points.max(axis=0)
    flat = high - low < FRAME_FLAT * (high - low).max()
    middle, half = (low + high) / 2, FRAME_RANGE * (high - low) / 2
    low = np.where(flat, measured[:, :3].min(axis=0), middle - half)
    high = np.where(flat, measured[:, :3].max(axis=0), middle + half)
    out = np.zeros((count, 6))
    moves = [i for i in moving.freedom or () if i < 3]
    out[:, moves] = np.random.default_rng(0).uniform(low, high, (count, 3))[:, moves]
    return out


def shape_of_lengths(context: Decision[Model], count: int) -> tuple[Array, Array, Array, Array] | None:
    """At poses within the frame: positions (m, 3), how every column moves them there (m, 3, k), what the correction moves (m, 3), and
    what zeros that are set anew do (m, 3, c). None where no lengths were read, or they tell no pose."""
    seen = [o for o in context.need_data.observations if o.kind == "lengths"]
    moving, fit, base = context.model.mechanism, context.need_fit, context.proven.base
    if not seen or moving is None or not len(moving.frame_points) or not fit.problem.families:
        return None
    from robocal.measure.lengths import owner

    # The robot's own zeros, where it has kept them.
    obs = min(seen, key=lambda o: bool(owner(o)))
    measured = fit.solution.x[0, fit.problem.places[0]].reshape(-1, 6)
    away = _lengths_at(context.model, obs, poses_within(moving, measured, count))
    known = dict(zip(fit.problem.table.names, map(float, fit.solution.x[0]), strict=False))
    before = dict(zip(base.problem.table.names, map(float, base.x[0]), strict=False))
    made = build(context.model, away)
    length, jac, slope = _linear(made, known, fit.total.names)
    gap = length - _linear(made, before, ())[0]
    size = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), TINY)
    u, values, vt = np.linalg.svd(slope / size, full_matrices=False)
    told = values[:, -1] > SINGULAR_BELOW * values[:, 0]
    if not told.any() or slope.shape[1] < slope.shape[2]:
        return None
    moves = [i for i in moving.freedom or () if i < 3]
    back = np.zeros((int(told.sum()), 3, slope.shape[1]))
    inverse = (vt[told].swapaxes(1, 2) / values[told, None]) @ u[told].swapaxes(1, 2) / size[told].swapaxes(1, 2)
    back[:, moves] = -inverse[:, : len(moves)]
    place = away.configurations.starts[told, :3]
    return place, back @ jac[told], (back @ gap[told, :, None])[..., 0], back if owner(obs) else back[..., :0]


def frame_is_known(context: Decision[Model]) -> bool:
    """Whether what reads coordinates has all its frames where somebody stated them: then the machine's own place is measured too."""
    seen = [o.frame for o in context.need_data.observations if o.kind in ABSOLUTE]
    return bool(seen) and not any(f is not None and any(f.free) for f in seen)


def _lengths_at(model: Model, obs: Observations, vectors: Array) -> DataSet:
    from robocal.measure.lengths import read_everywhere

    count, cables = len(vectors), len(model.parts["cable"])
    where = Configurations(tuple(map(str, range(count))), start=vectors)
    return DataSet(where, (read_everywhere(obs, count, cables),))


def _linear(made: Problem, values: dict[str, float], names: Sequence[str]) -> tuple[Array, Array, Array]:
    """What the sensors show (m, c), its derivatives by named columns (m, c, k), zero where none depends on them, and by the pose
    (m, c, d)."""
    table = made.table.with_values({n: values[n] for n in made.table.names if n in values})
    there = made.with_table(table).with_free([n for n in names if n in table])
    lengths, jac, slope = _rows(there)
    out = np.zeros((*lengths.shape, len(names)))
    out[..., [list(names).index(n) for n in there.free]] = jac.reshape(*lengths.shape, -1)
    return lengths, out, slope


def _rows(made: Problem) -> tuple[Array, Array, Array]:
    """The rows of one term, configuration by configuration."""
    term, x = made.bound_terms[0], made.start
    r, _, local = term.evaluate(x, np.zeros(1, dtype=np.int64), 0, len(term.configuration))
    order = np.argsort(term.configuration, kind="stable")
    count = made.configurations
    jac = dense(term, x, 0, len(term.configuration), made.n)[order, 0]
    return r[0, order, 0].reshape(count, -1), jac, local[0, order, 0].reshape(count, len(order) // count, -1)

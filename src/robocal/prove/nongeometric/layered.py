"""Whether a residual layer helps, and the layer that it would be.

The model and the layer are fitted to the same rows of each round, blocks of rows in time order; the mean error of the
block that neither has seen is compared with and without the layer. It is switched on only when the paired bootstrap
95 % interval of the reduction lies above zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose.limits import LAYER_PLACES
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.geometry import so3
from robocal.measure.base import Rows
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, joints_of
from robocal.progress import Watch, tell
from robocal.prove.evidence import bootstrap_gain
from robocal.prove.nongeometric.layer import Layer, learn
from robocal.prove.split import make_split
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Guarded", "layer_errors", "layer_rows", "try_layer"]

ROUNDS = 5
KINDS = ("position", "pose")


@dataclass(frozen=True)
class Guarded:
    """A layer (None where it was refused), mean unseen error without and with it (m), gain with its 95 % interval, and
    the reason."""

    layer: Layer | None
    reason: Remark
    before: float | None = None
    after: float | None = None
    gain: tuple[float, float, float] | None = None
    rows: int = 0
    coverage: float | None = None  # share of unseen components within their 95 % band


@dataclass(frozen=True)
class LayerRows:
    """What the model misses, measured - predicted in base axes, (N, 3 or 6), and the configuration of every row."""

    missed: Array
    configuration: Ints


def layer_rows(data: DataSet, problem: Problem, x: Array) -> LayerRows | None:
    """What a model misses at x (1, P); None when other things than positions or poses in base-mounted frames were
    measured, or these together."""
    kinds = {o.kind for o in data.observations}
    if (
        len(kinds) != 1
        or not kinds <= set(KINDS)
        or any(o.frame and o.frame.mount != "base" for o in data.observations)
    ):
        return None
    frames = {o.label: o.frame for o in data.observations}
    missed, configurations = [], []
    for residual, term in zip(problem.residuals(x), problem.terms, strict=True):
        assert isinstance(term, Rows)
        frame = frames[residual.group]
        turn = np.eye(3)
        if frame is not None:
            at = problem.table.index[f"{frame.name}.rx"]
            turn = so3.exp(x[0, at : at + 3])
        # Rows are told in the instrument's axes, T_frame_base; base axes are turned back.
        parts = [-residual.value[:, a : a + 3] @ turn for a in range(0, residual.value.shape[1], 3)]
        missed.append(np.hstack(parts)[residual.used])
        configurations.append(residual.configuration[residual.used])
    return LayerRows(np.concatenate(missed), np.concatenate(configurations))


def layer_errors(layer: Layer, rows: LayerRows, q: Array) -> Array:
    """Errors (N,) in m that a layer leaves of what a model misses."""
    # A layer that was learned from positions serves poses too, and the other way round.
    left = rows.missed[:, :3] - layer.predict(q[rows.configuration])[:, :3]
    return np.asarray(np.linalg.norm(left, axis=1))


def try_layer(model: Model, data: DataSet, problem: Problem, x: Array, watch: Watch | None = None) -> Guarded:
    """Asks whether a layer on top of an identified model (its problem over all rows, its solution) helps on unseen
    blocks; makes it of all rows when it does."""
    q = data.configurations.joints
    rows = layer_rows(data, problem, x)
    if rows is None or q is None or not np.isfinite(q).all():
        return Guarded(None, Remark.of(Code.LAYER_NEEDS))
    if len(q) < LAYER_PLACES:
        return Guarded(None, Remark.of(Code.GROUP_FEW, least=LAYER_PLACES))
    joints = joints_of(model)
    learn_from = partial(learn, tuple(j.name for j in joints), tuple(j.type == "revolute" for j in joints))
    split = make_split(data, "blocks", folds=ROUNDS)
    weights = np.ones(problem.configurations) if problem.weights is None else problem.weights[0]
    start = np.repeat(np.atleast_2d(x), len(split), axis=0)
    tell(watch, "layer", configurations=len(split))
    each = least_squares(problem.with_weights(split.fit * weights), start).x if problem.n else start
    before, after = np.full(len(rows.configuration), np.nan), np.full(len(rows.configuration), np.nan)
    inside: list[Array] = []
    for k in range(len(split)):
        tell(watch, "layer", what=split.names[k])
        own = layer_rows(data, problem, each[k : k + 1])
        assert own is not None
        known, asked = split.fit[k][own.configuration], split.held_out[k][own.configuration]
        made = learn_from(q[own.configuration[known]], own.missed[known])
        there = q[own.configuration[asked]]
        left = own.missed[asked] - made.predict(there)
        before[asked] = np.linalg.norm(own.missed[asked, :3], axis=1)
        after[asked] = np.linalg.norm(left[:, :3], axis=1)
        inside.append((np.abs(left) < 1.96 * made.deviation(there)).ravel())
    gain = bootstrap_gain(before, after, rows.configuration, 0)
    good = gain[1] > 0
    made_of_all = learn_from(q[rows.configuration], rows.missed) if good else None
    words = Remark.of(Code.BLOCKS_FALL if good else Code.BLOCKS_DO_NOT_FALL)
    return Guarded(
        made_of_all, words, float(before.mean()), float(after.mean()), gain, len(rows.configuration),
        float(np.concatenate(inside).mean()),
    )  # fmt: skip

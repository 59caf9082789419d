"""A residual layer: what a calibrated model still misses, learned over joint space by a Gaussian process.

    y(q) = measured - predicted,   cov y = s^2 exp(-sum_j (1 - cos(q_j - q'_j)) / l_j^2) + n^2 I

y is in base axes: three numbers in m, and a rotation vector in rad where orientations were measured. A joint that
slides counts with (q_j - q'_j)^2 / 2. Every output has its own size s, all share length scales l and the ratio of
noise n / s; both maximise the marginal likelihood of a subset (Rasmussen and Williams, Gaussian processes for machine
learning, 2006, sections 2.2, 4.2.3 and 5.4). At most POINTS configurations are kept, spread evenly over the rows, so
the solution is exact and takes seconds. A layer is plain numbers. It knows nothing away from its points: there it
says zero, and its standard deviation says so.

Whether it helps: the model and the layer are fitted to the same rows of each round, blocks of rows in time order; the mean error of the
block that neither has seen is compared with and without the layer. It is switched on only when the paired bootstrap
95 % interval of the reduction lies above zero.
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.diagnose.limits import LAYER_PLACES
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.geometry import so3
from robocal.measure.base import Rows
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, joints_of
from robocal.progress import Watch, tell
from robocal.prove.evidence import bootstrap_gain
from robocal.prove.split import make_split
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["POINTS", "Guarded", "Layer", "layer_errors", "layer_rows", "learn", "try_layer"]

POINTS = 1500
SUBSET = 300
JITTER = 1e-8
ROUNDS = 5
KINDS = ("position", "pose")


@record
class Layer:
    """Points (p, n), their weights (p, d), size of every output (d,), length scales (n,), noise over size; `turning`
    (n,) tells joints that turn. d is 3 or 6, in base axes, m and rad."""

    joints: tuple[str, ...]
    turning: tuple[bool, ...]
    points: Array
    weights: Array
    size: Array
    lengths: Array
    noise: float

    def predict(self, q: Array) -> Array:
        """What is to be added to the model's pose at joint values (m, n): (m, d)."""
        out: Array = self._kernel(q) @ self.weights
        return out

    def deviation(self, q: Array) -> Array:
        """Standard deviation of a new measurement around the prediction (m, d)."""
        half = scipy.linalg.solve_triangular(self._factor, self._kernel(q).T, lower=True)
        left = np.maximum(1.0 - np.sum(half**2, axis=0), 0.0) + self.noise**2
        return np.asarray(np.sqrt(left)[:, None] * self.size)

    def _kernel(self, q: Array) -> Array:
        return np.asarray(np.exp(-distances(q, self.points, np.array(self.turning)) @ self.lengths**-2.0))

    @cached_property
    def _factor(self) -> Array:
        inner = self._kernel(self.points) + (self.noise**2 + JITTER) * np.eye(len(self.points))
        return np.asarray(scipy.linalg.cholesky(inner, lower=True))


def distances(a: Array, b: Array, turning: Bools) -> Array:
    """How far configurations are apart, joint by joint, (m, p, n): 1 - cos for joints that turn."""
    gap = a[:, None, :] - b[None, :, :]
    return np.asarray(np.where(turning, 1.0 - np.cos(gap), 0.5 * gap**2))


def learn(joints: tuple[str, ...], turning: tuple[bool, ...], q: Array, y: Array, *, points: int = POINTS) -> Layer:
    """A layer from configurations q (m, n) and what the model misses there, y (m, d)."""
    turns = np.array(turning)
    size = np.sqrt(np.mean(y**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    some = _spread(len(q), SUBSET)
    lengths, noise = _maximise_likelihood(distances(q[some], q[some], turns), y[some] / size, turns, np.ptp(q, axis=0))
    kept = _spread(len(q), points)
    kernel = np.exp(-distances(q[kept], q[kept], turns) @ lengths**-2.0)
    # size is that of signal and noise together: s^2 (1 + noise^2) = size^2.
    signal = size / np.sqrt(1.0 + noise**2)
    kernel[np.diag_indices_from(kernel)] += noise**2 + JITTER
    weights = scipy.linalg.solve(kernel, y[kept], assume_a="pos")
    return Layer(joints, turning, q[kept], weights, signal, lengths, noise)


def _spread(count: int, most: int) -> NDArray[np.int64]:
    """At most so many row numbers, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def _maximise_likelihood(apart: Array, y: Array, turning: Bools, span: Array) -> tuple[Array, float]:
    """Length scales and noise over signal of the highest marginal likelihood, climbed to from the best of three starts."""
    n = apart.shape[-1]
    eye = np.eye(len(y))

    def cost(u: Array) -> tuple[float, Array]:
        inverse = np.exp(-2.0 * u[:n])
        share = 1.0 / (1.0 + np.exp(-u[n]))  # of the variance that is signal
        signal = np.exp(-apart @ inverse)
        inner = share * signal + (1.0 - share + JITTER) * eye
        try:
            factor = scipy.linalg.cho_factor(inner, lower=True)
        except scipy.linalg.LinAlgError:
            return 1e12, np.zeros(n + 1)
        alpha = scipy.linalg.cho_solve(factor, y)
        d = y.shape[1]
        value = 0.5 * float(np.sum(y * alpha)) + d * float(np.log(np.diag(factor[0])).sum())
        outer = d * scipy.linalg.cho_solve(factor, eye) - alpha @ alpha.T
        moved = outer * share * signal
        slope = [0.5 * 2.0 * inverse[j] * float(np.sum(moved * apart[..., j])) for j in range(n)]
        slope.append(0.5 * share * (1.0 - share) * float(np.sum(outer * (signal - eye))))
        # A weak pull towards a length of one keeps joints that say nothing from running away.
        return value + 0.02 * float(u[:n] @ u[:n]), np.array(slope) + np.append(0.04 * u[:n], 0.0)

    bounds = [(np.log(0.02), np.log(30.0))] * n + [(-7.0, 9.0)]
    usual = np.where(turning, 1.0, np.where(span > 0, span, 1.0))
    starts = [np.append(np.log(np.clip(f * usual, 0.03, 20.0)), 0.0) for f in (0.15, 0.5, 1.5)]
    start = min(starts, key=lambda u: cost(u)[0])
    best = scipy.optimize.minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 40})
    return np.exp(best.x[:n]), float(np.exp(-0.5 * best.x[n]))


@record
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


@record
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

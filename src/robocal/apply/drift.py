"""Has a robot changed between two calibrations? How far in millimetres, and is that more than matters?

    d = x_2 - x_1,   cov(d) = f (C_1 + C_2) + (B_2 - B_1) S^2 (B_2 - B_1)^T + (frames of each run's own)

C is noise, B answers to the truth (`Total`), S the errors expected without data. Both runs met the same robot: what the
selection did alike to both cancels, and a hidden partner counts only as far as the two runs hid it differently. f is the
scatter of both runs' rows, block by block, over what even noise would give (`scatter`): what a model cannot describe is no
noise.

The verdict is of millimetres (`apart`): *unchanged* where the interval of the change lies below what matters, *drifted*
where it lies above and chance alone would show as much once in a thousand, *possible* else. Beside it stands a joint test of
the parameters, in the space that both runs saw: the directions in which d / S is known to better than half, eigenvalues
of S^-1 cov(d) S^-1 below DRIFT_OBSERVABLE.

    Q = sum_k (v_k^T d)^2 / lambda_k  ~  r F(r, nu)   without a change
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.apply.apart import Apart, apart, shows
from robocal.arms.chain import Chain
from robocal.diagnose.limits import DRIFT_CHANCE, DRIFT_MATTERS, DRIFT_OBSERVABLE
from robocal.diagnose.scatter import Kept, Scatter, scatter
from robocal.estimate.uncertainty import Total
from robocal.geometry import so3
from robocal.quantities import Amount, OwnUnit, Value

__all__ = ["Change", "Drift", "Single", "compare", "differs"]

Array = NDArray[np.float64]
ROUNDING = 1e-14  # tolerance: of a squared ratio of standard deviations
FEW = 5


@dataclass(frozen=True)
class Change:
    """One parameter in both runs (SI): change, its standard deviation without a drift, two-sided chance, and the same
    for the most conspicuous of all (Holm)."""

    name: str
    unit: OwnUnit
    first: Value
    second: Value
    change: Amount
    sigma: Amount
    p_value: float
    p_of_all: float


@dataclass(frozen=True)
class Single:
    """A change of one parameter of the robot as the only cause: its size and standard deviation (SI), and the chance of
    what it leaves unexplained. A robot's parameter need not have been fitted for that."""

    name: str
    unit: OwnUnit
    change: Amount
    sigma: Amount
    p_rest: float


@dataclass(frozen=True)
class Drift:
    """The comparison: how far the robot has changed, against what matters (m); joint statistic Q / r with r and nu degrees of
    freedom and its chance; changes, single causes (the best explanation first), and how far the runs scatter (None where a run
    did not keep its rows)."""

    apart: Apart
    matters: float
    statistic: float
    rank: int
    dof: float
    p_value: float
    changes: tuple[Change, ...]
    singles: tuple[Single, ...]
    scatter: Scatter | None = None

    @property
    def status(self) -> str:
        """unchanged, possible or drifted."""
        if self.apart.low > self.matters and self.apart.p_value < DRIFT_CHANCE:
            return "drifted"
        return "unchanged" if self.apart.high <= self.matters else "possible"


def differs(first: Chain, second: Chain, names: Sequence[str]) -> Array:
    """The step from one table to the other, (n,), rotation vectors in their tangent."""
    a, b = first.table, second.table
    step = {n: b[n].value - a[n].value for n in names}
    for t in a.turns:
        turn = a.names[t : t + 3]
        w = so3.log(so3.exp(np.array([b[n].value for n in turn])) @ so3.exp(a.values[t : t + 3]).T)
        step.update({n: float(v) for n, v in zip(turn, w, strict=True) if n in step})
    return np.array([step[n] for n in names])


def _split(total: Total, names: Sequence[str], other: Sequence[str]) -> tuple[Array, Array, Array, Array]:
    """Noise and response of the shared names, response to names of this run alone, and errors expected of all."""
    size = len(names)
    noise, response, own = np.zeros((size, size)), -np.eye(size), np.zeros((size, 0))
    known = [i for i, n in enumerate(names) if n in total.names]
    at = [total.names.index(names[i]) for i in known]
    noise[np.ix_(known, known)] = total.noise[np.ix_(at, at)]
    response[np.ix_(known, known)] = total.response[np.ix_(at, at)]
    rest = [i for i, n in enumerate(total.names) if n in other]
    own = np.zeros((size, len(rest)))
    own[known] = total.hidden[np.ix_(at, rest)]
    expected = np.zeros(size)
    expected[known] = total.expected[at]
    return noise, response, own, expected


def compare(
    first: Chain,
    second: Chain,
    known: tuple[Total, Total],
    joints: Array,
    conditions: Mapping[str, float],
    *,
    new_tool: bool = False,
    rows: tuple[Kept | None, Kept | None] = (None, None),
    matters: float = DRIFT_MATTERS,
) -> Drift:
    """Compares two corrected models of one nominal robot at joint values (m, n); `rows` are those that the fits left. With
    `new_tool` the tool was mounted anew, so it may differ."""
    a, b = known
    apart_names = {n for n in first.table.names if new_tool and n.startswith("tool.")}
    names = tuple(n for n in first.table.names if (n in a.names or n in b.names) and n not in apart_names)
    parts = [_split(t, names, [n for n in t.names if n not in names]) for t in known]
    expected = np.maximum(parts[0][3], parts[1][3])
    shared = (parts[1][1] - parts[0][1]) * expected
    seen = shows(first, second, names, joints, conditions, new_tool=new_tool)
    noise = parts[0][0] + parts[1][0]
    dof = _together(a, b, parts[0][0], parts[1][0])
    spread = None
    if rows[0] is not None and rows[1] is not None and (seen.x @ noise).any():
        spread = scatter((rows[0], rows[1]), known, names, seen.x)
        noise, dof = spread.factor * noise, min(dof, spread.dof)
    hidden = shared @ shared.T + parts[0][2] @ parts[0][2].T + parts[1][2] @ parts[1][2].T
    covariance = noise + hidden
    step = differs(first, second, names)
    values, vectors = np.linalg.eigh(covariance / np.outer(expected, expected))
    able = (values > ROUNDING) & (values < DRIFT_OBSERVABLE)
    rank = int(able.sum())
    q = float(np.sum((vectors[:, able].T @ (step / expected)) ** 2 / values[able]))
    chance = 1.0 if not rank else float(_tail(q / rank, rank, dof))
    return Drift(
        apart(seen, noise, hidden, dof, joints, matters),
        matters,
        q / max(rank, 1),
        rank,
        dof,
        chance,
        _changes(first, second, names, step, covariance, dof),
        _singles(first, names, expected, (vectors[:, able], values[able]), step, parts[1][1], q, dof),
        spread,
    )


def _together(a: Total, b: Total, first: Array, second: Array) -> float:
    """Degrees of freedom of a sum of two estimated variances (Welch, Satterthwaite), by the traces of their correlations."""
    size = np.sqrt(np.maximum(np.diag(first) + np.diag(second), 1e-300))
    u, v = (float(np.trace(c / np.outer(size, size))) for c in (first, second))
    spread = sum(w**2 / t.dof for w, t in ((u, a), (v, b)) if np.isfinite(t.dof))
    return (u + v) ** 2 / spread if spread > 0 else np.inf


def _singles(
    first: Chain,
    names: Sequence[str],
    expected: Array,
    space: tuple[Array, Array],
    step: Array,
    response: Array,
    q: float,
    dof: float,
) -> tuple[Single, ...]:
    """Every parameter as the only cause: a true change of it by one shows in the estimates as a column of 1 + B."""
    vectors, values = space
    rank = len(values)
    if rank < 2:
        return ()
    size = np.where(expected > 0, expected, 1.0)
    shows = (np.eye(len(names)) + response) / size[:, None] * size
    g = (vectors.T @ shows) / np.sqrt(values)[:, None]
    d = (vectors.T @ (step / size)) / np.sqrt(values)
    norm = np.einsum("kn,kn->n", g, g)
    out = []
    # What shows less than its own expected error over the noise of both runs explains nothing.
    for i in np.flatnonzero((norm > 1.0) & (expected > 0)).tolist():
        amount = float(g[:, i] @ d / norm[i])
        rest = max(q - amount**2 * float(norm[i]), 0.0)
        p = _tail(rest / (rank - 1), rank - 1, dof)
        sigma = float(size[i] / np.sqrt(norm[i]))
        out.append((rest, Single(names[i], first.table[names[i]].unit, amount * float(size[i]), sigma, p)))
    return tuple(single for _, single in sorted(out, key=lambda pair: pair[0])[:FEW])


def _tail(statistic: float, rank: int, dof: float) -> float:
    return float(
        special.chdtrc(rank, rank * statistic) if not np.isfinite(dof) else special.fdtrc(rank, dof, statistic)
    )


def _changes(
    first: Chain, second: Chain, names: Sequence[str], step: Array, covariance: Array, dof: float
) -> tuple[Change, ...]:
    sigma = np.sqrt(np.diag(covariance))
    tested = sigma > 0
    t = np.abs(step) / np.where(tested, sigma, 1.0)
    p = np.where(tested, 2 * special.stdtr(min(dof, 1e9), -t), 1.0)
    # Holm: the k-th smallest of m times m - k + 1, never less than the one before.
    order = np.argsort(p)
    adjusted = np.ones(len(p))
    many, running = int(tested.sum()), 0.0
    for k, i in enumerate(order[:many]):
        running = max(running, min(1.0, float(p[i]) * (many - k)))
        adjusted[i] = running
    return tuple(
        Change(
            n, first.table[n].unit, first.table[n].value, second.table[n].value, float(step[i]), float(sigma[i]), float(p[i]),
            float(adjusted[i]),
        )
        for i, n in enumerate(names) if tested[i]
    )  # fmt: skip

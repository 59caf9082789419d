"""Has a robot changed between two calibrations? The difference of two estimates against what both may be off by.

    d = x_2 - x_1,   cov(d) = C_1 + C_2 + (B_2 - B_1) S^2 (B_2 - B_1)^T + (frames of each run's own)

C is noise, B answers to the truth (`Total`), S the errors expected without data. Both runs met the same robot: what the
selection did alike to both cancels, and a hidden partner counts only as far as the two runs hid it differently. A test
of single parameters would miss what only sums show, so the joint test is in the space that both saw: the directions in
which d / S is known to better than half, eigenvalues of S^-1 cov(d) S^-1 below SEEN.

    Q = sum_k (v_k^T d)^2 / lambda_k  ~  r F(r, nu)   without a change

In the workspace: how far the two models' predictions are apart once the base (and a new tool) is placed best, against
the distribution of that distance without a change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.arms.chain import Chain
from robocal.calibrate.workspace import motion_field
from robocal.estimate.uncertainty import LEVEL, Total
from robocal.geometry import fits, so3

__all__ = ["Apart", "Change", "Drift", "Single", "compare", "differs"]

Array = NDArray[np.float64]
SEEN = 0.25  # of the expected variance: known to half of what was expected
ROUNDING = 1e-14
DRAWS = 20_000
FEW = 5


@dataclass(frozen=True)
class Change:
    """One parameter in both runs (SI): change, its standard deviation without a drift, two-sided chance, and the same
    for the most conspicuous of all (Holm)."""

    name: str
    unit: str
    first: float
    second: float
    change: float
    sigma: float
    p_value: float
    p_of_all: float


@dataclass(frozen=True)
class Single:
    """A change of one parameter of the robot as the only cause: its size and standard deviation (SI), and the chance of
    what it leaves unexplained. A robot's parameter need not have been fitted for that."""

    name: str
    unit: str
    change: float
    sigma: float
    p_rest: float


@dataclass(frozen=True)
class Apart:
    """Distance of the two models' predictions over the workspace (m): rms and largest, the rms expected without a drift
    and its 95 % limit, the chance of as much, and the rms that a drift adds (0 when nothing is left)."""

    rms: float
    largest: float
    expected: float
    limit: float
    p_value: float
    drift: float
    place: tuple[float, float, float]
    joints: tuple[float, ...]
    n: int


@dataclass(frozen=True)
class Drift:
    """The comparison: joint statistic Q / r with r and nu degrees of freedom, its chance, changes and distance."""

    statistic: float
    rank: int
    dof: float
    p_value: float
    changes: tuple[Change, ...]
    apart: Apart
    singles: tuple[Single, ...]  # the best explanation first

    @property
    def drifted(self) -> bool:
        """Whether chance alone would show as much in fewer than one comparison in twenty."""
        return self.p_value < 1 - LEVEL


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
    own[known] = (total.response * total.expected)[np.ix_(at, rest)]
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
) -> Drift:
    """Compares two corrected models of one nominal robot; `joints` (m, n) sample the workspace. With `new_tool` the tool
    was mounted anew, so it may differ."""
    a, b = known
    apart_names = {n for n in first.table.names if new_tool and n.startswith("tool.")}
    names = tuple(n for n in first.table.names if (n in a.names or n in b.names) and n not in apart_names)
    parts = [_split(t, names, [n for n in t.names if n not in names]) for t in known]
    expected = np.maximum(parts[0][3], parts[1][3])
    shared = (parts[1][1] - parts[0][1]) * expected
    covariance = (
        parts[0][0] + parts[1][0] + shared @ shared.T + parts[0][2] @ parts[0][2].T + parts[1][2] @ parts[1][2].T
    )
    step = differs(first, second, names)
    dof = _together(a, b, parts[0][0], parts[1][0])
    scaled = covariance / np.outer(expected, expected)
    values, vectors = np.linalg.eigh(scaled)
    seen = (values > ROUNDING) & (values < SEEN)
    rank = int(seen.sum())
    q = float(np.sum((vectors[:, seen].T @ (step / expected)) ** 2 / values[seen]))
    chance = 1.0 if not rank else float(_tail(q / rank, rank, dof))
    return Drift(
        q / max(rank, 1),
        rank,
        dof,
        chance,
        _changes(first, second, names, step, covariance, dof),
        _apart(first, second, names, covariance, joints, conditions, dof, new_tool),
        _singles(first, names, expected, (vectors[:, seen], values[seen]), step, parts[1][1], q, dof),
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


def _apart(
    first: Chain, second: Chain, names: Sequence[str], covariance: Array, joints: Array, conditions: Mapping[str, float],
    dof: float, new_tool: bool,
) -> Apart:  # fmt: skip
    """How far the predictions are apart over the workspace."""
    if new_tool:
        tool = {n: first.table[n].value for n in first.table.names if n.startswith("tool.")}
        second = replace(second, table=second.table.with_values(tool))
    pose = first.pose(joints, conditions)
    here, there = pose[:, :3, 3], second.pose(joints, conditions)[:, :3, 3]
    t = fits.rigid(there, here)
    gap = there @ t[:3, :3].T + t[:3, 3] - here
    field = motion_field(here)[:, :3]
    if new_tool:
        field = np.concatenate([field, pose[:, :3, :3]], axis=2)
    flat = field.reshape(-1, field.shape[2])
    jac = first.parameter_jacobian(joints, names, conditions)[:, :3].reshape(len(flat), -1)
    both = np.column_stack([gap.ravel(), jac])
    both = both - flat @ np.linalg.lstsq(flat, both, rcond=None)[0]
    gap, jac = both[:, 0].reshape(-1, 3), both[:, 1:]
    size = np.linalg.norm(gap, axis=1)
    square = float(np.mean(size**2))
    # d^T (J^T J / m) d with d ~ N(0, cov): a sum of chi squared with these weights.
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    weights = np.linalg.svd(jac @ root / np.sqrt(len(gap)), compute_uv=False) ** 2
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((DRAWS, len(weights))) ** 2 @ weights
    if np.isfinite(dof):
        draws = draws * dof / rng.chisquare(dof, DRAWS)
    expected = float(weights.sum())
    worst = int(np.argmax(size))
    return Apart(
        float(np.sqrt(square)),
        float(size[worst]),
        float(np.sqrt(expected)),
        float(np.sqrt(np.percentile(draws, 100 * LEVEL))),
        float((1 + np.sum(draws >= square)) / (1 + DRAWS)),
        float(np.sqrt(max(square - expected, 0.0))),
        (float(here[worst, 0]), float(here[worst, 1]), float(here[worst, 2])),
        tuple(float(v) for v in joints[worst]),
        len(gap),
    )

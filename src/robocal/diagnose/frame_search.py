"""What rows say of frames and zeros that may have moved, by configuration; formulas in `frame_steps`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.estimate.elimination import TOGETHER, beside_blocks
from robocal.estimate.problem import Problem
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["BestStep", "FrameSearch", "FrameSums"]

MEDIAN = 5.348  # of chi2 with six degrees of freedom
SOFT = 1e-3  # tolerance: of a column's own information: what the model answers but for this much is not seen


@record
class FrameSums:
    """Of one unit what every configuration says: g (U, q), A (U, q, q), X (U, q, n) and X H; its configurations in order, (m,)."""

    g: Array
    a: Array
    x: Array
    xh: Array
    views: Ints
    whole: bool  # whether a configuration tells all its numbers: only then is what single ones gain chi2

    def gain(self, profile: Array) -> float:
        """Of a motion in proportion to a profile (m,) over its configurations."""
        s, x, xh = (np.tensordot(profile, v[self.views], 1) for v in (self.g, self.x, self.xh))
        return step_gain(s, np.tensordot(profile**2, self.a[self.views], 1), xh @ x.T)

    def gains(self, order: Ints) -> Array:
        """Of a step before the k-th of its configurations in an order (m,), (m,); NaN where too few lie on either side."""
        m, fewest = len(self.views), int(limits.SEGMENT_VIEWS)
        out = np.full(m, np.nan)
        s, own, x, xh = (np.cumsum(v[self.views][order][::-1], axis=0)[::-1] for v in (self.g, self.a, self.x, self.xh))
        for k in range(fewest, m - fewest + 1):
            out[k] = step_gain(s[k], own[k], xh[k] @ x[k].T)
        return out


def step_gain(s: Array, own: Array, taken: Array) -> float:
    """s^T (own - taken)^-1 s, in units of its own sizes: s (q,) scores, `own` and `taken` (q, q)."""
    size = np.sqrt(np.where(np.diag(own) > 0, np.diag(own), 1.0))
    info = (own - taken) / size[:, None] / size
    info.flat[:: len(info) + 1] += SOFT
    return float(s / size @ np.linalg.solve(info, s / size))


@record
class BestStep:
    """What a unit gains most by, and from which of its configurations on (None: all)."""

    name: str
    first: int | None
    gain: float


class FrameSearch:
    """What the rows of a problem at x say of frames and zeros that may have moved."""

    def __init__(
        self, model: Model, data: DataSet, problem: Problem, x: Array, unit_names: Mapping[str, Sequence[str]]
    ) -> None:
        every = [n for names in unit_names.values() for n in names if n not in problem.free]
        wide = problem.with_free([*problem.free, *dict.fromkeys(every)])
        lin = wide.linearize(x)
        root = np.sqrt(wide.with_loss("huber").slopes(lin.r**2, lin))
        rows = np.empty((len(lin.r), wide.n + 1))
        np.multiply(lin.j, root[:, None], out=rows[:, :-1])
        np.multiply(lin.r, root, out=rows[:, -1])
        left = beside_blocks(replace(lin, j=rows, jl=lin.jl * root[:, None], jm=lin.jm * root[:, None]))[1]
        at = [wide.free.index(f) for f in problem.free]
        n, count, order = problem.n, problem.configurations, np.argsort(lin.configuration, kind="stable")
        ends = np.searchsorted(lin.configuration[order], np.arange(count + 1))
        columns = {name: [wide.free.index(f) for f in names] for name, names in unit_names.items()}
        shown = lin.j != 0
        rows_of = {
            name: np.bincount(lin.configuration[shown[:, c].any(axis=1)], minlength=count)
            for name, c in columns.items()
        }
        self.units: dict[str, FrameSums] = {}
        for name, many in rows_of.items():
            seen, k = np.flatnonzero(many), len(columns[name])
            x, xh = np.zeros((2, count, k, n))
            typical = float(np.median(many[seen])) if len(seen) else 0.0
            self.units[name] = FrameSums(np.zeros((count, k)), np.zeros((count, k, k)), x, xh, seen, typical >= k)
        whole = left.T @ left
        for views, rows in _by_view(left[order], ends):
            for name, u in self.units.items():
                seen = np.flatnonzero(rows_of[name][views])
                own, i = np.swapaxes(rows[seen][..., columns[name]], 1, 2) @ rows[seen], views[seen]
                u.g[i], u.a[i], u.x[i] = own[..., -1], own[..., columns[name]], own[..., at]
        a = whole[np.ix_(at, at)] + np.diag(_informs(problem))
        scale = np.sqrt(np.where(np.diag(a) > 0, np.diag(a), 1.0))
        self.h = np.linalg.pinv(a / scale[:, None] / scale, rcond=1e-12, hermitian=True) / scale[:, None] / scale
        taken = self.h @ whole[at, -1]
        for u in self.units.values():
            u.g[u.views] -= u.x[u.views] @ taken
            u.xh[u.views] = (u.x[u.views].reshape(-1, n) @ self.h).reshape(u.x[u.views].shape)

    def dispersion(self) -> float:
        """By how much more than noise single views gain, 1 at least."""
        alone = [
            step_gain(u.g[i], u.a[i], u.xh[i] @ u.x[i].T) / u.g.shape[1]
            for u in self.units.values()
            for i in u.views.tolist()
            if u.g.shape[1] == len(FRAME_SYMBOLS) and u.whole
        ]
        return max(1.0, float(np.median(alone)) / MEDIAN * len(FRAME_SYMBOLS)) if alone else 1.0

    def best(self, name: str, stated: bool) -> BestStep | None:
        """The step of a unit that gains most; `stated` asks whether it ever was where it is said to be."""
        u = self.units[name]
        m, fewest = len(u.views), int(limits.SEGMENT_VIEWS)
        if m < fewest or not u.whole:
            return None
        tried: list[tuple[float, int | None]] = [(u.gain(np.ones(m)), None)] if stated else []
        gains = u.gains(np.arange(m))
        tried += [(float(gains[k]), k) for k in range(fewest, m - fewest + 1)]
        if not tried:
            return None
        gain, k = max(tried, key=lambda t: t[0])
        if k is not None and self._slow(u, k, gain):
            return None
        return BestStep(name, None if k is None else int(u.views[k]), gain)

    def _slow(self, u: FrameSums, k: int, gain: float) -> bool:
        """Whether a ramp about the same place explains more than the step."""
        m = len(u.views)
        at, width = np.arange(m) + 0.5, 2 * int(limits.SEGMENT_VIEWS)
        while width <= 2 * m:
            if u.gain(np.clip((at - k) / width + 0.5, 0, 1)) > gain:
                return True
            width *= 2
        return False


def _by_view(rows: Array, ends: Ints) -> Iterator[tuple[Ints, Array]]:
    """Configurations (b,) with as many rows, some at a time, and their rows (b, k, n), of rows (N, n) in the order of configurations;
    `ends` (U + 1,) is where each begins."""
    counts = np.diff(ends)
    for k in np.unique(counts[counts > 0]):
        views = np.flatnonzero(counts == k)
        step = max(1, TOGETHER // (k * rows.shape[1]))
        for first in range(0, len(views), step):
            some = views[first : first + step]
            yield some, rows[ends[some][:, None] + np.arange(k)]


def _informs(problem: Problem) -> Array:
    """1 / sigma^2 of the free columns that have a prior, (n,)."""
    priors = [problem.table[n].prior if problem.table[n].prior_informs else None for n in problem.free]
    return np.array([0.0 if p is None else p**-2.0 for p in priors])

"""What is left that grows along a file: something warmed up or settled while it was measured.

    r + J dx + u J d = noise,    u_i = (t_i - mean t) / (t_last - t_first)

d is how far everything that was fitted drifted from the first row to the last, each held as softly as its expected error. A model that
lacks something leaves errors that wander along a path, and many columns follow any wandering. So the same columns are tried with
polynomials of time of higher degree in place of u (Legendre's): what drifts is explained far better by the first than by any other.

At the file's last row the machine is half of that drift away from what was identified, and afterwards it stays there or goes
on. No held-out row of the same file shows that. So the size is told, and what the error is then.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.diagnose.fit_checks import findings_of_segments
from robocal.diagnose.path_rates import time_order
from robocal.estimate.elimination import beside_blocks
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Linear
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.measure.rows import Rows
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["growth"]

GROWTH = declare(
    "residual-grows",
    "{group}: what is left grows along the file, by {size:.3g} from its first row to its last ({share:.0%} of the squared residuals): "
    "something warmed up or settled; after the file expect an error of {after:.3g} rms, not of {left:.3g}",
    "Measure once the machine and the instrument are warm, or record the temperature (a temperature column). Measure a few places of "
    "the beginning again at the end: the difference is the drift.",
)
HOLD = 10.0  # expected errors, as softly as in `stated_numbers`
FACTOR = 1e-3  # grid: of a length, a change by warmth and more
EPS = 1e-9  # tolerance: of a column: what is less is rounding
DEGREES = (2, 3, 4, 5)  # grid: polynomials that a drift is compared with


@dataclass(frozen=True)
class FileDrift:
    """What columns that a polynomial of time multiplies explain: the squares, less what chance explains, their share of all, how
    likely so much is by chance, and what every whitened row is off by at the end of the file, (N,)."""

    gain: float
    share: float
    chance: float
    end: Array


@check("growth", When.FIT, order=172, needs=("fit",))
def growth(context: Context[Model]) -> Iterator[Finding]:
    """What drifted along the file, of the instrument that shows most of it: by how much, and what the error is at its end."""
    fit, lin = context.need_fit, context.jacobian
    if not fit.problem.n or not len(lin.r):
        return
    there = _time(fit.data)[lin.configuration]
    if len(np.unique(lin.configuration[there != 0])) < limits.GROWTH_CONFIGURATIONS:
        return
    first = max(
        (d for w in _ways(context) if (d := _find(lin, there, fit.problem, w))), key=lambda d: d.gain, default=None
    )
    if first is None or findings_of_segments.run(context):
        return  # what stood elsewhere from a row on grew at once
    largest = None
    for (group, unit), (sigma, rows) in _lengths(context).items():
        count = len(np.unique(lin.observation[rows]))
        end, rest = (float(np.sqrt(((v[rows] * sigma) ** 2).sum() / count)) for v in (first.end, lin.r))
        if largest is None or end * largest[2] > largest[1] * rest:
            largest = group, end, rest, unit
    if largest is not None:
        group, end, rest, unit = largest
        # Of the squares that are left a third of the end's is drift already.
        size, left, after = (Quantity(v, unit) for v in (2 * end, rest, float(np.hypot(rest, end * np.sqrt(2 / 3)))))
        yield doubt(GROWTH, group=group, size=size, left=left, after=after, share=first.share)


def _time(data: DataSet) -> Array:
    """When every configuration was measured within its file, from -1 at the first to 1 at the last, (U,)."""
    order, clock, _ = time_order(data.configurations)
    file, out = np.zeros(len(order), dtype=np.int64), np.zeros(len(order))
    for number, obs in reversed(list(enumerate(data.observations))):
        file[obs.configuration] = number
    for number in np.unique(file):
        mine = file[order] == number
        if np.ptp(clock[mine]):
            out[order[mine]] = 2 * (clock[mine] - clock[mine][0]) / np.ptp(clock[mine]) - 1
    return out


def _ways(context: Context[Model]) -> list[Array]:
    """What may drift, as columns (n, k) of what was fitted, each as large as it may be expected: all lengths by one factor, a frame, and
    everything. Few columns tell a drift from the errors of a model along a path, many tell any drift of places one by one."""
    problem, model, out = context.need_fit.problem, context.model, []
    row = dict(zip(problem.free, np.diag(problem.scales), strict=True))
    long = [n for n in problem.free if n in model.geometric and problem.table[n].unit == "m"]
    if long:
        out.append(sum(row[n] / row[n].max() * context.values[n] * FACTOR for n in long)[:, None])
    frames = dict.fromkeys(o.frame.name for o in context.need_fit.data.observations if o.frame is not None)
    for frame in frames:
        own = [row[n] for s in FRAME_SYMBOLS if (n := f"{frame}.{s}") in row]
        if own:
            out.append(np.stack(own, axis=1))
    return [*out, np.diag(problem.scales)]


def _find(lin: Linear, time: Array, problem: Problem, way: Array) -> FileDrift | None:
    """The drift of some columns with time (N,), from -1 to 1, where it is beyond chance, of consequence, and no other slow change."""
    first = _explain(lin, time, problem, way)
    if first is None or first.chance > limits.GROWTH_CHANCE or first.share < limits.GROWTH_SHARE:
        return None
    others = (_explain(lin, scipy.special.eval_legendre(k, time), problem, way) for k in DEGREES)
    return None if any(o is not None and first.gain < limits.GROWTH_CLEARLY * o.gain for o in others) else first


def _explain(lin: Linear, factor: Array, problem: Problem, way: Array) -> FileDrift | None:
    """What columns way (n, k) of all explain once more where a factor (N,) of time multiplies them; None where nothing is left to tell."""
    n, k = way.shape
    there = lin.j @ way
    taken, left = beside_blocks(replace(lin, j=np.hstack([lin.j, factor[:, None] * there, lin.r[:, None]])))
    held = np.vstack([left, np.hstack([np.diag(1 / (HOLD * problem.scales)), np.zeros((n, k + 1))])])
    q, _ = np.linalg.qr(held[:, :n])
    rest = held[:, n:] - q @ (q.T @ held[:, n:])
    c, r = rest[:, :k], rest[:, -1]
    inner, outer = c.T @ c, c.T @ r
    known = np.linalg.inv(inner + np.eye(k))
    gain, many = float(outer @ known @ outer), float(np.trace(known @ inner))
    square = float(r @ r)
    dof = len(lin.r) - problem.repeated - float(taken.sum()) - n - many
    if dof < 1 or many < EPS or square <= gain:
        return None
    noise = (square - gain) / dof
    more = max(gain - many * noise, 0.0)
    chance = float(scipy.special.fdtrc(many, dof, gain / many / noise))
    # A mean of u^2 is a third: what is seen of the drift, at the end of the file. What the fit itself took up shows nowhere.
    end = np.sqrt(3 * more / gain) * (c[: len(lin.r)] @ (known @ -outer))
    return FileDrift(more, more / square, chance, end)


def _lengths(context: Context[Model]) -> dict[tuple[str, str], tuple[Array, Ints]]:
    """Of every instrument and the unit of its first numbers: their standard deviations, and which rows of `linearize` they are."""
    problem, out, count = context.need_fit.problem, dict[tuple[str, str], list[tuple[Array, Ints]]](), 0
    for term in problem.terms:
        assert isinstance(term, Rows)
        sigma = term.sigma[term.used & problem.in_use[term.configuration]]
        rows = count + np.arange(sigma.size).reshape(sigma.shape)
        count += sigma.size
        first, stop, unit = term.parts[0]
        if term.reading:
            part = sigma[:, first:stop].ravel(), rows[:, first:stop].ravel()
            out.setdefault((term.group, unit), []).append(part)
    return {key: (np.concatenate([s for s, _ in v]), np.concatenate([r for _, r in v])) for key, v in out.items()}

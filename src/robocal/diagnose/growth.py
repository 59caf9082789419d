"""What is left that grows along a file: something warmed up or settled while it was measured.

    r + J dx + u J d = noise,    u_i = 2 (t_i - t_first) / (t_last - t_first) - 1

d is how far everything that was fitted is off at the end of the file, each held as softly as its expected error. A model that lacks
something leaves errors that wander along a path, and many columns follow any wandering. So the same columns are tried with
polynomials of time of higher degree in place of u (Legendre's): what drifts is explained far better by the first than by any other.

At the file's last row the machine is d away from the middle. The fit took up s of it, the least squares of u J d by J s; in random order
that is next to nothing. A row shows (u J d - J s) in its error e, and J (d - s) at the end of the file:

    e_end^2 = e^2 + |J d - J s|^2 - |u J d - J s|^2

No held-out row shows that by itself. So beside what unseen rows are missed by, the error at the end is claimed (`error_growth`), and
J (d - s) is in every band (`move_at_end`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, once
from robocal.diagnose.fit_checks import findings_of_segments
from robocal.diagnose.path_rates import time_order
from robocal.estimate.elimination import beside_blocks, beside_each
from robocal.estimate.problem import Problem
from robocal.estimate.sparse_rows import blocks_of
from robocal.estimate.terms import Linear, Residuals
from robocal.fit.free_poses import own_poses
from robocal.fit.misfit import errors
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["FileDrift", "at_end", "drift_of_file", "error_growth", "largest_growth", "move_at_end"]

HOLD = 10.0  # expected errors, as softly as in `stated_numbers`
FACTOR = 1e-3  # grid: of a length, a change by warmth and more
EPS = 1e-9  # tolerance: of a column: what is less is rounding
DEGREES = (2, 3, 4, 5)  # grid: polynomials that a drift is compared with


@record
class FileDrift:
    """What columns that a polynomial of time multiplies explain: the squares, less what chance explains, their share of all, how
    likely so much is by chance, and which share of the columns' effect the fit did not take up. Of every fitted column how far it went
    from the middle of the file to its end, (n,), and what the fit took up of that, (n,)."""

    gain: float
    share: float
    chance: float
    observable: float
    step: Array
    taken: Array


@once
def drift_of_file(context: Context[Model]) -> FileDrift | None:
    """What drifted along the files; None where nothing did, or where something stood elsewhere from a row on: that grew at once."""
    fit, lin = context.need_fit, context.jacobian
    if not fit.problem.n or not len(lin.r):
        return None
    there = _time(fit.data)[lin.configuration]
    if len(np.unique(lin.configuration[there != 0])) < limits.GROWTH_CONFIGURATIONS:
        return None

    @cache
    def sums(degree: int) -> tuple[float, Array]:
        factor = there if degree == 1 else scipy.special.eval_legendre(degree, there)
        return _sums(lin, factor, fit.problem.scales)

    found = (d for w in _ways(context) if (d := _find(lin, sums, fit.problem, w)))
    first = min(found, key=lambda d: d.chance, default=None)
    return None if first is None or findings_of_segments.run(context) else first


def error_growth(
    context: Context[Model], posed: Problem | None = None, seen: Problem | None = None
) -> dict[str, Array]:
    """By unit, what the square of each row's error grows by until the end of its file, (N,) in the order of `errors`; nothing where
    nothing drifted. Of the rows of `seen`, with poses found from those of `posed` alone, where these are given."""
    drift = drift_of_file(context)
    if drift is None:
        return {}
    end, now = _changes(context, drift, posed, seen)
    units = dict.fromkeys(u for r in end for *_, u in r.parts)
    return {u: errors(end, u)[0] ** 2 - errors(now, u)[0] ** 2 for u in units}


def move_at_end(context: Context[Model], names: Sequence[str]) -> Array:
    """How far parameters are off at the end of the file beside what was fitted, (k,): zero where nothing drifted, or what was not
    fitted."""
    drift, free = drift_of_file(context), context.need_fit.problem.free
    if drift is None:
        return np.zeros(len(names))
    moved = dict(zip(free, drift.step - drift.taken, strict=True))
    return np.array([moved.get(n, 0.0) for n in names])


def at_end(values: Array, growth: Mapping[str, Array], unit: str) -> Array:
    """Errors (N,) in one unit as they are at the end of the file, by what their squares grow by."""
    return values if unit not in growth else np.sqrt(np.maximum(values**2 + growth[unit], 0.0))


def _changes(
    context: Context[Model], drift: FileDrift, posed: Problem | None = None, seen: Problem | None = None
) -> tuple[list[Residuals], list[Residuals]]:
    """What rows are off by at the end of the file, and what they show of it when they are measured. Poses of configurations are found
    anew from their rows; where the same rows are looked at, these changes are enlarged as errors of such poses are."""
    problem, x = posed or context.need_fit.problem, context.need_fit.solution.x
    where = [x, problem.retract(x, drift.step[None]), problem.retract(x, drift.taken[None])]
    many, wide = np.concatenate(where), np.ones(problem.configurations)
    if problem.blocks:
        many, factor, _ = own_poses(problem, many, np.ones((len(many), len(wide)), dtype=bool))
        wide = np.nan_to_num(factor[0]) if seen is None else wide
    time, end, now = _time(context.need_fit.data), list[Residuals](), list[Residuals]()
    for r, moved, taken in zip(*((seen or problem).residuals(v[None]) for v in many), strict=True):
        far, own = moved.value - r.value, taken.value - r.value
        for out, at in ((end, np.ones_like(time)), (now, time)):
            out.append(replace(r, value=(at[r.configuration, None] * far - own) * wide[r.configuration, None]))
    return end, now


def largest_growth(context: Context[Model], drift: FileDrift) -> tuple[str, str, float]:
    """The instrument that shows most of a drift, its SI unit, and by how much that grows from the first row to the last."""
    groups: dict[tuple[str, str], list[Array]] = {}
    for r, end in zip(context.residuals, _changes(context, drift)[0], strict=True):
        if r.reading:
            numbers = np.stack([v.length()[r.used] ** 2 for v in (r, end)])
            groups.setdefault((r.group, r.parts[0][2]), []).append(numbers)
    told = {key: np.concatenate(v, axis=1).mean(axis=1) for key, v in groups.items()}
    (group, unit), (_, end) = max(told.items(), key=lambda item: item[1][1] / item[1][0])
    return group, unit, 2 * float(np.sqrt(end))


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


Sums = Callable[[int], tuple[float, Array]]


def _find(lin: Linear, sums: Sums, problem: Problem, way: Array) -> FileDrift | None:
    """The drift of some columns with time, from -1 to 1, where it is beyond chance, of consequence, and no other slow change; the sums
    are by the degree of the polynomial."""
    first = _explain(lin, *sums(1), problem, way)
    if (
        first is None
        or first.chance > limits.GROWTH_CHANCE
        or first.share < limits.GROWTH_SHARE
        or first.observable < limits.GROWTH_SEEN
    ):
        return None
    others = (_explain(lin, *sums(k), problem, way) for k in DEGREES)
    return None if any(o is not None and first.gain < limits.GROWTH_CLEARLY * o.gain for o in others) else first


def _sums(lin: Linear, factor: Array, scale: Array) -> tuple[float, Array]:
    """How many numbers local blocks take, and the products (2 n + 1, 2 n + 1) of all columns, of the same where a factor (N,) of time
    multiplies them, and of what is left. Each column is as large as its error may be."""
    n = len(scale)
    if not _one_time(lin, factor):
        j = lin.j * scale
        own, left = beside_blocks(replace(lin, j=np.hstack([j, factor[:, None] * j, lin.r[:, None]])))
        return float(own.sum()), left.T @ left
    # What a block leaves of columns is multiplied as they are: by products of the columns alone, of half the width.
    j = np.empty((len(lin.j), n + 1))
    np.multiply(lin.j, scale, out=j[:, :n])
    j[:, n] = lin.r
    plain, once, twice = np.zeros((3, n + 1, n + 1))
    taken, alone = 0.0, lin.local < 0
    for rows, own, mine in beside_each(lin, j):
        taken += float(np.sum(own**2))
        _add_products(mine.reshape(-1, n + 1), factor[rows.ravel()], slice(None), plain, once, twice)
    rest, late = (j, factor) if alone.all() else (j[alone], factor[alone])
    for at, felt in blocks_of(rest):
        _add_products(rest[at, felt], late[at], felt, plain, once, twice)
    products = np.empty((2 * n + 1,) * 2)
    products[:n, :n], products[:n, n:-1], products[:n, -1] = plain[:n, :n], once[:n, :n], plain[:n, n]
    products[n:-1, :n], products[n:-1, n:-1], products[n:-1, -1] = once[:n, :n], twice[:n, :n], once[:n, n]
    products[-1, :n], products[-1, n:-1], products[-1, -1] = plain[n, :n], once[:n, n], plain[n, n]
    return taken, products


def _add_products(rows: Array, factor: Array, columns: Ints | slice, plain: Array, once: Array, twice: Array) -> None:
    """Adds the products of rows (m, k), of these and them times a factor (m,), and of the latter, to those of all columns."""
    at = columns if isinstance(columns, slice) else np.ix_(columns, columns)
    square = rows.T @ rows
    plain[at] += square
    if len(factor) and (factor == factor[0]).all():
        once[at] += factor[0] * square
        twice[at] += factor[0] ** 2 * square
        return
    late = factor[:, None] * rows
    once[at] += rows.T @ late
    twice[at] += late.T @ late


def _explain(lin: Linear, taken: float, sums: Array, problem: Problem, way: Array) -> FileDrift | None:
    """What columns way (n, k) of all explain once more where time multiplies them, by their sums; None where nothing is left to tell."""
    (n, k), scale = way.shape, problem.scales
    # What was fitted is held: products have digits to spare.
    chosen = np.zeros((2 * n + 1, n + k + 1))
    chosen[:n, :n], chosen[n:-1, n:-1], chosen[-1, -1] = np.eye(n), way / scale[:, None], 1.0
    products = chosen.T @ sums @ chosen
    fitted = np.linalg.solve(products[:n, :n] + np.eye(n) / HOLD**2, products[:n, n:])
    rest = products[n:, n:] - products[n:, :n] @ fitted
    inner, outer, square = rest[:k, :k], rest[:k, -1], float(rest[-1, -1])
    known = np.linalg.inv(inner + np.eye(k))
    gain, many = float(outer @ known @ outer), float(np.trace(known @ inner))
    dof = len(lin.r) - problem.repeated - taken - n - many
    if dof < 1 or many < EPS or square <= gain:
        return None
    noise = (square - gain) / dof
    more = gain - many * noise
    if more <= 0:
        return None
    chance = float(scipy.special.fdtrc(many, dof, gain / many / noise))
    by = np.sqrt(more / gain) * (known @ -outer)
    observable = float(by @ inner @ by / (by @ products[n:-1, n:-1] @ by))
    return FileDrift(more, more / square, chance, observable, way @ by, scale * (fitted[:, :k] @ by))


def _one_time(lin: Linear, factor: Array) -> bool:
    """Whether all rows of every local block have one factor (N,)."""
    inside = lin.local >= 0
    if lin.jm.shape[1] or not lin.jl.shape[1] or not inside.any():
        return not lin.jm.shape[1]
    block, own = lin.local[inside], factor[inside]
    first = np.full(int(block.max()) + 1, np.nan)
    first[block] = own
    return bool((first[block] == own).all())

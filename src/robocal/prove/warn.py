"""What a careful colleague would say about the data and the fit; among it whether errors follow those measured just before, more than
like poses explain (`follow`).

    t_i = sum_h w_i . (w_{i+h} - w_{j(i, h)}) / 4,   h = 1 to 4,    z = sum t / sqrt(sum t^2),    share = sum t / sum |w_i|^2

w are whitened residuals in the order of time. What a model leaves is a smooth function of the pose, and who measures cubes or
grids measures like poses one after the other: on real sets the lag-one product alone is large for that reason. So each pair of
neighbours in time is held against a pair as far apart in joint space, that was measured at quite another time: the errors
of both resemble each other for the pose's sake, those of the first for the time's sake besides. Where nobody measured like
poses at other times, the two cannot be told apart, and nothing is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.diagnose.limits import (
    COMPUTED_ERROR,
    COMPUTED_FREEDOM,
    FOLLOW_ALIKE,
    FOLLOW_PAIRS,
    FOLLOW_SHARE,
    FOLLOW_SIGMA,
    IMPLAUSIBLE_CHANGE,
    NOISE_ABOVE,
    NOISE_BELOW,
    NOISE_CHANCE,
    NUMBERS_PER_PARAMETER,
    PLANE_POINTS,
    PLANE_THICKNESS,
    UNMADE_SIGMA,
)
from robocal.diagnose.motions import open_remarks
from robocal.diagnose.numbers import reads
from robocal.diagnose.outliers import Outlier
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.geometry import fits
from robocal.measure.data import DataSet
from robocal.measure.machine import Machine
from robocal.measure.rows import KINDS, Rows
from robocal.prove.bands import total_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

if TYPE_CHECKING:
    from robocal.estimate.problem import Problem
    from robocal.fit.fit import Fit

__all__ = ["ABSOLUTE", "data_warnings", "few_numbers", "follows", "implausible", "input_remarks", "unmade"]

ABSOLUTE = ("position", "pose")  # kinds that read coordinates


def data_warnings(
    model: Machine,
    data: DataSet,
    fit: Fit,
    configurations: NDArray[np.int64],
    method: str = "lm",
    strange: Sequence[Outlier] = (),
) -> tuple[Remark, ...]:
    """What the inputs show before a fit, too few numbers, restarts, model error far above the stated noise."""
    out = [*input_remarks(model, data), *few_numbers(int(fit.problem.numbers.sum()), fit.problem.n)]
    bent = implausible(model, fit)
    # A known distance between sockets is no reading; and of an arm that was bent to a point everything is exact.
    arms = {o.label for o in data.observations if reads(o)} if not bent else set()
    for g in fit.groups:
        if g.stated is not None and g.tau > NOISE_ABOVE * g.stated:
            left, stated = Quantity(g.rms, g.unit), Quantity(g.stated, g.unit)
            out.append(Remark.of(Code.ABOVE_STATED_NOISE, group=g.name, left=left, stated=stated))
        if (
            g.name in arms
            and g.stated is not None
            and g.chi2 is not None
            and special.chdtr(g.dof, NOISE_BELOW**2 * g.chi2) < NOISE_CHANCE
        ):
            left, stated = Quantity(g.rms, g.unit), Quantity(g.stated, g.unit)
            out.append(Remark.of(Code.BELOW_STATED_NOISE, group=g.name, left=left, stated=stated))
        if g.name in arms and g.unit == "m" and g.rms < COMPUTED_ERROR and g.dof > COMPUTED_FREEDOM:
            out.append(Remark.of(Code.COMPUTED, group=g.name, left=Quantity(g.rms)))
    # A machine that stands where its own sensors say has coordinates only as far as something sees them.
    if model.freedom and not any(o.frame or o.targets or o.kind in ABSOLUTE for o in data.observations):
        out.append(Remark.of(Code.PLACE_OPEN))
    out.extend(open_remarks(model, fit))
    rows_of = [fit.problem.table[n] for n in fit.problem.free]
    if estimator(method).blind and any(p.prior or np.isfinite([p.lower, p.upper]).any() for p in rows_of):
        out.append(Remark.of(Code.PRIORS_IGNORED, method=method))
    out.extend(fit.notes)
    out.extend(bent)
    out.extend(_outliers(strange, fit))
    out.extend(_drift(data, fit))
    if fit.restarted:
        out.append(Remark.of(Code.RESTARTED, starts=fit.restarted))
    return tuple(out)


def few_numbers(numbers: int, parameters: int) -> tuple[Remark, ...]:
    """Fewer than two measured numbers to a parameter."""
    few = numbers < NUMBERS_PER_PARAMETER * parameters
    return (Remark.of(Code.FEW_MEASUREMENTS, numbers=numbers, parameters=parameters),) if few else ()


def input_remarks(model: Machine, data: DataSet | None = None) -> tuple[Remark, ...]:
    """What a model and measurements show before anything is fitted: parallel axes that the convention cannot tilt, identical
    poses, joints that stand still, points of one plane."""
    out: list[Remark] = list(model.remarks())
    if data is None:
        return tuple(out)
    q = data.configurations.joints
    q = None if q is None else q[np.isfinite(q).all(axis=1)]
    if q is not None and len(q) > 1 and np.ptp(q, axis=0).max(initial=0.0) < STILL:
        out.append(Remark.of(Code.ONE_PLACE))
    elif q is not None and len(q) > 1:
        still = [n for n, s in zip((j.name for j in model.joints), np.ptp(q, axis=0), strict=True) if s < STILL]
        if still:
            out.append(Remark.of(Code.JOINTS_STILL, joints=tuple(still)))
    spatial = model.freedom is None or {0, 1, 2} <= set(model.freedom)
    for obs in data.observations:
        if spatial and obs.kind in ("position", "pose") and len(obs) >= PLANE_POINTS and obs.value.ndim == 2:
            points = obs.value[:, :3] if obs.used is None else obs.value[obs.used, :3]
            if len(points) < PLANE_POINTS:
                continue
            extent = float(np.linalg.norm(np.ptp(points, axis=0)))
            off = float(np.abs(fits.plane(points)[2]).max())
            if extent > 0 and off < PLANE_THICKNESS * extent:
                out.append(Remark.of(Code.ONE_PLANE, group=obs.label, off=Quantity(off)))
    return tuple(out)


def _outliers(strange: Sequence[Outlier], fit: Fit) -> list[Remark]:
    """Rows that do not belong to the others, counted by instrument."""
    out = []
    for group in dict.fromkeys(o.group for o in strange):
        mine = [o for o in strange if o.group == group]
        total = sum(len(t.configuration) for t in fit.problem.terms if t.group == group)
        for code, some in (
            (Code.OUTLIERS, [o for o in mine if o.set_aside]),
            (Code.STRANGE, [o for o in mine if not o.set_aside]),
        ):
            if some:
                first, far = some[0].configuration, some[0].distance if np.isfinite(some[0].distance) else None
                counted = sum(o.counted for o in some) if code is Code.OUTLIERS else 0
                told = Remark.of(
                    code, group=group, count=len(some), total=total, configuration=first, distance=far, counted=counted or None
                )  # fmt: skip
                out.append(told)
    return out


def implausible(model: Machine, fit: Fit) -> list[Remark]:
    """Changes that no arm's making leaves: the nominal model, the order or the signs of the joints are likelier wrong."""
    names = [n for n in fit.problem.free if n in model.geometric]
    table = fit.problem.table
    x = fit.solution.x[0]
    found = []
    for n in names:
        change = abs(x[table.index[n]] - model.table[n].value)
        if change > IMPLAUSIBLE_CHANGE * model.table[n].scale:
            found.append((change / model.table[n].scale, f"{n} by {Quantity(change, table[n].unit):.3g}"))
    if not found:
        return []
    worst = tuple(words for _, words in sorted(found, reverse=True)[:3])
    return [Remark.of(Code.IMPLAUSIBLE, changes=worst)]


def unmade(model: Machine, stated: Problem, fit: Fit) -> list[Remark]:
    """Lengths and angles between axes that changed, beyond doubt, as no arm's making leaves them: what was written and what
    the data say. A joint's zero may be anywhere; and where parallel axes are written without Hayati's beta, a small tilt
    moves lengths along them by metres."""
    exempt = model.anywhere
    x, table = fit.solution.x, fit.problem.table
    built = {s for t in fit.problem.terms if isinstance(t, Rows) for s in KINDS[t.kind].made}
    beside = {p.name: p for p in stated.table.rows if p.name.rpartition(".")[2] in built and p.name not in model.table}
    drawn = {n: model.table[n] for n in model.geometric if n not in exempt} | beside
    off = total_of(fit)  # with what hidden partners may be off by: a column that stands for several may move far
    sigma = dict(zip(off.names, off.sigma, strict=True))
    found = []
    for n in fit.problem.free:
        if n not in drawn:
            continue
        nominal, there, scale = drawn[n].value, float(x[0, table.index[n]]), drawn[n].scale
        change = abs(there - nominal)
        if change > IMPLAUSIBLE_CHANGE * scale and change > UNMADE_SIGMA * sigma[n]:
            unit = table[n].unit.removesuffix("1")
            words = f"{n}: you wrote {Quantity(nominal, unit):.4g}, the data say {Quantity(there, unit):.4g}"
            found.append((change / scale, words))
    worst = tuple(words for _, words in sorted(found, reverse=True)[:3])
    return [Remark.of(Code.UNMADE, changes=worst)] if worst else []


def _drift(data: DataSet, fit: Fit) -> list[Remark]:
    """Errors that resemble those measured just before, more than like poses do: something moved or warmed up."""
    found: dict[str, tuple[float, float]] = {}
    for group, z, share in follows(data, fit):
        if z > FOLLOW_SIGMA and share > FOLLOW_SHARE and z > found.get(group, (0.0, 0.0))[0]:
            found[group] = z, share
    return [Remark.of(Code.ERRORS_FOLLOW, group=g, z=z, share=share) for g, (z, share) in found.items()]


Array = NDArray[np.float64]
Ints = NDArray[np.int64]
MOST = 1000  # grid: pairs that are compared
STILL = 1e-9  # tolerance: rad or m; values that were written and read again
NEAR = 4  # grid: rows that are just before or after
APART = 0.1  # grid: of the rows: quite another time
WIDE = 1 << 17  # grid: distances at once: more would leave the cache


def follows(data: DataSet, fit: Fit) -> list[tuple[str, float, float]]:
    """Group, z and share of what errors have in common with those just before, for every term that can tell."""
    q = data.configurations.joints
    if q is None:
        return []
    spread = np.nanstd(q, axis=0)
    place = q / np.where(spread > 0, spread, 1.0)
    out = []
    for r in fit.problem.residuals(fit.solution.x):
        order = np.argsort(r.configuration[r.used], kind="stable")
        found = _excess((r.value * r.scale)[r.used][order], place[r.configuration[r.used][order]])
        if found is not None:
            out.append((r.group, *found))
    return out


def _excess(w: Array, place: Array) -> tuple[float, float] | None:
    """z and share of one term, (m, d) residuals at (m, n) places in the order of time."""
    m = len(w)
    if m < FOLLOW_PAIRS or not (w * w).sum() > 0 or not np.isfinite(place).all():
        return None
    some = np.unique(np.linspace(0, m - 1 - NEAR, min(m - NEAR, MOST)).astype(np.int64))
    t, compared = np.zeros(len(some)), np.zeros(len(some))
    like = _like(place, some, max(5, int(APART * m)))
    for h in range(1, NEAR + 1):
        told = like[h - 1] >= 0
        more = np.einsum("kd,kd->k", w[some], w[some + h] - w[like[h - 1]])
        t += np.where(told, more, 0.0)
        compared += told
    kept = compared > 0
    if kept.sum() < FOLLOW_PAIRS:
        return None
    t = t[kept] / compared[kept]
    square, own = float(t @ t), float((w[some[kept]] ** 2).sum())
    return (float(t.sum()) / np.sqrt(square), float(t.sum()) / own) if square > 0 and own > 0 else None


def _like(place: Array, some: Ints, far: int) -> Ints:
    """For each of some rows and its successors 1 to NEAR, the row of another time whose distance in joint space is nearest to
    that of the successor, (NEAR, k); -1 where all are farther."""
    out = np.full((NEAR, len(some)), -1, dtype=np.int64)
    size = np.einsum("kn,kn->k", place, place)
    each = max(1, WIDE // len(place))
    for first in range(0, len(some), each):
        mine = some[first : first + each]
        row = np.arange(len(mine))
        square = size[mine][:, None] + size - 2 * place[mine] @ place.T
        away = np.sqrt(np.maximum(square, 0.0, out=square), out=square)
        for k, i in enumerate(mine):
            away[k, max(i - far + 1, 0) : i + far] = np.inf
        gap = np.empty_like(away)
        for h in range(1, NEAR + 1):
            reach = np.linalg.norm(place[mine + h] - place[mine], axis=1)
            np.abs(np.subtract(away, reach[:, None], out=gap), out=gap)
            best = np.argmin(gap, axis=1)
            ok = away[row, best] <= FOLLOW_ALIKE * reach + 1e-9
            out[h - 1, first : first + each] = np.where(ok, best, -1)
    return out

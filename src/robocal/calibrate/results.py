"""From a fit to the tables that people read: parameters with their status, rows with their errors, the prediction
band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate.bands import mean_conditions, measured_range
from robocal.calibrate.identification import Band, ParameterResult, RowTable
from robocal.calibrate.workspace import sample_joints
from robocal.estimate.problem import Problem
from robocal.estimate.rows import Residuals
from robocal.estimate.uncertainty import Total, Uncertainty, band, quantile
from robocal.geometry import so3
from robocal.measure.base import KINDS, Rows
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet
from robocal.parameters import Table
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.calibrate.fit import Fit

__all__ = ["parameter_results", "prediction_band", "row_table"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
# A parameter is claimed when the data, with everything else unknown too, narrow it to half of what was expected: share
# 1 - 1/4.
CLAIM = 0.75
SAMPLES = 500
# From here on the hidden partners, not the data, decide how well a parameter is known, and it is said.
WIDER = 1.5
NAMED = 6  # partners that are named


def parameter_results(
    model: Chain, fit: Fit, u: Uncertainty, off: Total, stated: Uncertainty | None
) -> tuple[ParameterResult, ...]:
    """Every parameter of the problem, in table order, with status and note; `off` is what it may be off by in all,
    `stated` the covariance under the stated noise alone."""
    table = fit.problem.table
    seen = fit.identifiability
    values = fit.solution.x[0]
    share = dict(zip(seen.names, seen.share, strict=True))
    total = dict(zip(off.names, off.sigma, strict=True))
    reach = quantile(off.dof)
    parts = _components(table, off, values)
    sigma = dict(zip(fit.problem.free, u.sigma, strict=True))
    instrument = dict(zip(fit.problem.free, stated.sigma_instrument, strict=True)) if stated else {}
    hidden: dict[str, list[str]] = {}
    for combination in seen.combinations:
        for name, _ in combination.partners:
            hidden.setdefault(name, []).append(combination.name)
    by_name = {c.name: c for c in seen.combinations}
    start = np.array([model.table[p.name].value if p.name in model.table else p.value for p in table.rows])
    delta = values[: len(start)] - start
    for t in table.turns:
        # Components of a rotation vector mix; what was turned about which axis is told by the rotation between the two.
        delta[t : t + 3] = so3.log(so3.exp(values[t : t + 3]) @ so3.exp(start[t : t + 3]).T)
    out = []
    for i, row in enumerate(table.rows):
        nominal = model.table[row.name].value if row.name in model.table else row.value
        notes: tuple[Remark, ...] = ()
        if row.name in sigma:
            status = "identified" if share[row.name] >= CLAIM else "prior"
            partners = tuple(hidden.get(row.name, [])[:NAMED])
            if status == "prior" and not partners:
                notes = (Remark.of(Code.LITTLE_SAID),)
            elif status == "prior":
                notes = (Remark.of(Code.ONLY_COMBINATION, partners=partners),)
            elif partners and total[row.name] > WIDER * sigma[row.name]:
                notes = (Remark.of(Code.HIDDEN_PARTNERS, partners=partners),)
            if values[i] <= row.lower or values[i] >= row.upper:
                notes = (Remark.of(Code.AT_BOUND), *notes)
        elif row.name in by_name:
            status, notes = "dropped", (by_name[row.name].remark,)
        else:
            status = "fixed"
        bar = max(total[row.name], sigma[row.name]) if row.name in sigma else None
        half = None if bar is None else reach * parts.get(row.name, bar)
        out.append(
            ParameterResult(
                row.name,
                row.unit,
                nominal,
                float(values[i]),
                float(delta[i]),
                bar,
                _number(instrument, row.name),
                _number(sigma, row.name),
                status,
                _number(share, row.name),
                notes,
                # What was excluded beforehand is not offered as possible.
                None
                if half is None
                else (float(max(values[i] - half, row.lower)), float(min(values[i] + half, row.upper))),
            )
        )
    return tuple(out)


def _components(table: Table, off: Total, values: Array) -> dict[str, float]:
    """Standard deviations of the components of rotation vectors: `off` speaks of turns w, and v moves by Jinv(v) w."""
    out = {}
    covariance = off.covariance
    for t in table.turns:
        names = table.names[t : t + 3]
        free = [i for i, n in enumerate(names) if n in off.names]
        at = [off.names.index(names[i]) for i in free]
        slope = so3.left_jacobian_inverse(values[None, t : t + 3])[0][:, free]
        spread = np.sqrt(np.diag(slope @ covariance[np.ix_(at, at)] @ slope.T))
        out.update({names[i]: float(spread[i]) for i in free})
    return out


def _number(source: dict[str, float], name: str) -> float | None:
    return float(source[name]) if name in source else None


def row_table(
    data: DataSet, base: Problem, base_x: Array, part: Fit, held: Ints, missed: Mapping[str, Array]
) -> RowTable:
    """One row per observation, in the order of the terms; `missed` are the errors of rows that were not fitted, by
    unit in the order of `evidence.errors`."""
    before, after = base.residuals(base_x), part.problem.residuals(part.solution.x)
    ids = np.array(data.configurations.ids, dtype=object)
    unit = np.concatenate([r.unit for r in before])
    count = [len(r.unit) for r in before]
    outside = np.isin(unit, held)
    place, unseen = [], []
    seen = dict.fromkeys(missed, 0)
    for a, term in zip(after, part.problem.terms, strict=True):
        assert isinstance(term, Rows)
        nothing = np.full((len(a.unit), 3), np.nan)
        place.append(term.predict(part.solution.x)[:, :3] if KINDS[term.kind].positional else nothing)
        left = np.full(len(a.unit), np.nan)
        for i, (_, _, u) in enumerate(a.parts):
            if u in missed:
                if i == 0:
                    left = missed[u][seen[u] : seen[u] + len(left)]
                seen[u] += len(left)
        unseen.append(left)
    return RowTable(
        tuple(ids[unit]),
        outside,
        _repeat([r.group for r in before], count),
        _repeat([r.kind for r in before], count),
        _repeat([t.target for t in part.problem.terms if isinstance(t, Rows)], count),
        np.concatenate(place),
        np.concatenate([_told(r) for r in before]),
        np.concatenate([_told(r) for r in after]),
        tuple(p for r, n in zip(before, count, strict=True) for p in [r.parts] * n),
        np.concatenate(unseen),
    )


def _repeat(words: list[str], count: list[int]) -> tuple[str, ...]:
    return tuple(w for w, n in zip(words, count, strict=True) for _ in range(n))


def _told(r: Residuals) -> Array:
    """The residual of every row, padded with NaN to six columns; the first is the whole error where a lever makes one."""
    out = np.full((len(r.value), 6), np.nan)
    out[:, : r.value.shape[1]] = r.value[:, :6]
    if r.lever is not None:
        out[:, 0] = r.length()
    return out


def prediction_band(model: Chain, data: DataSet, fit: Fit, off: Total) -> Band | None:
    """One standard deviation of the predicted position over joint space, with hidden parameters as uncertain as
    expected.

    Configurations are drawn within the joint limits (the measured range where a limit is infinite); positions are
    those of the first position or pose instrument.
    """
    q = data.configurations.joints
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if q is None or not found or not fit.identifiability.names:
        return None
    sample, region = sample_joints(model, measured_range(data.configurations), SAMPLES)
    obs = found[0]
    template = replace(
        obs,
        kind="position",
        configuration=np.arange(SAMPLES),
        value=np.zeros((SAMPLES, 3)),
        sigma=np.ones((SAMPLES, 3)),
        target=None if obs.target is None else np.zeros(SAMPLES, dtype=np.int64),
        extra={},
        rows=None,
        used=None,
    )
    columns = {k: np.full(SAMPLES, v) for k, v in mean_conditions(data.configurations).items()}
    away = DataSet(Configurations(tuple(map(str, range(SAMPLES))), sample, columns), (template,))
    names = off.names
    made = build(model, away)
    known = {n: fit.solution.x[0, fit.problem.table.index[n]] for n in made.table.names}
    made = build(model, away, values=known, free=[n for n in names if n in made.table])
    lin = made.linearize(made.start)
    jac = lin.j.reshape(SAMPLES, 3, -1)
    where = [names.index(n) for n in made.free]
    sigma = band(jac, off.covariance[np.ix_(where, where)])
    return Band(float(sigma.mean()), float(np.percentile(sigma, 95)), float(sigma.max()), SAMPLES, region)

"""From a fit to the tables that people read: parameters with their status, rows with their errors, the prediction
band."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose.check_registry import Finding, When, check, note, once
from robocal.diagnose.limits import PARTNERS_WIDER
from robocal.estimate.choosing.choice import together
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Residuals
from robocal.estimate.uncertainty import Total, Uncertainty, band, quantile
from robocal.fit.estimators import estimator
from robocal.fit.noise import owners
from robocal.fit.options import JointRegion
from robocal.geometry import so3
from robocal.measure.base import KINDS, Rows
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet, fingerprints
from robocal.measure.machine import Model
from robocal.parameters import ParameterTable
from robocal.prove.bands import find_identified, mean_conditions
from robocal.prove.decision import Decision
from robocal.prove.identification import Band, ParameterResult, RowTable
from robocal.prove.region import region_of_limits
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

if TYPE_CHECKING:
    from robocal.fit.fit import Fit

__all__ = ["parameter_results", "prediction_band", "prediction_of", "row_table"]

# From here on the hidden partners, not the data, decide how well a parameter is known, and it is said.
ROUNDING = 1e-12  # tolerance: rad


def parameter_results(
    model: Model, fit: Fit, u: Uncertainty, off: Total, stated: Uncertainty | None
) -> tuple[ParameterResult, ...]:
    """Every parameter of the problem, in table order, with status and note; `off` is what it may be off by in all,
    `stated` the covariance under the stated noise alone."""
    table = fit.problem.table
    seen = fit.identifiability
    share = dict(zip(seen.names, seen.share, strict=True))
    start = np.array([model.table[p.name].value if p.name in model.table else p.value for p in table.rows])
    values = _nearest_turns(table, fit.solution.x[0, : len(start)], start)
    total = _components(table, off.names, off.covariance, values)
    reach = quantile(off.dof)
    free = fit.problem.free
    sigma = _components(table, free, u.covariance * u.factor**2, values)
    instrument = _components(table, free, stated.covariance, values) if stated else {}
    hidden: dict[str, list[str]] = {}
    for combination in seen.combinations:
        for name, _ in combination.partners:
            hidden.setdefault(name, []).append(combination.name)
    by_name = {c.name: c for c in seen.combinations}
    told = find_identified(fit, off)
    delta = values - start
    out = []
    for i, row in enumerate(table.rows):
        nominal = model.table[row.name].value if row.name in model.table else row.value
        notes: tuple[Remark, ...] = ()
        fitted = row.name in free
        if fitted:
            status = "identified" if row.name in told else "prior"
            partners, _ = together([(name, 1.0) for name in hidden.get(row.name, [])])
            if status == "prior" and not partners:
                notes = (Remark.of(Code.LITTLE_SAID),)
            elif status == "prior":
                notes = (Remark.of(Code.ONLY_COMBINATION, partners=partners),)
            elif partners and total[row.name] > PARTNERS_WIDER * sigma[row.name]:
                notes = (Remark.of(Code.HIDDEN_PARTNERS, partners=partners),)
            if values[i] <= row.lower or values[i] >= row.upper:
                notes = (Remark.of(Code.AT_BOUND), *notes)
        elif row.name in by_name:
            status, notes = "dropped", (by_name[row.name].remark,)
        else:
            status = "fixed"
        if not fitted and row.turn and abs(delta[i]) > ROUNDING:
            # Held was the turn about this axis; the component is another number.
            notes = (Remark.of(Code.FOLLOWS_TURN), *notes)
        bar = max(total[row.name], sigma[row.name]) if fitted else None
        half = None if bar is None else reach * bar
        out.append(
            ParameterResult(
                row.name,
                row.unit,
                nominal,
                float(values[i]),
                float(delta[i]),
                bar,
                _number(instrument, row.name) if fitted else None,
                _number(sigma, row.name) if fitted else None,
                status,
                _number(share, row.name),
                notes,
                # What was excluded beforehand is not offered as possible.
                None
                if half is None
                else (float(max(values[i] - half, row.lower)), float(min(values[i] + half, row.upper))),
                None if status == "fixed" else float(row.scale),
            )
        )
    return tuple(out)


def _nearest_turns(table: ParameterTable, values: Array, start: Array) -> Array:
    """The same values with each rotation vector v in the form nearest to its nominal one: v (1 - 2 pi / |v|) is the same
    rotation, and half a turn may come out as either."""
    out = np.array(values)
    for t in table.turns:
        v = out[t : t + 3]
        angle = float(np.linalg.norm(v))
        other = v * (1 - 2 * np.pi / angle) if angle > 0 else v
        if np.linalg.norm(other - start[t : t + 3]) < np.linalg.norm(v - start[t : t + 3]):
            out[t : t + 3] = other
    return out


def _components(table: ParameterTable, names: Sequence[str], covariance: Array, values: Array) -> dict[str, float]:
    """Standard deviation of every free parameter from a covariance in the tangent: of a rotation vector v, whose components
    are told, by dv = Jinv(v) w; the covariance speaks of turns w."""
    out = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    for t in table.turns:
        mine = table.names[t : t + 3]
        free = [i for i, n in enumerate(mine) if n in out]
        at = [names.index(mine[i]) for i in free]
        slope = so3.left_jacobian_inverse(values[None, t : t + 3])[0][:, free]
        spread = np.sqrt(np.diag(slope @ covariance[np.ix_(at, at)] @ slope.T))
        out.update({mine[i]: float(spread[i]) for i in free})
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
    configuration = np.concatenate([r.configuration for r in before])
    count = [len(r.configuration) for r in before]
    outside = np.isin(configuration, held)
    place, unseen, turned = [], [], []
    marks = fingerprints(data)
    seen = dict.fromkeys(missed, 0)
    for a, term in zip(after, part.problem.terms, strict=True):
        assert isinstance(term, Rows)
        nothing = np.full((len(a.configuration), 3), np.nan)
        place.append(term.predict(part.solution.x)[:, :3] if KINDS[term.kind].positional else nothing)
        left: dict[str, Array] = {}
        for _, _, u in a.parts:
            if u in missed:
                left.setdefault(u, missed[u][seen[u] : seen[u] + len(nothing)])
                seen[u] += len(nothing)
        unseen.append(left.get(a.parts[0][2], nothing[:, 0]))
        turned.append(left.get("rad", nothing[:, 0]))
    return RowTable(
        tuple(ids[configuration]),
        outside,
        _repeat([r.group for r in before], count),
        _repeat([r.kind for r in before], count),
        _repeat([t.target for t in part.problem.terms if isinstance(t, Rows)], count),
        np.concatenate(place),
        np.concatenate([_row_residuals(r) for r in before]),
        np.concatenate([_row_residuals(r) for r in after]),
        tuple(p for r, n in zip(before, count, strict=True) for p in [r.parts] * n),
        np.concatenate(unseen),
        np.concatenate(turned),
        np.concatenate([~t.used for t in part.problem.terms]),
        np.concatenate([marks[i][t.index] for i, t in owners(data, part.problem)]),
    )


def _repeat(words: list[str], count: list[int]) -> tuple[str, ...]:
    return tuple(w for w, n in zip(words, count, strict=True) for _ in range(n))


def _row_residuals(r: Residuals) -> Array:
    """The residual of every row, padded with NaN to six columns; the first is the whole error where a lever makes one."""
    out = np.full((len(r.value), 6), np.nan)
    out[:, : r.value.shape[1]] = r.value[:, :6]
    if r.lever is not None:
        out[:, 0] = r.length()
    return out


def prediction_band(
    model: Model, data: DataSet, fit: Fit, off: Total, region: JointRegion | None = None
) -> Band | None:
    """One standard deviation of the error of the predicted position over joint space: of the model, with hidden
    parameters as uncertain as expected, and of what it leaves at every pose.

        sigma^2 = tr(J C J^T) + 3 tau^2

    tau is what the model left per axis beyond the stated noise (all that it left where none is stated). Configurations are
    those of the region, else drawn within the joint limits (the measured range where a limit is infinite); positions are
    those of the first position or pose instrument.
    """
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if data.configurations.joints is None or not found or not fit.identifiability.names:
        return None
    region = region or region_of_limits(model, data)
    count = len(region.joints)
    template = replace(
        found[0],
        kind="position",
        configuration=np.arange(count),
        value=np.zeros((count, 3)),
        sigma=np.ones((count, 3)),
        target=None if found[0].target is None else np.zeros(count, dtype=np.int64),
        extra={},
        rows=None,
        used=None,
        digits=None,
        rounding=None,
    )
    columns = {k: np.full(count, v) for k, v in mean_conditions(data.configurations).items()}
    away = DataSet(Configurations(tuple(map(str, range(count))), region.joints, columns), (template,))
    made = build(model, away)
    known = {n: fit.solution.x[0, fit.problem.table.index[n]] for n in made.table.names}
    made = build(model, away, values=known, free=[n for n in off.names if n in made.table])
    jac = made.linearize(made.start).j.reshape(count, 3, -1)
    where = [off.names.index(n) for n in made.free]
    tau = next((g.tau for g in fit.groups if g.name == found[0].label and g.unit == "m"), 0.0)
    left = float(np.sqrt(3)) * tau
    sigma = np.hypot(band(jac, off.covariance[np.ix_(where, where)]), left)
    mean, p95, most = float(sigma.mean()), float(np.percentile(sigma, 95)), float(sigma.max())
    return Band(mean, p95, most, count, region.name, left)


@once
def prediction_of(context: Decision[Model]) -> Band | None:
    """That of the fit to everything, over the range that was asked for."""
    known = context.model, context.need_data, context.need_fit, context.need_fit.total
    return prediction_band(*known, context.chosen.region)


@check("elsewhere", When.FIT, order=270, needs=("proven",))
def elsewhere(context: Decision[Model]) -> Iterator[Finding]:
    """The predicted error away from the data; a method that fits what cannot be seen has no honest one."""
    b = prediction_of(context)
    if b is not None and not estimator(context.chosen.method).blind:
        left = Quantity(b.left) if b.left > 0 else None
        yield note(Code.ELSEWHERE, region=b.region, mean=Quantity(b.mean), p95=Quantity(b.p95), left=left)

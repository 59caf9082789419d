"""From a fit to the tables that people read: parameters with their status, rows with their errors, the prediction band."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate.identification import Band, ParameterResult, RowTable
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import Uncertainty, band
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet

if TYPE_CHECKING:
    from robocal.calibrate.identify import Fit

__all__ = ["parameter_results", "prediction_band", "row_table"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
# A parameter is claimed when the data, with everything else unknown too, narrow it to half of what was expected: share 1 - 1/4.
CLAIM = 0.75
SAMPLES = 500


def parameter_results(model: Chain, fit: Fit, u: Uncertainty) -> tuple[ParameterResult, ...]:
    """Every parameter of the problem, in table order, with status and note."""
    table = fit.problem.table
    seen = fit.identifiability
    values = fit.solution.x[0]
    share = dict(zip(seen.names, seen.share, strict=True))
    total = dict(zip(seen.names, np.sqrt(np.diag(seen.posterior)), strict=True))
    sigma = dict(zip(fit.problem.free, u.sigma, strict=True))
    instrument = dict(zip(fit.problem.free, u.sigma_instrument, strict=True))
    hidden: dict[str, list[str]] = {}
    for combination in seen.combinations:
        for name, _ in combination.partners:
            hidden.setdefault(name, []).append(combination.name)
    by_name = {c.name: c for c in seen.combinations}
    out = []
    for i, row in enumerate(table.rows):
        nominal = model.table[row.name].value if row.name in model.table else row.value
        note = ""
        if row.name in sigma:
            status = "identified" if share[row.name] >= CLAIM else "prior"
            if status == "prior":
                partners = hidden.get(row.name, [])
                note = f"only a combination with {', '.join(partners[:6])} is seen" if partners else "the data say little beyond the prior"
        elif row.name in by_name:
            status, note = "dropped", by_name[row.name].text
        else:
            status = "fixed"
        out.append(
            ParameterResult(
                row.name,
                row.unit,
                nominal,
                float(values[i]),
                _number(sigma, row.name),
                _number(instrument, row.name),
                _number(total, row.name),
                status,
                _number(share, row.name),
                note,
            )
        )
    return tuple(out)


def _number(source: dict[str, float], name: str) -> float | None:
    return float(source[name]) if name in source else None


def row_table(
    data: DataSet, base: Problem, base_x: Array, part: Fit, held: Ints, loo: tuple[Array, Array] | None
) -> RowTable:
    """One row per observation, in the order of the terms."""
    before, after = base.residuals(base_x), part.problem.residuals(part.solution.x)
    outside = set(held.tolist())
    ids = data.configurations.ids
    configuration: list[str] = []
    group: list[str] = []
    kind: list[str] = []
    target: list[str] = []
    parts: list[tuple[tuple[int, int, str], ...]] = []
    place, first, second, is_held = [], [], [], []
    unseen: list[float] = []
    at = 0
    for a, b, term in zip(before, after, part.problem.terms, strict=True):
        names = _target_names(data, term)
        exact = term.predict(part.solution.x) if hasattr(term, "predict") else np.full(b.value.shape, np.nan)
        lengths = np.linalg.norm(b.value[:, : b.parts[0][1]], axis=1)
        metric = b.parts[0][2] == "m"
        for i, unit in enumerate(a.unit):
            configuration.append(ids[unit])
            group.append(a.group)
            kind.append(a.kind)
            target.append(names[i])
            parts.append(a.parts)
            is_held.append(int(unit) in outside)
            place.append(exact[i, :3] if metric and exact.shape[1] >= 3 else np.full(3, np.nan))
            first.append(_six(a.value[i]))
            second.append(_six(b.value[i]))
            if is_held[-1]:
                unseen.append(float(lengths[i]))
            else:
                unseen.append(float(loo[1][at]) if loo is not None and metric and not outside else np.nan)
            at += int(metric)
    return RowTable(
        tuple(configuration), np.array(is_held), tuple(group), tuple(kind), tuple(target), np.array(place), np.array(first),
        np.array(second), tuple(parts), np.array(unseen),
    )  # fmt: skip


def _six(value: Array) -> Array:
    out = np.full(6, np.nan)
    out[: min(6, len(value))] = value[:6]
    return out


def _target_names(data: DataSet, term: object) -> list[str]:
    index = term.index  # type: ignore[attr-defined]
    for obs in data.observations:
        if obs.label == term.group and obs.kind == term.kind:  # type: ignore[attr-defined]
            if obs.target is not None and obs.targets and index.max(initial=-1) < len(obs):
                return [obs.targets[t].name for t in obs.target[index]]
            return [""] * len(index)
    return [""] * len(index)


def prediction_band(model: Chain, data: DataSet, fit: Fit, u: Uncertainty) -> Band | None:
    """One standard deviation of the predicted position over joint space, with hidden parameters as uncertain as expected.

    Configurations are drawn within the joint limits (the measured range where a limit is infinite); positions are those of the first
    position or pose instrument.
    """
    q = data.configurations.joints
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if q is None or not found or not fit.identifiability.names:
        return None
    limits = model.limits
    low = np.where(np.isfinite(limits[:, 0]), limits[:, 0], q.min(axis=0))
    high = np.where(np.isfinite(limits[:, 1]), limits[:, 1], q.max(axis=0))
    rng = np.random.default_rng(0)
    sample = rng.uniform(low, high, (SAMPLES, len(low)))
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
    )
    columns = {k: np.full(SAMPLES, np.nanmean(v)) for k, v in data.configurations.columns.items()}
    away = DataSet(Configurations(tuple(map(str, range(SAMPLES))), sample, columns), (template,))
    names = fit.identifiability.names
    made = build(model, away)
    known = {n: fit.solution.x[0, fit.problem.table.index[n]] for n in made.table.names}
    made = build(model, away, values=known, free=names)
    lin = made.linearize(made.start)
    jac = lin.j.reshape(SAMPLES, 3, -1)
    where = [names.index(n) for n in made.free]
    sigma = band(jac, fit.identifiability.posterior[np.ix_(where, where)])
    region = "joint limits" if np.isfinite(limits).all() else "joint limits, or the measured range where there are none"
    return Band(float(sigma.mean()), float(np.percentile(sigma, 95)), float(sigma.max()), SAMPLES, region)

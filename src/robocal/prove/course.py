"""How the fit that is told came about: every parameter, and the greatest error, after each pass; of a filter also after each
configuration that it took in, with its 95 % band."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import ModelError
from robocal.estimate.trail import Trail
from robocal.estimate.uncertainty import quantile
from robocal.measure.machine import Model
from robocal.prove.decision import Decision
from robocal.prove.results import components, nominal_values
from robocal.quantities import Amount, DisplayUnit, OwnUnit

__all__ = ["ParameterPasses", "Passes", "filter_passes", "passes_of"]


@record
class ParameterPasses:
    """What one fitted parameter was off its nominal value after each pass, (k,); of a filter, half the width of its 95 % band."""

    name: str
    unit: OwnUnit
    change: list[Amount]
    band: list[Amount]


@record
class Passes:
    """What stood after `after` passes, or configurations taken in, (k,): changes of the fitted parameters, and the greatest error of any
    fitted measurement in the unit of the verdict; of configurations taken in there is none."""

    after: list[int]
    unit: DisplayUnit
    greatest_error: list[Amount]
    parameters: list[ParameterPasses]


def passes_of(context: Decision[Model]) -> Passes | None:
    """After each pass; None where nobody knows. Of more than a hundred some, at even steps, and the last."""
    fit = context.need_fit
    trail = fit.estimate and fit.estimate.passes
    if not trail or not trail.at:
        return None
    at, x, ended = list(trail.at), list(trail.x), int(fit.solution.iterations[0])
    if at[-1] != ended:
        at, x = [*at, ended], [*x, fit.solution.x[0]]
    try:
        greatest = fit.problem.greatest_error(np.array(x), context.unit).tolist()
    except ModelError:  # of what the verdict is found in, nothing was fitted
        greatest = []
    return Passes(at, context.unit, greatest, _parameters(context, np.array(x), None))


def filter_passes(context: Decision[Model]) -> Passes | None:
    """Of a filter, after each configuration that it took in, with its own covariance as fitted, to which is added what hidden partners may
    be off by; None for methods that are none. Of more than forty some, at even steps, and the last."""
    found = context.need_fit.estimate
    trail = found and found.filter
    if not trail or not trail.at:
        return None
    return Passes(list(trail.at), context.unit, [], _parameters(context, np.array(trail.x), trail))


def _parameters(context: Decision[Model], x: Array, seen: Trail | None) -> list[ParameterPasses]:
    problem = context.need_fit.problem
    table, free = problem.table, problem.free
    change = x[:, : len(table)] - nominal_values(context.model, table)
    band = np.zeros((0, len(free)))
    if seen is not None:
        factor, reach = context.uncertainty.factor, quantile(context.need_fit.total.dof)
        rows = zip(seen.covariance, seen.x, strict=True)
        known = [components(table, free, c * factor**2, values[: len(table)]) for c, values in rows]
        sigma = np.array([[k[name] for name in free] for k in known])
        band = reach * np.sqrt(sigma**2 + _hidden(context) ** 2)
    return [
        ParameterPasses(n, table[n].unit, change[:, table.index[n]].tolist(), band[:, i].tolist())
        for i, n in enumerate(free)
    ]


def _hidden(context: Decision[Model]) -> Array:
    """Standard deviation of what hidden partners add to every fitted parameter, (n,)."""
    fit, u = context.need_fit, context.uncertainty
    table, values = fit.problem.table, fit.solution.x[0, : len(fit.problem.table)]
    whole = components(table, *context.spread, values)
    own = components(table, fit.problem.free, u.covariance * u.factor**2, values)
    return np.array([np.sqrt(max(whole[n] ** 2 - own[n] ** 2, 0.0)) for n in fit.problem.free])

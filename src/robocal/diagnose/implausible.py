"""Changes of a machine that no making leaves: the order or the signs of joints, or a number in its file, are likelier wrong."""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose.check_registry import Context, Finding, Level, When, check, of_remarks, once
from robocal.diagnose.limits import IMPLAUSIBLE_CHANGE, UNMADE_SIGMA
from robocal.estimate.problem import Problem
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.measure.rows import KINDS, Rows
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["implausible", "implausible_changes", "out_of_tolerance"]


@once
def implausible_changes(context: Context[Model]) -> list[Remark]:
    """Those of the fit to everything."""
    return implausible(context.model, context.need_fit)


@check("implausible-changes", When.FIT, order=150, needs=("fit",))
def report_implausible(context: Context[Model]) -> Iterator[Finding]:
    """The changes of the fit to everything, as a doubt."""
    yield from of_remarks(implausible_changes(context), Level.DOUBT)


def implausible(model: Model, fit: Fit) -> list[Remark]:
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


def out_of_tolerance(model: Model, stated: Problem, fit: Fit) -> list[Remark]:
    """Lengths and angles between axes that changed, beyond doubt, as no arm's making leaves them: what was written and what
    the data say. A joint's zero may be anywhere; and where parallel axes are written without Hayati's beta, a small tilt
    moves lengths along them by metres."""
    exempt = model.anywhere
    x, table = fit.solution.x, fit.problem.table
    built = {s for t in fit.problem.terms if isinstance(t, Rows) for s in KINDS[t.kind].manufactured}
    beside = {p.name: p for p in stated.table.rows if p.name.rpartition(".")[2] in built and p.name not in model.table}
    drawn = {n: model.table[n] for n in model.geometric if n not in exempt} | beside
    off = fit.total  # with what hidden partners may be off by: a column that stands for several may move far
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

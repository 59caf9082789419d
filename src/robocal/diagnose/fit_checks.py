"""What a fit shows before anything is proven: changes that no making leaves (the order or the signs of joints, or a number in the
robot's file, are likelier wrong), what is left beside the stated noise, what the method ignored, could not do or had to begin again,
and what stood elsewhere for a part of a file.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal import _scipy as scipy
from robocal.diagnose import limits
from robocal.diagnose.cables.unread_carriages import find_unread_carriages
from robocal.diagnose.check_registry import Context, Finding, Level, When, check, doubt, note, of_remarks, once
from robocal.diagnose.fixed_numbers import names_to_free
from robocal.diagnose.segments.find import find_segments
from robocal.diagnose.segments.regions import find_joint
from robocal.diagnose.segments.tell import segment_numbers, segment_remarks
from robocal.diagnose.slack import find_slack
from robocal.diagnose.stated_numbers import reads
from robocal.estimate.problem import Problem
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.fit.noise import NoiseGroup
from robocal.measure.machine import Model, joints_of, sensor_zeros
from robocal.measure.reach import size_of
from robocal.measure.rows import KINDS, Rows
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity, Remark

__all__ = ["findings_of_segments", "implausible", "implausible_changes", "out_of_tolerance"]

OTHERS = "Wrong rows, names of targets or numbers may explain the rest, or what geometry leaves out"
DRIVES = "Friction without a direction, a payload that is not stated, or gears may explain the rest"
MOVED_OR_BENT = declare(
    "moved-or-bent",
    "{file}: from row {first} to row {last} everything is off[ by {shift:.3g}][, turned by {turn:.3g}] ({count} rows, {strength:.1f} "
    "times the residual elsewhere). On these rows {joint} is in another region: its load bends it to the other side there, or target or "
    "instrument moved just then",
    "Measure some poses of both regions again, in turns. What comes back is bending: free it (--groups compliance). What does not has "
    "moved: leave these rows out (--exclude {first}-{last}).",
)


@check("implausible-changes", When.FIT, order=150, needs=("fit",))
@once
def implausible_changes(context: Context[Model]) -> list[Finding]:
    """Those of the fit to everything, as a doubt."""
    return of_remarks(implausible(context.model, context.need_fit), Level.DOUBT)


def implausible(model: Model, fit: Fit) -> list[Remark]:
    """Changes that no arm's making leaves: the nominal model, the order or the signs of the joints are likelier wrong."""
    table, x = fit.problem.table, fit.solution.x[0]
    found = []
    for n in fit.problem.free:
        if n not in model.geometric:
            continue
        change, scale = abs(x[table.index[n]] - model.table[n].value), model.table[n].scale
        if change > limits.IMPLAUSIBLE_CHANGE * scale:
            found.append((change / scale, f"{n} by {Quantity(change, table[n].unit):.3g}"))
    return _tell_worst(Code.IMPLAUSIBLE, found)


def _tell_worst(code: str, found: list[tuple[float, str]]) -> list[Remark]:
    """A remark with the words of the three largest changes; none where there is none."""
    worst = tuple(words for _, words in sorted(found, reverse=True)[:3])
    return [Remark.of(code, changes=worst)] if worst else []


def out_of_tolerance(model: Model, stated: Problem, fit: Fit) -> list[Remark]:
    """Lengths, angles between axes, anchors and zeros of cables that changed, beyond doubt, as no making leaves them: what was written
    and what the data say. A joint's zero may be anywhere; and where parallel axes are written without Hayati's beta, a small tilt
    moves lengths along them by metres. What has a prior that says nothing was not stated, nor were zeros that a file of lengths has."""
    x, table = fit.solution.x, fit.problem.table
    built = {s for t in fit.problem.terms if isinstance(t, Rows) for s in KINDS[t.kind].manufactured}
    beside = {p.name: p for p in stated.table.rows if p.name.rpartition(".")[2] in built and p.name not in model.table}
    own = (model.table[n] for n in (*model.geometric, *sensor_zeros(model)) if n not in model.anywhere)
    drawn = {p.name: p for p in own if p.prior is None or p.prior_informs} | beside
    off = fit.total  # with what hidden partners may be off by: a column that stands for several may move far
    sigma = dict(zip(off.names, off.sigma, strict=True))
    found = []
    for n in fit.problem.free:
        if n not in drawn:
            continue
        nominal, there, scale = drawn[n].value, float(x[0, table.index[n]]), drawn[n].scale
        change = abs(there - nominal)
        far = limits.IMPLAUSIBLE_CHANGE * scale
        if table[n].unit == "m":
            far = min(far, max(limits.UNMADE_FAR, limits.UNMADE_SIGMA * scale))
        if change > far and change > limits.UNMADE_SIGMA * sigma[n]:
            unit = table[n].unit.removesuffix("1")
            words = f"{n}: you wrote {Quantity(nominal, unit):.4g}, the data say {Quantity(there, unit):.4g}"
            found.append((change / scale, words))
    return _tell_worst(Code.UNMADE, found)


@check("stated-noise", When.FIT, order=100, needs=("fit",))
def noise_findings(context: Context[Model]) -> Iterator[Finding]:
    """Model error far above the stated noise, noise that is not in the data, and data that were computed."""
    # A known distance between sockets is no reading; and of an arm that was bent to a point everything is exact.
    bent = list(implausible_changes.run(context))
    read = {o.label for o in context.need_data.observations if reads(o)} if not bent else set()
    for g in context.need_fit.groups:
        if g.stated is not None:
            amounts = {"left": Quantity(g.rms, g.unit), "stated": Quantity(g.stated, g.unit)}
            if g.tau > limits.NOISE_ABOVE * g.stated:
                # Where poses take most numbers, their residuals are small, however much they contradict the others.
                more = amounts | {"left": Quantity(max(g.sigma, g.rms), g.unit)}
                yield doubt(Code.ABOVE_STATED_NOISE, group=g.name, **more, **_remedy(context, g))
            chance = 1.0 if g.chi2 is None else scipy.special.chdtr(g.dof, limits.NOISE_BELOW**2 * g.chi2)
            if g.name in read and chance < limits.NOISE_CHANCE:
                yield doubt(Code.BELOW_STATED_NOISE, group=g.name, **amounts)
        if g.name in read and g.unit == "m" and g.rms < limits.COMPUTED_ERROR and g.dof > limits.COMPUTED_FREEDOM:
            yield doubt(Code.COMPUTED, group=g.name, left=Quantity(g.rms))


def _remedy(context: Context[Model], group: NoiseGroup) -> dict[str, str | None]:
    """What may explain it: of an arm what lies beyond geometry, or its geometry where that was held; of a cable robot numbers that are
    fixed, or parts that are left out; of a rig its lenses. So much that no machine errs by it is a mistake in the data."""
    said: dict[str, str | None] = dict.fromkeys(("option", "choice", "free", "beyond", "wrong", "target"))
    arm, moving = bool(joints_of(context.model)), context.model.mechanism
    if not arm and (line := names_to_free(context)):
        return said | {"free": line}
    size = {"m": 0.0 if moving is None else size_of(moving), "rad": 1.0}.get(group.unit, 0.0)
    if size > 0 and max(group.sigma, group.rms) > limits.LEFT_SHARE * size:
        return said | {"wrong": "targets" if arm else "cables"}
    if not context.model.table.rows:
        return said | {"target": "target"}
    if not arm:
        return said | {"beyond": "sag"}
    if group.unit == "N m":
        return said | {"option": DRIVES}
    held = not set(context.need_fit.identifiability.names) & set(context.model.geometric)
    return said | ({"choice": "--free"} if held else {"option": OTHERS})


@check("ignored-priors", When.FIT, order=130, needs=("fit", "options"))
def priors_without_effect(context: Context[Model]) -> Iterator[Finding]:
    """Priors and bounds of which the method takes no notice."""
    problem, method = context.need_fit.problem, context.chosen.method
    rows = [problem.table[n] for n in problem.free]
    if estimator(method).blind and any(p.prior or np.isfinite([p.lower, p.upper]).any() for p in rows):
        yield doubt(Code.PRIORS_IGNORED, method=method)


@check("method-notes", When.FIT, order=140, needs=("fit",))
def notes(context: Context[Model]) -> Iterator[Finding]:
    """What the method says of its own end."""
    yield from of_remarks(context.need_fit.notes, Level.DOUBT)


@check("restarts", When.FIT, order=180, needs=("fit",))
def restarts(context: Context[Model]) -> Iterator[Finding]:
    """Starts that were needed before the fit converged."""
    if context.need_fit.restarted:
        yield note(Code.RESTARTED, starts=context.need_fit.restarted)


@check("moved", When.PROOF, order=180, needs=("data",))
@once
def findings_of_segments(context: Context[Model]) -> list[Finding]:
    """What stood elsewhere, at the values of the fit, else of the baseline: one finding for every segment, and one for
    several of one cause. Where a joint is in another region on its rows, its load may bend it as well, and that is a doubt."""
    data = context.need_data
    # A cable that hangs now and then is no drum that slips from row to row.
    hung = [f"{s.cable}.l0" for s in find_slack(context)] if context.fit is not None else []
    found = [s for s in find_segments(context.model, data, context.values) if s.name not in hung]
    problem, x = context.need_baseline.problem, context.need_baseline.x
    if context.fit is not None:
        problem, x = context.fit.problem, context.fit.solution.x
    crossed = [find_joint(context.model, data, s, found, problem, x) for s in found]
    moved = [s for s, joint in zip(found, crossed, strict=True) if joint is None]
    bent = [(s, joint) for s, joint in zip(found, crossed, strict=True) if joint is not None]
    carried = find_unread_carriages(context.model, data, moved)
    told = of_remarks((*((carried,) if carried else ()), *segment_remarks(moved)), Level.REFUSE)
    return [*told, *(doubt(MOVED_OR_BENT, **segment_numbers(s), joint=joint) for s, joint in bent)]

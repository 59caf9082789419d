"""What a refit would bring, by one linear step at the fit: priors around the nominal values where measurements are few, and groups beyond
geometry where far more is left than the stated noise.

    d = -(J_F^T J_F + f W^-2)^-1 (J_F^T r_F + f W^-2 (x - x_0)),    r_U + J_U d    of the rows U that a round F has not seen

Rows are whitened, x_0 are the nominal values, W the widths of the priors in units of the error expected of each column, f the variance that
the fit leaves. Without a prior W is infinite. What a look promises is no more than advice: a refit is judged as any other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Finding, Machines, When, check, doubt
from robocal.fit.estimators import estimator
from robocal.fit.fit import Fit
from robocal.measure.machine import Model
from robocal.prove.decision import Decision
from robocal.prove.evidence import bootstrap_gain
from robocal.prove.judge import units_of
from robocal.prove.nongeometric.group_choice import ROUNDS, widen
from robocal.prove.nongeometric.linearised import linearise_fit
from robocal.prove.split import Split, make_split
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["GROUPS_HELP", "PRIORS_HELP"]

PRIORS_HELP = declare(
    "priors-help",
    "{numbers} numbers are few for what this model leaves: a quick look says that priors around the nominal values lower the mean error on "
    "unseen measurements from {before:.3g} to {after:.3g}",
    "Hold lengths and angles that softly (--prior length={length}mm --prior angle={angle}deg). Or measure more configurations.",
)
GROUPS_HELP = declare(
    "groups-help",
    "a quick look says that {line} would lower the mean error on unseen blocks of rows from {before:.3g} to {after:.3g}",
    "Try it (--groups {line}). A group enters only if unseen blocks of rows get better.",
)
LENGTHS, ANGLES = (1.0, 2.0, 5.0), (0.1, 0.3, 1.0)  # grid: widths of priors, in mm and deg
LOOSE = 1e-6  # tolerance: of the expected information, so that columns that nothing sees stay where they are


@check("priors-help", When.FIT, order=104, machines=Machines.JOINTED, needs=("proven",))
def priors_that_help(context: Decision[Model]) -> Iterator[Finding]:
    """Priors under which unseen measurements are met clearly better, where there are few numbers and none is stated."""
    fit, model, many = context.need_fit, context.model, len(np.unique(context.places))
    table, numbers = fit.problem.table, context.numbers[0]
    held = {n for n in model.geometric if n in set(table.free)}
    # Where noise is met there is nothing that a prior would keep a fit from following.
    over = _above(fit) or any(g.stated is None and g.unit == "m" and g.rms > limits.PRIORS_LEFT for g in fit.groups)
    enough = numbers > limits.PRIORS_NUMBERS * len({*held, *fit.problem.free}) or many < limits.PROOF_PLACES or not over
    if enough or not held or _blind(context) or any(model.table[n].prior is not None for n in held):
        return
    line, unit = (
        linearise_fit(model, fit, sorted(held), _dealt(context, limits.HOLD_OUT_SHARE)),
        units_of(fit.problem)[0],
    )
    fitted, every = line.columns(fit.problem.free), np.arange(len(line.names))
    noise, scales = line.left(fitted), line.problem.with_free(line.names).scales
    off = np.array([float(line.x[0, line.problem.table.index[n]]) - line.problem.table[n].value for n in line.names])
    before, at = line.unseen(_same(fitted), LOOSE, unit)
    best, told = before, None
    for length in LENGTHS:
        for angle in ANGLES:
            of = {"m": 1e-3 * length, "rad": np.radians(angle)}
            wide = np.array([of.get(line.problem.table[n].unit, np.inf) if n in held else np.inf for n in line.names])
            after, _ = line.unseen(_same(every), LOOSE + noise * (scales / wide) ** 2, unit, off / scales)
            if after.mean() < best.mean():
                best, told = after, (length, angle)
    if told is None or not _clearly(before, best, at, context.chosen.seed):
        return
    means = {"before": Quantity(float(before.mean()), unit), "after": Quantity(float(best.mean()), unit)}
    yield doubt(PRIORS_HELP, numbers=numbers, **means, length=f"{told[0]:g}", angle=f"{told[1]:g}")


@check("groups-help", When.FIT, order=105, machines=Machines.JOINTED, needs=("proven",))
def groups_that_help(context: Decision[Model]) -> Iterator[Finding]:
    """Groups beyond geometry under which unseen blocks of rows are met clearly better, where far more is left than was stated."""
    fit = context.need_fit
    if not _above(fit) or _blind(context) or len(np.unique(context.places)) < limits.GROUP_PLACES:
        return
    wide, members = widen(context.model)
    line = linearise_fit(wide, fit, [n for own in members.values() for n in own], _dealt(context, "blocks"))
    unit, chosen = units_of(fit.problem)[0], line.columns(fit.problem.free)
    first, at = line.unseen(_same(chosen), line.left(chosen), unit)
    last, entered = first, []
    while members:
        noise = line.left(chosen)
        before = line.unseen(_same(chosen), noise, unit)[0]
        tried = {}
        for name, own in members.items():
            some = np.union1d(chosen, line.columns(own))
            tried[name] = some, line.unseen(_same(some), noise, unit)[0]
        name = min(tried, key=lambda n: float(tried[n][1].mean()))
        if not _clearly(before, tried[name][1], at, context.chosen.seed):
            break
        chosen, last = tried[name]
        entered.append(name)
        del members[name]
    if entered:
        means = {"before": Quantity(float(first.mean()), unit), "after": Quantity(float(last.mean()), unit)}
        yield doubt(GROUPS_HELP, line=",".join(entered), **means)


def _above(fit: Fit) -> bool:
    """Whether far more is left than was stated."""
    return any(g.stated is not None and g.tau > limits.NOISE_ABOVE * g.stated for g in fit.groups)


def _blind(context: Decision[Model]) -> bool:
    """Whether nothing can be asked of the fit: of a method without noise, or of poses of its own."""
    return estimator(context.chosen.method).blind or bool(context.need_fit.problem.blocks) or context.frames_alone


def _same(columns: Ints) -> Callable[[int], Ints]:
    """The same columns in every round."""
    return lambda _: columns


def _dealt(context: Decision[Model], how: float | str) -> Split:
    many = min(ROUNDS, len(np.unique(context.places)))
    return make_split(context.need_data, how, folds=many, seed=context.chosen.seed)


def _clearly(before: Array, after: Array, at: Ints, seed: int) -> bool:
    """Whether errors fall beyond chance, and by so much that it is worth a remark."""
    falls = float(after.mean()) < (1 - limits.LOOK_LESS) * float(before.mean())
    return falls and bootstrap_gain(before, after, at, seed)[1] > 0

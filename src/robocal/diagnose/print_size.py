"""The size of what was printed beside the lengths of the machine: two explanations of one factor, named together.

    share_k = C_ks^2 / (C_kk C_ss)        of the variance of length or gain k that is that of the size s

C is the covariance after the fit. Pixels have no unit of length: a print and a machine that are both 1 % larger give the same images, and
where the data bring less than half of what is known of the size, what was stated of it decides both. Cables measure lengths in m, and
decide the size unless their drums are free too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, When, check, note
from robocal.measure.machine import Model
from robocal.measure.pixels import size_of_print
from robocal.remarks.english import declare

__all__ = ["UNSEPARATED"]

HALF = 0.5  # tolerance: of a variance: more than all else together
GAIN = "gain"

UNSEPARATED = declare(
    "print-beside-lengths",
    "{size} and {names} explain the same: what was stated of the print ({stated:.2%}) decides all of them",
    "Measure the print and write scale: known into its data file. Or state the lengths that are known by --prior.",
)


@check("print-size", When.FIT, order=218, needs=("fit",))
def size_beside_lengths(context: Context[Model]) -> Iterator[Finding]:
    """Lengths of the machine, and gains of drums, whose uncertainty is that of a print."""
    fit, model = context.need_fit, context.model
    total, table, own = fit.total, fit.problem.table, set(model.lengths)
    order = {n: i for i, n in enumerate(total.names)}
    others = [n for n in fit.problem.free if n in order and (n in own or n.rpartition(".")[2] == GAIN)]
    for size in dict.fromkeys(size_of_print(o) for o in context.need_data.observations if o.options.get("print")):
        prior = None if size not in order else table[size].prior
        if prior is None or not others:
            continue
        at = order[size]
        variance = float(total.covariance[at, at])
        if variance < HALF * prior**2:
            continue
        k = [order[n] for n in others]
        share = total.covariance[k, at] ** 2 / (np.diag(total.covariance)[k] * variance)
        named = [others[i] for i in np.argsort(-share, kind="stable") if share[i] > HALF]
        if named:
            yield note(UNSEPARATED, size=size, names=tuple(named), stated=prior)

"""What a fit makes of standard deviations that somebody states for instruments: a lens, a camera's place, the size of a print.

    z_i = (x_i - v_i) / sqrt(sigma_i^2 - s_i^2)        of each number with a prior sigma_i around its stated value v_i

s_i is the standard deviation after the fit: what the prior holds does not move, however wrong, so that the way is measured by how far
these data may move it.

Right priors leave |z| below 3. A prior that is too narrow bends everything else before it gives way, so the number that is farthest
off names what is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, When, check, doubt
from robocal.diagnose.limits import PRIOR_SIGMA
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.english import declare

__all__ = ["CONTRADICTED"]

LEAST = 0.3  # tolerance: of the prior: where data say less, a model that is not linear may have moved it as far

CONTRADICTED = declare(
    "prior-contradicted",
    "these data contradict what was stated of {what}: {name} is {z:.1f} standard deviations from its stated value",
    "Calibrate or measure {owner} again. Else state a larger sigma for it: {name} needs {times:.0f} times as much.",
)


@check("stated-priors", When.FIT, order=216)
def contradicted_priors(context: Context[Model]) -> Iterator[Finding]:
    """The number that ended farthest from where its prior has it, and whose it is."""
    fit = context.need_fit
    problem, x, after = fit.problem, fit.solution.x, dict(zip(fit.total.names, fit.total.sigma.tolist(), strict=True))
    table, change = problem.table, problem.difference(x)[0]
    found: dict[str, tuple[float, str]] = {}
    for name, moved in zip(problem.free, change.tolist(), strict=True):
        prior = table[name].prior
        if prior is None or name in context.model.table or not table[name].prior_informs:
            continue
        way = np.sqrt(max(prior**2 - after.get(name, prior) ** 2, (LEAST * prior) ** 2))
        owner, z = name.rpartition(".")[0], float(abs(moved) / way)
        if z > found.get(owner, (PRIOR_SIGMA, ""))[0]:
            found[owner] = z, name
    cameras = {str(o.options.get("camera", "")) for o in context.need_data.observations}
    # One that is wrong bends the others: the farthest alone, and what is left is told when that is mended.
    for owner, (z, name) in sorted(found.items(), key=lambda of: -of[1][0])[:1]:
        symbol = name.rpartition(".")[2]
        placed = f"the place of {owner}" if symbol in FRAME_SYMBOLS else f"the size of {owner}"
        what = f"the camera ({owner})" if owner in cameras else placed
        yield doubt(CONTRADICTED, what=what, owner=owner, name=name, z=z, times=float(np.ceil(z)))

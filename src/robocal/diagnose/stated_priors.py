"""What a fit makes of standard deviations that somebody states for instruments: a lens, a camera's place, the size of a print.

    z_i = (x_i - v_i) / sigma_i        of each number with a prior around its stated value v_i

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

CONTRADICTED = declare(
    "prior-contradicted",
    "these data contradict what was stated of {what}: {name} is {z:.1f} standard deviations from its stated value",
    "Calibrate or measure {owner} again. Else state a larger sigma for it: {name} needs {times:.0f} times as much.",
)


@check("stated-priors", When.FIT, order=216)
def contradicted_priors(context: Context[Model]) -> Iterator[Finding]:
    """Instruments of which a number ended far from where its prior has it; the farthest number of each."""
    problem, x = context.need_fit.problem, context.need_fit.solution.x
    table, change = problem.table, problem.difference(x)[0]
    found: dict[str, tuple[float, str]] = {}
    for name, moved in zip(problem.free, change.tolist(), strict=True):
        prior = table[name].prior
        if prior is None or name in context.model.table or not table[name].prior_informs:
            continue
        owner, z = name.rpartition(".")[0], abs(moved) / prior
        if z > found.get(owner, (PRIOR_SIGMA, ""))[0]:
            found[owner] = z, name
    cameras = {str(o.options.get("camera", "")) for o in context.need_data.observations}
    for owner, (z, name) in found.items():
        symbol = name.rpartition(".")[2]
        placed = f"the place of {owner}" if symbol in FRAME_SYMBOLS else f"the size of {owner}"
        what = f"the camera ({owner})" if owner in cameras else placed
        yield doubt(CONTRADICTED, what=what, owner=owner, name=name, z=z, times=float(np.ceil(z)))

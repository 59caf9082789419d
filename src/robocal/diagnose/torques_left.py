"""Torques of a joint that friction and gravity do not explain.

    share = sum e^2 / sum y^2        of a joint's torques y, e = y - predicted

without the tenth of the rows that is missed most, if the others are met. A joint of which the model predicts nothing, as one about
a plumb axis without speeds, is none of them. Rows that a robust fit set aside count: where half of a joint's rows are gross, the
other half proves nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, Given, When, check, refuse
from robocal.diagnose.limits import LEFT_SIGMA, TORQUE_ROWS, UNEXPLAINED_MOST
from robocal.measure.base import predict_rows
from robocal.measure.machine import Model, joints_of
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["TORQUES"]

TORQUES = declare(
    "torques-left",
    "{joint}: friction and gravity leave {share:.0%} of the squares of its torques, {left:.3g} rms[; the stated noise is {stated:.3g}]",
    "Check that joints, torques and speeds have the right order, units and signs, and that each row is of one moment.",
)


@check("torques-left", When.PROOF, order=81, given=Given.NOTHING, needs=("data", "fit"))
def torques_left(context: Context[Model]) -> Iterator[Finding]:
    """The joint of which the largest share is left."""
    fit, data, worst = context.need_fit, context.need_data, (UNEXPLAINED_MOST, "", 0.0, 0.0)
    stated = {g.name: g.stated or 0.0 for g in fit.groups}
    for obs in data.observations:
        if obs.kind != "joint_torque" or not len(obs):
            continue
        predicted = predict_rows(context.model, data, obs, fit.problem.table, fit.solution.x)[:, 0]
        for joint in np.unique(obs.extra["joint"]):
            mine = obs.extra["joint"] == joint
            read, error = obs.value[mine, 0], obs.value[mine, 0] - predicted[mine]
            noise, reach = stated.get(obs.label, 0.0), float(np.quantile(np.abs(error), TORQUE_ROWS))
            # Where more than a tenth is far beyond the noise, these are no gross rows among good ones: all count.
            kept = np.abs(error) <= (np.inf if 0 < LEFT_SIGMA * noise < reach else reach)
            left, size = (float(np.sqrt(np.mean(v[kept] ** 2))) for v in (error, read))
            if predicted[mine].any() and left > LEFT_SIGMA * noise and left**2 > worst[0] * size**2:
                worst = (left / size) ** 2, joints_of(context.model)[int(joint)].name, left, noise
    if worst[1]:
        share, name, left, noise = worst
        told = Quantity(noise, "N m") if noise else None
        yield refuse(TORQUES, joint=name, share=share, left=Quantity(left, "N m"), stated=told)

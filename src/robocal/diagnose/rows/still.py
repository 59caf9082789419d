"""An instrument that reads one and the same wherever the arm stands: it was stuck, or columns were filled in."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, Given, Machines, When, check, refuse
from robocal.diagnose.limits import STILL_MOVED, STILL_PLACES
from robocal.measure.base import kind_of
from robocal.measure.machine import Model
from robocal.remarks.english import declare

__all__ = ["STILL", "still"]

PLACED = ("position", "pose", "spherical", "bearing", "range", "pixels")  # kinds that read where the tool is
STILL = declare(
    "readings-still",
    "all readings are equal, though the joints move",
    "Give a different reading at each configuration.",
)


@check("still", When.READ, order=10, machines=Machines.JOINTED, given=Given.ACCEPTED, needs=("data",))
def still(context: Context[Model]) -> Iterator[Finding]:
    """A bar of fixed length may read so, and so may a contact."""
    joints = context.need_data.configurations.joints
    if joints is None:
        return
    for obs in context.need_data.observations:
        if obs.kind not in PLACED or obs.rows is None or len(obs) < STILL_PLACES:
            continue
        where = joints[obs.configuration]
        if (
            np.ptp(obs.value, axis=0).any()
            or len(np.unique(where, axis=0)) < STILL_PLACES
            or np.ptp(where, axis=0).max() < STILL_MOVED
        ):
            continue
        yield refuse(STILL, source=obs.source, kind=kind_of(obs).name, rows=len(obs))
        return

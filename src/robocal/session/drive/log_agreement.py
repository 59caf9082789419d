"""Whether logs that are fitted together are of one motor, from one zero, in one unit: what the first shows by itself, each other one has
to show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Bools
from robocal.drives.motor import LAG, Motor, motor_of, order_names
from robocal.files.drive_log import DriveLog
from robocal.remarks.remark import Remark
from robocal.session.drive.drive_fit import choose, highest_order, moments_of_sweeps
from robocal.session.drive.foreign_log import contradiction
from robocal.session.drive.table_share import explain

__all__ = ["contradictions"]


def contradictions(logs: Sequence[DriveLog], used: Sequence[Bools], most: int) -> Iterator[Remark]:
    """What is wrong with each log beside the first, by tables of at most so many orders."""
    first = None
    for log, rows in zip(logs[1:], used[1:], strict=True):
        ways = [set(np.unique(o.sweep.direction[u]).tolist()) for o, u in ((logs[0], used[0]), (log, rows))]
        # Of one direction alone no lag is known, by which the other lies elsewhere.
        if len(ways[0]) < 2 and ways[0] != ways[1]:
            continue
        first = first or _by_itself(logs[0], used[0], most)
        motor, coulomb = first
        why = contradiction(motor, coulomb, log, rows, {False: explain(motor, log.sweep, rows)})
        if why is not None:
            yield why


def _by_itself(log: DriveLog, rows: Bools, most: int) -> tuple[Motor, float]:
    """The motor that one log shows, and its Coulomb friction."""
    sweep = log.sweep
    highest, _ = highest_order([sweep], [rows])
    moments = moments_of_sweeps([sweep], [rows], highest)
    found = choose(moments, most, eccentric=False, loaded=sweep.loaded)
    x, _ = moments.fit(found.orders, found.lag)
    n = len(found.orders)
    values = {LAG: found.lag}
    for i, order in enumerate(found.orders):
        values |= dict(zip(order_names(order), (float(x[2 + i]), float(x[2 + n + i])), strict=True))
    mean = [
        float(np.mean(sweep.effort[rows & (sweep.direction == d)]))
        for d in (1, -1)
        if (rows & (sweep.direction == d)).any()
    ]
    coulomb = (mean[0] - mean[1]) / 2 if len(mean) == 2 else 0.0
    return motor_of(sweep.name, found.orders, sweep.unit, 1.0).with_values(values), coulomb

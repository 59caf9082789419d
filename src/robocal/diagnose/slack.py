"""A cable that hangs: where it is not taut its sensor shows more than the straight line, at some poses and not at others.

Of the lengths that were set aside as gross nearly all are of that cable, and too long. Rows of one part of a file are no slack: a drum
that slipped stays where it is (`segments/`).
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Machines, check_fit_twice, doubt, once, refuse
from robocal.fit.noise import owners
from robocal.measure.machine import Model
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["SLACK", "find_slack"]

SLACK = declare(
    "slack-cable",
    "{file}: of {gross} gross lengths {count} are of {cable}, {longer} of them too long, by up to {most:.3g}: rows {rows}. "
    "Was it taut?",
    "A cable that hangs shows more than its straight line. Look at the tension of {cable} in these rows. Measure them again with every "
    "cable taut, or do without them (--exclude {option}).",
)


@record
class Slack:
    """A cable that hung: its file, the rows of it, how many gross lengths there are, how many are too long, the most (m), and the
    share of its rows."""

    cable: str
    file: str
    rows: tuple[int, ...]
    gross: int
    longer: int
    most: float
    share: float


@once
def find_slack(context: Context[Model]) -> list[Slack]:
    """The cable of each file of lengths that hung; none where nothing points at one."""
    fit, out = context.need_fit, []
    names = context.model.parts.get("cable", ())
    left: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    for (number, term), r in zip(owners(fit.data, fit.problem), context.residuals, strict=True):
        left.setdefault(number, []).append((term.index, r.value[:, 0]))
    for number, parts in left.items():
        obs = fit.data.observations[number]
        if obs.kind != "lengths" or obs.used is None:
            continue
        off = np.zeros(len(obs))
        for index, value in parts:
            off[index] = -value  # read less predicted
        cable, gross = obs.extra["cable"].astype(int), ~obs.used
        own = np.bincount(cable[gross], minlength=len(names))
        most = int(own.argmax())
        mine = cable == most
        hung = gross[mine]
        begun = int(np.count_nonzero(np.diff(np.concatenate([[False], hung]).astype(int)) == 1))
        far = off[mine & gross]
        if (
            own[most] < max(limits.SLACK_LEAST, limits.SLACK_SHARE * own.sum())
            or begun < limits.SLACK_PARTS * own[most]
            or np.ptp(np.flatnonzero(hung)) < limits.SLACK_SPAN * len(hung)
            or np.mean(far > 0) < limits.SLACK_SHARE
        ):
            continue
        known = np.arange(len(obs)) if obs.rows is None else obs.rows
        rows = tuple(int(v) for v in known[mine & gross])
        counts = int(own.sum()), int(np.count_nonzero(far > 0))
        out.append(Slack(names[most], obs.source, rows, *counts, float(far.max()), float(hung.mean())))
    return out


@check_fit_twice(doubt=("slack", 162), refuse=("much-slack", 162), machines=Machines.POSED)
@once
def tell_slack(context: Context[Model]) -> list[Finding]:
    """Cables that hung: a doubt where few of their lengths did, for these were set aside."""
    return [
        (refuse if s.share > limits.GROSS_SHARE else doubt)(
            SLACK,
            file=s.file,
            cable=s.cable,
            count=len(s.rows),
            gross=s.gross,
            longer=s.longer,
            most=Quantity(s.most),
            rows=", ".join(map(str, s.rows)),
            option=",".join(map(str, s.rows)),
        )
        for s in find_slack(context)
    ]

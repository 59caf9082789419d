"""Joints that count from elsewhere than the robot's file says, told one by one in the joint's own unit."""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose import limits
from robocal.diagnose.check_registry import Context, Finding, Machines, When, check, doubt
from robocal.measure.machine import Model
from robocal.parameters import TYPICAL
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["LOST", "UNKNOWN", "cable_zeros", "find_moved_zeros", "find_unknown_zeros"]

LOST = declare(
    "zero-lost",
    "joints count from elsewhere than the robot's file says; add to what they show: {zeros}",
    "Write the calibrated robot to the controller, or these angles as joint offsets. Where a mastering was lost, set it anew.",
)


UNKNOWN = declare(
    "cable-zeros-unknown",
    "the zeros of {count} cables are off by {most:.0f} at most: the error before is that of the zeros",
    "If the sensors count from anywhere after each power-up, write `zeros: NAME` into the data file of the lengths: zeros are then "
    "fitted for the nominal robot too, and the gain is that of the geometry.",
)


@check("lost-zeros", When.FIT, order=155, machines=Machines.JOINTED, needs=("fit",))
def find_moved_zeros(context: Context[Model]) -> Iterator[Finding]:
    """Zeros of turning joints that moved, beyond doubt, as no mastering leaves them."""
    model, fit = context.model, context.need_fit
    moving = model.mechanism
    assert moving is not None
    zeros = [z for z in moving.open_zeros if z.parameter in fit.problem.free and model.table[z.parameter].unit == "rad"]
    moved = {z: (context.values[z.parameter] - model.table[z.parameter].value) / z.factor for z in zeros}
    least = limits.ZERO_CHANGE * TYPICAL["rad"]
    far = {z: v for z, v in moved.items() if abs(v) > least}
    if not far:
        return
    sigma = dict(zip(fit.total.names, fit.total.sigma, strict=True))
    sure = {z: v for z, v in far.items() if abs(v * z.factor) > limits.ZERO_SIGMA * sigma[z.parameter]}
    if sure:
        yield doubt(LOST, zeros=tuple(f"{z.joint} {Quantity(v, 'rad'):.4g}" for z, v in sure.items()))


@check("unknown-zeros", When.FIT, order=156, machines=Machines.POSED, needs=("fit",))
def find_unknown_zeros(context: Context[Model]) -> Iterator[Finding]:
    """Zeros of a robot's own cables that moved, most of them, farther than any drum was set by hand."""
    if off := cable_zeros(context):
        yield doubt(UNKNOWN, count=len(off), most=Quantity(max(off)))


def cable_zeros(context: Context[Model]) -> list[float]:
    """By how much (m) zeros of a robot's own cables moved that were lost, where most of them were."""
    cables, table = context.model.parts.get("cable", ()), context.model.table
    if not cables:
        return []
    sigma = dict(zip(context.need_fit.total.names, context.need_fit.total.sigma, strict=True))
    names = [n for c in cables if (n := f"{c}.l0") in context.need_fit.problem.free and n in table]
    change = {n: abs(context.values[n] - table[n].value) for n in names}
    off = [v for n, v in change.items() if v > max(limits.ZERO_LOST["m"], limits.ZERO_SIGMA * sigma[n])]
    return off if 2 * len(off) > len(cables) else []

"""What a fit leaves, and whether it is so much that model or data are wrong, whatever was gained.

    left > k sigma    and    left > share * size

per axis, of every instrument by itself: sigma is the stated noise (0: none is stated), size that of the machine (`size_of`). Beyond a
share of the variance measured nothing is explained at all.
"""

from __future__ import annotations

from collections.abc import Iterator

from robocal.diagnose import limits
from robocal.diagnose.check_registry import Finding, Given, Level, When, check, of_remarks, qualify, refuse
from robocal.diagnose.fit_checks import implausible, out_of_tolerance
from robocal.measure.machine import Model
from robocal.measure.reach import size_of
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__: list[str] = []


@check("unexplained-without-gain", When.PROOF, order=30, given=Given.NOTHING, needs=("evidence",))
def residual_without_gain(context: Decision[Model]) -> Iterator[Finding]:
    """Much is left and no gain is proven: nobody should hear that the nominal model may be as good as can be."""
    if not context.improvement:
        yield from left_over(context, limits.UNEXPLAINED_SHARE)


@check("bent", When.PROOF, order=70, given=Given.GAIN, needs=("proven",))
def bent(context: Decision[Model]) -> Iterator[Finding]:
    """The model was bent to data that it still does not explain, or to what no making leaves."""
    part = context.proven.part
    changes = implausible(context.model, part)
    left = max((g.rms for g in part.groups if g.unit == "m"), default=0.0)
    if changes and left > limits.BENT_LEAVES:
        yield refuse(Code.BENT, left=Quantity(left))
        yield from of_remarks(changes, Level.REFUSE)
    else:
        yield from of_remarks(out_of_tolerance(context.model, context.proven.base.problem, part), Level.REFUSE)


@check("left", When.PROOF, order=80, given=Given.GAIN, needs=("proven",))
def left(context: Decision[Model]) -> Iterator[Finding]:
    """Metres or angles that the model leaves of what one instrument measured: more than its noise, and than such a machine errs by."""
    for g in context.proven.part.groups:
        if g.unit == "rad" and g.rms > max(limits.ANGLES_LEFT, limits.ANGLES_SIGMA * (g.stated or 0.0)):
            yield refuse(Code.ANGLES_UNEXPLAINED, group=g.name, left=Quantity(g.rms, "rad"))
            return
    moving = context.model.mechanism
    far = [g for g in context.proven.part.groups if g.unit == "m" and g.sigma > limits.LEFT_SIGMA * (g.stated or 0.0)]
    size = size_of(moving) if far and moving is not None else 0.0
    for g in far:
        if size > 0 and g.sigma > limits.LEFT_SHARE * size:
            noise = Quantity(g.stated) if g.stated else None
            yield qualify(
                Code.LEFT, group=g.name, left=Quantity(g.sigma), share=g.sigma / size, size=Quantity(size), stated=noise
            )
            return


@check("unexplained", When.UNSEEN, order=70, given=Given.NOTHING, needs=("evidence",))
def residual_finding(context: Decision[Model]) -> Iterator[Finding]:
    """The model leaves so much that it does not describe this robot."""
    yield from left_over(context, limits.UNEXPLAINED_MOST)


def left_over(context: Decision[Model], most: float) -> Iterator[Finding]:
    """What is left beyond the stated noise, where it is more than a share of the variance."""
    assert context.evidence is not None
    (part, left), stated = context.evidence.residual_share, context.evidence.stated
    if part > most and left > limits.UNEXPLAINED_SIGMA * (stated or 0.0):
        noise = Quantity(stated) if stated else None
        yield refuse(Code.UNEXPLAINED, explained=1 - part, rms=Quantity(left), stated=noise)

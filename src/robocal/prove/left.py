"""What a fit leaves, and whether it is so much that model or data are wrong, whatever was gained.

    left > k sigma    and    left > share * size

per axis, of every instrument by itself: sigma is the stated noise (0: none is stated), size that of the machine (`size_of`). The second
is asked of pixels as a length at the distance of what they show, and of angles as what they move at the distance of that size. Rows that
a robust loss weighs down are left too. Beyond a share of the variance measured nothing is explained at all.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose import limits
from robocal.diagnose.check_registry import Finding, Given, Level, When, check, of_remarks, qualify, refuse
from robocal.diagnose.fit_checks import implausible, out_of_tolerance
from robocal.fit.fit import Fit
from robocal.fit.noise import NoiseGroup
from robocal.measure.machine import Model
from robocal.measure.reach import size_of
from robocal.measure.rows import Rows
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["ANGLES"]

ANGLES = declare(
    "angles-left",
    "{group}: the fit leaves angles of {left:.3g} per axis; at a distance as large as the machine ({size:.3g}) they move a point by "
    "{share:.1%} of that[; the stated noise is {stated:.3g}]: the model does not describe these data",
    "Look for zeros that were set anew while it was measured, for exchanged rows, columns or cables, and for numbers of the robot's file "
    "that are far off. If the instrument itself is so coarse, state the noise of its orientation (sigma).",
)


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
    """Metres, pixels or angles that the model leaves of what one instrument measured: more than its noise, and than such a machine errs
    by. A pixel is as long as where it looks, an angle as what it moves at the distance of the machine's size."""
    groups = context.proven.part.groups
    for g in groups:
        if g.unit == "rad" and g.rms > max(limits.ANGLES_LEFT, limits.ANGLES_SIGMA * (g.stated or 0.0)):
            yield refuse(Code.ANGLES_UNEXPLAINED, group=g.name, left=Quantity(g.rms, "rad"))
            return
    # Of frames alone nothing of the robot was fitted, and what making leaves of its angles is counted by `frames_alone`.
    units = ("m", "px") if context.frames_alone else ("m", "px", "rad")
    far = [g for g in groups if g.unit in units and amount(g) > limits.LEFT_SIGMA * (g.stated or 0.0)]
    moving = context.model.mechanism
    size = size_of(moving) if far and moving is not None else 0.0
    for g in far if size > 0 else ():
        metres = {"m": 1.0, "rad": size}.get(g.unit) or metres_per_pixel(context.proven.part, g.name)
        if amount(g) * metres > limits.LEFT_SHARE * size:
            noise = Quantity(g.stated, g.unit) if g.stated else None
            left, share = Quantity(amount(g), g.unit), amount(g) * metres / size
            code = ANGLES if g.unit == "rad" else Code.LEFT
            yield qualify(code, group=g.name, left=left, share=share, size=Quantity(size), stated=noise)
            return


def amount(group: NoiseGroup) -> float:
    """What is left per axis of the rows that were not set aside: a robust loss weighs some of them down, and they are left as well."""
    return max(group.sigma, group.rms)


def metres_per_pixel(fit: Fit, group: str) -> float:
    """How far something moves, across the sight, that moves by a pixel in the images of a group: sqrt(n / |dy/dp|^2), p where the camera
    or a target stands, of n pixels; 0 where nothing tells."""
    seen = [o for o in fit.data.observations if o.label == group]
    frames = dict.fromkeys(f.name for o in seen for f in (*([o.frame] if o.frame else []), *o.targets))
    problem, x = fit.problem.with_weights(None).with_priors(False), fit.solution.x
    most = 0.0
    for frame in frames:
        line = problem.with_free([n for s in "xyz" if (n := f"{frame}.{s}") in problem.table])
        for term in line.bound_terms:
            if isinstance(term, Rows) and term.group == group and term.used.any():
                _, narrow, _ = term.evaluate(x, np.zeros(1, dtype=np.int64), 0, len(term.scale))
                slope = np.sqrt(np.mean(np.sum(narrow[0][term.used] ** 2, axis=2)))
                most = max(most, float(slope))
    return 1 / most if most > 0 else 0.0


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

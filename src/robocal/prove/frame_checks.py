"""What is found of frames: those of the robot's file that look like others and are held, and frames that these poses cannot place.

    w_i = log(R^T R_i),    C = 1/n sum w_i w_i^T - mean,    s_1^2 >= s_2^2 >= s_3^2 its eigenvalues

R_i turn the hand at every configuration, R is their mean. A frame in the hand and one on the base are told apart by turns about two
axes: about one alone (s_2 = 0) the hand's frame may slide along it. What is wrong by e at every pose is e / s_2 there.
Source: Tsai and Lenz, IEEE T-RA 5 (1989).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._types import Array
from robocal.diagnose import vision_limits
from robocal.diagnose.check_registry import Finding, Given, When, check, note, qualify, refuse
from robocal.geometry import so3
from robocal.measure.data import Frame
from robocal.measure.machine import Model
from robocal.measure.reach import reach
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.bands import mean_conditions
from robocal.prove.decision import Decision
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__: list[str] = []

FIXED = declare(
    "frame-fixed",
    "{frame} stays where the robot file has it: measurements cannot tell it from {like}, which is free",
    "To look for {frame} instead, write --fix {like}.",
)
LITTLE_TURN = declare(
    "little-turn",
    "the hand hardly turns: by {first:.2g} in all about one axis and {second:.2g} about the next, so {names} cannot be told[ {apart}]",
    "Add poses in which the hand turns by 30 deg or more, about two axes that are at least 30 deg apart.",
)
ONE_AXIS = declare(
    "one-axis",
    "the hand turns about one axis alone: by {first:.3g} in all about ({axis}) of the tool, by {second:.2g} about any other, so {names} "
    "may slide along it[ {together}]",
    "Add poses in which the hand turns by 30 deg or more about a second axis, at least 30 deg from the first.",
)
OPEN = declare(
    "frames-open",
    "these measurements do not tell {names} of the frames",
    "Turn the hand about two axes at least 30 deg apart, measure orientations too, or fix what is known.",
)


LOOSE = declare(
    "frames-loose",
    "{name} may be off by {place:.3g} and {turn:.2g} (standard deviation): these measurements hardly place it",
    "Add poses in which the hand turns by 30 deg or more, about two axes that are at least 30 deg apart.",
)


@check("frames-alike", When.FIT, order=265, needs=("proven",))
def frames_alike(context: Decision[Model]) -> Iterator[Finding]:
    """Frames of the robot's file that were free and are held, for free frames of the data say the same."""
    for fixed in context.fixed_frames:
        yield note(FIXED, frame=fixed.name, like=fixed.like)


@check("hand-turns", When.UNSEEN, order=5, given=Given.NOTHING, needs=("proven",))
def hand_turns(context: Decision[Model]) -> Iterator[Finding]:
    """Frames in the hand and on the base, and a hand that does not turn about two axes."""
    names = tuple(n for n in _both_sides(context) if n == "tool" or not _known(context.frames[n]))
    sides = {"tool" if n == "tool" else context.frames[n].mount for n in names}
    changes = all(o.kind == "relative_pose" for o in context.need_data.observations)
    turns = _turns(context) if changes or len(sides) > 1 else None
    if turns is None:
        return
    away = so3.log(np.swapaxes(so3.project(turns.mean(axis=0))[None], 1, 2) @ turns)
    values, axes = np.linalg.eigh(np.cov(away.T, bias=True))
    if values[1] >= vision_limits.HAND_TURNS**2:
        return
    along = away @ axes[:, ::-1]
    first, second, _ = (Quantity(float(v), "rad") for v in np.ptp(along, axis=0))
    if values[2] < vision_limits.HAND_TURNS**2:
        apart = "apart" if len(names) > 1 else None
        yield refuse(LITTLE_TURN, first=first, second=second, names=names, apart=apart)
    else:
        axis = axes[:, -1] * np.sign(axes[np.argmax(np.abs(axes[:, -1])), -1])
        words = ", ".join(f"{v + 0.0:.2f}" for v in axis.round(2).tolist())
        together = "together" if len(names) > 1 else None
        yield refuse(ONE_AXIS, first=first, second=second, axis=words, names=names, together=together)


def _both_sides(context: Decision[Model]) -> tuple[str, ...]:
    """The free frames, where some are in the hand and some on the base, or changes alone were seen, and nothing else was to be found."""
    if not context.frames_alone:
        return ()
    free = dict.fromkeys(n.rpartition(".")[0] for n in context.proven.base.problem.table.free)
    owners = [n for n in free if n == "tool" or n in context.frames]  # a lens is no frame
    mounts = {n: "tool" if n == "tool" else context.frames[n].mount for n in owners}
    changes = all(o.kind == "relative_pose" for o in context.need_data.observations)
    return tuple(owners) if changes or set(mounts.values()) == {"tool", "base"} else ()


def _known(frame: Frame) -> bool:
    """Whether a prior places a frame, as well as a result would have to."""
    prior = frame.prior
    return (
        prior is not None and max(prior[:3]) <= vision_limits.KNOWN_PLACE and max(prior[3:]) <= vision_limits.FRAME_TURN
    )


def _turns(context: Decision[Model]) -> Array | None:
    """How the hand is turned at every configuration, (m, 3, 3); None where fewer than two are known."""
    c, problem = context.need_data.configurations, context.need_fit.problem
    if c.joints is not None:
        q = c.joints[np.isfinite(c.joints).all(axis=1)]
        found = reach(context.model, q, (), mean_conditions(c))[0][:, :3, :3]
    elif problem.families and problem.families[0].count == problem.configurations:
        vectors = context.need_fit.solution.x[0, problem.places[0]].reshape(problem.configurations, -1)
        found = so3.exp(vectors[:, -3:])
    else:
        found = so3.exp(c.starts[:, 3:])
    return found if len(found) > 1 else None


@check("frames-open", When.PROOF, order=55, given=Given.GAIN, needs=("proven",))
def frames_open(context: Decision[Model]) -> Iterator[Finding]:
    """Frames alone of which a part cannot be told from the rest."""
    if context.frames_alone:
        missed = tuple(c.name for c in context.need_fit.identifiability.combinations if c.partners)
        if missed:
            yield qualify(OPEN, names=missed)


@check("frames-loose", When.PROOF, order=56, given=Given.GAIN, needs=("proven",))
def frames_loose(context: Decision[Model]) -> Iterator[Finding]:
    """A camera or its target, alone to be found, that may be centimetres off."""
    if not _both_sides(context):
        return
    names, covariance = context.spread
    own = dict(zip(names, np.diag(covariance), strict=True))
    size = {}
    for owner in dict.fromkeys(n.rpartition(".")[0] for n in names):
        parts = (FRAME_SYMBOLS[:3], FRAME_SYMBOLS[3:])
        size[owner] = [float(np.sqrt(sum(own.get(f"{owner}.{s}", 0.0) for s in part))) for part in parts]
    name, (place, turn) = max(
        size.items(),
        key=lambda item: max(item[1][0] / vision_limits.FRAME_PLACE, item[1][1] / vision_limits.FRAME_TURN),
    )
    if place > vision_limits.FRAME_PLACE or turn > vision_limits.FRAME_TURN:
        yield qualify(LOOSE, name=name, place=Quantity(place, "m"), turn=Quantity(turn, "rad"))

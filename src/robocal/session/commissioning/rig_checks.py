"""What a rig is asked at power-up, before any long motion: as many drives as cables, each winch alone, the weight, small motions."""

from __future__ import annotations

from itertools import product

import numpy as np

from robocal._scipy import special
from robocal._types import Array
from robocal.diagnose.cables.power_up import RoughKnowledge, balance_chance, explain, explain_balance, lengths_chance
from robocal.diagnose.limits import CABLE_RIG_CHANCE, CABLE_RIG_STOP
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.commissioning.rig_motion import RigMotion, Stop
from robocal.simulation.cable_rig.winch_test import examine_winches

__all__ = ["check_rig", "remark_of_stop"]

SLACK_SHARE = 0.25  # grid: of the least tension, below which a cable counts as slack
SMALL = 0.1, np.radians(4.0)  # grid: m and rad of the motions about X_0, along each axis
TRAIL = 10, 20, 30  # grid: rows of a motion that failed at once
GROWTH = 0.25, 0.5, 1.0  # grid: of these motions, one round after the other
CORNERS = tuple(
    (*place, *turn)
    for place, turn in zip(
        product((1.0, -1.0), repeat=3),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1), (0.6, 0.6, 0), (0, 0.6, 0.6)),
        strict=True,
    )
)


def check_rig(motion: RigMotion, rng: np.random.Generator) -> Remark | None:
    """What is wrong with a rig, or None. Nothing moves on where something is."""
    world = motion.world
    names, said = world.spec.cables, world.spec.model
    drives = said.wrong.cables or len(names)
    if drives != len(names):
        return Remark.of(Code.RIG_DRIVES, drives=drives, cables=len(names))
    if not motion.allows(motion.ahead(motion.home)):
        return remark_of_stop(Stop("infeasible", "X_0"), motion)
    if (found := _winches(motion, rng)) is not None:
        return found
    shown: list[Array] = []
    for share, corner in product(GROWTH, CORNERS):
        step = share * np.array(corner) * np.repeat(SMALL, 3)
        target = se3.displace(motion.home, step[:3], step[3:])
        if not motion.allows(motion.ahead(target)):
            continue
        there = motion.go(target, "X_0")
        if isinstance(there, Stop):
            # Where nothing was known at rest, the first moments of the way tell: later a cable may hang slack.
            if not shown:
                shown += [motion.trail[row] for row in TRAIL if row < len(motion.trail)]
            return _lengths(motion, np.array(shown), True, CABLE_RIG_STOP) or remark_of_stop(there, motion)
        shown.append(there[0] + rng.normal(scale=said.cable.length_noise, size=len(names)))
        if (found := _lengths(motion, np.array(shown), share == GROWTH[-1])) is not None:
            return found
    return None


def knowledge_of(motion: RigMotion) -> RoughKnowledge:
    """What the builder says of anchors, the pose at power-up and lengths; stretch by tensions that differ counts as noise of lengths."""
    world = motion.world
    said = world.spec.model
    start = np.repeat([said.start.position_sigma, np.radians(said.start.angle_sigma)], 3)
    long = float(np.linalg.norm(motion.believed.a - motion.home[:3, 3], axis=1).mean())
    low, high = world.spec.limits
    stretch = said.cable.elongation_per_N * long * (high - low) / 4
    return RoughKnowledge(world.belief.sigma, start, float(np.hypot(said.cable.length_noise, stretch)))


def _lengths(motion: RigMotion, shown: Array, last: bool, least: float = CABLE_RIG_CHANCE) -> Remark | None:
    """Whether lengths at small motions fit together; where they do not, before the `last` motion only what one cause alone explains."""
    known, robot = knowledge_of(motion), motion.believed
    if not len(shown) or (chance := lengths_chance(robot, known, motion.home, shown)) >= least:
        return None
    best, second, *_ = explain(robot, known, motion.home, shown, np.zeros(shown.shape[1]))
    if not last and second.chance >= CABLE_RIG_CHANCE:
        return None
    if best.chance < CABLE_RIG_STOP:
        return Remark.of(Code.RIG_LENGTHS_DISAGREE, chance=chance) if last else None
    cables = tuple(robot.cables[i] for i in best.cables)
    alike = second.chance >= CABLE_RIG_CHANCE and len(second.cables) == len(cables)
    also = tuple(robot.cables[i] for i in second.cables) if alike else None
    if len(cables) == 2:
        return Remark.of(Code.RIG_EXCHANGED, cables=cables, also=also)
    return Remark.of(Code.RIG_ENCODER, cable=cables[0], gain=best.gain, also=also, times=second.gain if also else None)


def _balance(motion: RigMotion, tension: Array) -> Remark | None:
    """Whether the tensions at power-up hold the platform that was said."""
    known, robot, home = knowledge_of(motion), motion.believed, motion.home
    said = motion.world.spec.model
    found = explain_balance(robot, known, home, tension, said.cable.tension_known_to)
    if found.cables and balance_chance(robot, known, home, tension, said.cable.tension_known_to) < CABLE_RIG_CHANCE:
        one, other = (robot.cables[i] for i in found.cables)
        return Remark.of(Code.RIG_EXCHANGED, cables=(one, other), also=None)
    if found.cables or special.ndtr(-abs(found.weight - 1) / found.sigma) >= CABLE_RIG_CHANCE:
        return None
    weight = said.weight_N
    return Remark.of(Code.RIG_WEIGHT, said=weight, found=weight * found.weight, sigma=weight * found.sigma)


def _winches(motion: RigMotion, rng: np.random.Generator) -> Remark | None:
    """Each winch alone, and their tensions together."""
    world = motion.world
    said = world.spec.model
    least = SLACK_SHARE * float(world.spec.limits[0])
    try:
        found, tension = examine_winches(motion.plant, motion.wiring, motion.driven, least)
    except ModelError as error:
        raise error.of_file(
            world.spec.file.file, key="drives.coulomb_N_m", expected="less than the cables pull"
        ) from None
    if found is None:
        told = tension * (1 + rng.normal(scale=said.cable.tension_known_to, size=len(tension)))
        return _balance(motion, np.abs(told))
    code = Code.RIG_SLACK if found.what == "slack" else Code.RIG_REVERSED
    return Remark.of(code, cable=world.spec.cables[found.winch])


def remark_of_stop(stop: Stop, motion: RigMotion) -> Remark:
    """Why a motion was not made, or ended."""
    low, high = motion.world.spec.limits
    if stop.word in ("infeasible", "no-tensions"):
        return Remark.of(Code.RIG_INFEASIBLE, pose=stop.at, low=float(low), high=float(high))
    return Remark.of(Code.RIG_STOPPED, pose=stop.at, why=stop.word, cable=stop.cable or None)

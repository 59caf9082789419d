"""Camera and target from pairs of poses: where the robot says its flange is, and where the camera sees the target.

The robot is a machine whose poses are known, and the two frames are all that is free: gross views, noise, hold-out and verdict are those
of every identification. A camera that does not know how long a metre is has a scale, one with a clock of its own a delay.
Noise that nobody states is read off the residuals of a fit (`view_noise`) and weighs the next one, until it stays. A camera without
a target of known size drifts: then changes from pose to pose are what is fitted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.fit.options import Options
from robocal.fit.starts.consensus import find_flips
from robocal.geometry import se3
from robocal.geometry.pose_path import PosePath
from robocal.measure.base import problem as build
from robocal.measure.clock_rig import clock_rig, rate_columns
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Model, Rig
from robocal.measure.pose import SIGHT
from robocal.parameters import FRAME_SYMBOLS, ParameterTable
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.arm_errors import JointedArm, free_arm
from robocal.session.vision.delay_start import start_delay
from robocal.session.vision.drift import changes_alone, follow_one_another, read_drift
from robocal.session.vision.view_noise import log_noise, read_noise

__all__ = ["CAMERA", "TARGET", "HandEye", "PosePairs", "locate_camera", "pair_data", "tell_flips"]

CAMERA, TARGET = "camera", "board"
DELAY = f"{CAMERA}.delay"
FREE = (True,) * 6
ROUNDS = 8  # grid: the delay doubles its digits in each
SETTLED = 0.05  # tolerance: of the delay's sigma
ALIKE = 0.1  # tolerance: of the logarithm of sigma: weights off by that cost an estimate 1 % of its variance


@record(eq=False)
class PosePairs:
    """The `views`, T_camera_target (m, 4, 4), and T_base_flange beside them: `machine` (m, 4, 4), or a path and `time` (m,) on a clock of
    the camera's. `in_hand`: the camera is on the flange and the target on the base, else the other way round. `metric`: it knows how
    long a metre is. `sigma` (m, 6) as kind pose has it. `arm`: what carries the flange, at every view, where poses have no times."""

    views: Array
    in_hand: bool
    machine: Array | PosePath
    time: Array | None = None
    metric: bool = True
    sigma: Array | None = None
    arm: JointedArm | None = None

    def at(self, delay: float) -> PosePairs:
        """Those whose poses the path has for this delay (s) of the camera's clock."""
        assert isinstance(self.machine, PosePath) and self.time is not None
        return self.take(np.flatnonzero(self.machine.inside(self.time - delay)))

    def take(self, index: Ints) -> PosePairs:
        """Some of the views."""
        machine = self.machine if isinstance(self.machine, PosePath) else self.machine[index]
        time, sigma = (None if v is None else v[index] for v in (self.time, self.sigma))
        arm = None if self.arm is None else replace(self.arm, joints=self.arm.joints[index])
        return replace(self, views=self.views[index], machine=machine, time=time, sigma=sigma, arm=arm)


@record(eq=False)
class HandEye:
    """The decision, and where things are: `camera` and `target`, T_flange_camera and T_base_target of a camera in the hand, T_base_camera
    and T_flange_target of one beside the robot; the delay (s) of its clock with sigma, where it was found; and the views that were left
    out, for they show the other pose of a flat target. `arm`: the decision on frames and arm together, whose frames these are, where the
    arm's own errors are seen."""

    decision: Decision[Model]
    camera: Array
    target: Array
    delay: tuple[float, float] | None = None
    flipped: tuple[int, ...] = ()
    remarks: tuple[Remark, ...] = ()
    arm: Decision[Model] | None = None


def pair_data(pairs: PosePairs, machine: Array, twist: Array | None = None) -> DataSet:
    """The measured poses as data, with the flange at `machine` (m, 4, 4), on its way where `twist` (m, 6) is given."""
    count = len(machine)
    hand, base = ("tool", "base") if pairs.in_hand else ("base", "tool")
    columns = {} if twist is None else rate_columns(twist)
    options: dict[str, object] = {} if pairs.metric else {"scale": CAMERA}
    if pairs.metric and pairs.sigma is None:
        options[SIGHT] = True
    where = Configurations(tuple(map(str, range(count))), columns=columns, start=se3.to_vector(machine))
    seen = Observations(
        "pose",
        np.arange(count),
        se3.to_vector(pairs.views),
        pairs.sigma,
        frame=Frame(CAMERA, free=FREE, mount=hand),
        targets=(Frame(TARGET, free=FREE, mount=base),),
        target=np.zeros(count, dtype=np.int64),
        options=options,
    )
    return DataSet(where, (seen,))


def locate_camera(pairs: PosePairs, options: Options | None = None, watch: Watch | None = None) -> HandEye:
    """Where camera and target are. Raises ModelError."""
    options = options or Options()
    delay, machine, freed = None, pairs.machine, None
    found: Decision[Model]
    flipped = _flipped(pairs)
    kept = np.setdiff1d(np.arange(len(pairs.views)), flipped)
    pairs = pairs.take(kept)
    machine = pairs.machine
    if isinstance(machine, PosePath):
        found, delay, pairs, machine = _locate_late(pairs, machine, options, watch)
    else:
        found = _decide(pairs, pair_data(pairs, machine), options, watch)
        if pairs.arm is not None and all(o.second is None for o in found.need_data.observations):
            found, freed = _decide_with_arm(pairs.arm, found.need_data, options, watch)
    values = (freed or found).values
    places = {n: se3.from_vector(np.array([values[f"{n}.{s}"] for s in FRAME_SYMBOLS])) for n in found.frames}
    if CAMERA in places and not pairs.in_hand:  # an instrument that stands on the base is stored the other way round
        places[CAMERA] = se3.inverse(places[CAMERA])
    # Changes alone do not tell where the other one is: it is where it was seen first.
    if TARGET not in places:
        places[TARGET] = machine[0] @ places[CAMERA] @ pairs.views[0]
    elif CAMERA not in places:
        places[CAMERA] = machine[0] @ places[TARGET] @ se3.inverse(pairs.views[0])
    out = tuple(flipped.tolist())
    said = tell_flips([str(i + 1) for i in out], len(kept) + len(out))
    return HandEye(found, places[CAMERA], places[TARGET], delay, out, said, freed)


def tell_flips(views: Sequence[str], total: int) -> tuple[Remark, ...]:
    """The remark on views that were left out, for they show the other pose of a flat target."""
    if not views:
        return ()
    return (Remark.of(Code.VIEWS_FLIPPED, count=len(views), total=total, views=tuple(views)),)


def _flipped(pairs: PosePairs) -> Ints:
    """The views that show the other pose of a flat target; none of a camera that sees no target."""
    if not pairs.metric:
        return np.zeros(0, dtype=np.int64)
    if not isinstance(pairs.machine, PosePath):
        return np.flatnonzero(find_flips(pairs.views, pairs.machine, pairs.in_hand))
    assert pairs.time is not None
    when = pairs.time - start_delay(pairs.machine, pairs.time, pairs.views)
    inside = np.flatnonzero(pairs.machine.inside(when))
    machine = pairs.machine.at(when[inside])[0]
    return inside[find_flips(pairs.views[inside], machine, pairs.in_hand)]


def _locate_late(
    pairs: PosePairs, path: PosePath, options: Options, watch: Watch | None
) -> tuple[Decision[Rig], tuple[float, float], PosePairs, Array]:
    """The decision and the delay with its sigma, and the pairs with the poses of the path beside them."""
    assert pairs.time is not None
    delay = start_delay(path, pairs.time, pairs.views)
    for _ in range(ROUNDS):
        near = pairs.at(delay)
        assert near.time is not None
        machine, twist = path.at(near.time - delay)
        found = _decide(near, pair_data(near, machine, twist), options, watch)
        change = found.values[DELAY]
        names, covariance = found.spread
        known = float(np.sqrt(covariance[names.index(DELAY), names.index(DELAY)])) if DELAY in names else np.inf
        delay += change
        if abs(change) <= SETTLED * known:
            break
    return found, (delay, known), near, machine


def _decide(pairs: PosePairs, data: DataSet, options: Options, watch: Watch | None) -> Decision[Rig]:
    """The decision, under noise of every direction's own where none is stated; of a camera that drifts, by changes alone."""
    late = bool(data.configurations.columns)
    rig: Rig = clock_rig(CAMERA) if late else Rig(CAMERA, ParameterTable(), ())
    found = decide(rig, data, options, watch)
    if pairs.sigma is not None:
        return found
    if not pairs.metric and follow_one_another(found):
        whole = found.need_data
        found = decide(rig, changes_alone(whole, pairs.in_hand), options, watch)
        data = changes_alone(whole, pairs.in_hand, read_drift(found, whole, pairs.in_hand))
        found = decide(rig, data, options, watch)
    before = np.zeros(())
    for _ in range(ROUNDS):
        data, sigma = _weigh(found, data, DELAY if late else None)
        if before.ndim and np.abs(np.log(sigma / before)).max() < ALIKE:
            break
        before = sigma
        (seen,) = data.observations
        found = decide(rig, replace(data, observations=(replace(seen, sigma=sigma),)), options, watch)
    return found


def _weigh(found: Decision[Rig], data: DataSet, late: str | None) -> tuple[DataSet, Array]:
    """The data and their noise (k, 6), in those axes in which residuals show the more: along the line of sight, or the camera's own."""
    (seen,) = data.observations
    problem, values = found.need_fit.problem, found.values
    ways = []
    turns = [{**seen.options, SIGHT: sight} for sight in (True, False)] if SIGHT in seen.options else [seen.options]
    for axes in turns:
        own = replace(seen, options=axes)
        used = replace(own, used=found.need_data.observations[0].used)
        made = build(found.model, replace(data, observations=(used,)), values=values).with_weights(problem.weights)
        made = made.with_free(problem.free)
        ways.append((log_noise(made, made.start), own, made))
    _, own, made = min(ways, key=lambda way: way[0])
    return replace(data, observations=(own,)), read_noise(made, made.start, late)


def _decide_with_arm(
    arm: JointedArm, data: DataSet, options: Options, watch: Watch | None
) -> tuple[Decision[Model], Decision[Model] | None]:
    """The same by joint values; and the decision on frames and arm, where errors of the arm are seen."""
    where = replace(data.configurations, start=None, joints=arm.joints)
    alone, together = free_arm(arm.machine, replace(data, configurations=where), options, watch)
    return alone, None if together is alone else together

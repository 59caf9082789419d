"""What else is unknown beside the frames: how far the camera's clock is behind the robot's, and how large the target is.

    T_i = T(t_i - delay),    p = factor p_stated,    until both change by less than a twentieth of their sigma

Both are parameters of one fit with the frames. The robot's poses are taken from its path, and points of the target are restated, at the
values of the round before, so that what is left of them is linear.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.vision_limits import CLOCK_LATE
from robocal.errors import ModelError
from robocal.files.robot_poses import RobotPoses
from robocal.fit.options import Options as Solver
from robocal.geometry import se3, so3
from robocal.geometry.pose_path import PosePath
from robocal.measure.clock_rig import ClockRig, clock_rig, place_columns, rate_columns
from robocal.measure.data import DataSet
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.delay_start import start_delay

__all__ = [
    "DELAY",
    "SHRINK",
    "HandEyeUnknowns",
    "find_lateness",
    "flange_at",
    "locate_unknowns",
    "path_of",
    "restate",
    "start_unknowns",
]

DENSE = 0.12  # tolerance: s between poses of a path: a hand hardly changes its speed in that time
FEWEST = 10  # tolerance: poses of a path
FASTEST = 20.0  # tolerance: m/s; the fastest robots reach half of it
MARGIN = 0.05  # grid: s, within which the delay is sought around its start
ROUNDS = 5  # grid: each doubles the digits
SETTLED = 0.05  # tolerance: of sigma
EYE = "camera"
DELAY, SHRINK = f"{EYE}.delay", "target.shrink"


@record(eq=False)
class HandEyeUnknowns:
    """Whether a delay and a size are looked for, and where they are: s, and times the stated size; the robot's path and the `time` (n,) of
    views on the camera's clock."""

    with_delay: bool = False
    with_size: bool = False
    delay: float = 0.0
    factor: float = 1.0
    path: PosePath | None = None
    time: Array | None = None

    @property
    def some(self) -> bool:
        """Whether anything is looked for."""
        return self.with_delay or self.with_size

    @property
    def inside(self) -> Bools | None:
        """Which views lie within the path, wherever their clock ends up."""
        if self.path is None or self.time is None:
            return None
        off = MARGIN * np.array([[-1.0], [1.0]]) if self.with_delay else np.zeros((1, 1))
        return np.asarray(self.path.inside(self.time - self.delay + off).all(axis=0))

    @property
    def rig(self) -> ClockRig:
        """The robot, whose poses these change."""
        return clock_rig(EYE, SHRINK.partition(".")[0] if self.with_size else "", delay=self.with_delay)

    def listing(self, made: Decision[Any]) -> Listing | None:
        """What was found, with one standard deviation."""
        names, covariance = made.spread
        rows = [
            (name, unit, value, scale * float(np.sqrt(covariance[names.index(key), names.index(key)])))
            for name, key, unit, value, scale in (
                ("delay of the camera's clock", DELAY, "ms", 1e3 * self.delay, 1e3),
                ("size of the target, over that stated", SHRINK, "", self.factor, self.factor),
            )
            if key in names
        ]
        if not rows:
            return None
        name, unit, value, sigma = zip(*rows, strict=True)
        return Listing((
            Column("name", "", list(name)),
            Column("found", "", np.array(value), figures=6),
            Column("sigma", "", np.array(sigma), figures=2),
            Column("unit", "", list(unit)),
        ))  # fmt: skip


def path_of(robot: RobotPoses, inverse: bool) -> PosePath | None:
    """The robot's path, of poses that were recorded while it moved; None of poses at stops."""
    if robot.times is None:
        return None
    times, first = np.unique(robot.times, return_index=True)
    if len(times) < FEWEST or float(np.median(np.diff(times))) > DENSE:
        return None
    poses = robot.pose[first]
    speed = float(np.median(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) / np.diff(times)))
    if speed > FASTEST:
        found = f"{speed:.3g} m/s in the median, of times in {robot.clock or 's'} and places as they were read"
        expected = "the unit in the head of the column: time [s]; or --units of the poses"
        raise ModelError(
            "no hand is as fast as these poses follow one another", key="time", found=found, expected=expected
        )
    return PosePath(times, se3.inverse(poses) if inverse else poses)


def start_unknowns(o: Any, path: PosePath | None, time: Array | None, seen: Array, where: Ints) -> HandEyeUnknowns:
    """What is asked for, and where it starts: times (n,) of views, and poses (v, 4, 4) of the target in some, `where` (v,). Raises
    ModelError."""
    delay = 0.0
    if o.free_delay:
        if path is None or time is None:
            found = "views without times (--pair time)" if time is None else "poses at stops, or without times"
            expected = "poses recorded ten times a second or more, with a column time [s], while the hand moves"
            raise ModelError("a delay needs the robot's path", key="--free-delay", found=found, expected=expected)
        delay = start_delay(path, time[where], seen)
    return HandEyeUnknowns(o.free_delay, o.free_size, delay, 1.0, path, time)


def find_lateness(unknowns: HandEyeUnknowns, seen: Array, where: Ints) -> Remark | None:
    """A delay that is not looked for and that the turns of the hand show: `seen` (v, 4, 4), poses of the target in the views `where`."""
    if unknowns.with_delay or unknowns.path is None or unknowns.time is None:
        return None
    delay = start_delay(unknowns.path, unknowns.time[where], seen)
    return None if abs(delay) < CLOCK_LATE else Remark.of(Code.CLOCKS_APART, delay=Quantity(delay, "s"))


def locate_unknowns(opened: Any, solver: Solver, watch: Watch | None = None) -> tuple[Any, Decision[Any]]:
    """What was opened, at what was found, and the decision. Raises ModelError."""
    for _ in range(ROUNDS):
        made = decide(opened.machine, opened.data, solver, watch)
        unknowns: HandEyeUnknowns = opened.unknowns
        if not unknowns.some:
            break
        change, shrink = made.values.get(DELAY, 0.0), made.values.get(SHRINK, 0.0)
        names, covariance = made.spread
        sigma = dict(zip(names, np.sqrt(np.diag(covariance)), strict=True))
        if abs(change) <= SETTLED * sigma.get(DELAY, np.inf) and abs(shrink) <= SETTLED * sigma.get(SHRINK, np.inf):
            break
        factor = unknowns.factor / (1 + shrink)
        opened = opened.restated(replace(unknowns, delay=unknowns.delay + change, factor=factor))
    return opened, made


def restate(data: DataSet, flange: Array, old: HandEyeUnknowns, new: HandEyeUnknowns) -> tuple[DataSet, Array]:
    """The data and the poses of the flange (n, 4, 4) at another delay and size, with the columns by which these change them."""
    columns: dict[str, Array] = {}
    if new.path is not None and new.time is not None:
        flange, twist = new.path.at(new.time - new.delay)
        columns |= rate_columns(twist) if new.with_delay else {}
    if new.with_size:
        columns |= place_columns(flange[:, :3, 3])
    where = replace(data.configurations, start=se3.to_vector(flange), columns=columns)
    (obs,) = data.observations
    times = new.factor / old.factor
    if times != 1 and obs.kind == "pixels":
        obs = replace(obs, extra={**obs.extra, "point": times * obs.extra["point"]})
    elif times != 1:
        value = np.array(obs.value)
        value[:, :3] *= times
        obs = replace(obs, value=value)
    return replace(data, configurations=where, observations=(obs,)), flange


def flange_at(flange: Array, columns: Mapping[str, Array], change: float, shrink: float) -> Array:
    """Poses of the flange (n, 4, 4) as a fit has them, whose delay and size are off by so much."""
    shift, turn = np.zeros((len(flange), 3)), np.zeros((len(flange), 3))
    for i, axis in enumerate("xyz"):
        shift[:, i] += change * columns.get(f"rate.t{axis}", 0.0) + shrink * columns.get(f"place.t{axis}", 0.0)
        turn[:, i] += change * columns.get(f"rate.r{axis}", 0.0)
    moved = se3.compose(so3.exp(turn), np.zeros((len(flange), 3))) @ flange
    moved[:, :3, 3] += shift
    return moved

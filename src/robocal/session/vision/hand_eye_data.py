"""Views of a target and the robot's poses as data for `decide`: given flange poses are a machine without joints whose poses are known."""

from __future__ import annotations

from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose.camera_changes import half_turns_open, view_poses
from robocal.diagnose.half_turns import undo_half_turns
from robocal.errors import ModelError
from robocal.files.robot_poses import RobotPoses, read_robot_poses
from robocal.files.text import InputFile
from robocal.fit.starts.consensus import find_flips
from robocal.geometry import se3
from robocal.geometry.pose_path import PosePath
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.measure.pixels import HALF_TURNS
from robocal.progress import Watch
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.corner_table import CAMERA
from robocal.session.vision.hand_eye_joints import read_joint_poses
from robocal.session.vision.hand_eye_pair import Pairs, pair_views, some_names
from robocal.session.vision.hand_eye_rig import RigViews, join_rig, mount_rig, open_rig
from robocal.session.vision.hand_eye_unknowns import HandEyeUnknowns, path_of, restate, start_unknowns
from robocal.session.vision.hand_eye_views import HandEyeViews, read_views
from robocal.session.vision.pose_pairs import tell_flips
from robocal.vision.lenses import Lens

__all__ = ["BOARD", "EYE", "HandEyeData", "open_hand_eye"]

EYE, BOARD = "camera", "board"
PLACE = (1.0, 3.0)  # of a frame that is looked for, m and rad
FEWEST = 3  # tolerance: pairs of a closed form
ENOUGH = f"{FEWEST} at least, better 15 to 30"


@record(kw_only=True, eq=False)
class HandEyeData:
    """What was opened: data, pairs of views and poses, the robot's poses T_base_flange (n, 4, 4) of the data's configurations, the views as
    they were read, the arm whose joints were read, what else is unknown, cameras that are bolted to the first, the files and remarks."""

    data: DataSet
    robot: RobotPoses
    pairs: Pairs
    flange: Array
    inhand: bool
    inverse: bool
    source: HandEyeViews
    arm: Any
    unknowns: HandEyeUnknowns
    rig: RigViews | None = None
    files: tuple[InputFile, ...]
    remarks: tuple[Any, ...]

    @property
    def machine(self) -> Any:
        """The arm whose joints were read, or the robot whose flange is where it says."""
        if self.arm is not None:
            return self.arm
        return self.unknowns.rig if self.unknowns.some else Rig("robot", freedom=())

    @property
    def lens(self) -> Lens | None:
        """The lens that was given; None of measured poses."""
        return self.source.lens

    def restated(self, unknowns: HandEyeUnknowns) -> HandEyeData:
        """The same at another delay of the camera's clock and another size of the target."""
        data, flange = restate(self.data, self.flange, self.unknowns, unknowns)
        return replace(self, data=data, flange=flange, unknowns=unknowns)

    @property
    def hand(self) -> str:
        """What the robot's poses are of."""
        return "flange" if self.arm is None else "tool"

    @property
    def observations(self) -> Observations:
        """The rows of the first camera."""
        return self.data.observations[0]

    @property
    def views(self) -> tuple[str, ...]:
        """The names of the views."""
        return self.data.configurations.ids

    def with_flange(self, flange: Array) -> DataSet:
        """The data with other poses of the robot."""
        return replace(self.data, configurations=replace(self.data.configurations, start=se3.to_vector(flange)))

    def target_views(self, which: int | None = None) -> tuple[Ints, Array]:
        """The configurations (V,) of views that show a target well, that which most rows show or another, and its pose in the camera in
        each, (V, 4, 4)."""
        obs = self.observations
        if obs.target is not None and len(obs.targets) > 1:
            most = int(np.bincount(obs.target).argmax())
            obs = obs.take(np.flatnonzero(obs.target == (most if which is None else which)))
            obs = replace(obs, targets=(), target=None)
        if obs.kind == "pose":
            return obs.configuration, se3.from_vector(obs.value)
        found = view_poses(obs)
        return found.configuration, found.pose


def open_hand_eye(o: Any, watch: Watch | None = None) -> HandEyeData:
    """Reads corners or poses of a target, the robot's poses and the lens, and pairs views with poses. Raises InputError."""
    arm, joints = None, None
    if o.arm is None:
        robot = read_robot_poses(o.robot, maker=o.maker, euler=o.euler, units=o.units, quaternion=o.quaternion)
    else:
        poses = ("maker", "euler", "quaternion", "inverse", "free_delay", "free_size")
        o.refuse(poses, "joint values are no poses", "--arm alone")
        robot, arm, joints = read_joint_poses(o.robot, o.arm, o.units)
    views = read_views(o, watch)
    obs, said = views.observations, views.remarks
    pairs = pair_views(
        views.names, robot, o.pair or ("time" if o.free_delay else None), named=views.named, times=views.times
    )
    if len(pairs.view) < FEWEST:
        alone = f"; alone are views {some_names(pairs.views_alone)}" if len(pairs.views_alone) else ""
        raise ModelError(
            "too few views have a pose of the robot",
            key="--pair",
            found=f"{len(pairs.view)}, paired {pairs.description}{alone}",
            expected=ENOUGH,
        )
    flange = robot.pose[pairs.pose]
    if o.inverse:
        flange = se3.inverse(flange)
    inhand = o.camera == "hand"
    whole = DataSet(Configurations(views.names), (_frames(obs, inhand),)).take(pairs.view)
    rig = None if o.rig is None else open_rig(o, robot, obs, (EYE, BOARD, CAMERA))
    if rig is not None:
        whole, pairs = join_rig(rig, whole, pairs)
        further = tuple(_frames(r, inhand) for r in whole.observations[1:])
        whole = mount_rig(rig, replace(whole, observations=(whole.observations[0], *further)))
        flange = robot.pose[pairs.pose] if not o.inverse else se3.inverse(robot.pose[pairs.pose])
        said = (*said, *rig.remarks)
    _refuse_seen_once(whole)
    flipped = _flipped(whole, flange, inhand)
    if len(flipped):
        names = [whole.configurations.ids[i] for i in flipped.tolist()]
        said = (*said, *tell_flips(names, len(flange)))
        kept = np.setdiff1d(np.arange(len(flange)), flipped)
        pairs, flange, whole = (pairs.take(kept), flange[kept], whole.take(kept))
    joints = None if joints is None else joints[pairs.pose]
    where = replace(whole.configurations, joints=joints, digits=None, start=se3.to_vector(flange))
    data = replace(whole, configurations=where)
    if o.undo_half_turns:
        data, undone = _undo(Rig("robot", freedom=()) if arm is None else arm, data)
        said = (*said, *undone)
    opened = HandEyeData(
        data=data, robot=robot, pairs=pairs, flange=flange, inhand=inhand, inverse=o.inverse, source=views, arm=arm,
        unknowns=HandEyeUnknowns(), rig=rig, files=(*views.files, *robot.files, *(() if rig is None else rig.files)), remarks=said,
    )  # fmt: skip
    path = None if pairs.time is None or arm is not None else path_of(robot, o.inverse)
    return opened if path is None and not (o.free_delay or o.free_size) else _with_unknowns(o, opened, path)


def _with_unknowns(o: Any, opened: HandEyeData, path: PosePath | None) -> HandEyeData:
    """The same with poses between those of the robot's path, and with what else is looked for at its start. Raises ModelError."""
    if path is not None and opened.source.rolling:
        found, expected = "a log of poses on the way, and shutter: rolling", "images of stops, or a global shutter"
        raise ModelError(
            "images of a rolling shutter in motion are not read", key="--lens", found=found, expected=expected
        )
    where, seen = opened.target_views()
    time = opened.pairs.time
    unknowns = start_unknowns(o, path, time, seen, where)
    inside = unknowns.inside
    if inside is not None and not inside.all():
        kept, pairs = np.flatnonzero(inside), opened.pairs
        if len(kept) < FEWEST:
            raise ModelError(
                "too few views lie within the robot's path", key="--free-delay", found=str(len(kept)), expected=ENOUGH
            )
        gone = tuple(np.array(opened.views)[~inside].tolist())
        pairs = replace(pairs.take(kept), views_alone=(*pairs.views_alone, *gone))
        opened = replace(opened, data=opened.data.take(kept), flange=opened.flange[kept], pairs=pairs)
        unknowns = replace(unknowns, time=None if unknowns.time is None else unknowns.time[kept])
    return opened.restated(unknowns)


def _refuse_seen_once(data: DataSet) -> None:
    """Raises ModelError where every marker is in one view alone: each is where it looks to be, whatever the camera."""
    obs = data.observations[0]
    seen = np.zeros((len(data.configurations), max(len(obs.targets), 1)), dtype=bool)
    seen[obs.configuration, 0 if obs.target is None else obs.target] = True
    if (seen.sum(axis=0) < 2).all():
        raise ModelError(
            "no marker is seen in two views", key="view", found=f"{len(seen)} views, each with markers of its own",
            expected="the same markers in three views or more",
        )  # fmt: skip


def _flipped(data: DataSet, flange: Array, inhand: bool) -> Ints:
    """The configurations whose measured pose is the other one of a flat target; none of corners, which say it themselves."""
    obs = data.observations[0]
    if obs.kind != "pose":
        return np.zeros(0, dtype=np.int64)
    return np.unique(obs.configuration[find_flips(se3.from_vector(obs.value), flange[obs.configuration], inhand)])


def _frames(obs: Observations, inhand: bool) -> Observations:
    """The same rows seen by a camera on the flange or the base, of a target on the other."""
    camera, target = ("tool", "base") if inhand else ("base", "tool")
    names = [t.name for t in obs.targets] or [BOARD]
    if EYE in names:
        names = [f"marker_{n}" for n in names]
    targets = tuple(Frame(n, free=(True,) * 6, mount=target, expected=PLACE) for n in names)
    which = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    frame = Frame(EYE, free=(True,) * 6, mount=camera, expected=PLACE)
    return replace(obs, frame=frame, targets=targets, target=which)


def _undo(machine: Any, data: DataSet) -> tuple[DataSet, tuple[Remark, ...]]:
    """The data where views are labelled from one end of the board, and in how many they were not."""
    (obs,) = data.observations
    if obs.kind != "pixels":
        raise ModelError("measured poses have no labels", key="--undo-half-turns", expected="corners of a board")
    asked = replace(data, observations=(replace(obs, options={**obs.options, HALF_TURNS: True}),))
    if not half_turns_open(asked.observations[0]):
        raise ModelError(
            "this target does not look the same after half a turn", key="--undo-half-turns", expected="without it"
        )
    done, turned = undo_half_turns(machine, asked)
    own = replace(done.observations[0], options=obs.options)
    count = sum(int(t.sum()) for t in turned.values())
    said = Remark.of(Code.HALF_TURNS_UNDONE, count=count, total=len(data.configurations), instruments=(obs.label,))
    return replace(done, observations=(own,)), (said,)

"""Other ways to read the robot's poses: in the other direction, with another meaning of their angles, in other units, out of step, and with
one number of an orientation wrong.

    Y_i = A M_i B,    M_i = T_i for a camera beside the robot, T_i^-1 for one in the hand

Y_i is the pose of the target in the camera, T_i that of the flange as it was read. A and B have a closed form, and what most views miss
of it says whether a reading can be right. T read as T^-1 is the same as a camera on the other side: no data tell these two apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.diagnose.limits import EXPLAINED_CLEARLY, EXPLANATIONS_ALIKE
from robocal.diagnose.vision_limits import HAND_EYE_ASK
from robocal.files import orientation
from robocal.files.robot_poses import RobotPoses
from robocal.fit.starts.frames import hand_eye
from robocal.geometry import se3, so3
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.hand_eye_data import HandEyeData

__all__ = ["PoseReading", "doubt_poses", "read_otherwise"]

ROUNDS, FAR = 4, 3.0  # grid: of fits without views that are so many medians off
FEWEST = 4  # grid: views of which the middle says anything
SHIFTS = {1: "later", -1: "earlier"}
KILO = 1e3  # from m to mm
PLACE = "xyz"
DEGREES = 180 / np.pi
ORDERS = (("ZYX", True), ("XYZ", False), ("XYZ", True), ("ZYX", False), ("ZYZ", True))


@record(eq=False)
class PoseReading:
    """One reading: its name, what to say for it, and what most views miss of the target, m and rad; as it was `stated`, or another."""

    name: str
    option: str
    place: float
    turn: float
    distance: float
    stated: bool = False

    @property
    def share(self) -> float:
        """What is missed, as a share of the distance of the target."""
        return float(np.hypot(self.place / self.distance, self.turn))


def read_otherwise(opened: HandEyeData) -> tuple[PoseReading, ...]:
    """As stated, in the other direction, and the readings that leave less, the best first."""
    where, seen = opened.target_views()
    if len(where) < FEWEST:
        return ()
    out: list[PoseReading] = []
    for name, option, poses, views in _readings(opened, where, seen):
        if len(views) < FEWEST:
            continue
        machine = se3.inverse(poses) if opened.inhand else poses
        place, turn = _misfit(views, machine)
        distance = float(np.median(np.linalg.norm(views[:, :3, 3], axis=1)))
        out.append(PoseReading(name, option, place, turn, distance, stated=not out))
    stated, reverse, *rest = out
    better = sorted((r for r in rest if r.share < stated.share), key=lambda r: r.share)
    return (stated, reverse, *better)


def doubt_poses(readings: tuple[PoseReading, ...]) -> list[Remark]:
    """What explains poses that do not belong to what is seen: all readings that leave little and alike."""
    if not readings or readings[0].share < HAND_EYE_ASK:
        return []
    stated, *others = readings
    least = min(r.share for r in others)
    if least > min(stated.share / EXPLAINED_CLEARLY, HAND_EYE_ASK):
        return []
    alike = [r for r in others if r.share <= EXPLANATIONS_ALIKE * least]
    amounts = {"before": Quantity(stated.place), "before_turn": Quantity(stated.turn, "rad")}
    return [
        Remark.of(
            Code.POSES_READ_OTHERWISE,
            reading=r.name,
            option=r.option,
            **amounts,
            after=Quantity(r.place),
            after_turn=Quantity(r.turn, "rad"),
        )
        for r in alike
    ]


Row = tuple[str, str, Array, Array]


def _readings(opened: HandEyeData, where: Ints, seen: Array) -> Iterator[Row]:
    """Name, option, poses of the robot (V, 4, 4) and of the target (V, 4, 4)."""
    pose = opened.flange[where]
    yield "as stated", "", pose, seen
    camera, place = ("fixed", "beside the robot") if opened.inhand else ("hand", "in the hand")
    if opened.arm is not None:  # joint values have one direction
        yield f"of a camera {place}", f"--camera {camera}", se3.inverse(pose), seen
    else:
        symbol, option = ("T_base_flange", "without --inverse") if opened.inverse else ("T_flange_base", "--inverse")
        other = f"{option}, or --camera {camera}"
        yield f"the other direction ({symbol}, or the camera {place})", other, se3.inverse(pose), seen
        yield from _forms(opened, where, seen, other)
    for shift, word in SHIFTS.items():
        some = np.arange(max(0, -shift), len(pose) - max(0, shift))
        name, option = f"every view with the pose one {word}", "the image in a column `image` beside the poses"
        yield name, option, pose[some + shift], seen[some]


def _forms(opened: HandEyeData, where: Ints, seen: Array, other: str) -> Iterator[Row]:
    """Numbers that mean other turns, in both directions, and other lengths."""

    def in_direction(t: Array, inverse: bool) -> Array:
        return se3.inverse(t) if inverse else t

    if opened.source.target is not None:
        yield from _of_target(opened.source.target, opened, where, seen)
    raw = opened.robot.pose[opened.pairs.pose][where]
    for name, option, turn in _turns(opened.robot, opened.pairs.pose[where]):
        made = se3.compose(turn, raw[:, :3, 3])
        yield name, option, in_direction(made, opened.inverse), seen
        both = f"{name} and the other direction", f"{option}, and {other}"
        yield *both, in_direction(made, not opened.inverse), seen
    for name, option, turn in _one_number(opened.robot, opened.pairs.pose[where]):
        made, where_to = se3.compose(turn, raw[:, :3, 3]), "in the file of the poses"
        yield name, f"{option} {where_to}", in_direction(made, opened.inverse), seen
    for name, option, made in _columns(raw):
        yield name, option, in_direction(made, opened.inverse), seen
    # Of lengths that are in mm already, a thousandth is no other unit: what is 1000 times too large is the target.
    for factor, name in _units(opened.robot):
        made = np.array(raw)
        made[:, :3, 3] *= factor
        yield f"lengths of the robot's poses in {name}", f"--units {name}", in_direction(made, opened.inverse), seen
    # Poses of a target have units of their own.
    for factor, name in _units(opened.source.target) if opened.source.target is not None else ():
        near = np.array(seen)
        near[:, :3, 3] *= factor
        yield f"lengths of the target's poses in {name}", f"--target-units {name}", opened.flange[where], near


def _units(poses: RobotPoses) -> Iterator[tuple[float, str]]:
    """The unit that lengths may have been taken for another, with the factor to it."""
    if poses.length == "m":
        yield 1 / KILO, "mm"
    elif poses.length == "mm":
        yield KILO, "m"


def _columns(raw: Array) -> Iterator[tuple[str, str, Array]]:
    """Places with another sign or in another order, and turns alone in the other direction: no option says these, the file must."""
    for i, name in enumerate(PLACE):
        made = np.array(raw)
        made[:, i, 3] *= -1
        yield f"{name} with the other sign", f"change the sign of {name} in the file of the poses", made
    for i, j in ((0, 1), (1, 2), (0, 2)):
        made = np.array(raw)
        made[:, [i, j], 3] = raw[:, [j, i], 3]
        both = f"{PLACE[i]} and {PLACE[j]}"
        yield f"{both} exchanged", f"exchange {both} in the file of the poses", made
    made = np.array(raw)
    made[:, :3, :3] = np.swapaxes(raw[:, :3, :3], 1, 2)
    yield "turns in the other direction, places as they are", "invert the turns in the file of the poses", made


def _of_target(target: RobotPoses, opened: HandEyeData, where: Ints, seen: Array) -> Iterator[Row]:
    """Poses of a target in the other direction, and with the scalar of a quaternion elsewhere."""
    flange, rows = opened.flange[where], opened.pairs.view[where]
    inverse = opened.source.target_inverse
    symbol, option = (
        ("T_camera_target", "without --target-inverse") if inverse else ("T_target_camera", "--target-inverse")
    )
    yield f"poses of the target in the other direction ({symbol})", option, flange, se3.inverse(seen)
    place = (se3.inverse(target.pose) if inverse else target.pose)[rows, :3, 3]
    for name, option, turn in _one_number(target, rows):
        made, said = se3.compose(turn, place), f"{option} in the file of the target's poses"
        yield f"{name}, of the target's poses", said, flange, se3.inverse(made) if inverse else made
    if target.form.startswith("quaternion"):
        for name, option, turn in _turns(target, rows):
            made = se3.compose(turn, place)
            said = option.replace("--quaternion", "--target-quaternion")
            yield f"{name} of the target's poses", said, flange, se3.inverse(made) if inverse else made


def _one_number(poses: RobotPoses, rows: Ints) -> Iterator[tuple[str, str, Array]]:
    """Orientations of which one number has the other sign or another unit, or two are exchanged."""
    if not poses.columns:
        return
    numbers, scalar = poses.numbers[rows], {"quaternion_xyzw": 3, "quaternion_wxyz": 0}.get(poses.form)
    own = [i for i in range(numbers.shape[1]) if i != scalar]  # another sign of the scalar is the other direction
    for i in own:
        name, made = poses.columns[i], np.array(numbers)
        made[:, i] *= -1
        yield f"{name} with the other sign", f"change the sign of {name}", poses.turns(made)
        for factor, unit in ((1 / DEGREES, "deg"), (DEGREES, "rad")) if scalar is None else ():
            made = np.array(numbers)
            made[:, i] *= factor
            yield f"{name} in {unit}", f"write `{name} [{unit}]` at the head of its column", poses.turns(made)
    for i, j in combinations(own, 2):
        made = np.array(numbers)
        made[:, [i, j]] = numbers[:, [j, i]]
        both = f"{poses.columns[i]} and {poses.columns[j]}"
        yield f"{both} exchanged", f"exchange {both}", poses.turns(made)


def _turns(robot: RobotPoses, rows: Ints) -> Iterator[tuple[str, str, Array]]:
    """Other meanings of the numbers of an orientation."""
    n, form = robot.numbers[rows], robot.form
    if form.startswith("quaternion"):
        order = "wxyz" if form.endswith("xyzw") else "xyzw"
        q = n / np.maximum(np.linalg.norm(n, axis=1), 1e-12)[:, None]
        scalar = "first" if order == "wxyz" else "last"
        turn = orientation.quaternion(q[:, [1, 2, 3, 0]] if order == "wxyz" else q)
        yield f"the scalar of the quaternion {scalar}", f"--quaternion {order}", turn
    if form not in ("euler", "rotation_vector"):
        return
    for factor, unit in ((1.0, ""), (1 / DEGREES, "deg"), (DEGREES, "rad")):
        angles, words, say = n * factor, f", angles in {unit}" if unit else "", f" and --units {unit}" if unit else ""
        if unit or form != "rotation_vector":
            yield f"a rotation vector{words}", f"--maker ur{say}", so3.exp(angles)
        for order, intrinsic in ORDERS:
            letters = order if intrinsic else order.lower()
            yield (
                f"angles {letters}{words}",
                f"--euler {letters}{say}",
                orientation.euler(angles, order, intrinsic=intrinsic),
            )


def _misfit(seen: Array, machine: Array) -> tuple[float, float]:
    """What most views miss of Y = A M B, in m and rad: the medians, of a fit without views that are far off."""
    kept = np.ones(len(seen), dtype=bool)
    place, turn = np.full(len(seen), np.inf), np.full(len(seen), np.inf)
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS):
            a, b = hand_eye(seen[kept], machine[kept])
            there = a @ machine @ b
            place = np.linalg.norm(there[:, :3, 3] - seen[:, :3, 3], axis=1)
            turn = np.linalg.norm(so3.log(np.swapaxes(there[:, :3, :3], 1, 2) @ seen[:, :3, :3]), axis=1)
            good = (place <= FAR * np.median(place)) & (turn <= FAR * np.median(turn))
            if good.sum() < FEWEST or (good == kept).all():
                break
            kept = good
    return float(np.median(place)), float(np.median(turn))

"""Is this a cable robot at all? Geometry that cannot be meant is refused, geometry that is odd is remarked on."""

from __future__ import annotations

import numpy as np

from robocal.cables.geometry import CableRobot, straight
from robocal.errors import ModelError
from robocal.geometry import so3
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["FAR", "check"]

FEWEST, MOST = 3, 12
FAR = 1e9  # m; lengths of anchors and poses further away are no numbers
SAME = 1e-6  # m; anchors closer than this are one
PRINTED = 1e-6  # of a moment of inertia: a thin plate's, printed with seven digits, is still a plate's
LOST = 1e-9  # smallest singular value of L over the largest below which a direction of motion is not held


def check(robot: CableRobot) -> tuple[Remark, ...]:
    """What is odd. Raises ModelError, whose key is a field or a cable, for a number of cables outside 3 to
    12, one cable given twice, anchors that cannot hold the platform, crossed limits and impossible numbers."""
    m = len(robot.cables)
    if not FEWEST <= m <= MOST:
        raise ModelError("a cable robot of this kind", key="cables", found=m, expected=f"{FEWEST} to {MOST} cables")
    if not np.isfinite(robot.numbers).all():
        cable = robot.cables[int(np.argwhere(~np.isfinite(robot.numbers))[0, 0])]
        raise ModelError("an anchor is not a number", key=cable)
    _far(robot)
    _numbers(robot)
    doubts = _anchors(robot)
    rank = _rank(robot)
    d = len(robot.axes)
    if rank < min(m, d):
        raise ModelError(
            "these anchors cannot hold the platform, wherever it is: its cables meet in one point or line",
            key="platform_anchors",
            found=f"{rank} directions held",
            expected=f"{d} for {robot.degrees}; a platform whose orientation does not matter is {'2T' if robot.planar else '3T'}",
        )
    if m < d:
        doubts.append(Remark.of(Code.POSE_UNDETERMINED, cables=m, degrees=d))
    return tuple(doubts)


def _far(robot: CableRobot) -> None:
    """No anchor is further away than lengths are numbers."""
    for side, letter, points in (("frame", "a", robot.a), ("platform", "b", robot.b)):
        away = np.abs(points).max(axis=1)
        i = int(np.argmax(away))
        if away[i] > FAR:
            raise ModelError(
                f"a {side} anchor that far away", key=f"{robot.cables[i]}.{letter}", found=float(away[i]), expected=f"within {FAR:g} m"
            )  # fmt: skip


def _numbers(robot: CableRobot) -> None:
    """Limits, masses and what the cables are made of."""
    if robot.limits is not None:
        for cable, (low, high) in zip(robot.cables, robot.limits, strict=True):
            if high <= 0:
                raise ModelError(
                    "this cable is always slack",
                    key=f"{cable}.tension",
                    found=[float(low), float(high)],
                    expected="above 0 N",
                )
            if low < 0:
                raise ModelError(
                    "a cable cannot push", key=f"{cable}.tension", found=float(low), expected="0 N or more"
                )
            if low >= high:
                raise ModelError(
                    "the tension limits are crossed or equal",
                    key=f"{cable}.tension",
                    found=[float(low), float(high)],
                    expected="least, greatest",
                )
    for what in ("elasticity", "density", "diameter"):
        values = getattr(robot, what)
        bad = None if values is None else (values < 0) | ~np.isfinite(values)
        if bad is not None and bad.any():
            i = int(np.argmax(bad))
            word = f"a negative {what}" if values[i] < 0 else f"the {what} is no number"
            raise ModelError(word, key=f"{robot.cables[i]}.{what}", found=float(values[i]), expected="0 or more")
    if robot.pulleys is not None and (robot.pulleys.radius < 0).any():
        cable = robot.cables[int(np.argmax(robot.pulleys.radius < 0))]
        raise ModelError("a negative radius", key=f"{cable}.pulley", expected="0 or more")
    if robot.mass is not None and robot.mass <= 0:
        raise ModelError("a platform has a mass", key="mass", found=robot.mass, expected="above 0 kg")
    if robot.inertia is not None:
        _inertia(robot.inertia)


def _inertia(inertia: np.ndarray) -> None:
    moments = np.linalg.eigvalsh(inertia)
    symmetric = np.allclose(inertia, inertia.T, rtol=0, atol=1e-9 * max(np.abs(inertia).max(), 1e-300))
    if not symmetric or moments[0] < -1e-9 * moments[-1] or moments[2] > (moments[0] + moments[1]) * (1 + PRINTED):
        raise ModelError(
            "no body has this inertia",
            key="inertia",
            found=[float(f"{v:.4g}") for v in moments],
            expected="a symmetric matrix whose principal moments are positive, the greatest at most the sum of the others",
        )


def _anchors(robot: CableRobot) -> list[Remark]:
    """No cable twice; frame anchors that coincide are remarked on."""
    doubts = []
    for i, j in zip(*np.triu_indices(len(robot.cables), 1), strict=True):
        if np.linalg.norm(robot.a[i] - robot.a[j]) > SAME:
            continue
        one, other = robot.cables[i], robot.cables[j]
        if np.linalg.norm(robot.b[i] - robot.b[j]) <= SAME:
            raise ModelError(
                f"cables {one} and {other} are the same: their anchors coincide at both ends",
                key=str(other),
                found=[float(v) for v in robot.a[j]],
            )
        doubts.append(Remark.of(Code.SAME_FRAME_POINT, one=one, other=other))
    return doubts


def _rank(robot: CableRobot) -> int:
    """The number of directions that the cables hold, at the best of some poses in the middle of the frame."""
    rng = np.random.default_rng(0)
    poses = np.broadcast_to(robot.home, (8, 4, 4)).copy()
    moves = [i for i in range(3) if i in robot.axes]
    turns = [i for i in range(3) if i + 3 in robot.axes]
    extent = np.maximum(robot.a.max(axis=0) - robot.a.min(axis=0), 1e-3)
    poses[:, moves, 3] += 0.2 * extent[moves] * rng.uniform(-1, 1, (8, len(moves)))
    turn = np.zeros((8, 3))
    turn[:, turns] = rng.uniform(-0.3, 0.3, (8, len(turns)))
    poses[:, :3, :3] = so3.exp(turn)
    full, slope, _ = straight(robot, poses)
    inside = np.isnan(full).all(axis=0)
    if inside.any():
        raise ModelError(
            "this pulley is so large that the platform anchor lies in it wherever the platform is",
            key=f"{robot.cables[int(np.argmax(inside))]}.pulley",
            expected="a smaller radius, in the unit of the file",
        )
    size = max(float(np.abs(robot.b).max()), SAME)
    scaled = np.nan_to_num(slope / np.array([1, 1, 1, size, size, size]))[..., list(robot.axes)]
    values = np.linalg.svd(scaled, compute_uv=False)
    return int((values > LOST * values[:, :1]).sum(axis=1).max())

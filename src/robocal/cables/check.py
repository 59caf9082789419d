"""Is this a cable robot at all? Geometry that cannot be meant is refused, geometry that is odd is remarked on."""

from __future__ import annotations

import numpy as np

from robocal.cables.geometry import CableRobot, straight
from robocal.errors import ModelError, require
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
    expected = f"{FEWEST} to {MOST} cables"
    require(FEWEST <= m <= MOST, "a cable robot of this kind", key="cables", found=m, expected=expected)
    good = np.isfinite(robot.ends).all(axis=1)
    require(good.all(), "an anchor is not a number", key=robot.segments.names[int(np.argmin(good))])
    _far(robot)
    _numbers(robot)
    doubts = _anchors(robot)
    rank, d = _rank(robot), len(robot.axes)
    turned = f"a platform whose orientation does not matter is {'2T' if robot.planar else '3T'}"
    require(
        rank >= min(m, d), "these anchors cannot hold the platform, wherever it is: its cables meet in one point or line",
        key="platform_anchors", found=f"{rank} directions held", expected=f"{d} for {robot.degrees}; {turned}",
    )  # fmt: skip
    if m < d:
        doubts.append(Remark.of(Code.POSE_UNDETERMINED, cables=m, degrees=d))
    return tuple(doubts)


def _far(robot: CableRobot) -> None:
    """No anchor is further away than lengths are numbers."""
    for side, letter, points in (("frame", "a", robot.ends[:, :3]), ("platform", "b", robot.ends[:, 3:6])):
        away = np.abs(points).max(axis=1)
        i = int(np.argmax(away))
        key, found, expected = f"{robot.segments.names[i]}.{letter}", float(away[i]), f"within {FAR:g} m"
        require(found <= FAR, f"a {side} anchor that far away", key=key, found=found, expected=expected)


def _numbers(robot: CableRobot) -> None:
    """Limits, masses and what the cables are made of."""
    limits = () if robot.limits is None else robot.limits.tolist()
    for cable, (low, high) in zip(robot.cables, limits, strict=False):
        for holds, message, found, expected in (
            (high > 0, "this cable is always slack", [low, high], "above 0 N"),
            (low >= 0, "a cable cannot push", low, "0 N or more"),
            (low < high, "the tension limits are crossed or equal", [low, high], "least, greatest"),
        ):
            require(holds, message, key=f"{cable}.tension", found=found, expected=expected)
    for what in ("elasticity", "density", "diameter"):
        values = getattr(robot, what)
        for cable, value in zip(robot.cables, () if values is None else values.tolist(), strict=False):
            word = f"a negative {what}" if value < 0 else f"the {what} is no number"
            require(0 <= value < np.inf, word, key=f"{cable}.{what}", found=value, expected="0 or more")
    for cable, gain in zip(robot.cables, robot.gain.tolist(), strict=True):
        require(0 < gain < np.inf, "a gain is above 0", key=f"{cable}.gain", found=gain, expected="a number near 1")
    for cable, growth in zip(robot.cables, robot.build_up.tolist(), strict=True):
        expected = "a small number, as 0.02 per m"
        require(
            abs(growth) < np.inf,
            "a build-up that is no number",
            key=f"{cable}.build_up",
            found=growth,
            expected=expected,
        )
    for cable, radius in zip(robot.segments.names, () if robot.wheels is None else robot.wheels.radius, strict=False):
        require(radius >= 0, "a negative radius", key=f"{cable}.pulley", expected="0 or more")
    massive = robot.mass is None or robot.mass > 0
    require(massive, "a platform has a mass", key="mass", found=robot.mass, expected="above 0 kg")
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
    doubts: list[Remark] = []
    if not robot.segments.is_plain:
        return doubts  # cables along one segment are told apart by how often they run along it
    for i, j in zip(*np.triu_indices(len(robot.cables), 1), strict=True):
        if np.linalg.norm(robot.a[i] - robot.a[j]) > SAME:
            continue
        one, other = robot.cables[i], robot.cables[j]
        same = f"cables {one} and {other} are the same: their anchors coincide at both ends"
        require(np.linalg.norm(robot.b[i] - robot.b[j]) > SAME, same, key=other, found=robot.a[j].tolist())
        doubts.append(Remark.of(Code.SAME_FRAME_POINT, one=one, other=other))
    return doubts


def _rank(robot: CableRobot) -> int:
    """The number of directions that the cables hold, at the best of some poses in the middle of the frame."""
    rng = np.random.default_rng(0)
    poses = np.broadcast_to(robot.home, (8, 4, 4)).copy()
    moves = [i for i in range(3) if i in robot.axes]
    turns = [i for i in range(3) if i + 3 in robot.axes]
    extent = np.maximum(np.ptp(robot.frame_points, axis=0), 1e-3)
    poses[:, moves, 3] += 0.2 * extent[moves] * rng.uniform(-1, 1, (8, len(moves)))
    turn = np.zeros((8, 3))
    turn[:, turns] = rng.uniform(-0.3, 0.3, (8, len(turns)))
    poses[:, :3, :3] = so3.exp(turn)
    full, slope, _ = straight(robot, poses)
    inside = np.isnan(full).all(axis=0)
    require(
        not inside.any(), "this pulley is so large that the platform anchor lies in it wherever the platform is",
        key=f"{robot.cables[int(np.argmax(inside))]}.pulley", expected="a smaller radius, in the unit of the file",
    )  # fmt: skip
    size = max(float(np.abs(robot.platform_points).max(initial=0.0)), SAME)
    scaled = np.nan_to_num(slope / np.array([1, 1, 1, size, size, size]))[..., list(robot.axes)]
    values = np.linalg.svd(scaled, compute_uv=False)
    return int((values > LOST * values[:, :1]).sum(axis=1).max())

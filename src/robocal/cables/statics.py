"""Statics of a platform on taut cables, straight or over pulleys: structure matrix, gravity, stiffness.

    W t + w = 0

t (m,) are the tensions, w (6,) the external wrench (force, moment) in base axes about the platform's origin, and column
i of W is what one newton in cable i does to the platform: (u_i, R b_i x u_i), u_i from the platform anchor to the frame
anchor. W = -L^T, L being the gradient of the cable lengths with respect to the platform's (v, w).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array
from robocal._types import Array
from robocal.cables.balance._kernels import structure_kernel
from robocal.cables.geometry import CableRobot, straight
from robocal.cables.pulley import curvature
from robocal.errors import ModelError, require
from robocal.geometry import so3
from robocal.geometry.gravity import GRAVITY

__all__ = ["gravity_wrench", "row_weights", "stiffness", "structure", "structure_of", "structures"]


def structure(pose: ArrayLike, a: ArrayLike, b: ArrayLike, strict: bool = True) -> Array:
    """Structure matrices W (k, 6, m) of poses (k, 4, 4): columns (u_i, R b_i x u_i); forces [1], moments [m].

    a (m, 3) frame anchors in base coordinates, b (m, 3) platform anchors in platform coordinates, m. Raises ModelError
    for anchors that do not pair up and, if `strict`, for a cable without length; its column is NaN otherwise. (3.34) of
    the seed with the sign put right.
    """
    poses, frame, platform = as_kernel_array(pose, a, b)
    require(poses.ndim == 3 and poses.shape[1:] == (4, 4), "poses are an array (k, 4, 4)", found=poses.shape)
    shapes = frame.shape, platform.shape
    if frame.ndim != 2 or frame.shape[1:] != (3,) or frame.shape != platform.shape:
        raise ModelError("frame and platform anchors are two arrays (m, 3) of one length", found=shapes)
    out = np.empty((len(poses), 6, len(frame)))
    structure_kernel(poses, frame, platform, out)
    if strict:
        _whole(out, [f"c{i + 1}" for i in range(len(frame))])
    return out


def structure_of(robot: CableRobot, pose: ArrayLike, strict: bool = True) -> Array:
    """Structure matrices W (k, d, m) of a robot at poses (k, 4, 4): the rows of the d components of the twist that it has.

    Over pulleys the cables pull where they arrive at the platform. Raises ModelError and sets NaN as `structure` does.
    """
    rows = list(robot.axes)
    if robot.wheels is None and robot.segments.is_plain:
        out = structure(pose, robot.a, robot.b, strict=False)
    else:
        length, gradient, _ = straight(robot, pose)
        gradient[~(length > 0.0)] = np.nan
        out = -gradient.swapaxes(1, 2)
    if len(rows) < 6:
        out = np.ascontiguousarray(out[:, rows])
    if strict:
        _whole(out, robot.cables)
    return out


def structures(structure: ArrayLike) -> Array:
    """Structure matrices (k, d, m) as kernels read them. Raises ModelError for another shape and numbers that are none."""
    w = as_kernel_array(structure)
    if w.ndim != 3 or not np.isfinite(w).all():
        raise ModelError("structure matrices are an array (k, d, m) of finite numbers", found=w.shape)
    return w


def _whole(found: Array, cables: Sequence[str]) -> None:
    """Raises ModelError naming the first cable without direction."""
    if not np.isfinite(found).all():
        row, _, cable = np.argwhere(~np.isfinite(found))[0]
        why = "the cable has no length: its frame anchor and its platform anchor coincide, or the pose is not finite"
        raise ModelError(why, row=int(row), key=cables[cable])


def row_weights(d: int, length: ArrayLike = 1.0) -> Array:
    """What makes rows of W comparable, (d,): 1 for forces, 1 / length for moments, in m.

    length: one number, where d says which rows are moments (x and y; x, y and a turn; all six), or of every row (d,), 1 for forces
    (`CableRobot.lengths_of_rows`). Raises ModelError for one that is not positive.
    """
    long = np.asarray(length, dtype=float)
    if long.shape not in ((), (d,)) or not ((long > 0.0) & (long < np.inf)).all():
        raise ModelError("a length that compares moments with forces is positive", key="length", found=length)
    if long.ndim:
        return 1.0 / long
    forces = {2: 2, 3: 2, 6: 3}.get(d, d)
    return np.array([1.0] * forces + [1.0 / float(long)] * (d - forces))


def gravity_wrench(pose: ArrayLike, mass: float, com: ArrayLike, gravity: ArrayLike = GRAVITY) -> Array:
    """Wrench (k, 6) of the weight: (m g, R c x m g) [N, N m], c (3,) the centre of mass in platform coordinates, m.

    Raises ModelError for a mass that is negative or no number.
    """
    poses, c = np.asarray(pose, dtype=float), np.asarray(com, dtype=float)
    sound = 0.0 <= mass < np.inf and c.shape == (3,) and np.isfinite(c).all()
    require(sound, "a platform needs a mass >= 0 kg and a centre of mass (3,)", found=(mass, c.tolist()))
    force = np.broadcast_to(mass * np.asarray(gravity, dtype=float), (len(poses), 3))
    return np.concatenate([force, np.cross(poses[:, :3, :3] @ c, force)], axis=1)


def stiffness(robot: CableRobot, pose: ArrayLike, tension: ArrayLike, force: ArrayLike = (0, 0, 0)) -> Array:
    """Stiffness K (k, d, d) = -d(wrench on the platform)/d(v, w) at locked winches [N/m, N, N m], rows and columns those
    of the twist that the robot has.

    K = sum_i [A, -A S; S A, -S A S - [f]x S], A = k u u^T + t C, S = [R b]x, f = t u: the cables' own stiffness
    k = (1 + e t) / (e l), e the elasticity and l the length from the frame anchor, over the pulley where there is one,
    and that of their tension t by the curvature C of the length (I - u u^T over l where it is straight).
    pose (k, 4, 4), tension (k, m) or (m,) N; `force` (3,) N, constant in base axes, acts at the centre of mass. K is
    symmetric in equilibrium only. Neglected are sag, the cable behind the frame anchor, and friction in the pulleys.
    Raises ModelError for unknown elasticity. After Behzadipour and Khajepour (2006), who have straight cables.
    """
    t = np.asarray(pose, dtype=float).reshape(-1, 4, 4)
    robot.need_straight()
    e, rows = robot.need("elasticity"), list(robot.axes)
    pull = np.broadcast_to(np.asarray(tension, dtype=float), (len(t), len(robot.cables)))
    full, gradient, lever = straight(robot, t)
    u = -gradient[..., :3]
    curved = curvature(t[:, None, :3, 3] + lever - robot.a, robot.pulleys)
    along = (1.0 + e * pull) / (e * full)
    cable = along[..., None, None] * u[..., :, None] * u[..., None, :] + pull[..., None, None] * curved
    s = so3.skew(lever)
    k = np.empty((len(t), 6, 6))
    k[:, :3, :3] = cable.sum(axis=1)
    k[:, :3, 3:] = -(cable @ s).sum(axis=1)
    k[:, 3:, :3] = (s @ cable).sum(axis=1)
    k[:, 3:, 3:] = -(s @ cable @ s + so3.skew(pull[..., None] * u) @ s).sum(axis=1)
    k[:, 3:, 3:] -= so3.skew(np.asarray(force, dtype=float)) @ so3.skew(t[:, :3, :3] @ robot.com)
    return k[:, rows][:, :, rows]

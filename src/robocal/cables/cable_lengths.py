"""Inverse kinematics: the lengths that the sensors show at given poses, and their gradient L.

    straight, or over pulleys    l_i = full_i - l0_i
    with stretch                 l_i = full_i / (1 + e_i t_i) - l0_i
    with sag                     l_i = the unstretched length of the elastic catenary that pulls with t_i, - l0_i
    what the sensor shows        l_i / g_i

The tension of a cable is that at the platform. The gradient is taken at constant tension; only that of the straight
(or pulley) lengths gives the structure matrix, W = -L^T.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.cables.elastic import stretch
from robocal.cables.geometry import CableRobot, straight
from robocal.cables.hanging import hang
from robocal.errors import ModelError, require

__all__ = ["inverse", "model_of", "pulls"]

Lengths = Callable[[Array, Array | None], tuple[Array, Array]]
TOUCHING = 1e-9  # m; a cable shorter than this has no direction


def inverse(
    robot: CableRobot, pose: ArrayLike, tension: ArrayLike | None = None, *, sag: bool = False
) -> tuple[Array, Array]:
    """What the sensors show (k, m), and the gradient L (k, m, 6) of the lengths with respect to the platform's twist (v, w) in base
    axes about its origin.

    pose (k, 4, 4); tension (k, m) or (m,) in N: cables stretch by the robot's elasticity, and with `sag` hang by their
    weight. Raises ModelError for a cable without length, for one whose anchor lies inside its pulley, for unknown
    elasticity or density, and for a cable whose tension does not carry its weight.
    """
    t = np.asarray(pose, float).reshape(-1, 4, 4)
    shape = (len(t), len(robot.cables))
    pull = None if tension is None else pulls(robot, tension, shape)
    full, _, _ = straight(robot, t)
    length, slope = model_of(robot, sag=sag, tense=pull is not None)(t, pull)
    shown = robot.readings(length)
    for bad, why in (
        (full < TOUCHING, "has no length: its two anchors are at one place"),
        (np.isnan(full), "ends inside its own pulley"),
        (np.isnan(length), "cannot hang so: its tension does not carry its weight"),
        (robot.unwinds(shown), "is longer than all that its drum holds with this build-up"),
    ):
        if bad.any():
            at, cable = (int(v) for v in np.argwhere(bad)[0])
            raise ModelError(f"cable {robot.cables[cable]} {why} (pose {at})", row=at, key=robot.cables[cable])
    return shown, slope


def pulls(robot: CableRobot, tension: ArrayLike, shape: tuple[int, int]) -> Array:
    """Tensions (k, m) in N from (k, m), (m,) or one for all. Raises ModelError for one that is no number or pushes."""
    pull = np.broadcast_to(np.asarray(tension, float), shape)
    bad = ~((pull >= 0) & (pull < np.inf))
    if bad.any():
        at, cable = (int(v) for v in np.argwhere(bad)[0])
        key, found = robot.cables[cable], f"{pull[at, cable]:.4g} N"
        raise ModelError(f"a cable cannot push (pose {at})", row=at, key=key, found=found, expected="0 N or more")
    return pull


def model_of(robot: CableRobot, *, sag: bool, tense: bool) -> Lengths:
    """The length model that fits what is known: a function of poses (k, 4, 4) and tensions (k, m) to lengths less their zeros, and L.

    It never raises: where there is no such cable the lengths are not numbers, so that a search can step back.
    """
    require(tense or not sag, "a sagging cable needs its tension", key="tension")
    if sag:
        density = robot.need("density")
        return lambda pose, pull: _sagging(robot, density, pose, pull)
    elasticity = robot.need("elasticity") if tense else np.zeros(len(robot.cables))
    return lambda pose, pull: _taut(robot, elasticity, pose, pull)


def _taut(robot: CableRobot, elasticity: Array, pose: Array, pull: Array | None) -> tuple[Array, Array]:
    full, slope, _ = straight(robot, pose)
    length, by_full, _ = stretch(full, 0.0 if pull is None else pull, elasticity)
    return length - robot.zeros, slope * by_full[..., None]


def _sagging(robot: CableRobot, density: Array, pose: Array, pull: Array | None) -> tuple[Array, Array]:
    lever = robot.b @ pose[:, :3, :3].swapaxes(-1, -2)
    d = pose[:, None, :3, 3] + lever - robot.a
    elasticity = np.zeros(len(robot.cables)) if robot.elasticity is None else robot.elasticity
    hung = hang(d, np.asarray(pull), density, elasticity, robot.pulleys)
    return hung.length - robot.zeros, np.concatenate([hung.gradient, np.cross(lever, hung.gradient)], axis=-1)

"""A cable robot: a platform hung from frame anchors, and the lengths of its straight cables.

    l_i = |a_i - (p + R b_i)| - l0_i

Cable i runs from frame anchor a_i (base coordinates) to platform anchor b_i (platform coordinates); l0_i is the zero
of its length sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robocal.parameters import Parameter, Table

__all__ = ["SYMBOLS", "CableRobot", "cable_robot", "lengths"]

Array = NDArray[np.float64]
SYMBOLS = ("ax", "ay", "az", "bx", "by", "bz", "l0")


@dataclass(frozen=True)
class CableRobot:
    """Anchors and sensor zeros of m cables, as a parameter table: `c1.ax` ... `c1.bz`, `c1.l0` in m."""

    name: str
    cables: tuple[str, ...]
    table: Table


def cable_robot(
    name: str, frame_anchors: Array, platform_anchors: Array, zeros: Array | None = None, free: Sequence[str] = ()
) -> CableRobot:
    """A robot from anchors (m, 3) and (m, 3); `free` lists the symbols that are to be identified."""
    l0 = np.zeros(len(frame_anchors)) if zeros is None else zeros
    rows, cables = [], []
    for i, numbers in enumerate(np.column_stack([frame_anchors, platform_anchors, l0]), start=1):
        cables.append(f"c{i}")
        rows += [
            Parameter(f"c{i}.{s}", float(v), "m", s in free, expected=0.01)
            for s, v in zip(SYMBOLS, numbers, strict=True)
        ]
    return CableRobot(name, tuple(cables), Table(tuple(rows)))


def lengths(pose: Array, cable: Array) -> tuple[Array, Array, Array]:
    """Length (B, m), its gradient with respect to the platform's (v, w), (B, m, 6), and to the cable's seven numbers,
    (B, m, 7).

    pose (B, m, 4, 4), cable (B, 7) in the order of SYMBOLS.
    """
    a, b, l0 = cable[:, None, :3], cable[:, None, 3:6], cable[:, None, 6]
    r = pose[..., :3, :3]
    lever = np.einsum("bmij,bmj->bmi", r, np.broadcast_to(b, (*pose.shape[:2], 3)))
    c = pose[..., :3, 3] + lever - a
    full = np.linalg.norm(c, axis=-1)
    u = c / full[..., None]
    by_pose = np.concatenate([u, np.cross(lever, u)], axis=-1)
    by_cable = np.concatenate([-u, np.einsum("bmij,bmi->bmj", r, u), -np.ones((*full.shape, 1))], axis=-1)
    return full - l0, by_pose, by_cable

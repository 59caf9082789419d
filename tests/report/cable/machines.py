"""Robots and surfaces to be drawn."""

from __future__ import annotations

import numpy as np

from robocal.cables.boundary import Surface, directions, triangulate_directions
from robocal.cables.geometry import CableRobot, cable_robot

LIMITS = (20.0, 125.0)


def robot_of(
    m: int, degrees: str = "3R3T", plane: str = "xz", names: list[str] | None = None, size: float = 1.0
) -> CableRobot:
    """A robot with m cables around a platform of half a metre, or of `size` times that."""
    turn = 2 * np.pi * np.arange(m) / m + 0.3
    ring = np.stack([2 * np.cos(turn), 1.5 * np.sin(turn), 1.5 + np.where(np.arange(m) % 2, 1.4, -1.2)], axis=1)
    small = np.stack([0.2 * np.cos(turn + 0.4), 0.2 * np.sin(turn + 0.4), 0.1 * np.cos(2.1 * turn)], axis=1)
    if degrees != "3R3T":
        across = next(k for k in range(3) if "xyz"[k] not in plane)
        ring[:, across] = small[:, across] = 0.0
        small = small * 0 if degrees == "2T" else small
    return cable_robot(
        "rig", size * ring, size * small, names=names, limits=np.tile(LIMITS, (m, 1)), degrees=degrees, plane=plane
    )  # fmt: skip


def ball(count: int, radius: float = 0.8) -> Surface:
    """A sphere as `boundary.surface` would give it, with a flat top."""
    start, way = np.array([0.0, 0.0, 1.5]), directions(count)
    return Surface(start, start + radius * way, triangulate_directions(way))

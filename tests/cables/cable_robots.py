"""Published robots for tests: read from ../shared/data/cable-robots where it is present."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from robocal.cables.geometry import CableRobot, cable_robot
from robocal.geometry import se3, so3

PUBLISHED = ("ipanema_1", "ipanema_2", "ipanema_3", "cogiro", "laval")
FOLDER = Path(__file__).parents[2].parent / "shared" / "data" / "cable-robots"


def published(name: str) -> CableRobot:
    """Read without the project's importer, so that the two can be compared."""
    place = FOLDER / f"{name}.yaml"
    if not place.is_file():
        pytest.skip(f"{place} is not here")
    data = YAML(typ="safe").load(place.read_text(encoding="utf-8"))
    a, b, zeros = data["frame_anchors"], data["platform_anchors"], data.get("initial_lengths_m")
    limits, com = (
        np.tile(np.array(data["tension_limits_N"], float), (len(a), 1)),
        np.array(data["centre_of_mass_m"], float),
    )
    return cable_robot(name, a, b, zeros, limits=limits, com=com, mass=float(data["mass_kg"]))


def box() -> CableRobot:
    """Eight cables, crossed, in a frame of 5 x 4 x 3 m: no data needed."""
    x, y, z = 2.5, 2.0, 3.0
    corners = [[sx * x, sy * y, h] for h in (0.1, z) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    attach = [[sx * 0.1, sy * 0.12, -h * 0.3] for h in (-1, 1) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    attach[3][0] += 0.02
    return cable_robot("box", corners, attach, np.linspace(0, 0.7, 8))


def directions(rng: np.random.Generator, n: int, size: object) -> np.ndarray:
    """Vectors (n, 3) of given lengths in random directions."""
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True) * np.reshape(np.asarray(size, float), (-1, 1))


def poses(robot: CableRobot, rng: np.random.Generator, n: int, tilt: float = np.radians(15)) -> np.ndarray:
    """Poses in the middle of the frame; below the anchors of a suspended robot."""
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    if high[2] - low[2] < 1:
        low = np.array([*low[:2], low[2] - 5.5])
        high = np.array([*high[:2], high[2] - 1.5])
    at = (low + high) / 2 + 0.3 * (high - low) * rng.uniform(-1, 1, (n, 3))
    return se3.compose(so3.exp(directions(rng, n, rng.uniform(0, tilt, n))), at)


def moved(pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """p + v, exp(w) R."""
    out = pose.copy()
    out[..., :3, 3] += twist[:3]
    out[..., :3, :3] = so3.exp(twist[3:]) @ pose[..., :3, :3]
    return out

"""What only cable robots have of a drift: lines of sight, a frame that grows, and how two or more calibrations scatter."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.geometry import fits

__all__ = ["Scattered", "calibration_scatter", "growth", "sights"]

XYZ = "xyz"


def sights(robot: CableRobot) -> Array:
    """Unit vectors (m, 3) from the frame anchors to those of the platform at home: along them anchor and zero look alike."""
    towards = robot.home[:3, 3] + robot.b - robot.a
    return np.asarray(towards / np.linalg.norm(towards, axis=1, keepdims=True))


def growth(robot: CableRobot) -> dict[str, float]:
    """The rates of frame anchors, m, where the frame grows about its middle."""
    away = robot.a - robot.a.mean(axis=0)
    names = (robot.row(f"{c}.a{s}") for c in robot.cables for s in XYZ)
    return dict(zip(names, away.ravel().tolist(), strict=True))


@record(eq=False)
class Scattered:
    """How calibrations scatter about their mean, m: root mean square of a component (3.39a) and of a point, of a zero; and of what is
    left of a component once every frame is brought onto the mean by a motion, and by a motion and a size. `along` and `across` are
    what is left by then along the lines of sight and, of one component, across them; `size` (k,) is that of each frame beside the
    mean, less 1."""

    component: float
    point: float
    zero: float
    moved: float
    scaled: float
    along: float
    across: float
    size: Array


def calibration_scatter(robot: CableRobot, anchors: Array, zeros: Array) -> Scattered:
    """The scatter of k calibrations, anchors (k, m, 3) and zeros (k, m)."""
    mean = anchors.mean(axis=0)
    off = anchors - mean
    rigid, size, left = [], [], []
    for each in anchors:
        t = fits.rigid(each, mean)
        there = each @ t[:3, :3].T + t[:3, 3]
        a, b = there - there.mean(axis=0), mean - mean.mean(axis=0)
        s = float((a * b).sum() / (a * a).sum())
        rigid.append(there - mean)
        size.append(1 / s - 1)
        left.append(s * a - b)
    towards = mean.mean(axis=0) + robot.b - mean
    sight = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    rest = np.array(left)
    along = np.einsum("kmi,mi->km", rest, sight)
    across = rest - along[..., None] * sight
    rms = [float(np.sqrt(np.mean(np.square(v)))) for v in (off, zeros - zeros.mean(axis=0), rigid, rest, along)]
    return Scattered(
        rms[0], float(np.sqrt(3.0)) * rms[0], rms[1], rms[2], rms[3], rms[4],
        float(np.sqrt(np.square(across).sum() / (2 * across.shape[0] * across.shape[1]))), np.array(size),
    )  # fmt: skip

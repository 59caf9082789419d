"""Pixels: r = project(T_camera_target X) - uv, for points X known in the target's frame.

value (k, 2) in pixels, sigma (k, 2); extra["point"] (k, 3) in m; options["camera"] names the camera whose nine
intrinsics are parameters, options["intrinsics"] their values and options["free"] the symbols to identify. The frame
is the camera's: mounted on "tool" it is a camera in hand, mounted on "base" a fixed one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Rows, register
from robocal.parameters import Parameter
from robocal.vision.camera import SYMBOLS, project

__all__ = ["PIXELS", "rays"]

Array = NDArray[np.float64]
UNSTATED = (0.1, 0.1)
UNDISTORT = 8  # steps; each gains a factor of the distortion
EXPECTED = (10.0, 10.0, 10.0, 10.0, 0.1, 0.1, 0.01, 0.01, 0.1)


class PixelRows(Rows):
    """Reprojection error; columns are the carrier's, then the free intrinsics."""

    def __init__(self, builder: Builder, obs: Observations, target: int, index: NDArray[np.int64]) -> None:
        intrinsics = builder.rows(p.name for p in parameters(obs))
        super().__init__(builder.view(obs, target, index), obs, index, UNSTATED, intrinsics)
        self.point = np.ascontiguousarray(obs.extra["point"][index])

    def evaluate(self, x: Array, which: NDArray[np.int64], first: int, rows: int) -> tuple[Array, Array, Array]:
        t, j, jl = self.carrier.pose(x, first, rows)
        lever = np.einsum("bmij,mj->bmi", t[:, :, :3, :3], self.point[first : first + rows])
        uv, jp, ji = project(lever + t[:, :, :3, 3], x[:, None, self.numbers])
        # d point = v + w x lever, so d uv = jp v + (lever x jp) w row by row.
        both = np.concatenate([jp, np.cross(lever[:, :, None, :], jp)], axis=-1)
        jac = np.concatenate([both @ j, ji[..., self.own]], axis=-1)
        return uv - self.measured(which, first, rows), jac, both @ jl


def rays(obs: Observations, uv: Array) -> Array:
    """Unit directions (k, 3) in the camera that the stated intrinsics project to pixels uv (k, 2), by fixed-point
    iteration."""
    intrinsics = np.array([p.value for p in parameters(obs)])
    p = np.concatenate([(uv - intrinsics[2:4]) / intrinsics[:2], np.ones((len(uv), 1))], axis=1)
    for _ in range(UNDISTORT):
        p[:, :2] -= (project(p, intrinsics)[0] - uv) / intrinsics[:2]
    return np.asarray(p / np.linalg.norm(p, axis=1, keepdims=True))


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target."""
    return [PixelRows(builder, obs, t, index) for t, index in builder.split(obs)]


def parameters(obs: Observations) -> Sequence[Parameter]:
    """The camera's nine intrinsics."""
    camera, values, free = obs.options["camera"], obs.options["intrinsics"], obs.options.get("free", ())
    assert isinstance(values, tuple) and isinstance(free, tuple)
    units = ("px",) * 4 + ("1",) * 5
    return [
        Parameter(f"{camera}.{s}", float(v), u, s in free, expected=e)
        for s, v, u, e in zip(SYMBOLS, values, units, EXPECTED, strict=True)
    ]


PIXELS = register(Kind("pixels", 2, terms, parameters, ((0, 2, "px"),), owner="camera"))

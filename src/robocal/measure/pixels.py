"""Pixels: r = project(T_camera_target X) - uv, for points X known in the target's frame.

value (k, 2) in pixels, sigma (k, 2); extra["point"] (k, 3) in m; options["camera"] names the camera whose nine
intrinsics are parameters, options["intrinsics"] their values and options["free"] the symbols to identify. The frame
is the camera's: mounted on "tool" it is a camera in hand, mounted on "base" a fixed one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.losses import Loss
from robocal.estimate.terms import Normal
from robocal.measure.builder import Builder
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Rows, SightRows, register
from robocal.parameters import Parameter
from robocal.vision.camera import SYMBOLS, image_of, project

__all__ = ["PIXELS", "rays"]

CHUNK = 1 << 17  # numbers of the carrier's Jacobian at once
UNDISTORT = 8  # steps; each gains a factor of the distortion
SCALE = 5e-3  # of a printed marker or board: a printer scales, paper and glue swell
EXPECTED = (10.0, 10.0, 10.0, 10.0, 0.1, 0.1, 0.01, 0.01, 0.1)


class PixelRows(SightRows):
    """Reprojection error; columns are the carrier's, then the free intrinsics. All points that one configuration sees of one
    target are a sight: they move together, so the carrier is asked once for all of them."""

    def __init__(self, builder: Builder, obs: Observations, target: int, index: Ints) -> None:
        seen = np.zeros(len(index), dtype=np.int64) if obs.target is None else obs.target[index]
        order = np.lexsort((seen, obs.configuration[index]))
        index, seen = index[order], seen[order]
        where = obs.configuration[index]
        new = np.ones(len(index), dtype=bool)
        new[1:] = (where[1:] != where[:-1]) | (seen[1:] != seen[:-1])
        first = np.flatnonzero(new)
        intrinsics = builder.rows(p.name for p in parameters(obs))
        sight = np.cumsum(new) - 1
        super().__init__(builder.view(obs, target, index[first]), obs, index, intrinsics, sight)
        self.edges = np.append(first, len(index))
        self.point = np.ascontiguousarray(obs.extra["point"][index])

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        seen, sight, _ = self.look(x, first, rows)
        t, j, jl = (a[:, sight] for a in seen)
        lever = np.einsum("bmij,mj->bmi", t[:, :, :3, :3], self.point[first : first + rows])
        if not len(self.columns) and not jl.shape[-1]:
            uv = image_of(lever + t[:, :, :3, 3], x[:, None, self.numbers])
            nothing = np.empty((*uv.shape, 0))
            return uv - self.values_at(which, first, rows), nothing, nothing
        uv, jp, ji = project(lever + t[:, :, :3, 3], x[:, None, self.numbers])
        # d point = v + w x lever, so d uv = jp v + (lever x jp) w row by row.
        both = np.concatenate([jp, np.cross(lever[:, :, None, :], jp)], axis=-1)
        jac = np.concatenate([both @ j, ji[..., self.own]], axis=-1)
        return uv - self.values_at(which, first, rows), jac, both @ jl

    def stretch(self, x: Array, r: Array, first: int, rows: int) -> Array:
        """Of points that are stated 1 + s too far from the origin of their target."""
        (t, _, _), sight, _ = self.look(x, first, rows)
        t = t[:, sight]
        lever = np.einsum("bmij,mj->bmi", t[:, :, :3, :3], self.point[first : first + rows])
        jp = project(lever + t[:, :, :3, 3], x[:, None, self.numbers])[1]
        return np.asarray(-np.einsum("bmij,bmj->bmi", jp, lever))

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        from robocal.measure._kernels import accumulate_sights

        value = self.value if len(self.value) == 1 else self.value[which]
        one, two, own = (np.ascontiguousarray(of[self.edges[:-1]]) for of in (*self.local, self.pair))
        cut = out.gl.shape[2] if self.touches[0] else 0
        for part, lo, hi in self._spans(weight):
            some = slice(part, part + 1) if part >= 0 else slice(None)
            mine, here = out.take(some), x[some]
            sights = max(1, CHUNK // (len(here) * 6 * max(1, len(self.columns) + 12)))
            for first in range(lo, hi, sights):
                t, j, jl = self.carrier.pose(here, first, min(sights, hi - first))
                accumulate_sights(
                    t, j, jl, first, cut, np.ascontiguousarray(here[:, self.numbers]), self.own, self.edges, self.point,
                    value[some] if len(value) > 1 else value, self.scale, weight[some] if len(weight) > 1 else weight, self.configuration,
                    self.columns, one, two, own + pair, loss.kind, loss.tuning, loss.curved[some], mine.cost, mine.g, mine.a, mine.gl,
                    mine.al, mine.asl, mine.gm, mine.am, mine.asm, mine.cross,
                )  # fmt: skip
        return True

    def _spans(self, weight: Array) -> list[tuple[int, int, int]]:
        """Which sights have a weight, first and behind the last: of all problems together (-1), or of each where they differ."""
        active = weight[:, self.configuration[self.edges[:-1]]] > 0
        ends = [(int(some[0]), int(some[-1]) + 1) if len(some) else (0, 0) for some in map(np.flatnonzero, active)]
        if all(end == ends[0] for end in ends):
            return [(-1, *ends[0])]
        return [(b, *end) for b, end in enumerate(ends)]


def rays(obs: Observations, uv: Array) -> Array:
    """Unit directions (k, 3) in the camera that the stated intrinsics project to pixels uv (k, 2), by fixed-point
    iteration."""
    intrinsics = np.array([p.value for p in parameters(obs)])
    p = np.concatenate([(uv - intrinsics[2:4]) / intrinsics[:2], np.ones((len(uv), 1))], axis=1)
    for _ in range(UNDISTORT):
        p[:, :2] -= (image_of(p, intrinsics) - uv) / intrinsics[:2]
    return np.asarray(p / np.linalg.norm(p, axis=1, keepdims=True))


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target, and one for all that are local blocks."""
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


PIXELS = register(Kind("pixels", 2, terms, parameters, ((0, 2, "px"),), owner="camera", unstated=0.1, scale=SCALE))

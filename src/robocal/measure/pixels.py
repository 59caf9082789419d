"""Pixels: r = project(T_camera_target X) - uv, for points X known in the target's frame.

value (k, 2) in pixels, sigma (k, 2); extra["point"] (k, 3) in m; of corners of squares whose errors are correlated
extra["covariances"] (k, 2, 8) and extra["square and corner"] (k, 2), as in `sights.correlations`. options["camera"] names the
camera whose intrinsics are parameters, options["intrinsics"] their values, of any model of `vision.camera`, and options["free"] the
symbols to identify. options["known"] are symbols with a prior that they share, of covariance options["covariance"];
options["together"] are priors that targets share, as the markers of a map. Where extra["growth"] (k, 3) is given, the points of each
target are at X + e growth: e, the parameter `target.edge`, is by how much its printed squares are larger than stated. options["print"]
names what was printed all together, whose size is a parameter: points are at `print.size` X, within options["print sigma"]. The frame is
the camera's: mounted on "tool" it is a camera in hand, mounted on "base" a fixed one. options["offset"] is a frame T_frame_camera of a
camera that is bolted to the one whose frame it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.estimate.losses import Loss
from robocal.estimate.terms import Normal
from robocal.measure.builder import Builder, offsets_of
from robocal.measure.data import Observations
from robocal.measure.rows import NONE, Kind, Rows, SightRows, register
from robocal.measure.sights.correlations import (
    COVARIANCES,
    SQUARE_CORNER,
    Decorrelation,
    RowCorrelations,
    block_of_rows,
)
from robocal.measure.sights.views import SharedView, sights_of, views_of
from robocal.parameters import FRAME_SYMBOLS, Parameter, Together
from robocal.vision.camera import image_radius, model_of, project, unproject

__all__ = ["EDGE", "GROWTH", "HALF_TURNS", "LENS_FILE", "PIXELS", "PixelRows", "fold_of_lens", "rays"]

HALF_TURNS = "half_turns"  # the option of observations in which half turns of the target are to be undone
LENS_FILE = "lens file"  # the option that has the file of the lens, where it is of one
GROWTH, EDGE = "growth", "edge"  # of points, and the symbol of what multiplies it

CHUNK = 1 << 17  # numbers of the carrier's Jacobian at once
FEW = 4  # problems that lack less than one in so many of what any of them has are told by what they lack
SCALE = 5e-3  # of a printed marker or board: a printer scales, paper and glue swell
NEAR_RIM = 0.9  # of the farthest that a lens images: pixels beyond are looked at one by one
NO_MIXING = np.empty((0, 8, 8))
HELD = np.full((1, 6), -1, dtype=np.int64)


class PixelRows(SightRows):
    """Reprojection error; columns are the carrier's, then the free intrinsics. All points that one configuration sees of one
    target are a sight: they move together, so the carrier is asked once for all of them."""

    view: SharedView | None

    def __init__(self, builder: Builder, obs: Observations, target: int, index: Ints, view: SharedView | None) -> None:
        seen = np.zeros(len(index), dtype=np.int64) if obs.target is None else obs.target[index]
        square = None if obs.sigma is None else obs.extra.get(SQUARE_CORNER)
        block = np.zeros_like(seen) if square is None else block_of_rows(square[index], obs.configuration[index], seen)
        order = np.lexsort((block, seen, obs.configuration[index]))
        index, seen, block = index[order], seen[order], block[order]
        where = obs.configuration[index]
        new = np.ones(len(index), dtype=bool)
        new[1:] = (where[1:] != where[:-1]) | (seen[1:] != seen[:-1])
        first = np.flatnonzero(new)
        intrinsics = builder.rows(p.name for p in parameters(obs)[: len(intrinsics_of(obs))])
        sight = np.cumsum(new) - 1
        super().__init__(builder.view(obs, target, index[first]), obs, index, intrinsics, sight)
        self.point = self.growth = np.ascontiguousarray(obs.extra["point"][index])
        # Where what was printed may be larger than stated: by which number of the table, and what that does to points.
        self.edge = NONE
        if printed := size_of_print(obs):
            self.point, self.edge = np.zeros_like(self.growth), builder.rows([printed])
        elif GROWTH in obs.extra:
            self.growth = np.ascontiguousarray(obs.extra[GROWTH][index])
            self.edge = builder.rows([edge_of(obs.targets[target].name)])
        self.grown = NONE  # its column, where that is free
        self.sights = sights_of(sight, np.zeros_like(sight))
        self.correlations: RowCorrelations | None = None
        if square is not None:
            edges = np.flatnonzero(np.append(True, np.append(np.diff(block) != 0, True)))
            corner = square[index, 1].astype(np.int64)
            self.correlations = RowCorrelations(edges, obs.extra[COVARIANCES][index], corner, self.sigma)
        # What it shares with other targets, where its own frame stands in the table, and the columns of that.
        self.view, self.free = view, HELD
        self.seats = (
            builder.rows(f"{obs.targets[target].name}.{s}" for s in FRAME_SYMBOLS) if view is not None else NONE
        )

    def _with(self, **changes: Any) -> Self:
        other = super()._with(**changes)
        if changes.keys() & {"sigma", "used", "correlations"}:
            other.__dict__.pop("_independent", None)
        return other

    @cached_property
    def _independent(self) -> Decorrelation | None:
        return None if self.correlations is None else self.correlations.decorrelate(self.used, self.sigma)

    @property
    def plain(self) -> Self:
        return self if self.correlations is None else self._with(correlations=None)

    def bind(self, column_of: Ints) -> Self:
        bound = super().bind(column_of)
        mine = column_of[self.edge]
        if (mine >= 0).any():
            bound = bound._with(grown=mine, columns=np.append(bound.columns, mine))
        if self.view is None:
            return bound
        return bound._with(view=self.view.bind(column_of), free=np.append(column_of[self.seats], mine)[None])

    def hold(self, family: int) -> Self:
        held = super().hold(family)
        return held if self.view is None else held._with(view=self.view.hold(family))

    def join(self, some: Sequence[Self]) -> Self:
        """The rows of several targets of one view, these among them, for normal equations alone."""
        assert self.view is not None
        place = np.searchsorted(self.view.configuration, np.concatenate([t.configuration for t in some]))
        seat = np.repeat(np.arange(len(some)), [len(t.configuration) for t in some])
        order = np.lexsort((seat, place))
        sights = sights_of(place[order], seat[order])
        point, growth, scale, configuration = (
            np.concatenate([getattr(t, name) for t in some])[order]
            for name in ("point", "growth", "scale", "configuration")
        )
        last = len(self.columns) - len(self.grown)
        carrier, own = self.view.carrier, self.columns[last - len(self.own) : last]
        each = [a for t in some if (a := t._independent) is not None]
        apart = Decorrelation.join(each, order) if each else None  # all or none: they are of one table
        none = np.full(len(order), -1, dtype=np.int64)
        local = tuple(none if block is None else block[place[order]] for block in carrier.local)
        return self._with(
            carriers=(carrier,), columns=np.concatenate([carrier.columns, own]), sights=sights, point=point, growth=growth,
            edge=np.concatenate([t.edge for t in some]), grown=NONE, scale=scale,
            configuration=configuration, value=np.concatenate([t.value for t in some], axis=1)[:, order], local=local, pair=none,
            seats=np.stack([t.seats for t in some]), free=np.concatenate([t.free for t in some]), view=None, _independent=apart,
        )  # fmt: skip

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        apart = self._independent
        if apart is None or not rows:
            return self._see(x, which, first, rows)
        lo, hi = apart.whole_blocks(first, rows)
        r, jac, local = self._see(x, which, lo, hi - lo)
        some = slice(first - lo, first - lo + rows)
        r, jac, local = (apart.mix(v, lo)[:, some] for v in (r[..., None], jac, local))
        return r[..., 0], jac, local

    def _see(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        """Residuals and Jacobians of pixels as they were read."""
        from robocal.measure.sights._kernels import evaluate_sights

        (t, j, jl), sight, _ = self.look(x, first, rows)
        r, jac, local = (np.empty((len(x), rows, 2, *n)) for n in ((), (len(self.columns),), (jl.shape[3],)))
        evaluate_sights(
            t, j, jl, sight, first, self.point, self.growth, self._edges(x)[:, 0],
            np.ascontiguousarray(x[:, self.numbers]), self.own, r, jac, local,
        )  # fmt: skip
        return r - self.values_at(which, first, rows), jac, local

    def _edges(self, x: Array) -> Array:
        """What multiplies the growth of points, (B, T): by how much squares are larger than stated, or the size of the print."""
        if len(self.edge) == 1:
            return np.ascontiguousarray(np.repeat(x[:, self.edge], len(self.free), axis=1))
        return np.ascontiguousarray(x[:, self.edge]) if len(self.edge) else np.zeros((len(x), len(self.free)))

    def behind(self, x: Array) -> float:
        """The share of the sights whose first point lies behind the camera."""
        first = self.sights.edges[:-1]
        (t, _, _), sight, _ = self.bind(np.full(x.shape[1], -1, dtype=np.int64)).look(x, 0, len(self.index))
        t = t[0, sight[first]]
        return float(np.mean(np.einsum("si,si->s", t[:, 2, :3], self._points(x[:1], first)[0]) + t[:, 2, 3] <= 0))

    def metres_per_pixel(self, x: Array) -> Array:
        """What a pixel is across the direction of sight at the distance of each point, (m,)."""
        (t, _, _), sight, _ = self.bind(np.full(x.shape[1], -1, dtype=np.int64)).look(x, 0, len(self.index))
        t = t[0, sight]
        away = np.einsum("mij,mj->mi", t[:, :3, :3], self._points(x[:1], slice(None))[0]) + t[:, :3, 3]
        fx, fy = x[0, self.numbers[:2]]
        return np.asarray(np.linalg.norm(away, axis=1) / np.sqrt(fx * fy))

    def _points(self, x: Array, rows: Any) -> Array:
        """Where points are in the frame of their target, (B, m, 3); of a single target."""
        edge = self._edges(x)[:, 0]
        return np.asarray(self.point[rows] + edge[:, None, None] * self.growth[rows])

    def stretch(self, x: Array, r: Array, first: int, rows: int) -> Array:
        """Of points that are stated 1 + s too far from the origin of their target."""
        apart = self._independent
        lo, hi = (first, first + rows) if apart is None else apart.whole_blocks(first, rows)
        (t, _, _), sight, _ = self.look(x, lo, hi - lo)
        t = t[:, sight]
        lever = np.einsum("bmij,bmj->bmi", t[:, :, :3, :3], self._points(x, slice(lo, hi)))
        jp = project(lever + t[:, :, :3, 3], x[:, None, self.numbers])[1]
        out = np.asarray(-np.einsum("bmij,bmj->bmi", jp, lever))
        return out if apart is None else apart.mix(out[..., None], lo)[:, first - lo : first - lo + rows, :, 0]

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        if len(self.grown):  # alone: its edge is a column of its rows
            return False
        value = self.value if len(self.value) == 1 else self.value[which]
        if 1 < len(x) == len(weight) and len(value) == 1 and not loss.curved.any() and (x == x[0]).all():
            # Problems that differ in their weights alone: all rows once, less what each problem lacks of them.
            most = weight.max(axis=0, keepdims=True)
            lack = most - weight
            if FEW * int((lack > 0).sum()) < lack.size:
                whole, less = out.nothing(1), out.nothing(len(x))
                self._add(x[:1], value, most, loss, pair, whole)
                self._add(x, value, lack, loss, pair, less)
                out.add(whole, 1.0)
                out.add(less, -1.0)
                return True
        self._add(x, value, weight, loss, pair, out)
        return True

    def _add(self, x: Array, value: Array, weight: Array, loss: Loss, pair: int, out: Normal) -> None:
        from robocal.measure._kernels import frames_of
        from robocal.measure.sights._kernels import accumulate_views

        edges, views, seat = self.sights.edges, self.sights.views, self.sights.seat
        begin = edges[views[:-1]]
        one, two, own = (np.ascontiguousarray(of[begin]) for of in (*self.local, self.pair))
        numbers = np.ascontiguousarray(x[:, self.numbers])
        # The carrier of one target ends in it; behind that of several come their frames.
        together = self.seats.ndim > 1
        free = self.free if together else HELD
        seats, edge = np.tile(np.eye(4), (len(x), len(free), 1, 1)), self._edges(x)
        if together:
            frames_of(np.ascontiguousarray(x[:, self.seats.ravel()]), 0, np.arange(len(free)), seats)
        cut = out.gl.shape[2] if self.touches[0] else 0
        apart = self._independent
        block, mixing = (NONE, NO_MIXING) if apart is None else (apart.block, apart.mixing)
        for part, lo, hi in _spans(weight[:, self.configuration[begin]] > 0):
            some = slice(part, part + 1) if part >= 0 else slice(None)
            mine, here = out.take(some), x[some]
            many = max(1, CHUNK // (len(here) * 6 * max(1, len(self.columns) + 12)))
            for first in range(lo, hi, many):
                t, j, jl = self.carrier.pose(here, first, min(many, hi - first))
                accumulate_views(
                    t, j, jl, first, cut, views, edges, seat, seats[some], edge[some], free, numbers[some], self.own, self.point,
                    self.growth, value[some] if len(value) > 1 else value, self.scale, block, mixing,
                    weight[some] if len(weight) > 1 else weight, self.configuration, self.columns, one, two, own + pair,
                    loss.kind, loss.tuning, loss.curved[some], mine.cost, mine.g, mine.a, mine.gl, mine.al, mine.asl,
                    mine.gm, mine.am, mine.asm, mine.cross,
                )  # fmt: skip


def _spans(active: Bools) -> list[tuple[int, int, int]]:
    """Which views have a weight (B, V), first and behind the last: of all problems together (-1), or of each where they differ."""
    ends = [(int(some[0]), int(some[-1]) + 1) if len(some) else (0, 0) for some in map(np.flatnonzero, active)]
    if all(end == ends[0] for end in ends):
        return [(-1, *ends[0])]
    return [(b, *end) for b, end in enumerate(ends)]


def rays(obs: Observations, uv: Array) -> Array:
    """Unit directions (k, 3) in the camera that the stated intrinsics project to pixels uv (k, 2); of a pixel beyond those where the lens
    folds back, the farthest direction on that side."""
    return unproject(uv, np.array(intrinsics_of(obs)), nearest=True)


def fold_of_lens(obs: Observations) -> tuple[float, Bools]:
    """How far from its centre (px) the stated lens images at most, where it folds back, and which rows (k,) lie where it images nothing."""
    lens = np.array(intrinsics_of(obs))
    radius, lost = image_radius(lens), np.zeros(len(obs), dtype=np.bool_)
    far = np.hypot(*((obs.value - lens[2:4]) / lens[:2]).T) > NEAR_RIM * radius
    lost[far] = np.isnan(unproject(obs.value[far], lens)[:, 0])
    return float(radius * np.sqrt(lens[0] * lens[1])), lost


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term per target, and one for all that are local blocks."""
    parts = builder.split(obs)
    return [
        PixelRows(builder, obs, *part, view) for part, view in zip(parts, views_of(builder, obs, parts), strict=True)
    ]


def intrinsics_of(obs: Observations) -> tuple[float, ...]:
    """The numbers of the camera."""
    values = obs.options["intrinsics"]
    assert isinstance(values, tuple)
    return values


def parameters(obs: Observations) -> Sequence[Parameter]:
    """The camera's intrinsics, and by how much what was printed is larger than stated."""
    camera, values, free = obs.options["camera"], intrinsics_of(obs), obs.options.get("free", ())
    assert isinstance(free, tuple)
    model = model_of(np.array(values))
    known = {
        n: c[i] ** 0.5
        for prior in together(obs)
        for i, (n, c) in enumerate(zip(prior.names, prior.covariance, strict=True))
    }
    edges = [edge_of(t.name) for t in obs.targets] if GROWTH in obs.extra else []
    return [
        *(
            Parameter(f"{camera}.{s}", float(v), u, s in free, prior=known.get(f"{camera}.{s}"), expected=e)
            for s, v, u, e in zip(model.symbols, values, model.units, model.expected, strict=True)
        ),
        *(Parameter(n, 0.0, "m", n in known, prior=known.get(n)) for n in edges),
        *_size_of_print(obs),
    ]


def _size_of_print(obs: Observations) -> list[Parameter]:
    """The size of what was printed, where that is to be found."""
    name, sigma = size_of_print(obs), obs.options.get("print sigma")
    prior = sigma if isinstance(sigma, float) else SCALE
    return [Parameter(name, 1.0, "1", True, prior=prior, expected=prior)] if name else []


def size_of_print(obs: Observations) -> str:
    """The parameter that multiplies all points; nothing where their places are as stated."""
    printed = obs.options.get("print")
    return f"{printed}.size" if printed else ""


def edge_of(target: str) -> str:
    """The parameter by which the squares of a target are larger than stated."""
    return f"{target}.{EDGE}"


def together(obs: Observations) -> Sequence[Together]:
    """What is known beforehand, together: of the intrinsics, and of targets."""
    known, covariance = obs.options.get("known", ()), obs.options.get("covariance", ())
    targets = obs.options.get("together", ())
    assert isinstance(known, tuple) and isinstance(covariance, tuple) and isinstance(targets, tuple)
    return [*([Together(tuple(f"{obs.options['camera']}.{s}" for s in known), covariance)] if known else []), *targets]


PINHOLE = ("fx", "fy", "cx", "cy")
FACTORS = (PINHOLE[:2], PINHOLE)  # the focal length, and the size of the image
PIXELS = register(
    Kind(
        "pixels", 2, terms, parameters, ((0, 2, "px"),), owner="camera", unstated=0.1, scale=SCALE, together=together, views=True,
        frames=offsets_of,
        factors=FACTORS,
    )
)  # fmt: skip

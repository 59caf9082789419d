"""Photographs in a map that was established before: where the camera was, and what that may be off by.

The markers of the map and the numbers of the lens have their covariances as priors, one of both where they share errors (`map_lens`), and
the map as a whole stays where it is: so a pose's sigma holds the noise of its corners, the map and the lens. Gross rows, noise and the fit
are those of every identification.
A flat set of corners, seen from far or from the front, fits two poses alike:

    R' = (I - 2 s s^T) R (I - 2 n n^T),   s the line of sight, n the normal of the corners' plane

is where the search for the other one begins.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.gross import sift
from robocal.diagnose.vision_limits import MARKER_SIZE, MARKER_SIZE_CHANCE, POSE_RIVAL
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import uncertainty
from robocal.fit.noise import assess, tau_of, under
from robocal.fit.starts.cameras import resect, resect_sights
from robocal.geometry import se3, so3
from robocal.geometry.fits import plane
from robocal.measure.base import Rows
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.measure.pixels import EDGE, rays
from robocal.progress import Watch
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.session.vision.displaced import exclude_markers, find_displaced, most_displaced
from robocal.session.vision.map_lens import with_lens
from robocal.session.vision.map_prior import FIXED, MapPrior, prior_targets
from robocal.session.vision.map_sizes import EdgeErrors, size_of_all, with_edges
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import take_markers
from robocal.vision.maps import MarkerMap
from robocal.vision.sheets import SQUARE

__all__ = ["Displaced", "LocatedViews", "Rival", "locate_views", "predict_views"]

WHOLE = 4  # grid: corners that tell a pose
ROUNDS = 4  # grid: of fit and noise
APART = 2e-3  # tolerance: rad: poses nearer than that are one


@record(eq=False)
class Rival:
    """The other pose T_map_camera (4, 4) of a view, and how likely it is beside the first (1: as likely)."""

    view: int
    pose: Array
    likelihood: float


@record
class Displaced:
    """A marker of the map most of whose corners were set aside: how many, of how many, how far from its place (m) it stands, and another
    marker that may have moved in its place."""

    name: str
    aside: int
    corners: int
    distance: float
    other: str = ""


@record(eq=False)
class LocatedViews:
    """Views (V) that were located: ids, T_map_camera (V, 4, 4), the covariance (V, 6, 6) of their small motions (v, w) in map axes, how
    many markers and corners each has, corners set aside, and what is left of the others (px, rms); the other poses that some of them may
    have; views that show too little; markers that the map does not have; what is left of all corners (px, of one axis), and the sigma
    that they state; the markers of the map that stand elsewhere; and by how much of their edges all markers look larger than the
    distances of the map allow, where they do."""

    ids: tuple[str, ...]
    poses: Array
    covariance: Array
    markers: Ints
    corners: Ints
    aside: Ints
    rms: Array
    rivals: tuple[Rival, ...]
    lacking: tuple[str, ...]
    strangers: tuple[str, ...]
    left: float
    stated: float | None
    moved: tuple[Displaced, ...]
    larger: float | None = None


def locate_views(
    table: CornerTable, known: MarkerMap, lens: Lens, edges: EdgeErrors | None = None, watch: Watch | None = None
) -> LocatedViews:
    """Where the camera was; `edges` is what sizes in the map may be off by. Raises ModelError where no view shows a whole marker of it."""
    data, prior, lacking, strangers = _data(table, known, lens)
    map_of = take_markers(known, [t.name for t in prior.targets])
    data = _begin(data, map_of)
    every = np.arange(len(data.configurations))
    clean = sift(Rig(CAMERA), data, every, watch).data
    moved = {m.change.name: m.other for m in find_displaced(clean, prior, "none")[: most_displaced(prior)]}
    clean = with_edges(replace(table, data=exclude_markers(clean, [*moved])), edges, prior).data
    clean = with_lens(clean, known, lens)
    noisy, x = _fit(clean)
    covariance = _local_covariance(noisy, x, uncertainty(noisy, x).covariance if noisy.n else np.zeros((0, 0)))
    inward = se3.from_vector(noisy.values_of(0, x)[0])
    (obs,) = clean.observations
    residual = _residual(noisy, x, len(obs))
    used = np.ones(len(obs), dtype=bool) if obs.used is None else obs.used
    many, aside, square = (
        np.bincount(obs.configuration, w, minlength=len(every))
        for w in (used.astype(float), (~used).astype(float), np.square(residual).sum(axis=1) * used)
    )
    pairs = np.unique(np.stack([obs.configuration, obs.target]), axis=1)[0] if obs.target is not None else every
    poses, spread = _outward(inward, covariance)
    return LocatedViews(
        ids=clean.configurations.ids, poses=poses, covariance=spread, markers=np.bincount(pairs, minlength=len(every)),
        corners=np.bincount(obs.configuration, minlength=len(every)), aside=aside.astype(np.int64),
        rms=np.sqrt(square / np.maximum(many, 1)), rivals=_rivals(noisy, x, obs, map_of, used), lacking=lacking, strangers=strangers,
        left=float(np.sqrt(np.mean(np.square(residual[used])))),
        stated=None if obs.sigma is None else float(np.sqrt(np.mean(np.square(obs.sigma)))), moved=_moved(obs, used, poses, map_of, moved),
        larger=_larger(noisy, x, map_of, edges),
    )  # fmt: skip


def predict_views(table: CornerTable, known: MarkerMap, lens: Lens, cameras: Array) -> Array:
    """The covariance (U, 6, 6) that images in a map will have, (v, w) in map axes, of the views of a table at the truth T_map_camera
    (U, 4, 4)."""
    data, *_ = _data(table, known, lens)
    start = se3.to_vector(se3.inverse(cameras))
    data = with_lens(replace(data, configurations=replace(data.configurations, start=start)), known, lens)
    problem = build(Rig(CAMERA), data)
    x = problem.start
    shared = uncertainty(problem, x).covariance
    return _outward(se3.from_vector(problem.values_of(0, x)[0]), _local_covariance(problem, x, shared))[1]


def _larger(problem: Problem, x: Array, known: MarkerMap, edges: EdgeErrors | None) -> float | None:
    """By how much the markers look larger beside their distances than the map has them, where chance does not make as much."""
    names = [f"{n}.{EDGE}" for n in known.names]
    if edges is None or not set(names) <= set(problem.free):
        return None
    at = [problem.free.index(n) for n in names]
    off = x[0, [problem.table.index[n] for n in names]]
    shared = [t for t in problem.table.together if names[0] in t.names]
    known_to = shared[0].of(names) if shared else np.diag([float(problem.table[n].prior or 0.0) ** 2 for n in names])
    share, chance = size_of_all(known.size, off, uncertainty(problem, x).covariance[np.ix_(at, at)], known_to)
    return share if chance < MARKER_SIZE_CHANCE and abs(share) > MARKER_SIZE else None


def _fit(clean: DataSet) -> tuple[Problem, Array]:
    """The problem of all corners that count with the noise as fitted, and its solution x (1, P)."""
    every = np.arange(len(clean.configurations))
    made = build(Rig(CAMERA), clean)
    x, noisy = made.start, made
    for _ in range(ROUNDS):
        x = least_squares(noisy, x).x
        if not (tau := tau_of(assess(clean, noisy, x, every, 0.0))):
            return noisy, x
        noisy = under(made, clean, tau)
    return noisy, least_squares(noisy, x).x


def _data(
    table: CornerTable, known: MarkerMap, lens: Lens
) -> tuple[DataSet, MapPrior, tuple[str, ...], tuple[str, ...]]:
    """The corners of markers that the map has, its markers as targets at their places, the lens with its covariance; what the
    map says of them; views that show no whole marker of it, and markers that it does not have."""
    obs, ids = table.pixels, table.data.configurations.ids
    number = {n: i for i, n in enumerate(known.names)}
    which = np.array([number.get(m, -1) for m in table.marker], dtype=np.int64)
    strangers = tuple(sorted({m for m, w in zip(table.marker, which.tolist(), strict=True) if w < 0}))
    many = np.bincount(obs.configuration[which >= 0], minlength=len(ids))
    good = (which >= 0) & (many[obs.configuration] >= WHOLE)
    lacking = tuple(ids[i] for i in np.flatnonzero(many < WHOLE).tolist())
    if not good.any():
        found = ", ".join(strangers[:8]) or "none"
        raise ModelError(
            "no view shows a marker of the map", key="marker", found=found, expected=f"{known.names[0]}, ..."
        )
    names = tuple(known.names[i] for i in np.unique(which[good]).tolist())
    seat = {number[n]: i for i, n in enumerate(names)}
    edge = known.size[which]
    points = SQUARE[table.corner % WHOLE] * (edge / 2)[:, None]
    target = np.array([seat.get(w, 0) for w in which.tolist()], dtype=np.int64)
    frames = tuple(Frame(n, tuple(known.vector[number[n]].tolist()), (False,) * 6, "tool") for n in names)
    options: dict[str, object] = {"camera": CAMERA, "intrinsics": lens.numbers, "free": lens.known}
    options |= {"known": lens.known, "covariance": lens.covariance}
    prior = MapPrior(frames, ())
    if known.covariance is not None:
        prior = prior_targets([known], frames, FIXED, align=False)
        options["together"] = prior.together
    seen = replace(obs, extra={"point": points}, target=target, targets=prior.targets, options=options)
    views = np.flatnonzero(many >= WHOLE)
    return replace(table.data, observations=(seen.take(np.flatnonzero(good)),)).take(views), prior, lacking, strangers


def _begin(data: DataSet, known: MarkerMap) -> DataSet:
    """The same with a start for every view, from all its corners at once."""
    (obs,) = data.observations
    order = np.argsort(obs.configuration, kind="stable")
    first = np.searchsorted(obs.configuration[order], np.arange(len(data.configurations)))
    points = _in_map(obs, known)
    along = rays(obs, obs.value)
    found = resect_sights(points[order], along[order], first, 1)
    start = se3.to_vector(np.stack([best for (best,) in found]))
    return replace(data, configurations=replace(data.configurations, start=start))


def _in_map(obs: Observations, known: MarkerMap) -> Array:
    """Where the corners (n, 3) are in the map, m."""
    poses = known.poses[obs.target]
    return np.asarray(np.einsum("nij,nj->ni", poses[:, :3, :3], obs.extra["point"]) + poses[:, :3, 3])


def _local_covariance(problem: Problem, x: Array, shared: Array) -> Array:
    """The covariance (U, 6, 6) of the configurations' own poses: of their rows, N^-1, and of what is shared, C, with K = N^-1 J_l^T J,

    N^-1 + K C K^T
    """
    lin = problem.linearize(x)
    out = np.zeros((problem.configurations, 6, 6))
    order = np.argsort(lin.local, kind="stable")
    edges = np.searchsorted(lin.local[order], np.arange(problem.configurations + 1))
    for u in range(problem.configurations):
        rows = order[edges[u] : edges[u + 1]]
        own = lin.jl[rows]
        inverse = np.linalg.pinv(own.T @ own, hermitian=True)
        gain = inverse @ own.T @ lin.j[rows]
        out[u] = inverse + gain @ shared @ gain.T
    return out


def _outward(inward: Array, covariance: Array) -> tuple[Array, Array]:
    """T_map_camera (V, 4, 4) and its covariance from T_camera_map = (R, t): dT^-1 = (-R^T v - R^T [t] w, -R^T w)."""
    back = np.zeros_like(covariance)
    r = np.swapaxes(inward[:, :3, :3], 1, 2)
    back[:, :3, :3] = back[:, 3:, 3:] = -r
    back[:, :3, 3:] = -r @ so3.skew(inward[:, :3, 3])
    return se3.inverse(inward), back @ covariance @ np.swapaxes(back, 1, 2)


def _residual(problem: Problem, x: Array, count: int) -> Array:
    """What is left of every corner (n, 2), px, in the order of the rows."""
    out = np.zeros((count, 2))
    for term, r in zip(problem.terms, problem.residuals(x), strict=True):
        assert isinstance(term, Rows)
        out[term.index] = r.value
    return out


def _rivals(problem: Problem, x: Array, obs: Observations, known: MarkerMap, used: Bools) -> tuple[Rival, ...]:
    """The other poses that fit nearly as well, the map and the lens where they are."""
    alone = problem.with_free(())
    poses = se3.from_vector(alone.values_of(0, x)[0])
    points = _in_map(obs, known)
    start = np.array([se3.to_vector(_mirror(t, points[(obs.configuration == u) & used])) for u, t in enumerate(poses)])
    mirrored = np.array(x)
    mirrored[:, alone.places[0]] = start.ravel()
    one, other = least_squares(alone, x).x, least_squares(alone, mirrored).x
    squares = [_squares(alone, at) for at in (one, other)]
    first, second = (se3.from_vector(alone.values_of(0, at)[0]) for at in (one, other))
    turn = np.linalg.norm(so3.log(second[:, :3, :3] @ np.swapaxes(first[:, :3, :3], 1, 2)), axis=1)
    likely = np.exp(-0.5 * (squares[1] - squares[0]))
    before = np.einsum("uij,uj->ui", second[:, :3, :3], _middles(obs, points, len(poses))) + second[:, :3, 3]
    some = (turn > APART) & (likely > POSE_RIVAL) & (before[:, 2] > 0)
    return tuple(Rival(u, se3.inverse(second[u]), float(likely[u])) for u in np.flatnonzero(some).tolist())


def _middles(obs: Observations, points: Array, views: int) -> Array:
    many = np.maximum(np.bincount(obs.configuration, minlength=views), 1)
    return np.stack([np.bincount(obs.configuration, points[:, k], minlength=views) / many for k in range(3)], axis=1)


def _mirror(pose: Array, points: Array) -> Array:
    """The pose (4, 4) that shows the plane of points (n, 3) mirrored at the plane across the line of sight; itself of too few."""
    if len(points) < 3:
        return pose
    normal, middle = plane(points)[0], points.mean(axis=0)
    at = pose[:3, :3] @ middle + pose[:3, 3]
    sight = at / np.linalg.norm(at)
    r = (np.eye(3) - 2 * np.outer(sight, sight)) @ pose[:3, :3] @ (np.eye(3) - 2 * np.outer(normal, normal))
    return se3.compose(r, at - r @ middle)


def _squares(problem: Problem, x: Array) -> Array:
    """Sum of squares of the whitened residuals of every configuration (U,)."""
    out = np.zeros(problem.configurations)
    for r in problem.residuals(x):
        np.add.at(out, r.configuration, ((r.value * r.scale) ** 2).sum(axis=-1))
    return out


def _moved(
    obs: Observations, used: Bools, views: Array, known: MarkerMap, alike: Mapping[str, str]
) -> tuple[Displaced, ...]:
    """Markers most of whose corners were set aside, and how far from its place each stands: the median of what views show of it."""
    assert obs.target is not None
    many = np.bincount(obs.target, minlength=len(obs.targets))
    gone = np.bincount(obs.target[~used], minlength=len(obs.targets))
    along, out = rays(obs, obs.value), []
    for i in np.flatnonzero(2 * gone > many).tolist():
        apart = []
        for u in np.unique(obs.configuration[obs.target == i]).tolist():
            rows = np.flatnonzero((obs.target == i) & (obs.configuration == u))
            if len(rows) == WHOLE:
                there = views[u] @ resect(obs.extra["point"][rows], along[rows], 1)[0]
                apart.append(float(np.linalg.norm(there[:3, 3] - known.vector[i, :3])))
        away = float(np.median(apart)) if apart else float("nan")
        name = obs.targets[i].name
        out.append(Displaced(name, int(gone[i]), int(many[i]), away, alike.get(name, "")))
    return tuple(out)

"""Where markers and views are to one another, to begin a fit with: a map that grows from two markers that many views show together.

    T_camera_marker,k       of one sight, k = 1, 2: seen from far or from the front, a square fits two poses alike
    view     T_camera_map = T_camera_marker,k T_map_marker^-1    of the sight and k by which all known markers in it are met best
    marker   T_map_marker = T_map_camera T_camera_marker,k       of the sight and k by which all located views that show it meet it best

Both are asked in turn, those first that other markers or other views decide; then all of them are moved to where corners are met
(`adjust`). A map that was fitted since is asked once more: through the lens that the fit found, the other pose of a marker or of a view may
be the right one. Errors are told in extents of a sight, so that a lens that is not known yet judges as well; a sight that is far off, as
of a marker that moved, counts as no more than that.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.geometry import se3
from robocal.vision.camera import image_and_slope, image_of

__all__ = ["MapStart", "MarkerSights", "grow_map", "revise_map"]

CAP = 0.25  # tolerance: of a sight's extent: a worse error counts as this one
SURE = 1.5  # tolerance: how many times worse the second best has to be
SAME = 0.1  # tolerance: rad: poses of a marker whose normals are nearer than that are one
VOTERS = 12  # grid: sights that are asked for ways; all of them judge
ROUNDS = 3  # grid: steps of views and markers after each growth; the fit does the rest
LAST = 10  # grid: such steps in the end
WEAK = 0.03  # tolerance: of a sight's extent: errors beyond pull less and less; a map that is torn shall heal
REVISIONS = 4  # grid: how often views and markers are asked again, all together
LOWER = 0.9  # tolerance: of what a fitted pose leaves: rounding is no other pose, and the fit to both decides


@record(eq=False)
class MarkerSights:
    """Whole markers in views: number of view and marker (S,), corners (S, 4, 2) in px, their places on the marker (S, 4, 3) in m, and two
    poses T_camera_marker (S, 2, 4, 4), the better one first, the same twice where there is one."""

    view: Ints
    marker: Ints
    corners: Array
    points: Array
    poses: Array

    @property
    def extent(self) -> Array:
        """How large each is seen, px (S,)."""
        return np.asarray(
            np.sqrt(np.square(self.corners - self.corners.mean(axis=1, keepdims=True)).sum(axis=2).mean(axis=1))
        )


@record(eq=False)
class MapStart:
    """T_camera_map (V, 4, 4) of views and T_map_marker (M, 4, 4) of markers, NaN where nothing joins them to the first marker, and what
    each sight is off by, in its extents (S,)."""

    views: Array
    markers: Array
    errors: Array


class _Growth:
    """The state of a map that grows."""

    def __init__(self, sights: MarkerSights, lens: Array, views: int, markers: int) -> None:
        self.sights, self.lens, self.extent = sights, lens, sights.extent
        self.view = np.full((views, 4, 4), np.nan)
        self.marker = np.full((markers, 4, 4), np.nan)
        self.of_view = [np.flatnonzero(sights.view == v) for v in range(views)]
        self.of_marker = [np.flatnonzero(sights.marker == m) for m in range(markers)]
        self.waiting_views: list[tuple[float, int, Array]] = []
        self.waiting_markers: list[tuple[int, float, int, Array]] = []

    @property
    def located(self) -> Bools:
        return np.asarray(np.isfinite(self.view[:, 0, 0]))

    @property
    def placed(self) -> Bools:
        return np.asarray(np.isfinite(self.marker[:, 0, 0]))

    def errors(self, some: Ints, camera_marker: Array) -> Array:
        """What sights are off by at T_camera_marker (..., s, 4, 4), in their extents, (..., s)."""
        t = camera_marker
        seen = self.sights.points[some] @ np.swapaxes(t[..., :3, :3], -2, -1) + t[..., None, :3, 3]
        with np.errstate(all="ignore"):
            off = np.linalg.norm(image_of(seen, self.lens) - self.sights.corners[some], axis=-1)
            off = np.sqrt(np.square(off).mean(axis=-1)) / self.extent[some]
        behind = (seen[..., 2] <= 0).any(axis=-1)
        return np.asarray(np.where(behind | ~(off < CAP), CAP, off))

    def start(self) -> MapStart:
        """Where all of it is now."""
        s = self.sights
        errors = self.errors(np.arange(len(s.view)), self.view[s.view] @ self.marker[s.marker])
        return MapStart(self.view, self.marker, errors)

    def begin(self) -> None:
        """Two markers that most views show together, and the one of which more is seen in the origin; that alone, of lone ones."""
        s = self.sights
        seen = np.zeros((len(self.view), len(self.marker)), dtype=np.int64)
        seen[s.view, s.marker] = 1
        together = seen.T @ seen
        many = np.diag(together).copy()
        np.fill_diagonal(together, 0)
        if not together.any():
            self.marker[many.argmax()] = np.eye(4)
            return
        one, other = sorted(np.unravel_index(int(together.argmax()), together.shape), key=lambda m: -many[m])
        self.marker[one] = np.eye(4)
        views = _few(np.flatnonzero(seen[:, one] & seen[:, other]))
        first, second = (
            np.array([self.of_marker[m][s.view[self.of_marker[m]] == v][0] for v in views]) for m in (one, other)
        )
        a, b = s.poses[first], s.poses[second]
        ways = (se3.inverse(a)[:, :, None] @ b[:, None]).reshape(-1, 4, 4)
        # Of each view the pose of the first marker that explains the second better.
        off = self.errors(second, np.einsum("vkij,wjl->wkvil", a, ways)).min(axis=1)
        off += 1e-3 * self.errors(first, np.swapaxes(a, 0, 1)).sum(axis=1).min()
        self.marker[other] = ways[int(np.square(off).sum(axis=1).argmin())]

    def locate(self) -> int:
        """Views that show known markers; how many. Those that nothing decides wait, each with the way that is likeliest."""
        s, placed, count = self.sights, self.placed, 0
        self.waiting_views = []
        for v in np.flatnonzero(~self.located):
            some = self.of_view[v][placed[s.marker[self.of_view[v]]]]
            if not len(some):
                continue
            ways, cost = self._ways_of_view(some)
            best, sure = _best(cost, ways, self.marker[s.marker[some[0]], :3, 2])
            if len(some) > 1 or sure > SURE**2:
                self.view[v] = ways[best]
                count += 1
            else:
                self.waiting_views.append((sure, int(v), ways[best]))
        return count

    def place(self) -> int:
        """Markers that located views show, in the same way."""
        s, located, count = self.sights, self.located, 0
        self.waiting_markers = []
        for m in np.flatnonzero(~self.placed):
            some = self.of_marker[m][located[s.view[self.of_marker[m]]]]
            if not len(some):
                continue
            ways, cost = self._ways_of_marker(some)
            best, sure = _best(cost, ways, None)
            if sure > SURE**2:
                self.marker[m] = ways[best]
                count += 1
            else:
                self.waiting_markers.append((len(some), sure, int(m), ways[best]))
        return count

    def guess(self) -> int:
        """Of what waits, the view that is surest, or else the marker; whether there was any."""
        if self.waiting_views:
            _, view, way = max(self.waiting_views, key=lambda w: w[0])
            self.view[view] = way
        elif self.waiting_markers:
            *_, marker, way = max(self.waiting_markers, key=lambda w: w[:2])
            self.marker[marker] = way
        return bool(self.waiting_views or self.waiting_markers)

    def _ways_of_view(self, some: Ints, *known: Array) -> tuple[Array, Array]:
        """Where sights of known markers may put their view, `known` ways first, and what each leaves of all of them, squared, (W,)."""
        held, few = self.marker[self.sights.marker[some]], _few(some)
        own = self.sights.poses[few] @ se3.inverse(self.marker[self.sights.marker[few]])[:, None]
        ways = np.concatenate([*known, own.reshape(-1, 4, 4)])
        return ways, np.square(self.errors(some, ways[:, None] @ held)).mean(axis=1)

    def _ways_of_marker(self, some: Ints, *known: Array) -> tuple[Array, Array]:
        """The same of a marker that located views show."""
        by, few = self.view[self.sights.view[some]], _few(some)
        own = se3.inverse(self.view[self.sights.view[few]])[:, None] @ self.sights.poses[few]
        ways = np.concatenate([*known, own.reshape(-1, 4, 4)])
        return ways, np.square(self.errors(some, by @ ways[:, None])).mean(axis=1)

    def revise(self, below: float = 1 / SURE**2) -> bool:
        """Views, then markers, where another pose leaves less than `below` of what is left of all that is known; whether any did."""
        s, moved = self.sights, False
        for poses, numbers, ask, own, other in (
            (self.view, np.flatnonzero(self.located), self._ways_of_view, self.of_view, s.marker),
            (self.marker, np.flatnonzero(self.placed), self._ways_of_marker, self.of_marker, s.view),
        ):
            known = self.placed if other is s.marker else self.located
            for i in numbers:
                ways, cost = ask(own[i][known[other[own[i]]]], poses[[i]])
                if cost.min() < below * cost[0]:
                    poses[i], moved = ways[int(cost.argmin())], True
        return moved

    def adjust(self, rounds: int) -> None:
        """Views, then markers, a step of Gauss and Newton each, by what sights leave that are near."""
        s = self.sights
        use = np.flatnonzero(self.located[s.view] & self.placed[s.marker])
        points, corners, extent = s.points[use], s.corners[use], self.extent[use, None, None]
        for turn in range(2 * rounds):
            of_view = turn % 2 == 0
            t = self.view[s.view[use]] @ self.marker[s.marker[use]]
            lever = points @ np.swapaxes(t[:, :3, :3], 1, 2)
            with np.errstate(all="ignore"):
                uv, by = image_and_slope(lever + t[:, None, :3, 3], self.lens)
            left = (uv - corners) / extent
            size = np.sqrt(np.square(left).sum(axis=2).mean(axis=1))
            scale = max(3 * float(np.median(size)), WEAK)
            good = np.isfinite(size) & ((lever[:, :, 2] + t[:, None, 2, 3]) > 0).all(axis=1)
            weight = np.where(good, 1 / (1 + (np.where(good, size, 0.0) / scale) ** 2), 0.0)
            if not of_view:  # motions in map axes
                turned = self.view[s.view[use]][:, :3, :3]
                lever = lever @ turned
                by = by @ turned[:, None]
            else:
                lever = lever + t[:, None, :3, 3] - self.view[s.view[use]][:, None, :3, 3]
            by = np.concatenate([by, -by @ _skew(lever)], axis=3) / extent[..., None]
            by = np.where(good[:, None, None, None], by, 0.0).reshape(len(use), 8, 6)
            left = np.where(good[:, None, None], left, 0.0).reshape(len(use), 8)
            own = s.view[use] if of_view else s.marker[use]
            poses = self.view if of_view else self.marker
            a, g = np.zeros((len(poses), 6, 6)), np.zeros((len(poses), 6))
            heavy = np.swapaxes(by * weight[:, None, None], 1, 2)
            np.add.at(a, own, heavy @ by)
            np.add.at(g, own, (heavy @ left[..., None])[..., 0])
            some = np.unique(own)
            some = some[np.linalg.norm(a[some], axis=(1, 2)) > 0]
            size_ = np.sqrt(np.maximum(np.einsum("mii->mi", a[some]), 1e-30))
            scaled = a[some] / (size_[:, :, None] * size_[:, None]) + 1e-6 * np.eye(6)
            step = -np.linalg.solve(scaled, (g[some] / size_)[..., None])[..., 0] / size_
            poses[some] = se3.displace(poses[some], step[:, :3], step[:, 3:])


def _few(some: Ints) -> Ints:
    """Some of the sights: as many as are asked for ways."""
    return some[:: -(-len(some) // VOTERS)]


def _skew(v: Array) -> Array:
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return np.asarray(out - np.swapaxes(out, -1, -2))


def _best(cost: Array, ways: Array, axis: Array | None) -> tuple[int, float]:
    """The cheapest of some poses (n, 4, 4), and how many times more the cheapest costs that turns an axis (z) elsewhere."""
    best = int(cost.argmin())
    normal = ways[:, :3, 2] if axis is None else ways[:, :3, :3] @ axis
    apart = np.arccos(np.clip(normal @ normal[best], -1, 1)) > SAME
    return best, float(cost[apart].min() / max(cost[best], 1e-18)) if apart.any() else np.inf


def grow_map(sights: MarkerSights, lens: Array, views: int, markers: int) -> MapStart:
    """Views and markers of sights through a lens (n,), beside the marker that most others are seen with."""
    grown = _Growth(sights, lens, views, markers)
    grown.begin()
    while grown.locate() + grown.place() or grown.guess():
        grown.adjust(ROUNDS)
    for _ in range(REVISIONS):
        grown.adjust(LAST)
        if not grown.revise():
            break
    return grown.start()


def revise_map(sights: MarkerSights, lens: Array, views: Array, markers: Array) -> MapStart | None:
    """The map of T_camera_map (V, 4, 4) and T_map_marker (M, 4, 4), which were fitted to sights through a lens (n,), with other poses where
    these leave less; None where none does."""
    grown = _Growth(sights, lens, len(views), len(markers))
    grown.view, grown.marker = np.array(views), np.array(markers)
    return grown.start() if grown.revise(LOWER) else None

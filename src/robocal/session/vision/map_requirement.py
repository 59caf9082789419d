"""What a map of markers, and a camera's place in it, will be off by: predicted from markers, lens and poses, before a picture is taken.

The problem of `vision map` is built at the truth, with corners that have no noise, and its covariance is taken; then that of `vision map
--held`, for one more image from each of the poses. To first order, so it holds while errors are small against distances.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.errors import ModelError
from robocal.estimate.uncertainty import uncertainty
from robocal.geometry import se3
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.vision.corner_table import CAMERA, CORNERS, CornerTable
from robocal.session.vision.marker_places import EXPECTED
from robocal.session.vision.place_views import predict_views
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import project_covariance, rigid_motions, rigid_projector, take_markers
from robocal.vision.map_views import MapViews, project_map
from robocal.vision.maps import MapLens, MarkerMap
from robocal.vision.sheets import SQUARE
from robocal.vision.sightings import find_islands

__all__ = ["PlanErrors", "PredictedMap", "corner_table", "predict_map"]

WHOLE = 4  # grid: corners of a marker


@record
class PlanErrors:
    """Errors to be expected, rms (m; the turn in rad, a length of three components): of the markers' places along x and y (a component)
    and along z, laid on the truth as well as it goes; the largest sigma along z; both in the frame of one marker, as that shows them;
    of the camera in a new image in the finished map."""

    map_xy: float
    map_z: float
    worst_z: float
    reference_xy: float
    reference_z: float
    camera_xy: float
    camera_z: float
    camera_turn: float


@record(eq=False)
class PredictedMap:
    """A map of the markers that are seen, with the covariance that it will have; the lens afterwards; how many markers each view has (V,),
    in how many views each marker of the plan is (M,); the covariance (U, 6, 6) of a new image from each view that shows one, in map axes;
    and the marker that is the reference."""

    map: MarkerMap
    lens: Lens
    markers: Ints
    views: Ints
    camera: Array
    reference: str

    @property
    def errors(self) -> PlanErrors:
        """The errors to be expected."""
        c = self.map.covariance
        assert c is not None
        own = np.diag(c).reshape(-1, 6)
        beside = np.diag(_from_reference(self.map, self.map.names.index(self.reference))).reshape(-1, 6)
        view = np.einsum("uii->ui", self.camera)

        def rms(variances: Array) -> float:
            return float(np.sqrt(np.mean(variances)))

        return PlanErrors(
            map_xy=rms(own[:, :2]), map_z=rms(own[:, 2]), worst_z=float(np.sqrt(own[:, 2].max())), reference_xy=rms(beside[:, :2]),
            reference_z=rms(beside[:, 2]), camera_xy=rms(view[:, :2]), camera_z=rms(view[:, 2]), camera_turn=rms(view[:, 3:].sum(axis=1)),
        )  # fmt: skip


def predict_map(
    known: MarkerMap, cameras: Array, lens: Lens, sigma: float, size: tuple[int, int], survey: float | None = None
) -> PredictedMap:
    """The map that cameras T_map_camera (V, 4, 4) will give through a lens with its covariance; `sigma` of a corner in px; `survey`: what
    each marker's place is measured to otherwise, m. Raises ModelError where the views join no map."""
    sights = project_map(known, cameras, lens.intrinsics, size)
    shown = np.bincount(sights.view, minlength=len(cameras))
    seen = np.bincount(sights.marker, minlength=len(known.names))
    _join(known, sights, cameras, survey)
    there = take_markers(known, [known.names[i] for i in np.flatnonzero(seen)])
    reference = int(seen[seen > 0].argmax())
    table = corner_table(there, cameras, sights, seen, sigma, size)
    found, after = _predict(table, there, lens, reference, survey)
    views = table.keep(np.ones(len(table.pixels), dtype=bool))
    camera = predict_views(views, found, after, cameras[shown > 0])
    return PredictedMap(found, after, shown, seen, camera, there.names[reference])


def corner_table(
    there: MarkerMap, cameras: Array, sights: MapViews, seen: Ints, sigma: float, size: tuple[int, int]
) -> CornerTable:
    """The corners of the markers that are seen as a table, without noise."""
    number = np.cumsum(seen > 0) - 1
    target = np.repeat(number[sights.marker], WHOLE)
    corner = np.tile(np.arange(WHOLE), len(sights.view))
    edge = there.size[target]
    targets = tuple(
        Frame(n, tuple(v), (True,) * 6, "tool", EXPECTED)
        for n, v in zip(there.names, there.vector.tolist(), strict=True)
    )
    obs = Observations(
        "pixels", np.repeat(sights.view, WHOLE).astype(np.int64), sights.pixels.reshape(-1, 2),
        np.full((len(target), 2), sigma), targets=targets, target=target.astype(np.int64),
        extra={"point": SQUARE[corner] * (edge / 2)[:, None]}, options={"camera": CAMERA}, group=CORNERS,
    )  # fmt: skip
    start = se3.to_vector(se3.inverse(cameras))
    data = DataSet(Configurations(tuple(str(i + 1) for i in range(len(cameras))), start=start), (obs,))
    names = tuple(there.names[t] for t in target.tolist())
    return CornerTable(
        data=data, size=size, marker=names, corner=corner, family=None, upright=True, files=(), remarks=()
    )


def _join(known: MarkerMap, sights: MapViews, cameras: Array, survey: float | None) -> None:
    """Raises ModelError where nothing is seen, or views do not join the markers."""
    if not len(sights.view):
        expected = "larger markers; or poses of the camera in the map, units in the headers, whose z looks at the printed sides"
        away = known.vector[:, :3].mean(axis=0) - cameras[:, :3, 3]
        far = np.linalg.norm(away, axis=1)
        ahead = int((np.einsum("vi,vi->v", away, cameras[:, :3, 2]) > 0).sum())
        found = f"{len(cameras)} poses, {far.min():.3g} to {far.max():.3g} m away; {ahead} look at them"
        raise ModelError("no pose shows a marker", key="POSES", found=found, expected=expected)
    some = np.unique(sights.marker)
    shown = np.zeros((len(cameras), len(some)), dtype=bool)
    shown[sights.view, np.searchsorted(some, sights.marker)] = True
    islands = find_islands(shown)
    if len(islands) > 1 and survey is None:
        apart = "; ".join(", ".join(known.names[some[i]] for i in island[:8].tolist()) for island in islands[:4])
        expected = "poses that show markers of both groups, or --survey"
        raise ModelError("no pose joins some markers to the others", key="POSES", found=apart, expected=expected)


def _predict(
    table: CornerTable, there: MarkerMap, lens: Lens, reference: int, survey: float | None
) -> tuple[MarkerMap, Lens]:
    """The map with its covariance and what it shares with the lens, and the lens with what is left of its own."""
    own = None if survey is None else (survey,) * 3 + (EXPECTED[1],) * 3
    targets = tuple(
        replace(f, prior=own) if own is not None else replace(f, free=(i != reference,) * 6)
        for i, f in enumerate(table.pixels.targets)
    )
    seen = table.with_prior(lens).pixels
    problem = build(Rig("map"), replace(table.data, observations=(replace(seen, targets=targets),)))
    total = uncertainty(problem, problem.start)
    names = [f"{n}.{s}" for n in there.names for s in FRAME_SYMBOLS]
    at = {n: i for i, n in enumerate(names)}
    free = list(problem.free)
    told = [i for i, n in enumerate(free) if n in at]
    rows = [at[free[i]] for i in told]
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(rows, rows)] = total.covariance[np.ix_(told, told)]
    own_lens = [free.index(f"{CAMERA}.{s}") for s in lens.known]
    after = Lens.of(lens.model, lens.numbers, lens.size, lens.known, total.covariance[np.ix_(own_lens, own_lens)])
    across = np.zeros((len(names), len(own_lens)))
    across[rows] = total.covariance[np.ix_(told, own_lens)]
    shared = np.array(after.covariance), rigid_projector(there) @ across
    through = MapLens(lens.model, lens.known, lens.numbers, after.numbers, *shared)
    return replace(there, covariance=project_covariance(there, covariance), lens=through), after


def _from_reference(known: MarkerMap, at: int) -> Array:
    """The covariance (6M, 6M) of the markers in the frame of one of them, along the axes of the map: its own motion is taken from all."""
    assert known.covariance is not None
    count = len(known.names)
    around = rigid_motions(known.vector[:, :3] - known.vector[at, :3])
    pick = np.zeros((6, 6 * count))
    pick[:, 6 * at : 6 * at + 6] = np.eye(6)
    less = np.eye(6 * count) - around @ pick
    return np.asarray(less @ known.covariance @ less.T)

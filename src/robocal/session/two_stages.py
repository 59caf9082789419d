"""The way in two stages, beside one estimate: a map of the markers from images alone, then the machine, with the map held.

1 map      the views through the lens as it is stated; no machine. It is laid on the marker whose place is known
2 machine  the same estimate, of which lens, size and markers are held

What the first stage gets wrong (a lens that bends it, a print of another size) no reading of the second can mend.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from robocal._record import replace
from robocal._types import Ints
from robocal.errors import ModelError
from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Model
from robocal.measure.pixels import intrinsics_of
from robocal.progress import Watch, tell
from robocal.prove.identify import Identification, identify
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.session.vision.map_fit import fit_map
from robocal.vision.camera import model_of
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import move_map
from robocal.vision.maps import MarkerMap
from robocal.vision.sheets import SQUARE

__all__ = ["identify_in_stages", "views_of_map"]

KEY = "--two-stages"
EXPECTED = "one camera, and squares on the base whose places are free, but for one that is known"
NEAR = 1e-6  # tolerance: of half an edge: corners that are written, not measured

M = TypeVar("M", bound=Model)


def identify_in_stages(model: M, data: DataSet, options: Options, watch: Watch | None = None) -> Identification[M]:
    """The machine by a map that was made before it. Raises ModelError where the images are none of a map, or make none."""
    at, corner, first = views_of_map(data)
    tell(watch, "map")
    every = list(data.observations)
    every[at] = _hold(every[at], _map(every[at], corner, first, watch))
    return identify(model, replace(data, observations=tuple(every)), options, watch)


def views_of_map(data: DataSet) -> tuple[int, Ints, Frame]:
    """Which of the observations show the markers of a map, the corner of its square that every row is, and the marker whose place is
    known. Raises ModelError where none do."""
    at = [i for i, o in enumerate(data.observations) if o.kind == "pixels"]
    if len(at) != 1:
        raise ModelError("two stages need one camera", key=KEY, found=f"{len(at)} files of pixels", expected=EXPECTED)
    obs = data.observations[at[0]]
    corner = _corners(obs)
    known = [t for t in obs.targets if not any(t.free)]
    if not known or len(known) == len(obs.targets) or any(t.mount != "base" for t in obs.targets):
        found = f"{len(known)} of {len(obs.targets)} squares with a known place"
        raise ModelError("two stages need a map to be found", key=KEY, found=found, expected=EXPECTED)
    return at[0], corner, known[0]


def _corners(obs: Observations) -> Ints:
    """Which corner of its square every row is, (n,). Raises ModelError where rows are no corners of squares."""
    point, sign = obs.extra.get("point"), SQUARE[:, :2]
    if point is None or obs.target is None:
        raise ModelError("two stages need markers with numbers", key=KEY, found="one target", expected=EXPECTED)
    half = np.abs(point[:, :2]).max(axis=1)[:, None]
    corner = ((point[:, None, :2] * sign).sum(axis=2)).argmax(axis=1)
    if (np.abs(point[:, :2] - half * sign[corner]) > NEAR * half).any() or point[:, 2].any():
        raise ModelError("two stages need corners of squares", key=KEY, found="other points", expected=EXPECTED)
    return np.asarray(corner, dtype=np.int64)


def _map(obs: Observations, corner: Ints, first: Frame, watch: Watch | None) -> MarkerMap:
    """The map in the frame of the base, from images alone."""
    used = np.arange(len(obs)) if obs.used is None else np.flatnonzero(obs.used)
    views, view = np.unique(obs.configuration[used], return_inverse=True)
    seen = replace(
        obs.take(used), configuration=view.astype(np.int64), frame=None, used=None,
        targets=tuple(Frame(t.name, (0.0,) * 6, (True,) * 6, "tool") for t in obs.targets), options={"camera": CAMERA},
    )  # fmt: skip
    assert seen.target is not None
    ids = Configurations(tuple(map(str, views.tolist())))
    names = tuple(obs.targets[t].name for t in seen.target.tolist())
    table = CornerTable(
        data=DataSet(ids, (seen,)), size=(0, 0), marker=names, corner=corner[used], family=None, upright=True, files=(), remarks=()
    )  # fmt: skip
    numbers = intrinsics_of(obs)
    lens = Lens.of(model_of(np.array(numbers)).name, numbers)
    found = fit_map(table.keep(np.ones(len(used), dtype=bool)), lens, "huber", first.name, watch=watch)
    return move_map(found.map, se3.from_vector(np.array(first.value)))


def _hold(obs: Observations, map_: MarkerMap) -> Observations:
    """The corners of markers that the map has, with these, the lens and the size where they are."""
    place = dict(zip(map_.names, map_.vector.tolist(), strict=True))
    targets = tuple(
        replace(t, value=tuple(place.get(t.name, t.value)), free=(False,) * 6, prior=None) for t in obs.targets
    )
    options = {k: v for k, v in obs.options.items() if k not in ("print", "print sigma")}
    options |= {"free": (), "known": (), "covariance": (), "together": ()}
    assert obs.target is not None
    there = [i for i, t in enumerate(targets) if t.name in place]
    return replace(obs, targets=targets, options=options).take(np.flatnonzero(np.isin(obs.target, there)))

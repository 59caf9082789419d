"""A lens from corners: a camera before a target is a machine whose pose is its own in every view, and whose only numbers are the lens's.

Start, gross rows, selection, noise, hold-out and verdict are those of every identification. The nominal lens is the one that was
given, else the plain camera: as long as the image is wide, centred, without distortion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import replace
from robocal._types import Array
from robocal.errors import ModelError
from robocal.estimate.least_squares import least_squares
from robocal.fit.options import Options
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS, Parameter, ParameterTable
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.session.vision.lens_prior import free_numbers
from robocal.session.vision.marker_places import place_markers
from robocal.vision.camera import MODELS
from robocal.vision.lens_start import FlatViews, find_focal, flat_places, look_flat
from robocal.vision.lenses import Lens

__all__ = [
    "camera_points",
    "expected_of",
    "fit_lens",
    "improve_lens",
    "lens_of",
    "look_at_views",
    "plain_lens",
    "tilts",
    "view_poses",
]

# What the numbers of a lens are expected to be off by without data: of the width of the image; else without a unit.
OF_WIDTH = {"fx": 0.3, "fy": 0.3, "cx": 0.05, "cy": 0.05}
EXPECTED, TANGENTIAL = 0.3, 0.01
EXACT = 1e-16  # tolerance: of the cost; a fit ends well within its noise, and two programs shall agree to a millionth of that


def plain_lens(size: tuple[int, int], model: str) -> Lens:
    """The plain camera: as long as the image is wide (px), centred, without distortion."""
    width, height = size
    numbers = [float(width), float(width), (width - 1) / 2, (height - 1) / 2]
    return Lens.of(model, numbers + [0.0] * (len(MODELS[model].symbols) - 4), size)


def expected_of(symbol: str, width: int) -> float:
    """What a number of a lens is expected to be off by without data, of images so wide."""
    return OF_WIDTH[symbol] * width if symbol in OF_WIDTH else TANGENTIAL if symbol[0] == "p" else EXPECTED


def lens_rig(lens: Lens, free: Sequence[str], width: int) -> Rig:
    """The camera as a machine without joints, some of whose numbers are to be found."""
    rows = []
    for symbol, value, unit in zip(lens.kind.symbols, lens.numbers, lens.kind.units, strict=True):
        rows.append(Parameter(f"{CAMERA}.{symbol}", value, unit, symbol in free, expected=expected_of(symbol, width)))
    return Rig(CAMERA, ParameterTable(tuple(rows)))


def look_at_views(table: CornerTable) -> FlatViews | None:
    """What the views say before anything is fitted; None of a target that is not flat."""
    obs = table.pixels
    places = flat_places(obs.extra["point"])
    target = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    return None if places is None else look_flat(places, obs.value, obs.configuration, target)


def fit_lens(
    table: CornerTable, nominal: Lens, fix: Sequence[str] = (), known: bool = False, watch: Watch | None = None
) -> Decision[Rig]:
    """The lens that views show, beside the nominal one, which is `known` from elsewhere, or a plain camera. Numbers in `fix` stay as they
    are there. Raises ModelError."""
    symbols = nominal.kind.symbols
    free = free_numbers(nominal, fix)
    if not free:
        expected = f"at least one of {', '.join(symbols)} to be found"
        raise ModelError(
            "every number of the lens stays as it is", key="--fix", found=", ".join(fix), expected=expected
        )
    begin = dict(zip(symbols, nominal.numbers, strict=True))
    seen = None if known else look_at_views(table)
    focal = None if seen is None else find_focal(seen, table.size)
    if focal is not None:
        begin |= {s: focal for s in ("fx", "fy") if s in free}
    model = lens_rig(nominal, free, table.size[0])
    # Poses begin where they are seen through the lens with which the fit begins.
    begun = place_markers(table.with_lens(tuple(begin.values()), free))
    placed = place_configurations(model, begun.data)
    placed = replace(placed, observations=begun.with_lens(nominal.numbers, free).data.observations)
    options = Options(begin={f"{CAMERA}.{s}": v for s, v in begin.items() if s in free})
    made = decide(model, placed, options, watch)
    fit = made.need_fit
    ended = least_squares(fit.problem, fit.solution.x, cost_tolerance=EXACT)
    return replace(made, fit=replace(fit, solution=replace(fit.solution, x=ended.x, cost=ended.cost)))


def improve_lens(table: CornerTable, prior: Lens, watch: Watch | None = None) -> Lens:
    """What views say of a lens beside its covariance, each with a pose of its own; the lens itself where they say nothing."""
    model = Rig(CAMERA)
    try:
        begun = place_markers(table.with_prior(prior))
        made = decide(model, place_configurations(model, begun.data), Options(), watch)
    except ModelError:
        return prior
    return lens_of(made, prior, table.size, prior.source)


def lens_of(made: Decision[Rig], nominal: Lens, size: tuple[int, int], source: str = "") -> Lens:
    """The lens that was found, with what its numbers may be off by."""
    symbols = nominal.kind.symbols
    numbers = [made.values.get(f"{CAMERA}.{s}", v) for s, v in zip(symbols, nominal.numbers, strict=True)]
    names, covariance = made.spread
    at = [names.index(f"{CAMERA}.{s}") for s in symbols if f"{CAMERA}.{s}" in names]
    known = [i for i in at if covariance[i, i] > 0]
    told = tuple(names[i].rpartition(".")[2] for i in known)
    return Lens.of(nominal.model, numbers, size, told, covariance[np.ix_(known, known)], source)


def view_poses(made: Decision[Rig]) -> Array:
    """T_camera_target (V, 4, 4) of every view."""
    fit = made.need_fit
    return se3.from_vector(fit.problem.values_of(0, fit.solution.x)[0].reshape(fit.problem.configurations, 6))


def tilts(made: Decision[Rig]) -> Array:
    """The angle (V,) between the target's normal and the line of sight to its origin, deg."""
    poses = view_poses(made)
    way = poses[:, :3, 3] / np.linalg.norm(poses[:, :3, 3], axis=1)[:, None]
    return np.asarray(np.degrees(np.arccos(np.clip(np.abs(np.sum(poses[:, :3, 2] * way, axis=1)), 0.0, 1.0))))


def camera_points(table: CornerTable, made: Decision[Rig]) -> Array:
    """Where corners are in the camera's frame, (n, 3) m."""
    obs = table.pixels
    poses = view_poses(made)[obs.configuration]
    points = obs.extra["point"]
    if obs.targets and obs.target is not None:
        frames = np.array([[made.values[f"{t.name}.{s}"] for s in FRAME_SYMBOLS] for t in obs.targets])
        held = se3.from_vector(frames)[obs.target]
        points = np.einsum("nij,nj->ni", held[:, :3, :3], points) + held[:, :3, 3]
    return np.asarray(np.einsum("nij,nj->ni", poses[:, :3, :3], points) + poses[:, :3, 3])

"""A lens from corners: a camera before a target is a machine whose pose is its own in every view, and whose only numbers are the lens's.

Start, gross rows, selection, noise, hold-out and verdict are those of every identification. The nominal lens is the one that was
given, else the plain camera: as long as the image is wide, centred, without distortion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.estimate.least_squares import least_squares
from robocal.fit.options import Options
from robocal.fit.starts.own import place_configurations
from robocal.measure.machine import Rig
from robocal.parameters import Parameter, ParameterTable
from robocal.progress import Watch
from robocal.prove.decision import Decision, decide
from robocal.session.vision.corner_table import CAMERA, CornerTable
from robocal.vision.camera import SYMBOLS
from robocal.vision.lens_start import FlatViews, find_focal, flat_places, look_flat

__all__ = ["fit_lens", "lens_model", "numbers_of", "look_at_views", "plain_lens"]

# What the numbers of a lens are expected to be off by without data: of the width of the image, then without a unit.
EXPECTED = {"fx": 0.3, "fy": 0.3, "cx": 0.05, "cy": 0.05, "k1": 0.3, "k2": 0.3, "p1": 0.01, "p2": 0.01, "k3": 0.3}
PIXELS = ("fx", "fy", "cx", "cy")
EXACT = 1e-16  # tolerance: of the cost; a fit ends well within its noise, and two programs are to agree to a millionth of that


def plain_lens(size: tuple[int, int]) -> dict[str, float]:
    """The plain camera: as long as the image is wide (px), centred, without distortion."""
    width, height = size
    return dict(zip(SYMBOLS, (width, width, (width - 1) / 2, (height - 1) / 2, 0, 0, 0, 0, 0), strict=True))


def lens_model(numbers: Mapping[str, float], free: Sequence[str], size: tuple[int, int]) -> Rig:
    """The camera as a machine without joints."""
    rows = (
        Parameter(
            f"{CAMERA}.{s}", float(v), "px" if s in PIXELS else "1", s in free, expected=EXPECTED[s] * (size[0] if s in PIXELS else 1)
        )
        for s, v in numbers.items()
    )
    return Rig(CAMERA, ParameterTable(tuple(rows)))


def look_at_views(table: CornerTable) -> FlatViews | None:
    """What the views say before anything is fitted; None of a target that is not flat."""
    places = flat_places(table.pixels.extra["point"])
    return None if places is None else look_flat(places, table.pixels.value, table.pixels.configuration, len(table.data.configurations))


def fit_lens(
    table: CornerTable, nominal: Mapping[str, float], fix: Sequence[str], known: bool, watch: Watch | None = None
) -> Decision[Rig]:
    """The lens that views show, beside the nominal one: known from elsewhere, or to begin with anything."""
    free = tuple(s for s in nominal if s not in fix)
    begin = dict(nominal)
    seen = None if known else look_at_views(table)
    focal = None if seen is None else find_focal(seen, table.size)
    if focal is not None:
        begin |= {s: focal for s in ("fx", "fy") if s in free}
    model = lens_model(nominal, free, table.size)
    # Poses begin where they are seen through the lens with which the fit begins.
    placed = place_configurations(model, table.with_lens(tuple(begin.values()), free).data)
    placed = replace(placed, observations=table.with_lens(tuple(nominal.values()), free).data.observations)
    options = Options(begin={f"{CAMERA}.{s}": v for s, v in begin.items() if s in free})
    made = decide(model, placed, options, watch)
    fit = made.need_fit
    ended = least_squares(fit.problem, fit.solution.x, cost_tolerance=EXACT)
    return replace(made, fit=replace(fit, solution=replace(fit.solution, x=ended.x, cost=ended.cost)))


def numbers_of(made: Decision[Rig]) -> Array:
    """The numbers of the lens that was found, in the order of its table."""
    return np.array([made.values[n] for n in made.model.table.names])

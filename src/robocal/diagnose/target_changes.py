"""Mistakes in what was printed, each as a change of the points of all targets: corners in another order, an edge in another unit.

A marker whose corners are counted the other way round is a mirrored marker: p and its mirror image have different projections from one
place. A size in another unit is a factor that no other instrument shares.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from robocal._record import replace
from robocal._types import Array
from robocal.estimate.problem import Problem
from robocal.measure.data import DataSet, Observations
from robocal.measure.pixels import size_of_print
from robocal.remarks.english import declare
from robocal.remarks.remark import Number

__all__ = ["CORNERS_REORDERED", "TARGET_UNIT", "as_printed", "seem_of_other_unit", "target_changes"]

CORNERS_REORDERED = declare(
    "corners-reordered",
    "the corners of the markers of {instruments} are counted in another order: with {order}, the error of most points falls from "
    "{stated:.3g} to {left:.3g}",
    "Number the corners of {files} so: {order}. Corner 0 is the upper left one, then clockwise, as the marker is printed.",
)
TARGET_UNIT = declare(
    "target-unit",
    "the target of {instruments} is stated {factor:.4g} times its size ({meant}): with that undone, the error of most points falls from "
    "{stated:.3g} to {left:.3g}",
    "State the size, or the points, of {files} in the unit of the file.",
)
UNITS = {  # by how much a size is too large that is read in one unit, and meant in another
    1000.0: "mm read as m", 1e-3: "m read as mm", 100.0: "cm read as m", 0.01: "m read as cm", 10.0: "mm read as cm",
    0.1: "cm read as mm", 1 / 0.0254: "inches read as m", 1 / 25.4: "inches read as mm", 25.4: "mm read as inches",
}  # fmt: skip
# Nobody prints so wrongly: half way, in logarithms, to the smallest of these factors.
FAR = 0.5 * math.log(10.0)  # tolerance: see above
SAME = 1e-9  # tolerance: m, of a square's half edge
Change = tuple[str, Callable[[Observations], Observations], Mapping[str, Number]]


def target_changes(some: Sequence[Observations]) -> Iterator[Change]:
    """Each change with the code of its finding and its numbers."""
    for factor, meant in UNITS.items():
        yield TARGET_UNIT, partial(_scale, factor=factor), {"factor": factor, "meant": meant}
    if not all(_square(o) for o in some):
        return
    for reverse in (True, False):
        for turns in range(4):
            if reverse or turns:
                order = [(3 - k if reverse else k) for k in np.roll(np.arange(4), turns).tolist()]
                words = ", ".join(map(str, order)) + " in place of 0, 1, 2, 3"
                yield CORNERS_REORDERED, partial(_reorder, order=tuple(order)), {"order": words}


def seem_of_other_unit(data: DataSet, problem: Problem, x: Array) -> bool:
    """Whether a print is so far from its size at x (1, P) that no printer makes it."""
    sizes = {size_of_print(o) for o in data.observations if o.kind == "pixels"} & set(problem.table.names)
    found = [float(x[0, problem.table.index[n]]) for n in sizes]
    return any(v <= 0 or abs(math.log(v)) > FAR for v in found)


def as_printed(obs: Observations) -> Observations:
    """The same with a print as large as stated: a size that is free would take up whatever factor is tried."""
    return replace(obs, options={k: v for k, v in obs.options.items() if k != "print"})


def _scale(obs: Observations, factor: float) -> Observations:
    """The points of targets that are stated a factor too large."""
    return replace(obs, extra={**obs.extra, "point": obs.extra["point"] / factor})


def _corner(point: Array) -> Array:
    """Which corner of a square points (k, 3) are: upper left, then clockwise."""
    x, y = point[:, 0] > 0, point[:, 1] > 0
    return np.where(y, np.where(x, 1, 0), np.where(x, 2, 3))


def _square(obs: Observations) -> bool:
    """Whether all points are corners of squares about the origins of their targets."""
    p = obs.extra["point"]
    return bool(len(p) and (np.abs(np.abs(p[:, 0]) - np.abs(p[:, 1])) < SAME).all() and (np.abs(p[:, 0]) > SAME).all())


def _reorder(obs: Observations, order: tuple[int, ...]) -> Observations:
    """Corner k of the file is corner order[k] of the marker."""
    point = np.array(obs.extra["point"])
    half = np.abs(point[:, :1])
    signs = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    point[:, :2] = half * signs[np.array(order)[_corner(point)]]
    return replace(obs, extra={**obs.extra, "point": point})

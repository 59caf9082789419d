"""A map of the workspace: how wrong the nominal model is there, and how well the corrected one is known.

Configurations are drawn at random; those whose tool lies in a slice (one cell thick) by joint values and geometry alone fill
its cells. In every cell two means over its configurations: the distance between the nominal prediction (base and tool placed
best) and the corrected one, and the 95 % radius of the corrected one. Cells that no configuration reached stay empty.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.estimate.uncertainty import Total, radius
from robocal.fit.noise import median, quantile
from robocal.geometry import fits
from robocal.measure.machine import Mechanism
from robocal.measure.reach import places_by_joints, reach
from robocal.prove.place_bands import base_motion, parameters_of, predict, sample_joints

__all__ = ["AccuracyMap", "Slice", "accuracy_map"]

DRAWN = 240_000
ANCHORS = 2_000
ACROSS = 28  # cells along the longer side
MOST = 8_000  # configurations of a slice that are evaluated
GLANCE = 50
SHARE = 0.5  # percent cut off either end of the workspace: a few stretched arms must not set its size


@record
class Slice:
    """Cells of one slice: centre (c, 3) in base coordinates, error of the nominal model and 95 % radius of the
    corrected one (c,) in m, configurations in each (c,); `across` are the axes along u and v."""

    name: str
    across: tuple[int, int]
    side: float
    centre: Array
    error: Array
    band: Array
    count: Ints


@record
class AccuracyMap:
    """Slices of the workspace, and the region from which configurations were drawn."""

    slices: tuple[Slice, ...]
    region: str


def accuracy_map(
    nominal: Mechanism, corrected: Mechanism, total: Total, conditions: Mapping[str, float], measured: Array | None
) -> AccuracyMap:
    """Two slices: horizontal at the median height, and vertical through the axis of the base (y = 0).

    `nominal` has its tool where the baseline put it; `measured` (n, 2) is the measured range of every joint.
    """
    joints, region = sample_joints(corrected, measured, DRAWN, 0)
    place = places_by_joints(corrected, joints)
    anchor = joints[:ANCHORS]
    there, jac = reach(corrected, anchor, parameters_of(corrected, total), conditions)
    motion = base_motion(jac, there[:, :3, 3])
    t = fits.rigid(reach(nominal, anchor, (), conditions)[0][:, :3, 3], there[:, :3, 3])
    side = max(map(_extent, place.T)) / ACROSS
    rng = np.random.default_rng(1)
    slices = []
    for name, across, level in (("horizontal", (0, 1), median(place[:, 2])), ("vertical", (0, 2), 0.0)):
        normal = 3 - sum(across)
        inside = np.flatnonzero(np.abs(place[:, normal] - level) <= side / 2)
        if len(inside) > MOST:
            inside = np.sort(rng.choice(inside, MOST, replace=False))
        if not len(inside):
            continue
        q = joints[inside]
        before = reach(nominal, q, (), conditions)[0][:, :3, 3] @ t[:3, :3].T + t[:3, 3]
        after = predict(corrected, q, total, conditions, motion, turn=False)
        error = np.linalg.norm(before - after.pose[:, :3, 3], axis=1)
        band = radius(after.position, total.dof)
        cell = np.floor(place[inside][:, across] / side).astype(np.int64)
        # One number says a cell, and they are in the order of their rows.
        lowest, many = cell.min(axis=0), np.ptp(cell, axis=0) + 1
        number, where, count = np.unique((cell - lowest) @ [many[1], 1], return_inverse=True, return_counts=True)
        cells = lowest + np.stack(np.divmod(number, many[1]), axis=1)
        centre = np.full((len(cells), 3), level)
        centre[:, across] = (cells + 0.5) * side
        error, band = (np.bincount(where.ravel(), weights=v, minlength=len(cells)) / count for v in (error, band))
        slices.append(Slice(name, across, side, centre, error, band, count))
    return AccuracyMap(tuple(slices), region)


def _extent(values: Array) -> float:
    """How far (m,) extend without SHARE percent at either end."""
    return -_end(-values) - _end(values)


def _end(values: Array) -> float:
    """The SHARE percent quantile of (m,), by those up to what every GLANCE-th of them says of four times as many: quicker than by all."""
    share, some = SHARE / 100, np.sort(values[::GLANCE])
    low = values[values <= some[int(4 * share * len(some))]]
    return quantile(low, share * (len(values) - 1) / (len(low) - 1))

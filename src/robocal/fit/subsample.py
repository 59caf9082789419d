"""A part of many rows, for what is only a beginning: where frames stand about, how large the noise about is.

Everything that is told, decided or proven is asked of all rows afterwards, from there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal._types import Bools, Ints
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, freedom_of

__all__ = ["ENOUGH", "MANY", "subsample"]

MANY = 2000  # rows of one instrument and target: up to here all of them are taken at once
ENOUGH = 1000  # and so many of more
GOLDEN = 0.6180339887498949


def subsample(machine: Model, data: DataSet, configurations: Ints, enough: int = ENOUGH) -> tuple[DataSet, Ints]:
    """The data with `enough` of the used rows of some configurations where an instrument has more than twice as many of a target, spread
    over all of them, and only the configurations that these rows touch; and which of those are of the chosen ones.

    The same data where no instrument has so many or one has no row there, and where configurations have poses of their own, each
    of which needs its rows.
    """
    if freedom_of(machine) or all(len(o) <= 2 * enough for o in data.observations):
        return data, configurations
    chosen = np.zeros(len(data.configurations), dtype=bool)
    chosen[configurations] = True
    rows = [_rows(o, chosen) for o in data.observations]
    if all(len(r) <= 2 * enough for own in rows for r in own) or not all(any(len(r) for r in own) for own in rows):
        return data, configurations
    kept = [o.take(_some(own, enough)) for o, own in zip(data.observations, rows, strict=True)]
    ends = [e for o in kept for e in (o.configuration, o.second) if e is not None]
    touched, new = np.unique(np.concatenate(ends), return_inverse=True)
    parts = iter(np.split(new, np.cumsum([len(e) for e in ends])[:-1]))
    moved = (replace(o, configuration=next(parts), second=None if o.second is None else next(parts)) for o in kept)
    return DataSet(data.configurations.take(touched), tuple(moved)), np.flatnonzero(chosen[touched])


def _rows(obs: Observations, chosen: Bools) -> list[Ints]:
    """The rows of each target that count, in their order."""
    counts = chosen[obs.configuration] if obs.used is None else chosen[obs.configuration] & obs.used
    if obs.target is None:
        return [np.flatnonzero(counts)]
    return [np.flatnonzero(counts & (obs.target == t)) for t in np.unique(obs.target)]


def _some(rows: list[Ints], enough: int) -> Ints:
    """All rows of targets that have few, `enough` of the others. Who measures grids measures like places at equal distances:
    steps along the golden section fall in with no period."""
    k = np.arange(enough)
    step = (k + k * GOLDEN % 1.0) / enough
    taken = (own if len(own) <= 2 * enough else own[(step * len(own)).astype(np.int64)] for own in rows)
    return np.sort(np.concatenate(list(taken)))

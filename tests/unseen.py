"""Unseen measurements of a fit: its errors one by one, and its bands on other data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import Total
from robocal.fit.noise import NoiseGroup, apply_noise
from robocal.measure.base import Model
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.prove.bands import Bands, row_bands
from robocal.prove.folds import unseen
from robocal.prove.split import Split


def leave_one_out(
    problem: Problem, x: Array, configurations: Ints, unit: str = "m", label: Ints | None = None
) -> Array:
    """The error of every observation when its own configuration is left out of the fit: exact, non-linear, one batch.

    Configurations with the same `label` (U,), repeats of one place, are left out together. Returns (N,) in the order
    of `errors`, NaN for others than `configurations`.
    """
    label = np.arange(problem.configurations) if label is None else label
    chosen = np.zeros(problem.configurations, dtype=bool)
    chosen[configurations] = True
    every = np.unique(label[chosen])
    held = (label == every[:, None]) & chosen
    split = Split(held, ~held & chosen, tuple(map(str, every)), "leave-one-out")
    return unseen(problem, x, split, (unit,)).value[unit]


def bands_of_data(
    model: Model, data: DataSet, values: Mapping[str, float], total: Total, groups: Iterable[NoiseGroup]
) -> list[Bands]:
    """Bands of a data set that the fit has not seen: `values` by name are the identified ones, `groups` the noise as
    fitted (its tau joins the sigma that the data state)."""
    noisy = apply_noise(data, {(g.name, g.unit): g.tau for g in groups if g.tau > 0})
    made = build(model, noisy)
    made = made.with_table(made.table.with_values({n: v for n, v in values.items() if n in made.table}))
    return row_bands(made, made.start, total, np.arange(len(data.configurations)))

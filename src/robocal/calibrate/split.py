"""Which configurations are fitted and which are held out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from robocal.errors import ModelError
from robocal.measure.data import Configurations

__all__ = ["places", "stratified"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
NEAR = 2e-4  # rad or m, in every joint


def places(configurations: Configurations) -> Ints:
    """A number for every configuration, equal where the machine stood at the same place: repeats are held out together,
    or the fit would have seen them."""
    place = configurations.joints if configurations.joints is not None else configurations.start
    if place is None or not len(place):
        return np.arange(len(configurations))
    # Encoders jitter: what is nearer than NEAR is the same place.
    known = np.nan_to_num(place)
    near = cKDTree(known).query_pairs(NEAR, p=np.inf, output_type="ndarray")
    graph = coo_array((np.ones(len(near)), near.T), shape=(len(place), len(place)))
    label = connected_components(graph, directed=False)[1].astype(np.int64)
    # A configuration without joint values (two sockets a known distance apart) is a place of its own.
    unknown = np.flatnonzero(np.isnan(place).any(axis=1))
    label[unknown] = len(place) + np.arange(len(unknown))
    return np.unique(label, return_inverse=True)[1].ravel()


def stratified(configurations: Configurations, fraction: float, seed: int) -> tuple[Ints, Ints]:
    """Fit and held-out units: space is halved along its widest direction until a cell holds about 1 / fraction places,
    one of each is held out, with all of its repeats.

    So both sets cover the same joint space. Raises ModelError for a fraction outside [0, 0.5].
    """
    if not 0 <= fraction <= 0.5:
        raise ModelError("the held-out share must lie between 0 and 0.5", key="hold_out", found=fraction)
    everyone = np.arange(len(configurations))
    label = places(configurations)
    first = np.unique(label, return_index=True)[1]
    many = round(fraction * len(first))
    if many == 0:
        return everyone, everyone[:0]
    rng = np.random.default_rng(seed)
    place = configurations.joints if configurations.joints is not None else configurations.start
    if place is None:
        place = np.zeros((len(everyone), 1))
    place = np.nan_to_num(place)[first]
    spread = np.ptp(place, axis=0)
    place = place / np.where(spread > 0, spread, 1.0)
    cells = [np.arange(len(first))]
    while len(cells) < many:
        largest = max(range(len(cells)), key=lambda i: len(cells[i]))
        cell = cells.pop(largest)
        widest = int(np.argmax(np.ptp(place[cell], axis=0)))
        # Equal values keep a random order, so that no file order leaks into the split.
        order = np.lexsort((rng.random(len(cell)), place[cell, widest]))
        half = len(cell) // 2
        cells += [cell[order[:half]], cell[order[half:]]]
    chosen = [int(rng.choice(cell)) for cell in cells if len(cell)]
    held = everyone[np.isin(label, chosen)]
    return np.setdiff1d(everyone, held), held

"""Which configurations stood at the same place: repeats, that are held out together and that show what readings scatter by."""

from __future__ import annotations

import numpy as np
import scipy

from robocal._types import Array, Ints
from robocal.measure.data import Configurations

__all__ = ["NEAR", "places"]

NEAR = 2e-4  # tolerance: rad or m, in every joint


def places(configurations: Configurations, near: float = NEAR) -> Ints:
    """A number for every configuration, equal where the machine stood at the same place, no joint further than `near`
    (rad, m) away: repeats are held out together, or the fit would have seen them."""
    known: Ints | None = configurations.memo.get(("places", near))
    if known is None:
        known = configurations.memo["places", near] = _labels(configurations, near)
    return known.copy()


def _labels(configurations: Configurations, near: float) -> Ints:
    place = configurations.joints if configurations.joints is not None else configurations.start
    if place is None or not len(place):
        return np.arange(len(configurations))
    # Encoders jitter: what is nearer than that is the same place.
    known = np.nan_to_num(place)
    label = _chains(known, near)
    some = _loose(known, label, near)
    if len(some):
        pairs = some[scipy.spatial.cKDTree(known[some]).query_pairs(near, p=np.inf, output_type="ndarray")]
        graph = scipy.sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(len(place), len(place)))
        linked = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        label[some] = len(place) + linked[some]
    # Numbered by the first of each; one without joint values (two sockets a known distance apart) is a place of its own.
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    order = first[inverse.ravel()]
    unknown = np.flatnonzero(np.isnan(place).any(axis=1))
    order[unknown] = len(place) + np.arange(len(unknown))
    return np.unique(order, return_inverse=True)[1].ravel()


def _chains(place: Array, near: float) -> Ints:
    """A number for every row, equal at least where rows are linked by steps of at most `near` in every component: rows are parted
    wherever a component has a gap, until no gap is left."""
    label, count = np.zeros(len(place), dtype=np.int64), 0
    while True:
        for values in place.T:
            order = np.lexsort((values, label))
            gap = (np.diff(values[order]) > near * (1 + 1e-9)) | (np.diff(label[order]) > 0)
            label[order] = np.concatenate([[0], np.cumsum(gap)])
        if (now := int(label.max(initial=0))) == count:
            return label
        count = now


def _loose(place: Array, label: Ints, near: float) -> Ints:
    """Rows of those chains that are longer than one step, whose rows are to be linked one by one."""
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.append(True, np.diff(label[order]) > 0))
    rows = place[order]
    span = np.maximum.reduceat(rows, starts) - np.minimum.reduceat(rows, starts)
    wide = np.asarray((span > near).any(axis=1))
    return np.sort(order[wide[label[order]]])

"""The rigid motions of a map of markers as a whole: which they are, and what is left of an error without them.

A small motion (t, r) of the whole map moves marker i by v_i = t + r x p_i, w_i = r: the columns of G (6M, 6). Of an error e (6M,) of
all markers, the motion that brings their corners nearest to where they should be is taken off:

    e - G (G^T W G)^-1 G^T W e = P e,   W = C^T C,   C e the motions of all corners (12M,)

so that no marker is the reference, and metres are not compared with radians.
Source: Baarda, S-transformations and criterion matrices (1973).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import replace
from robocal._types import Array
from robocal.geometry import se3, so3
from robocal.vision.maps import MarkerMap

__all__ = [
    "corner_weights",
    "move_map",
    "project_covariance",
    "rigid_motions",
    "rigid_projector",
    "take_markers",
    "turn_covariance",
]


def rigid_motions(positions: Array) -> Array:
    """G (6M, 6): the motions (v, w) of markers at positions (M, 3) m, for a unit of each component of (t, r) about the map's origin."""
    count = len(positions)
    g = np.zeros((count, 6, 6))
    g[:, :3, :3] = g[:, 3:, 3:] = np.eye(3)
    g[:, :3, 3:] = -so3.skew(positions)
    return g.reshape(6 * count, 6)


def corner_weights(known: MarkerMap) -> Array:
    """W (M, 6, 6): the square of the motions of a marker's four corners, m^2, over its small motion (v, w)."""
    out = np.zeros((len(known.names), 6, 6))
    around = known.corners - known.vector[:, None, :3]
    turn = -so3.skew(around)  # (M, 4, 3, 3)
    out[:, :3, :3] = 4 * np.eye(3)
    out[:, :3, 3:] = turn.sum(axis=1)
    out[:, 3:, :3] = np.swapaxes(out[:, :3, 3:], -1, -2)
    out[:, 3:, 3:] = (np.swapaxes(turn, -1, -2) @ turn).sum(axis=1)
    return out


def rigid_projector(known: MarkerMap) -> Array:
    """P (6M, 6M), which takes the motion of the whole map out of small motions of its markers."""
    middle = known.vector[:, :3].mean(axis=0)
    g = rigid_motions(known.vector[:, :3] - middle)  # about the middle: the same motions, better conditioned
    weighted = (corner_weights(known) @ g.reshape(-1, 6, 6)).reshape(-1, 6)
    return np.asarray(np.eye(len(g)) - g @ np.linalg.solve(g.T @ weighted, weighted.T))


def project_covariance(known: MarkerMap, covariance: Array) -> Array:
    """The covariance (6M, 6M) in which no motion of the whole map is counted, P C P^T."""
    p = rigid_projector(known)
    out = p @ covariance @ p.T
    return np.asarray((out + out.T) / 2)


def turn_covariance(covariance: Array, rotation: Array) -> Array:
    """The covariance (6M, 6M) of the same small motions in axes that are turned by R (3, 3)."""
    count = len(covariance) // 6
    turn = np.kron(np.eye(2 * count), rotation)
    return np.asarray(turn @ covariance @ turn.T)


def move_map(known: MarkerMap, transform: Array) -> MarkerMap:
    """The same map in another frame: T_other_marker = T_other_map T_map_marker."""
    r = transform[:3, :3]
    turned = None if known.covariance is None else turn_covariance(known.covariance, r)
    sizes = known.size_covariance
    if sizes is not None:
        count = 6 * len(known.names)
        across = (sizes[:, :count].reshape(len(sizes), -1, 3) @ r.T).reshape(len(sizes), count)
        sizes = np.hstack([across, sizes[:, count:]])
    lens = known.lens
    if lens is not None:
        lens = replace(lens, across=(r @ lens.across.reshape(-1, 3, len(lens.known))).reshape(lens.across.shape))
    vector = se3.to_vector(transform @ known.poses)
    return replace(known, vector=vector, covariance=turned, size_covariance=sizes, lens=lens)


def take_markers(known: MarkerMap, names: Sequence[str]) -> MarkerMap:
    """The markers of these names, in this order."""
    at = [known.names.index(n) for n in names]
    rows = (6 * np.array(at)[:, None] + np.arange(6)).ravel()
    covariance = None if known.covariance is None else known.covariance[np.ix_(rows, rows)]
    sizes = known.size_covariance
    if sizes is not None:
        sizes = sizes[np.ix_(at, [*rows.tolist(), *(6 * len(known.names) + i for i in at)])]
    lens = known.lens
    if lens is not None:
        lens = replace(lens, across=lens.across[rows], edges=None if lens.edges is None else lens.edges[at])
    return replace(
        known, names=tuple(names), size=known.size[at], vector=known.vector[at], covariance=covariance, size_covariance=sizes,
        lens=lens,
    )  # fmt: skip

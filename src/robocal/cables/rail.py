"""A frame anchor on a rail: a = a_0 + g s d, with s what its carriage reads, g its gain and d the rail's direction, of length 1."""

from __future__ import annotations

import numpy as np

from robocal._types import Array

__all__ = ["RAIL", "by_rail", "offset"]

RAIL = ("carriage", "rail", "rx", "ry", "rz")  # reading and gain of the carriage, and the direction, of any length


def offset(rails: Array, carriage: Array | None = None) -> Array:
    """How far anchors (..., 3) are from the origins of their rails (..., 5), in the order of RAIL, where the carriages read (...) m, or
    where they are stated to stand."""
    size = np.linalg.norm(rails[..., 2:], axis=-1)
    reading = rails[..., 0] if carriage is None else carriage
    return np.asarray((rails[..., 1] * reading / np.where(size > 0, size, 1.0))[..., None] * rails[..., 2:])


def by_rail(rails: Array, along: Array, carriage: Array | None = None) -> Array:
    """Derivatives (..., 5), in the order of RAIL, of a length that grows by `along` (..., 3) with its anchor; by the stated reading 0
    where carriages are read. The direction stays of length 1."""
    size = np.linalg.norm(rails[..., 2:], axis=-1, keepdims=True)
    d = rails[..., 2:] / np.where(size > 0, size, 1.0)
    reading = rails[..., 0] if carriage is None else carriage
    forward = (along * d).sum(axis=-1)
    turning = (rails[..., 1] * reading)[..., None] * (along - forward[..., None] * d) / np.where(size > 0, size, 1.0)
    by_reading = rails[..., 1] * forward if carriage is None else np.zeros_like(forward)
    return np.concatenate([by_reading[..., None], (reading * forward)[..., None], turning], axis=-1)

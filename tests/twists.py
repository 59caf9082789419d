"""Rigid motions from twists, for tests."""

from __future__ import annotations

import numpy as np

from robocal.geometry import se3, so3


def exp(twist: np.ndarray) -> np.ndarray:
    """The motion along a twist (v, w) (..., 6): R = exp(w), p = J_l(w) v."""
    p = (so3.left_jacobian(twist[..., 3:]) @ twist[..., :3, None])[..., 0]
    return se3.compose(so3.exp(twist[..., 3:]), p)

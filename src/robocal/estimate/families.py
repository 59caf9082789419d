"""Local blocks: poses and points of which there are many, each met by few rows, and eliminated block by block.

A problem has at most two families of them (the poses of the configurations, the targets that they see); a row touches at most
one block of each. Blocks are points (3 numbers in x) or frame vectors (6), and move in their tangent space.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import ModelError
from robocal.parameters import check_covariance

__all__ = ["Family", "LocalPrior"]

FRAME = 6  # numbers of a frame vector; a point has three, and does not turn
KEY = "prior of local blocks"
_THREE = np.array([3], dtype=np.int64)
_COLUMNS = np.array([[3, 4, 5]], dtype=np.int64)


@record(eq=False)
class LocalPrior:
    """Of every local block, around where it starts: root (L, l, l), R^T R the information; start (L, w), w = 3 for points and 6
    for frame vectors; axes (l,) the components that a block's step moves."""

    root: Array
    start: Array
    axes: tuple[int, ...]

    def rows(self, now: Array) -> tuple[Array, Array]:
        """R e (B, L, l) of every block at `now` (B, L, w) and its slope (B, L, l, l): whitened rows like any others."""
        from robocal.geometry import so3

        e = np.asarray(now - self.start)
        slope = np.broadcast_to(np.eye(e.shape[-1]), (*e.shape, e.shape[-1])).copy()
        if e.shape[-1] == FRAME:
            e[..., 3:] = so3.log(so3.exp(now[..., 3:]) @ np.swapaxes(so3.exp(self.start[:, 3:]), -1, -2))
            slope[..., 3:, 3:] = so3.left_jacobian_inverse(e[..., 3:])
        axes = np.array(self.axes, dtype=np.int64)
        return np.einsum("lij,blj->bli", self.root, e[..., axes]), self.root @ slope[..., axes[:, None], axes]


@record(eq=False)
class Family:
    """Blocks of one kind: start (L, w), the components of each that a step moves, and what is known of each beforehand."""

    start: Array
    axes: tuple[int, ...]
    prior: LocalPrior | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", np.array(self.start, dtype=np.float64, order="C"))

    @property
    def count(self) -> int:
        """How many blocks, L."""
        return len(self.start)

    @property
    def width(self) -> int:
        """Numbers of a block in x, w."""
        return int(self.start.shape[1])

    @property
    def size(self) -> int:
        """Numbers of a step of one block, l."""
        return len(self.axes)

    def advance(self, values: Array, step: Array) -> Array:
        """Blocks (B, L w) after a step (B, L, l); rotation vectors move on the group."""
        from robocal.geometry._kernels import turn_vectors

        flat = np.ascontiguousarray(values).reshape(len(values) * self.count, self.width).copy()
        moved = np.zeros_like(flat)
        moved[:, self.axes] = step.reshape(len(flat), self.size)
        flat[:, :3] += moved[:, :3]
        if self.width == FRAME:
            turn_vectors(flat, _THREE, moved, _COLUMNS)
        return flat.reshape(len(values), -1)

    def with_prior(self, sigma: ArrayLike | None = None, covariance: ArrayLike | None = None) -> Family:
        """The same blocks with a prior around their start: standard deviations (l,) or (L, l), infinite where nothing is known,
        or covariances (l, l) or (L, l, l), l components in the order of `axes`; from neither, none.

        Raises ModelError for another shape and for what is no covariance.
        """
        given = sigma if covariance is None else covariance
        if given is None:
            return replace(self, prior=None)
        shape = (self.size,) if covariance is None else (self.size, self.size)
        s = np.asarray(given, float)
        if s.shape not in (shape, (self.count, *shape)):
            expected = f"{shape} or {(self.count, *shape)}"
            raise ModelError("a prior of local blocks has another shape", key=KEY, found=s.shape, expected=expected)
        if covariance is not None:
            check_covariance(s, self.size, KEY)
            root = np.linalg.inv(np.linalg.cholesky(s))
        elif not (s > 0).all():
            raise ModelError("a prior of a local block must be above zero", key=KEY, found=float(s.min()))
        else:
            root = np.eye(self.size) / s[..., :, None]
        whole = np.broadcast_to(root, (self.count, self.size, self.size)).copy()
        return replace(self, prior=LocalPrior(whole, self.start, self.axes))

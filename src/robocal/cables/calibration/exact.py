"""The frame anchor and the zero of one cable from few poses, without a guess: all exact solutions.

A cable from a to the points s_j, where its platform anchor was, of which the sensor shows y_j = |s_j - a| - l0:

    |s_j|^2 - y_j^2 = 2 s_j . a + 2 y_j l0 - (|a|^2 - l0^2)

is linear in (a, l0, c), c = |a|^2 - l0^2. As many poses as unknowns, five in space and four in a plane, give one solution; one pose
less leaves a line of them, on which c = |a|^2 - l0^2 is quadratic: two roots, or one where the other has a negative length. Points
in a plane (in space) or on a line leave an anchor and its mirror image however many there are, and are refused. The squares lose the
signs of the lengths: a root counts only if all y_j + l0 are positive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.errors import ModelError

__all__ = ["Exact", "exact", "flat"]

SHAPES = ("one point", "a line", "a plane")
FLAT = 1e-6  # of the extent of the points: a spread that is none
ROUNDING = 1e-12  # of a coordinate
OPEN = 1e-10  # of the largest singular value: a direction that the equations leave open


@dataclass(frozen=True, eq=False)
class Exact:
    """All solutions: frame anchors (r, 3) and zeros (r,)."""

    anchors: Array
    zeros: Array


def flat(points: ArrayLike, axes: Sequence[int] = (0, 1, 2)) -> str | None:
    """What the points (n, 3) all lie in if they tell no anchor in the `axes` from its mirror image: one point, a line or (in space)
    a plane; None where they spread in every direction."""
    s = np.asarray(points, float)[:, list(axes)]
    spread = np.linalg.svd(s - s.mean(axis=0), compute_uv=False)
    rank = int((spread > max(FLAT * spread[0], ROUNDING * np.abs(s).max())).sum())
    return SHAPES[rank] if rank < len(axes) else None


def exact(
    points: ArrayLike, readings: ArrayLike, axes: Sequence[int] = (0, 1, 2), at: ArrayLike = (0.0, 0.0, 0.0)
) -> Exact:
    """All frame anchors and zeros with which a cable has exactly the lengths that were read.

    points (n, 3) in m: the platform anchor at every pose; readings (n,) in m; axes: the components of the frame anchor that are
    sought, the others are those of `at` (3,). From len(axes) + 2 poses on (fewer exact equations than rows: in the least-squares
    sense of the squares) there is one solution, from len(axes) + 1 there are two, one or none. Raises ModelError for fewer poses,
    and for points that lie in a plane, on a line or in one place.
    """
    s, y, fixed = np.asarray(points, float), np.asarray(readings, float), np.asarray(at, float)
    sought = list(axes)
    if len(s) < len(sought) + 1:
        raise ModelError(
            "too few poses for an anchor and a zero", found=len(s), expected=f"{len(sought) + 1} or more poses"
        )
    what = flat(s, sought)
    if what is not None:
        raise ModelError(
            f"the platform anchor of a cable stays in {what}: its frame anchor and the mirror image fit alike",
            expected="poses that move it in every direction",
        )
    other = [i for i in range(3) if i not in sought]
    middle, shift = s[:, sought].mean(axis=0), y.mean()
    p, d = s[:, sought] - middle, y - shift
    size = np.abs(p).max()
    # Unknowns in units of `size`, from the middle of the points and of the readings.
    p, d, across = p / size, d / size, ((s[:, other] - fixed[other]) ** 2).sum(axis=1) / size**2
    rows = np.column_stack([2 * p, 2 * d, -np.ones(len(p))])
    right = (p**2).sum(axis=1) + across - d**2
    u, sigma, vt = np.linalg.svd(rows, full_matrices=True)
    kept = int((sigma > OPEN * sigma[0]).sum())
    if kept < len(sought) + 1:
        raise ModelError(
            "the poses do not tell an anchor and a zero",
            found=f"{kept} independent equations",
            expected=len(sought) + 1,
        )
    base = vt[:kept].T @ ((u[:, :kept].T @ right) / sigma[:kept])
    roots = [base] if kept == rows.shape[1] else [base + t * vt[-1] for t in _on_cone(base, vt[-1])]
    found = [root for root in roots if (d + root[len(sought)] > 0).all()]
    anchors = np.tile(fixed, (len(found), 1))
    for anchor, root in zip(anchors, found, strict=True):
        anchor[sought] = middle + size * root[: len(sought)]
    return Exact(anchors, np.array([size * root[len(sought)] - shift for root in found]))


def _on_cone(base: Array, along: Array) -> list[float]:
    """Where base + t along meets c = |a|^2 - l0^2."""
    sign = np.ones(len(base) - 1)
    sign[-1] = -1.0
    x, v = base[:-1], along[:-1]
    two, one, none = (sign * v) @ v, 2 * (sign * x) @ v - along[-1], (sign * x) @ x - base[-1]
    if abs(two) <= 1e-14 * (abs(one) + abs(none)):
        return [] if one == 0 else [-none / one]
    under = one * one - 4 * two * none
    if under < 0:
        # A double root whose discriminant rounding made negative is still a root.
        return [-one / (2 * two)] if under > -1e-10 * one * one else []
    q = -0.5 * (one + np.copysign(np.sqrt(under), one))
    return [q / two] + ([none / q] if q != 0 and under > 0 else [])

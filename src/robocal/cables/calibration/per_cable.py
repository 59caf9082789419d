"""Every cable by itself, from poses that are taken as measured: frame anchor and zero.

    length    sum_j w_j (f_j |s_j - a| - (y_j + l0))^2              s_j = p_j + R_j b,  f_j = 1 / (1 + e t_j)
    squared   sum_j w_j ((f_j |s_j - a|)^2 - (y_j + l0)^2)^2        3.18 of the thesis behind `examples/cable-laval`

With poses as measured nothing joins the cables, and the problem of m cables is m problems of four numbers. The start solves the
squared equations exactly, so that no guess is needed: |s_j|^2 - y_j^2 = 2 s_j . a + 2 y_j l0 - (|a|^2 - l0^2) is linear in (a, l0, c),
with c the bracket. Points in a plane (in space) or on a line leave an anchor and its mirror image however many there are, and are
refused. The squared residual is here to be compared with: noise enters its slopes, and it errs by what does not fade with the number
of poses (`propagation.bias_of_squares`). Where cables run over pulleys, the straight ones are refined (`wrapped`).

Frame anchors and zeros of cables that run over pulleys: the straight ones refined, cable by cable.

    r_j = f_j l(T_j, a) - (y_j + l0),   f_j = 1 / (1 + e t_j),   l the length over the pulley

A pulley takes centimetres of length along; what a straight cable makes of them is near enough for Gauss and Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robocal._jit import as_kernel_array, as_kernel_indices
from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.cables.geometry import CableRobot, lengths
from robocal.errors import ModelError, require, require_one_of

__all__ = ["RESIDUALS", "CableFits", "flat", "per_cable"]

ROUNDS, END = 60, 1e-14
AX, L0 = 0, 6
SHAPES = ("one point", "a line", "a plane")
FLAT = 1e-6  # of the extent of the points: a spread that is none
ROUNDING = 1e-12  # of a coordinate


def flat(points: ArrayLike, axes: Sequence[int] = (0, 1, 2)) -> str | None:
    """What the points (n, 3) all lie in if they tell no anchor in the `axes` from its mirror image: one point, a line or (in space)
    a plane; None where they spread in every direction."""
    s = np.asarray(points, float)[:, list(axes)]
    spread = np.linalg.svd(s - s.mean(axis=0), compute_uv=False)
    rank = int((spread > max(FLAT * spread[0], ROUNDING * np.abs(s).max())).sum())
    return SHAPES[rank] if rank < len(axes) else None


def refine_over_pulleys(
    robot: CableRobot, t: Array, y: Array, share: Array, weight: Array, x: Array, axes: tuple[int, ...]
) -> tuple[Array, Array, Array, Bools]:
    """x (B, m, 4), cost (B, m), normal matrices (B, m, k, k) and whether each fit arrived (B, m).

    t (1 or B, n, 4, 4), y, share and weight (1 or B, n, m) as in `per_cable`; x (B, m, 4) is where the fit starts.
    """
    batch, m = x.shape[:2]
    sought = [*(AX + i for i in axes), L0]
    out, k = x.copy(), len(sought)
    cost, info, done = np.empty((batch, m)), np.empty((batch, m, k, k)), np.zeros((batch, m), dtype=np.bool_)
    poses = np.broadcast_to(t, (batch, *t.shape[1:]))
    for c in range(m):
        f, w, said = (np.broadcast_to(v, (batch, *v.shape[1:]))[..., c] for v in (share, weight, y))
        numbers = np.concatenate([out[:, c, :3], np.tile(robot.b[c], (batch, 1)), out[:, c, 3:]], axis=1)
        for turn in range(ROUNDS):
            length, _, slope = lengths(poses, numbers, robot.pulley(c))
            zero = numbers[:, None, L0]
            r = np.where(w > 0, f * (length + zero) - zero - said, 0.0)
            j = f[..., None] * slope[..., sought]
            j[..., -1] = -1.0
            normal = np.einsum("bn,bni,bnj->bij", w, j, j)
            step = -np.linalg.solve(normal, np.einsum("bn,bni,bn->bi", w, j, r)[..., None])[..., 0]
            cost[:, c], info[:, c] = 0.5 * (w * r * r).sum(axis=1), normal
            numbers[:, sought] += step
            done[:, c] = np.abs(step).max(axis=1) < END * np.abs(numbers).max(axis=1) + END
            if turn and done[:, c].all():
                break
        done[:, c] |= np.abs(step).max(axis=1) < 1e-9
        out[:, c] = numbers[:, [0, 1, 2, L0]]
    return out, np.asarray(cost), np.asarray(info), done


RESIDUALS = ("length", "squared")


@record(eq=False)
class CableFits:
    """Of B lists: frame anchors (B, m, 3) and zeros (B, m) in m, half the weighted sum of squares (B, m), iterations (B, m), whether
    each fit arrived (B, m), and the normal matrices (B, m, k, k) over the `axes` of the anchor and the zero; `numbers` (B, m) were
    read of each cable."""

    anchors: Array
    zeros: Array
    cost: Array
    iterations: Ints
    converged: Bools
    normal: Array
    axes: tuple[int, ...]
    numbers: Ints

    @property
    def covariance(self) -> Array:
        """Of the sought components of the anchor and of the zero, (B, m, k, k): with the sigma that was stated, or with what the
        residuals leave where none was (weights of one)."""
        return np.asarray(np.linalg.inv(self.normal))

    @property
    def left(self) -> Array:
        """What the residuals say of the sigma that was stated, of 1 m where none was: sqrt(2 cost / (n - k)), (B, m)."""
        k = len(self.axes) + 1
        return np.asarray(np.sqrt(2 * self.cost / np.where(self.numbers > k, self.numbers - k, np.nan)))


def per_cable(
    robot: CableRobot,
    poses: ArrayLike,
    readings: ArrayLike,
    *,
    sigma: ArrayLike = 1.0,
    tensions: ArrayLike | None = None,
    residual: str = "length",
    start: ArrayLike | None = None,
) -> CableFits:
    """Frame anchors and zeros of every cable of `robot` from poses and what its sensors showed.

    poses (n, 4, 4), or of every list (B, n, 4, 4), T_base_platform in m; readings (n, m) or (B, n, m) in m, NaN where none was taken;
    sigma of a reading in m, a number or one of each cable (m,); tensions (n, m) or (B, n, m) in N, under which the robot's cables
    stretch (default: they do not); start (m, 4) or (B, m, 4), anchor and zero (default: none is needed).
    What the robot cannot reach by its degrees of freedom (y of a planar xz robot) stays as the robot has it. Raises ModelError for
    shapes that do not fit, for an unknown residual and, without a start, for lists that do not tell an anchor from its mirror image.
    """
    from robocal.cables.calibration import _kernels as kernels

    require_one_of(residual, RESIDUALS, "unknown residual")
    modelled = residual == "length" or robot.pulleys is None
    require(modelled, "the squared residual is of straight cables", found="pulleys", expected="residual='length'")
    t, y = _lists(poses, 4, "poses"), _lists(readings, 3, "readings")
    m = len(robot.cables)
    paired = y.shape[1:] == (t.shape[1], m) and len({len(t), len(y), 1}) <= 2
    found, expected = (
        f"{t.shape[:2]} poses, readings {y.shape}",
        "as many rows of readings as poses, a column per cable",
    )
    require(paired, "poses and readings do not belong together", found=found, expected=expected)
    read = np.isfinite(y)
    weight = read / np.broadcast_to(np.asarray(sigma, float), (m,)) ** 2
    strain = np.zeros((1, *y.shape[1:]))
    if tensions is not None:
        strain = _lists(tensions, 3, "tensions") * robot.need("elasticity")
    batch, axes = max(len(t), len(y)), tuple(i for i in robot.axes if i < 3)
    x = np.empty((batch, m, 4))
    x[:] = np.column_stack([robot.a, robot.zeros]) if start is None else np.asarray(start, float)
    k = len(axes) + 1
    cost, info = np.empty((batch, m)), np.empty((batch, m, k, k))
    count, reason = np.zeros((batch, m), dtype=np.int64), np.zeros((batch, m), dtype=np.int64)
    kind: Any = kernels.SQUARED if residual == "squared" else kernels.LENGTH
    at, b, said, stretch, heavy = as_kernel_array(t, robot.b, np.where(read, y, 0.0), strain, weight)
    sought = as_kernel_indices(np.array(axes))
    kernels.fit_cables(kind, at, b, said, stretch, heavy, sought, start is not None, x, cost, count, reason, info)
    lost = np.argwhere(reason == kernels.DEGENERATE)
    if start is None and len(lost):
        _refuse(robot, t, read, axes, *lost[0])
    numbers, arrived = np.broadcast_to(read.sum(axis=1), (batch, m)), reason == kernels.SETTLED
    if robot.pulleys is not None:
        share = 1 / (1 + strain)
        x, cost, info, arrived = refine_over_pulleys(robot, t, np.where(read, y, 0.0), share, weight, x, axes)
    return CableFits(x[..., :3], x[..., 3], cost, count, arrived, info, axes, numbers)


def _lists(array: ArrayLike, rank: int, what: str) -> Array:
    out = np.asarray(array, float)
    expected = "(n, ...) or of every list (B, n, ...)"
    require(out.ndim in (rank - 1, rank), f"the {what} have another shape", found=out.shape, expected=expected)
    return out if out.ndim == rank else out[None]


def _refuse(robot: CableRobot, t: Array, read: Bools, axes: tuple[int, ...], at: int, cable: int) -> None:
    """Says why the list `at` does not tell the anchor of a cable."""
    some = read[at if len(read) > 1 else 0][:, cable]
    pose = t[at if len(t) > 1 else 0][some]
    name, enough = robot.cables[cable], len(axes) + 2
    few, expected = "too few poses for a start without a guess", f"{enough} or more"
    require(len(pose) >= enough, few, key=name, found=len(pose), expected=expected)
    what = flat(pose[:, :3, 3] + pose[:, :3, :3] @ robot.b[cable], axes)
    said = "does not move enough" if what is None else f"stays in {what}"
    raise ModelError(
        f"the platform anchor of {name} {said}: its frame anchor and the mirror image fit alike", key=name,
        expected="poses that move it in every direction, or a start",
    )  # fmt: skip

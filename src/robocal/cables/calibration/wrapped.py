"""Frame anchors and zeros of cables that run over pulleys: the straight ones refined, cable by cable.

    r_j = f_j l(T_j, a) - (y_j + l0),   f_j = 1 / (1 + e t_j),   l the length over the pulley

A pulley takes centimetres of length along; what a straight cable makes of them is near enough for Gauss and Newton's method.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.cables.geometry import CableRobot, lengths

__all__ = ["refine_over_pulleys"]

ROUNDS, END = 60, 1e-14
AX, L0 = 0, 6


def refine_over_pulleys(
    robot: CableRobot, t: Array, y: Array, share: Array, weight: Array, x: Array, axes: tuple[int, ...]
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
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

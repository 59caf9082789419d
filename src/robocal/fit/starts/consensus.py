"""Camera and target as most views have them, whatever the others show: least trimmed squares of Y_i = T_t T_i X.

    q_k = quantile over i of |r_ik|,    d_i^2 = sum_k (|r_ik| / q_k)^2        r_i1 shift (m), r_i2 turn (rad)

Each of many sets of three views gives (T_t, X). Of those with the least q_1 q_2 the views of the least d are fitted again, and again,
until the best is left. A flat target has two poses that look alike: its normal n, or n mirrored at the line of sight v,
n' = 2 (n v) v - n. A view that is far, and of which the other pose fits, was given the wrong one of both.
Sources: Rousseeuw and Van Driessen, Computing LTS regression for large data sets (1999); Schweighofer and Pinz, IEEE T-PAMI 28 (2006).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array, Bools
from robocal.fit.starts.frames import hand_eye, metre
from robocal.geometry import se3, so3

__all__ = ["agree", "find_flips", "other_pose", "views_near"]

SETS, KEPT, AGAIN = 80, 4, 3  # grid: sets of views, of which so many are fitted again, so often
SHARE = 0.4  # grid: of the views, that must agree: half of them may be wrong
MOST = 300  # grid: views that are looked at
LEAST = 3  # views that tell both frames; one more, and a metre too
FEWEST = 6  # views: of fewer, three that agree by chance are half
FAR = 6.0  # tolerance: times what views that agree miss: no noise goes so far
UNLIKE = 0.05  # tolerance: rad: no camera is off by so much at most views
NEARER = 0.25  # tolerance: of the turn of a view as it was given


def shorten(measured: Array, scale: float) -> Array:
    """Poses (m, 4, 4) of which a metre was read as `scale`."""
    out = np.array(measured)
    out[:, :3, 3] /= scale
    return out


Found = tuple[Array, Array, float]


def _fit(measured: Array, machine: Array, scaled: bool) -> Found:
    """T_t, X and what a metre is read as, of some views."""
    scale = metre(measured, machine) if scaled else 1.0
    return *hand_eye(shorten(measured, scale) if scaled else measured, machine), scale


def agree(measured: Array, machine: Array, scaled: bool = False) -> Found | None:
    """T_t and X with Y_i = T_t T_i X of views that agree, and what a metre is read as, which is to be found where `scaled`; Y and T
    (m, 4, 4); None of few views."""
    m = len(measured)
    if m < FEWEST:
        return None
    if m > MOST:
        some = np.linspace(0, m - 1, MOST).astype(np.int64)
        measured, machine, m = measured[some], machine[some], MOST
    rng = np.random.default_rng(0)
    count = max(LEAST, int(np.ceil(SHARE * m)))
    found = []
    for _ in range(SETS):
        few = rng.choice(m, LEAST + scaled, replace=False)
        one = _fit(measured[few], machine[few], scaled)
        found.append((_spread(one, measured, machine)[0], one))
    found.sort(key=lambda f: f[0])
    best = found[:KEPT]
    for _ in range(AGAIN):
        for k, (_, one) in enumerate(best):
            near = np.argsort(_spread(one, measured, machine)[1], kind="stable")[:count]
            again = _fit(measured[near], machine[near], scaled)
            best[k] = _spread(again, measured, machine)[0], again
    return min(best, key=lambda f: f[0])[1]


def _spread(found: Found, measured: Array, machine: Array) -> tuple[float, Array]:
    """q_1 q_2, and d^2 (m,)."""
    shift, turn = missed(found, measured, machine)
    q = [max(float(np.quantile(v, SHARE)), 1e-12) for v in (shift, turn)]
    return q[0] * q[1], (shift / q[0]) ** 2 + (turn / q[1]) ** 2


def missed(found: Found, measured: Array, machine: Array) -> tuple[Array, Array]:
    """How far T_t T_i X is from Y_i: shift (m,) in m, turn (m,) in rad."""
    away, hand, scale = found
    predicted = away @ machine @ hand
    shift = np.linalg.norm(predicted[:, :3, 3] - measured[:, :3, 3] / scale, axis=1)
    turn = np.linalg.norm(so3.log(predicted[:, :3, :3] @ np.swapaxes(measured[:, :3, :3], 1, 2)), axis=1)
    return shift, turn


def views_near(found: Found, measured: Array, machine: Array) -> Bools:
    """Which views (m,) are as near to T_t T_i X as noise goes; none where most turn by more than a camera's noise."""
    both = [(v, float(np.quantile(v, SHARE))) for v in missed(found, measured, machine)]
    (shift, far), (turn, turned) = both
    near: Bools = (shift <= FAR * far) & (turn <= FAR * turned) & (turned < UNLIKE)
    return near


def other_pose(seen: Array) -> Array:
    """T_camera_target (m, 4, 4) with the normal of the target mirrored at the line of sight to its origin."""
    n, v = seen[:, :3, 2], seen[:, :3, 3]
    v = v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12)
    away = np.cross(n, v)
    size = np.linalg.norm(away, axis=1, keepdims=True)
    # From n to v, and as far again.
    angle = 2 * np.arctan2(size, np.sum(n * v, axis=1, keepdims=True) * np.sign(np.sum(n * v, axis=1, keepdims=True)))
    axis = away / np.maximum(size, 1e-12) * np.sign(np.sum(n * v, axis=1, keepdims=True))
    return se3.compose(so3.exp(axis * angle) @ seen[:, :3, :3], seen[:, :3, 3])


def find_flips(seen: Array, machine: Array, in_hand: bool) -> Bools:
    """Which views T_camera_target (m, 4, 4), with the flange at machine (m, 4, 4), were given the other pose of a flat target."""
    out = np.zeros(len(seen), dtype=bool)
    measured, other = seen, other_pose(seen)
    if in_hand:
        measured, other = se3.inverse(measured), se3.inverse(other)
    found = agree(measured, machine)
    if found is None:
        return out
    turn, mirrored = (missed(found, y, machine)[1] for y in (measured, other))
    usual = float(np.quantile(turn, SHARE))
    out[:] = (usual < UNLIKE) & (turn > FAR * usual) & (mirrored < NEARER * turn)
    return out

"""Starts of instruments that see a frame.

    position:  y_i = R (p_i + R_i c) + t        linear in (R, R (x) c, t), then projected on rotations
    pose:      Y_i = T_t T_i X                  R_t^T R_Yi = R_i R_X is linear and homogeneous, then t and x are linear
    displacement:   y_i = R (p_j - p_i)         a rotation alone
    relative pose:  A_i X = X B_i               log A_i = R_X log B_i, then x is linear
    scale:          p_Yi / s = R_t p_i + R_t R_i x + t        linear in (1 / s, x, t)

Sources: Kabsch (1976); Andreff, Horaud, Espiau (1999) for the linear hand-eye form; Park and Martin (1994) for
A X = X B.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.fit.starts.target_rows import TargetRows, frame_values, start
from robocal.geometry import fits, se3, so3
from robocal.measure.bearing import directions
from robocal.measure.builder import offsets_of

__all__ = ["hand_eye", "point_start", "poses", "relative_hand"]

# tolerance: rad, and of the widest column: turns of the tool that are less say nothing of where a target is on it. A nominal robot's
# error of a millimetre would put it metres away.
TURNED = 1e-3
# tolerance: of the largest singular value: of turns about one axis the second smallest is as small as the noise.
ONE_AXIS = 0.05


def hand_eye(measured: Array, machine: Array) -> tuple[Array, Array]:
    """T_t and X with Y_i = T_t T_i X in the least-squares sense; Y and T (m, 4, 4), m >= 3."""
    ry, r = measured[:, :3, :3], machine[:, :3, :3]
    m = len(r)
    eye = np.eye(3)
    # vec (row-major) of R_t^T R_Y is (I (x) R_Y^T) vec(R_t^T), of R_i R_X is (R_i (x) I) vec(R_X).
    left = np.einsum("ij,mlk->mikjl", eye, ry).reshape(m, 9, 9)
    right = np.einsum("mij,kl->mikjl", r, eye).reshape(m, 9, 9)
    _, size, vt = np.linalg.svd(np.concatenate([left, -right], axis=2).reshape(-1, 18), full_matrices=False)
    a, b = vt[-1, :9].reshape(3, 3), vt[-1, 9:].reshape(3, 3)
    if np.linalg.det(a) < 0:
        a, b = -a, -b
    rt, rx = so3.project(a).T, so3.project(b)
    if size[-2] < ONE_AXIS * size[0]:
        # Turns about one axis leave more than one answer, and a mixture of answers is none.
        first, second = ry[0].T, r[0].T
        rt = so3.project(so3.log(ry @ first).T @ so3.log(r @ second))
        rx = second @ rt.T @ ry[0]
    turned, shift = rt @ r, measured[:, :3, 3] - machine[:, :3, 3] @ rt.T
    design = (turned - turned.mean(axis=0)).reshape(-1, 3)
    x = _told(design, (shift - shift.mean(axis=0)).ravel())
    return se3.compose(rt, (shift - turned @ x).mean(axis=0)), se3.compose(rx, x)


def point_start(points: Array, machine: Array, offset: bool = True) -> tuple[Array, Array]:
    """T_t and c with y_i = T_t (p_i + R_i c); points (m, 3), machine (m, 4, 4). Without `offset` (or with few poses) c
    is zero."""
    r, p = machine[:, :3, :3], machine[:, :3, 3]
    m = len(p)
    if not offset or m < 14:
        return fits.rigid(p, points), np.zeros(3)
    # y_k = sum_j R_kj p_j + sum_jl (R_kj c_l) R_i,jl + t_k: the same design matrix for every coordinate k. Of c, what no turn of the
    # tool tells is zero: from rounding alone it would be kilometres.
    design = np.concatenate([p, r.reshape(m, 9)], axis=1)
    s = np.linalg.lstsq(design - design.mean(axis=0), points - points.mean(axis=0), rcond=TURNED)[0].T
    rt = so3.project(s[:, :3])
    c = np.einsum("kj,kjl->l", rt, s[:, 3:12].reshape(3, 3, 3)) / 3
    return se3.compose(rt, (points - (p + r @ c) @ rt.T).mean(axis=0)), c


def relative_hand(machine: Array, measured: Array) -> Array:
    """X (4, 4) with A_i X = X B_i; A = machine, B = measured (m, 4, 4)."""
    a, b = so3.log(machine[:, :3, :3]), so3.log(measured[:, :3, :3])
    r = so3.project(np.einsum("mi,mj->ij", a, b))
    design = (machine[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    values = (measured[:, :3, 3] @ r.T - machine[:, :3, 3]).ravel()
    return se3.compose(r, _told(design, values))


def relative_metre(machine: Array, measured: Array) -> float:
    """What an instrument of which only changes B_i count, A_i X = X B_i (m, 4, 4), reads a metre as; 1 where nothing tells it."""
    r = relative_hand(machine, measured)[:3, :3]
    # (R_A - 1) x - R_X t_B / s = -t_A is linear in (x, 1 / s).
    ahead = (measured[:, :3, 3] @ r.T)[..., None]
    design = np.concatenate([ahead, np.eye(3) - machine[:, :3, :3]], axis=2).reshape(-1, 4)
    share = float(np.linalg.lstsq(design, machine[:, :3, 3].ravel(), rcond=TURNED)[0][0])
    return 1 / share if share > 0 else 1.0


def _told(design: Array, values: Array) -> Array:
    """A place on the tool (3,) from differences of turns (3 m, 3): along what they do not tell it is zero."""
    least = TURNED * np.sqrt(len(design) / 3)
    widest = float(np.linalg.norm(design, 2)) if len(design) else 0.0
    return np.asarray(np.linalg.lstsq(design, values, rcond=least / widest)[0] if widest > least else np.zeros(3))


# --- what the registry calls --------------------------------------------------------------------------------------------


@start("position", "spherical")
def _points(seen: TargetRows) -> list[dict[str, float]]:
    """An instrument that measured points in its own frame."""
    frame, v = seen.outside, seen.value
    if frame is None:
        return []
    points = v[:, :3] if seen.obs.kind == "position" else v[:, :1] * directions(v[:, 1:])
    out = []
    for offset in (True, False) if seen.loose else (False,):
        found, c = point_start(points, seen.at(seen.machine), offset)
        own = seen.shift_target(se3.compose(np.eye(3), c)) if offset else {}
        out.append(frame_values(frame.name, found) | own)
    return out


@start("displacement")
def _displacement(seen: TargetRows) -> list[dict[str, float]]:
    frame = seen.outside
    if frame is None or seen.other is None:
        return []
    moved = seen.at(seen.other)[:, :3, 3] - seen.points
    r = so3.project(np.einsum("mi,mj->ij", seen.value, moved))
    # Where the instrument stands is not seen, and keeps its stated value.
    return [frame_values(frame.name, se3.compose(r, frame.value[:3]))]


@start("relative_pose")
def _relative(seen: TargetRows) -> list[dict[str, float]]:
    if seen.other is None or not seen.loose:
        return []
    change, measured = se3.inverse(seen.at(seen.machine)) @ seen.at(seen.other), se3.from_vector(seen.value)
    owner = seen.obs.options.get("scale")
    if not owner:
        return [seen.shift_target(relative_hand(change, measured))]
    scale = relative_metre(change, measured)
    measured[:, :3, 3] /= scale
    return [seen.shift_target(relative_hand(change, measured)) | {f"{owner}.scale": scale}]


@start("pose")
def _pose(seen: TargetRows) -> list[dict[str, float]]:
    measured = se3.from_vector(seen.value)
    owner = seen.obs.options.get("scale")
    if not owner:
        return poses(seen, measured, seen.machine)
    # Where a reading is the inverse of what a camera in hand sees, all its lengths are as much too long.
    scale = metre(measured if seen.outside else se3.inverse(measured), seen.machine)
    measured[:, :3, 3] /= scale
    return [{**found, f"{owner}.scale": scale} for found in poses(seen, measured, seen.machine)]


def poses(seen: TargetRows, measured: Array, machine: Array) -> list[dict[str, float]]:
    """An instrument that measured poses of its target, (k, 4, 4), with the tool at machine (k, 4, 4)."""
    frame = seen.obs.frame
    if frame is None or not any(frame.free):
        return []
    if seen.outside is None:
        for offset in offsets_of(seen.obs):
            measured = se3.from_vector(offset.value) @ measured
        return _in_hand(seen, measured, machine)
    machine = seen.at(machine)
    out = []
    if seen.loose:
        found, shift = hand_eye(measured, machine)
        out.append(frame_values(frame.name, found) | seen.shift_target(shift))
    r = so3.project(np.einsum("mij,mkj->ik", measured[:, :3, :3], machine[:, :3, :3]))
    t = (measured[:, :3, 3] - machine[:, :3, 3] @ r.T).mean(axis=0)
    return [*out, frame_values(frame.name, se3.compose(r, t))]


def metre(measured: Array, machine: Array) -> float:
    """What an instrument with measured poses Y_i (m, 4, 4) of T_t T_i X reads a metre as; 1 where nothing tells it."""
    rt = hand_eye(measured, machine)[0][:3, :3]
    # p_Yi / s - R_t R_i x - t = R_t p_i is linear in (1 / s, x, t).
    turned = rt @ machine[:, :3, :3]
    ahead, way = (v - v.mean(axis=0) for v in (measured[:, :3, 3], machine[:, :3, 3] @ rt.T))
    design = np.concatenate([ahead[..., None], -(turned - turned.mean(axis=0))], axis=2).reshape(-1, 4)
    share = float(np.linalg.lstsq(design, way.ravel(), rcond=TURNED)[0][0])
    return 1 / share if share > 0 else 1.0


def _in_hand(seen: TargetRows, measured: Array, machine: Array) -> list[dict[str, float]]:
    """A camera in hand that measures poses of a target on the base: Y^-1 = T_base_target^-1 T_i X, hand-eye again."""
    frame, target = seen.obs.frame, seen.target
    assert frame is not None
    if frame.mount != "tool" or target is None or target.mount != "base":
        return []
    away, hand = hand_eye(se3.inverse(measured), machine)
    return [{**frame_values(frame.name, hand), **frame_values(target.name, se3.inverse(away))}]

"""Closed-form starts, so that nobody must guess where the instrument stands.

    position:  y_i = R (p_i + R_i c) + t        linear in (R, R (x) c, t), then projected on rotations
    pose:      Y_i = T_t T_i X                  R_t^T R_Yi = R_i R_X is linear and homogeneous, then t and x are linear

Every start is refined with frames and targets alone, all starts as one batch, and the cheapest is kept: a mirror or
local minimum would have to fool all of them. Sources: Kabsch (1976); Andreff, Horaud, Espiau (1999) for the linear
hand-eye form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.geometry import fits, se3, so3
from robocal.measure.data import DataSet, Frame, Observations
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["closed_form", "hand_eye", "point_start", "refine"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def hand_eye(measured: Array, machine: Array) -> tuple[Array, Array]:
    """T_t and X with Y_i = T_t T_i X in the least-squares sense; Y and T (m, 4, 4), m >= 3."""
    ry, r = measured[:, :3, :3], machine[:, :3, :3]
    m = len(r)
    eye = np.eye(3)
    # vec (row-major) of R_t^T R_Y is (I (x) R_Y^T) vec(R_t^T), of R_i R_X is (R_i (x) I) vec(R_X).
    left = np.einsum("ij,mlk->mikjl", eye, ry).reshape(m, 9, 9)
    right = np.einsum("mij,kl->mikjl", r, eye).reshape(m, 9, 9)
    v = np.linalg.svd(np.concatenate([left, -right], axis=2).reshape(-1, 18), full_matrices=False)[2][-1]
    a, b = v[:9].reshape(3, 3), v[9:].reshape(3, 3)
    if np.linalg.det(a) < 0:
        a, b = -a, -b
    rt, rx = so3.project(a).T, so3.project(b)
    design = np.concatenate([rt @ r, np.broadcast_to(eye, (m, 3, 3))], axis=2).reshape(-1, 6)
    values = (measured[:, :3, 3] - machine[:, :3, 3] @ rt.T).ravel()
    s = np.linalg.lstsq(design, values, rcond=None)[0]
    return se3.compose(rt, s[3:]), se3.compose(rx, s[:3])


def point_start(points: Array, machine: Array, offset: bool = True) -> tuple[Array, Array]:
    """T_t and c with y_i = T_t (p_i + R_i c); points (m, 3), machine (m, 4, 4). Without `offset` (or with few poses) c
    is zero."""
    r, p = machine[:, :3, :3], machine[:, :3, 3]
    m = len(p)
    if not offset or m < 14:
        return fits.rigid(p, points), np.zeros(3)
    # y_k = sum_j R_kj p_j + sum_jl (R_kj c_l) R_i,jl + t_k: the same design matrix for every coordinate k.
    design = np.concatenate([p, r.reshape(m, 9), np.ones((m, 1))], axis=1)
    s = np.linalg.lstsq(design, points, rcond=1e-10)[0].T
    rt = so3.project(s[:, :3])
    c = np.einsum("kj,kjl->l", rt, s[:, 3:12].reshape(3, 3, 3)) / 3
    return se3.compose(rt, (points - (p + r @ c) @ rt.T).mean(axis=0)), c


def closed_form(model: Chain, data: DataSet, obs: Observations, units: Ints) -> list[dict[str, float]]:
    """Starting values by name for the frame and the target of one instrument; empty where nothing is free or nothing
    is known."""
    if (
        obs.kind not in ("position", "pose")
        or data.configurations.joints is None
        or obs.frame is None
        or not any(obs.frame.free)
    ):
        return []
    posed = np.asarray(np.isfinite(data.configurations.joints).all(axis=1))[obs.configuration]
    index = np.flatnonzero(np.isin(obs.configuration, units) & posed)
    if obs.target is not None and len(index):
        # The most frequent target starts the frame; the others follow in the refinement.
        first = np.bincount(obs.target[index]).argmax()
        index = index[obs.target[index] == first]
    if len(index) < 3:
        return []
    machine = model.pose(data.configurations.joints, data.configurations.columns)[obs.configuration[index]]
    seen = obs.targets[0 if obs.target is None else int(first)] if obs.targets else None
    value = obs.value[index] if obs.value.ndim == 2 else obs.value[0, index]
    if obs.frame.mount != "base" or (seen is not None and seen.mount != "tool"):
        return _in_hand(obs, seen, value, machine)
    own = model.table
    held = np.eye(4) if seen is None else se3.from_vector(seen.value)
    loose = (seen is not None and any(seen.free)) or (
        seen is None and any(own[f"tool.{s}"].free for s in FRAME_SYMBOLS)
    )
    name = "tool" if seen is None else seen.name
    nominal = np.array([own[f"tool.{s}"].value for s in FRAME_SYMBOLS])
    starts = []
    for free_offset in (True, False) if loose else (False,):
        shift = np.eye(4)
        if obs.kind == "pose" and free_offset:
            frame, shift = hand_eye(se3.from_vector(value), machine @ held)
        elif obs.kind == "pose":
            moved = machine @ held
            r = so3.project(np.einsum("mij,mkj->ik", se3.from_vector(value)[:, :3, :3], moved[:, :3, :3]))
            frame = se3.compose(r, (value[:, :3] - moved[:, :3, 3] @ r.T).mean(axis=0))
        else:
            frame, c = point_start(value, machine @ held, free_offset)
            shift = se3.compose(np.eye(3), c)
        values = dict(zip((f"{obs.frame.name}.{s}" for s in FRAME_SYMBOLS), se3.to_vector(frame), strict=True))
        if free_offset:
            base = held if seen is not None else se3.from_vector(nominal)
            values.update(zip((f"{name}.{s}" for s in FRAME_SYMBOLS), se3.to_vector(base @ shift), strict=True))
        starts.append(values)
    return starts


def _in_hand(obs: Observations, seen: Frame | None, value: Array, machine: Array) -> list[dict[str, float]]:
    """A camera in hand that measures poses of a target on the base: Y^-1 = T_base_target^-1 T_i X, hand-eye again."""
    assert obs.frame is not None
    if obs.kind != "pose" or obs.frame.mount != "tool" or seen is None or seen.mount != "base":
        return []
    away, hand = hand_eye(se3.inverse(se3.from_vector(value)), machine)
    found = ((obs.frame.name, hand), (seen.name, se3.inverse(away)))
    return [{f"{n}.{s}": float(v) for n, t in found for s, v in zip(FRAME_SYMBOLS, se3.to_vector(t), strict=True)}]


def refine(problem: Problem, frames: tuple[str, ...], starts: list[dict[str, float]]) -> Array:
    """The best x (1, P) after fitting frames and targets from every start at once; the table's own values are one more
    start."""
    x = np.repeat(problem.start, len(starts) + 1, axis=0)
    for row, values in zip(x[1:], starts, strict=True):
        for name, value in values.items():
            # A held component keeps its stated value.
            if name in frames:
                row[problem.table.index[name]] = value
    if not frames:
        return x[:1]
    solution = least_squares(problem.with_free(frames), x)
    cost = np.where(np.isfinite(solution.cost), solution.cost, np.inf)
    return solution.x[[int(np.argmin(cost))]]


def frames_of(data: DataSet) -> dict[str, Frame]:
    """All instruments' frames and targets by name."""
    out: dict[str, Frame] = {}
    for obs in data.observations:
        for frame in (*((obs.frame,) if obs.frame else ()), *obs.targets):
            out.setdefault(frame.name, frame)
    return out

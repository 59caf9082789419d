"""Whether the target is as large as stated: the robot's poses know how long a metre is, and corners say it by the size of the target.

    q t_i = R_A (R_i t_B + t_i') + t_A,    z = |q - 1| / sigma

t_i and t_i' are the places of the target in the camera and of the flange; q, t_A, t_B and a small turn of A are free. Views that the rest
contradicts do not count.
"""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal.diagnose.vision_limits import TARGET_SIZE_LEFT, TARGET_SIZE_MATERIAL, TARGET_SIZE_SIGMA
from robocal.geometry import se3, so3
from robocal.measure.machine import Rig
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.corner_table import CAMERA
from robocal.session.vision.hand_eye_data import EYE, HandEyeData
from robocal.session.vision.hand_eye_errors import HandEyeErrors, chain_of, frame_of, middle_of

__all__ = ["contradict_size"]

ROUNDS, FAR = 4, 3.0  # grid: of fits without views that are so many medians off
UNKNOWN = 10  # numbers of the equations above
FEWEST = 6  # grid: views that tell a size


def contradict_size(opened: HandEyeData, made: Decision[Rig], errors: HandEyeErrors) -> tuple[Remark | None, bool]:
    """A target of another size than stated, where that puts it elsewhere by more than what is normal; and whether by more than the error
    that views which were left out show."""
    normal = errors.normal
    if opened.unknowns.with_size:
        return None, False
    where, seen = _with_lens(opened, made).target_views()
    if len(where) < FEWEST:
        return None, False
    a, b = chain_of(frame_of(made, EYE), frame_of(made, middle_of(made)[0]), opened.inhand)
    flange = opened.flange[where]
    machine = se3.inverse(flange) if opened.inhand else flange
    turn, there = a[:3, :3] @ machine[:, :3, :3], machine[:, :3, 3] @ a[:3, :3].T
    moved = there + turn @ b[:3, 3]
    eye = np.broadcast_to(np.eye(3), turn.shape)
    columns = np.concatenate([seen[:, :3, 3:], -turn, -eye, so3.skew(moved)], axis=2)
    kept = np.ones(len(where), dtype=bool)
    for _ in range(ROUNDS):
        x = np.linalg.lstsq(columns[kept].reshape(-1, UNKNOWN), there[kept].ravel(), rcond=None)[0]
        left = np.linalg.norm(columns @ x - there, axis=1)
        good = left <= FAR * np.median(left)
        if good.sum() < FEWEST or (good == kept).all():
            break
        kept = good
    rows, over = columns[kept].reshape(-1, UNKNOWN), 3 * int(kept.sum()) - UNKNOWN
    noise = float((left[kept] ** 2).sum()) / over
    if noise > normal**2:  # more is wrong than a size
        return None, False
    sigma = float(np.sqrt(noise * np.linalg.pinv(rows.T @ rows)[0, 0]))
    size, distance = float(x[0]), float(np.median(np.linalg.norm(seen[:, :3, 3], axis=1)))
    shift = abs(size - 1) * distance
    if abs(size - 1) < TARGET_SIZE_SIGMA * sigma or shift < TARGET_SIZE_MATERIAL * normal:
        return None, False
    z = abs(size - 1) / max(sigma, np.finfo(float).eps)
    stated = normal if errors.left_out is None else max(normal, errors.left_out.rms)
    said = Remark.of(Code.TARGET_SIZE_CONTRADICTED, factor=size, z=z, shift=Quantity(shift))
    return said, shift > TARGET_SIZE_LEFT * stated


def _with_lens(opened: HandEyeData, made: Decision[Rig]) -> HandEyeData:
    """The views through the lens as it was found: one that was given wrongly makes a target nearer, not larger."""
    if opened.lens is None:
        return opened
    obs, given = opened.observations, zip(opened.lens.kind.symbols, opened.lens.numbers, strict=True)
    numbers = tuple(made.values.get(f"{CAMERA}.{s}", v) for s, v in given)
    found = replace(obs, options={**obs.options, "intrinsics": numbers})
    return replace(opened, data=replace(opened.data, observations=(found,)))

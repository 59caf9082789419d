"""Torques of joints in a validation: whether friction and gravity tell more of them than their mean does."""

from __future__ import annotations

import numpy as np

from robocal.measure.data import DataSet
from robocal.prove.model_errors import Errors
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["torque_reasons"]

NO_BETTER = 0.9  # tolerance: of the error of the mean, as of positions


def torque_reasons(data: DataSet, found: Errors) -> list[Remark]:
    """That a model is no better than the mean torque of every joint, where it is not."""
    away = [
        np.abs(_others(obs.value[:, 0], obs.extra["joint"])) for obs in data.observations if obs.kind == "joint_torque"
    ]
    if not away or not len(found.torque):
        return []
    error, constant = float(found.torque.mean()), float(np.concatenate(away).mean())
    told = {"error": Quantity(error, "N m"), "constant": Quantity(constant, "N m")}
    return [Remark.of(Code.MEAN_AS_GOOD, **told)] if error >= NO_BETTER * constant else []


def _others(torque: np.ndarray, joint: np.ndarray) -> np.ndarray:
    """Torques (k,) less the mean of the others of the same joint."""
    out = np.array(torque)
    for j in np.unique(joint):
        mine = joint == j
        n = int(mine.sum())
        out[mine] = (torque[mine] - torque[mine].mean()) * (n / (n - 1) if n > 1 else 1.0)
    return out

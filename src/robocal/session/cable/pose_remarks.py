"""What is doubtful about poses from lengths: not found, not the only ones, or not explained."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.forward import Forward
from robocal.diagnose.limits import LENGTHS_UNLIKELY, LENGTHS_UNSTATED
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["pose_remarks"]


def pose_remarks(names: tuple[str, ...], found: Forward, sigma: float | None) -> Iterator[Remark]:
    """Poses that were not found, are not the only ones, or do not fit their lengths."""
    from scipy.stats import chi2

    spare = found.residual.shape[1] - found.covariance.shape[1]
    for i, name in enumerate(names):
        r = found.residual[i]
        if not np.isfinite(r).all():
            yield Remark.of(Code.NO_POSE, pose=name)
            continue
        if not found.converged[i]:
            yield Remark.of(Code.SEARCH_UNENDED, pose=name)
        if np.isnan(found.covariance[i]).any() and (sigma is not None or spare > 0):
            yield Remark.of(Code.SINGULAR_POSE, pose=name)
        if found.solutions[i] > 1:
            yield Remark.of(Code.SEVERAL_POSES, pose=name, count=int(found.solutions[i]))
        if sigma is not None and spare > 0 and chi2.sf((r @ r) / sigma**2, spare) < LENGTHS_UNLIKELY:
            rms = Quantity(float(np.sqrt((r @ r) / spare)))
            yield Remark.of(Code.LENGTHS_UNEXPLAINED, pose=name, left=rms, expected=Quantity(sigma))
        if sigma is None and (left := np.sqrt((r @ r) / len(r))) > LENGTHS_UNSTATED:
            yield Remark.of(Code.LENGTHS_LEFT, pose=name, left=Quantity(float(left)))

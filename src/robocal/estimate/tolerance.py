"""The greatest error that a model leaves, where iterations stop at one: max |y - h(x)| <= tolerance.

The error is that of a whole observation in m: of a position the distance, of a pose its place, of a range and angles the place that
they tell. Source: the identification algorithm of the RV-2AJ article, equation 14 (docs/references.md).
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError
from robocal.estimate.problem import Problem

__all__ = ["greatest_error"]


def greatest_error(problem: Problem, x: Array) -> Array:
    """The greatest error (B,), m, at x (B, P), of the readings that count. Raises ModelError where no reading is a length."""
    x = np.atleast_2d(x)
    worst, counted, lengths = np.zeros(len(x)), problem.in_use, False
    for rows in problem.residuals(x):
        for part, (_, _, unit) in enumerate(rows.parts):
            some = rows.used & counted[rows.configuration]
            if unit != "m" or not rows.reading or not some.any():
                continue
            lengths = True
            error = rows.length(part).reshape(len(x), -1)[:, some]
            worst = np.maximum(worst, error.max(axis=1))
    if not lengths:
        raise ModelError(
            "nothing that was measured is a length, so there is no error to stop at", key="tolerance",
            expected="no tolerance, or data with positions, poses, ranges or lengths",
        )  # fmt: skip
    return worst

"""What the digits of a file carry: the error that rounding alone leaves in what is predicted and measured.

    e_i^2 = sum_c h_ic^2 / 12 + sum_j |J_ij|^2 h_ij^2 / 12 + (8 eps |y_i|)^2

with h what one unit in the last digit means, of the components c of row i and of its joint values j, J the derivative of
the row by a joint, y what was measured. A number that is rounded to the nearest is off by h / sqrt(12), evenly spread. The
last part is what double precision leaves of a sum of lengths.

Digits say how exact numbers may be, never that they are wrong: joints that were commanded to whole degrees are exact. So
they are no floor of the noise, and are only asked where what is left lies below anything that an arm repeats.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate.evidence import errors
from robocal.calibrate.fit import Fit
from robocal.estimate.rows import Residuals
from robocal.measure.base import Rows
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet

__all__ = ["FINE", "WITHIN", "carried"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
FINE = 1e-5  # m: no arm repeats better, so what is left below is rounding, or numbers that were computed
WITHIN = 3.0  # times what the digits carry: still nothing but rounding
STEP = 1e-6  # rad or m
EPS = float(np.finfo(float).eps)


def carried(model: Chain, data: DataSet, found: Fit, told: Bools) -> float | None:
    """Root mean square over the told rows (N,), those with lengths as in `evidence.errors`, of what rounding leaves, in m;
    None where it is so coarse that nothing can be said."""
    x = found.solution.x
    made = found.problem
    here = made.residuals(x)
    size = max((float(np.abs(o.value[..., :3]).max(initial=0.0)) for o in data.observations), default=0.0)
    square = _written(data, made.terms, here) + (8 * EPS * max(size, 1.0)) ** 2
    joints, digits = data.configurations.joints, data.configurations.digits
    if joints is not None and digits is not None:
        for i in range(joints.shape[1]):
            moved = joints.copy()
            moved[:, i] += STEP
            there = build(model, replace(data, configurations=replace(data.configurations, joints=moved)))
            change = [replace(b, value=b.value - a.value) for a, b in zip(here, there.residuals(x), strict=True)]
            length, at = errors(change, "m")
            square += (length / STEP * digits[at, i]) ** 2 / 12
    level = float(np.sqrt(np.mean(square[told])))
    return level if level < FINE else None


def _written(data: DataSet, terms: tuple[object, ...], here: list[Residuals]) -> Array:
    """The squared error of the measured values themselves, (N,) as in `evidence.errors`; nothing where the file does not
    say them as they are compared."""
    out = []
    following = iter(zip(terms, here, strict=True))
    for obs in data.observations:
        taken = 0
        while taken < len(obs):
            term, rows = next(following)
            assert isinstance(term, Rows)
            taken += len(term.index)
            for start, stop, unit in rows.parts:
                if unit == "m":
                    h = np.zeros((len(term.index), 1)) if obs.digits is None else obs.digits[term.index, start:stop]
                    out.append(np.sum(h**2, axis=1) / 12)
    return np.concatenate(out)

"""The error of an observation: the length of its residual in metres (and, for poses, its angle in radians)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array, Ints
from robocal.estimate.terms import ProblemTerm, Residuals

__all__ = ["by_unit", "errors"]

Number = TypeVar("Number", bound=np.generic)


def errors(residuals: Sequence[Residuals], unit: str) -> tuple[Array, Ints]:
    """Length of the residual of every observation that has components in this SI unit: (N,) or (B, N), and its
    configuration (N,)."""
    values, configurations = [], []
    for r in residuals:
        for i, (_, _, u) in enumerate(r.parts):
            if u == unit:
                values.append(r.length(i))
                configurations.append(r.configuration)
    if not values:
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    return np.concatenate(values, axis=-1), np.concatenate(configurations)


def by_unit(terms: Sequence[ProblemTerm | Residuals], values: Sequence[NDArray[Number]], unit: str) -> NDArray[Number]:
    """What is known of the rows of every term, (m,) each, in the order of `errors`, (N,)."""
    out = [v for t, v in zip(terms, values, strict=True) for *_, u in t.parts if u == unit]
    return np.concatenate(out) if out else np.zeros(0, dtype=values[0].dtype if values else bool)

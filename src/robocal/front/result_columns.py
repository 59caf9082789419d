"""Results as columns and matrices: what data frames, numpy and editors take as it is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import ModelError, one_of

__all__ = ["Covariance", "ParameterColumns", "ResidualColumns", "parameter_columns", "residual_columns"]

NUMBERS = ("_mm", "_deg", "_px")  # how columns end that hold numbers


class ParameterColumns(TypedDict):
    """One entry per parameter in every list; numbers are in `unit`, that of the robot's file, and NaN where there is none."""

    name: list[str]
    unit: list[str]
    nominal: list[float]
    identified: list[float]
    delta: list[float]
    sigma: list[float]
    low: list[float]
    high: list[float]
    status: list[str]
    note: list[str]


class ResidualColumns(TypedDict, total=False):
    """One entry per measurement in every list, as in residuals.csv; columns that hold nothing are left out."""

    configuration: list[str]
    set: list[str]
    set_aside: list[str]
    group: list[str]
    kind: list[str]
    target: list[str]
    x_mm: list[float]
    y_mm: list[float]
    z_mm: list[float]
    before_mm: list[float]
    after_mm: list[float]
    held_out_mm: list[float]
    dx_before_mm: list[float]
    dy_before_mm: list[float]
    dz_before_mm: list[float]
    dx_after_mm: list[float]
    dy_after_mm: list[float]
    dz_after_mm: list[float]
    angle_before_deg: list[float]
    angle_after_deg: list[float]
    angle_held_out_deg: list[float]
    before_px: list[float]
    after_px: list[float]
    held_out_px: list[float]
    fingerprint: list[str]


@record(eq=False)
class Covariance:
    """The covariance (n, n) of parameters in SI: `matrix[i, j]` has the unit `units[i]` times `units[j]` (m, rad, ...).

    It holds what the parameters may be off by, those included that the data determine little.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    matrix: Array

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviations by name, in SI."""
        return dict(zip(self.names, np.sqrt(np.diag(self.matrix)).tolist(), strict=True))

    def of(self, *names: str) -> Array:
        """The matrix of these parameters, (k, k). Raises ModelError for a name that it lacks."""
        for name in names:
            if name not in self.names:
                raise ModelError(
                    "this covariance has no such parameter", argument="names", found=name, **one_of(name, self.names)
                )
        at = [self.names.index(name) for name in names]
        return np.asarray(self.matrix[np.ix_(at, at)])

    def __repr__(self) -> str:
        few = ", ".join(self.names[:6]) + (", ..." if len(self.names) > 6 else "")
        return f"Covariance of {len(self.names)} parameters in SI: {few}"


def parameter_columns(rows: Sequence[Any]) -> ParameterColumns:
    """The parameters of a result as columns."""
    ends = [r.interval or (math.nan, math.nan) for r in rows]
    return {
        "name": [r.name for r in rows],
        "unit": [r.unit for r in rows],
        "nominal": [_number(r.nominal) for r in rows],
        "identified": [_number(r.identified) for r in rows],
        "delta": [_number(r.delta) for r in rows],
        "sigma": [_number(r.sigma) for r in rows],
        "low": [_number(low) for low, _ in ends],
        "high": [_number(high) for _, high in ends],
        "status": [r.status for r in rows],
        "note": [r.note or "" for r in rows],
    }


def residual_columns(columns: Mapping[str, Sequence[Any]]) -> ResidualColumns:
    """The columns of residuals.csv, without those that hold nothing."""
    out: dict[str, list[Any]] = {}
    for name, values in columns.items():
        if name.endswith(NUMBERS):
            numbers = [_number(v) for v in values]
            if not all(map(math.isnan, numbers)):
                out[name] = numbers
        else:
            out[name] = ["" if v is None else str(v) for v in values]
    return out  # type: ignore[return-value]


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)

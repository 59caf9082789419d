"""Rows whose joints stand outside their limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.diagnose.check_registry import Finding, When, check, doubt
from robocal.diagnose.rows.table import TableContext
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import limits_of
from robocal.remarks.code import Code

__all__ = ["joint_limits", "outside"]

SLACK = 1e-9  # tolerance: rad or m; limits that were written in other units


@check("joint-limits", When.FILE, order=10, needs=("joints", "lines"))
def joint_limits(context: TableContext[Model]) -> Iterator[Finding]:
    """How many rows, which joints, and the first row."""
    assert context.joints is not None and context.lines is not None
    off = outside(context.joints, limits_of(context.model))
    rows = np.flatnonzero(off.any(axis=1))
    if len(rows):
        names = tuple(joints_of(context.model)[i].name for i in np.flatnonzero(off.any(axis=0)))
        first = int(context.lines[rows[0]])
        yield doubt(Code.OUTSIDE_LIMITS, file=context.file, rows=len(rows), joints=names, row=first)


def outside(q: Array, limits: Array) -> NDArray[np.bool_]:
    """Which joint values (m, n) lie outside limits (n, 2)."""
    return np.asarray((q < limits[:, 0] - SLACK) | (q > limits[:, 1] + SLACK))

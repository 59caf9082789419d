"""What a model and its measurements show before anything is fitted: parallel axes that the convention cannot tilt, identical poses,
joints that stand still, points of one plane, few numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.diagnose.check_registry import Context, Finding, Level, When, check, doubt, of_remarks
from robocal.diagnose.limits import NUMBERS_PER_PARAMETER, PLANE_POINTS, PLANE_THICKNESS
from robocal.geometry import fits
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["few_numbers", "flat_points", "geometry", "nothing_free", "still_joints"]

STILL = 1e-9  # tolerance: rad or m; values that were written and read again


@check("geometry", When.DATA, order=10)
def geometry(context: Context[Model]) -> Iterator[Finding]:
    """What the geometry of the machine shows."""
    moving = context.model.mechanism
    yield from () if moving is None else of_remarks(moving.remarks(), Level.DOUBT)


@check("still-joints", When.DATA, order=20, needs=("data",))
def still_joints(context: Context[Model]) -> Iterator[Finding]:
    """Joints that never move, or a machine that stands at one place."""
    q = context.need_data.configurations.joints
    q = None if q is None else q[np.isfinite(q).all(axis=1)]
    if q is None or len(q) < 2:
        return
    if np.ptp(q, axis=0).max(initial=0.0) < STILL:
        yield doubt(Code.ONE_PLACE)
        return
    still = [n for n, s in zip((j.name for j in joints_of(context.model)), np.ptp(q, axis=0), strict=True) if s < STILL]
    if still:
        yield doubt(Code.JOINTS_STILL, joints=tuple(still))


@check("flat-points", When.DATA, order=30, needs=("data",))
def flat_points(context: Context[Model]) -> Iterator[Finding]:
    """Measured points that lie in one plane."""
    freedom = freedom_of(context.model)
    if freedom is not None and not {0, 1, 2} <= set(freedom):
        return
    for obs in context.need_data.observations:
        if obs.kind not in ("position", "pose") or len(obs) < PLANE_POINTS or obs.value.ndim != 2:
            continue
        points = obs.value[:, :3] if obs.used is None else obs.value[obs.used, :3]
        if len(points) < PLANE_POINTS:
            continue
        extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        off = float(np.abs(fits.plane(points)[2]).max())
        if extent > 0 and off < PLANE_THICKNESS * extent:
            yield doubt(Code.ONE_PLANE, group=obs.label, off=Quantity(off))


@check("few-numbers", When.DATA, order=40, needs=("data",))
def few_numbers(context: Context[Model]) -> Iterator[Finding]:
    """Fewer than two measured numbers to a parameter."""
    numbers, parameters = context.numbers
    if numbers < NUMBERS_PER_PARAMETER * parameters:
        yield doubt(Code.FEW_MEASUREMENTS, numbers=numbers, parameters=parameters)


@check("nothing-free", When.DATA, order=50)
def nothing_free(context: Context[Model]) -> Iterator[Finding]:
    """A machine of which nothing may change: it can be looked at all the same. A rig has nothing that could."""
    if context.fit is None and context.model.table.rows and not context.model.table.free:
        yield doubt(Code.NOTHING_FREE)

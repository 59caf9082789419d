"""The machine as a picture shows it beside its measurements: lines in base coordinates, and where the instruments stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import field, record
from robocal._types import Array
from robocal.measure.builder import Builder
from robocal.measure.machine import Mechanism, Model, freedom_of
from robocal.prove.decision import Decision
from robocal.quantities import DisplayUnit, Value

__all__ = ["RobotShape", "ShapeLine", "shape_of", "shapes_of_rows"]

Extra: TypeAlias = "Mapping[str, ArrayLike] | None"
MOST = 300  # rows of a picture


@record(kw_only=True)
class ShapeLine:
    """A line through points (k, 3), or what stands at one point, by its name; the way along an arm has none."""

    name: str
    points: list[list[Value]]


@record(kw_only=True)
class RobotShape:
    """The corrected machine at a configuration near the middle of those that were measured, in base coordinates: `lines` from the base
    along the axes to the tool, or from platform to frame anchors; `tool` is where the tool or platform stands, `instruments` are
    those that have a frame."""

    unit: DisplayUnit = "m"
    configuration: str
    lines: list[ShapeLine]
    tool: list[Value]
    instruments: list[ShapeLine] = field(default_factory=list)


def shape_of(context: Decision[Model]) -> RobotShape | None:
    """The shape of what was identified; None of a model that has no place or nothing to show."""
    data, fit, moving = context.need_data, context.need_fit, context.corrected.mechanism
    c, x = data.configurations, fit.solution.x[:1]
    if moving is None:
        return None
    builder = Builder(context.model, fit.problem.table, c)
    one = np.array([_middle(context, x)])
    nothing = np.full(x.shape[1], -1, dtype=np.int64)
    tool = builder.tool(one).bind(nothing).pose(x, 0, 1)[0][0]
    joints = None if c.joints is None else c.joints[one]
    lines = moving.lines(joints, tool, {k: v[one] for k, v in c.columns.items()})
    found = [ShapeLine(name=n, points=points[0].tolist()) for n, points in lines.items() if np.isfinite(points).all()]
    if not found:
        return None
    seen = []
    for obs in {o.frame.name: o for o in data.observations if o.frame is not None}.values():
        carrier = builder.instrument(obs, one)
        if carrier is not None and obs.frame is not None:
            at = carrier.bind(nothing).pose(x, 0, 1)[0][0, 0, :3, 3]
            seen.append(ShapeLine(name=obs.frame.name, points=[at.tolist()]))
    name = c.ids[int(one[0])]
    return RobotShape(configuration=name, lines=found, tool=tool[0, :3, 3].tolist(), instruments=seen)


def shapes_of_rows(
    moving: Mechanism, names: Sequence[str], poses: Array, joints: Array | None = None, extra: Extra = None
) -> tuple[RobotShape, ...]:
    """The shape of a machine at rows with these names, where its tool or platform is at poses (m, 4, 4) and its joints at (m, n); rows
    whose pose is not known are left out, and of many some are taken, as evenly as can be."""
    known = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
    some = known[np.unique(np.linspace(0, len(known) - 1, min(MOST, len(known))).round().astype(int))]
    here = {k: np.broadcast_to(np.asarray(v, float), len(poses))[some] for k, v in (extra or {}).items()}
    found = moving.lines(None if joints is None else joints[some], poses[some], here)
    each = [(name, points.tolist()) for name, points in found.items()]
    return tuple(
        RobotShape(
            configuration=names[row],
            tool=poses[row, :3, 3].tolist(),
            lines=[ShapeLine(name=n, points=p[i]) for n, p in each],
        )
        for i, row in enumerate(some.tolist())
        if each
    )


def _middle(context: Decision[Model], x: Array) -> int:
    """The configuration whose joint values, or whose own pose, are nearest to the mean, each by its spread."""
    c, problem = context.need_data.configurations, context.need_fit.problem
    where = c.starts if c.joints is None else c.joints
    if freedom_of(context.model):
        first = len(problem.table)
        where = x[0, first : first + 6 * len(c)].reshape(-1, 6)
    spread = np.maximum(where.std(axis=0), 1e-9)
    return int(np.sum(((where - where.mean(axis=0)) / spread) ** 2, axis=1).argmin())

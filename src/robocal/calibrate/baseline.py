"""The baseline: the nominal model with instrument frames, targets and tool fitted, and nothing else of the robot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from robocal.arms.chain import Chain
from robocal.calibrate.fit import unit_weights
from robocal.calibrate.starts import search as starts
from robocal.estimate.identifiability import analyse
from robocal.estimate.problem import Problem
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["baseline", "frame_names"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Watch = Callable[[dict[str, object]], None]


def frame_names(model: Chain, problem: Problem) -> tuple[str, ...]:
    """The free parameters of the baseline: instruments' frames, targets, other kinds' parameters, and the tool."""
    tool = {f"tool.{s}" for s in FRAME_SYMBOLS}
    return tuple(n for n in problem.table.free if n not in model.table or n in tool)


def baseline(model: Chain, data: DataSet, units: Ints, watch: Watch | None = None) -> tuple[Problem, Array]:
    """The nominal model with frames and tool fitted to some units: the problem over all data (weights on those units)
    and x (1, P)."""
    made = build(model, data).with_weights(unit_weights(len(data.configurations), units))
    if watch:
        watch({"stage": "start"})
    frames = frame_names(model, made)
    candidates = starts.combined(model, data, units, made.with_free(frames))
    # What can be seen of the frames is asked where they are believed to stand, not at the table's zeros.
    there = made.with_table(made.table.with_values({n: v for n, v in candidates[0].items() if n in frames}))
    seen = analyse(there.with_free(frames), there.start) if frames else None
    return made, starts.refine(made, seen.kept if seen else (), [c for c in candidates if c])

"""Frames of the robot's file that say the same as frames of data files: tool and camera on one flange, base and world.

    T_flange_camera = T_flange_tool T_tool_camera,    T_world_base = T_world_foot T_foot_base

Measurements tell the product alone. Where both are free and nothing is known of either, one of them is a way to describe the other
and no quantity of its own: the robot's own frame is held where its file has it. A frame with a prior that informs is a quantity, and
stays free.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TypeVar

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.estimate.elimination import squares
from robocal.measure.base import kind_of
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Frame, same_rows
from robocal.measure.machine import Model, freedom_of
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["FixedFrame", "fix_frames", "frames_alone", "frames_of"]

M = TypeVar("M", bound=Model)
BODIES = ("tool", "base")  # what the robot's own frames are called, and what frames of data files are mounted on
SAME = 1e-6  # tolerance: of a column: what double precision leaves of one that others repeat


@record
class FixedFrame:
    """A frame of the robot's file that is held, the parameters of it that were free, and the free frames that say the same."""

    name: str
    parameters: tuple[str, ...]
    like: tuple[str, ...]


def frames_of(data: DataSet) -> dict[str, Frame]:
    """The frames of instruments, targets and places by name, in the order of their first mention."""
    found: dict[str, Frame] = {}
    for obs in data.observations:
        for frame in (*((obs.frame,) if obs.frame else ()), *obs.targets, *kind_of(obs).frames(obs)):
            found.setdefault(frame.name, frame)
    return found


def frames_alone(model: Model, free: Collection[str], data: DataSet) -> bool:
    """Whether the free parameters of a problem are those of frames of the data and of the tool, and no others but numbers of an
    instrument that are known to a prior, such as a lens, or are found with its frame; where poses are known, whatever is free."""
    if freedom_of(model) == ():
        return bool(free)
    mine = {p.name for f in (*frames_of(data).values(), Frame("tool")) for p in f.parameters}
    numbers = ((kind_of(obs).placed, p) for obs in data.observations for p in kind_of(obs).parameters(obs))
    known = {p.name for placed, p in numbers if placed or p.prior is not None}
    return not mine.isdisjoint(free) and (mine | known).issuperset(free)


def fix_frames(model: M, data: DataSet) -> tuple[M, tuple[FixedFrame, ...]]:
    """The model with those frames of its own fixed that look like free frames of the data, and which they are: of the same model and
    rows the same model again."""
    memo = data.configurations.memo
    known = memo.get("fixed frames")
    if known is None or known[0] is not model or not same_rows(known[1], data.observations):
        known = memo["fixed frames"] = model, data.observations, _fix(model, data)
    fixed: tuple[M, tuple[FixedFrame, ...]] = known[2]
    return fixed


def _fix(model: M, data: DataSet) -> tuple[M, tuple[FixedFrame, ...]]:
    held: list[FixedFrame] = []
    table = model.table
    if freedom_of(model) is not None or not table.free:
        return model, ()
    for body in BODIES:
        names = (f"{body}.{s}" for s in FRAME_SYMBOLS)
        own = [n for n in names if n in table and table[n].free and not table[n].prior_informs]
        near = {f.name: f for f in frames_of(data).values() if f.mount == body and any(f.free)} if own else {}
        others = {p.name: f.name for f in near.values() for p in f.parameters if p.free}
        if not others:
            continue
        alike, partners = _alike(model, data, own, list(others))
        if alike:
            held.append(FixedFrame(body, alike, tuple(dict.fromkeys(others[n] for n in partners))))
    if not held:
        return model, ()
    gone = {n for h in held for n in h.parameters}
    return model.with_table(table.with_free([n for n in table.free if n not in gone])), tuple(held)


def _alike(model: Model, data: DataSet, own: list[str], others: list[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Which of a frame's own parameters the others repeat wherever it stands, and which of the others do."""
    problem = build(model, data, free=[*own, *others])
    columns = squares(problem.with_loss("none"), problem.start).root
    at = {n: i for i, n in enumerate(problem.free)}
    first, second = columns[:, [at[n] for n in own]], columns[:, [at[n] for n in others]]
    share = np.linalg.lstsq(second, first, rcond=SAME**2)[0]
    size, missed = _lengths(first), _lengths(first - second @ share)
    alike = (size > 0) & (missed <= SAME * size)
    used = (np.abs(share[:, alike]) > SAME).any(axis=1)
    return tuple(n for n, a in zip(own, alike, strict=True) if a), tuple(
        n for n, u in zip(others, used, strict=True) if u
    )


def _lengths(columns: Array) -> Array:
    return np.asarray(np.linalg.norm(columns, axis=0))

"""Whether rows that seem to have moved are those where a joint is in another region: a load that bends it to its other side moves
what was measured as a knock would.

    m_j = -g dp / dq_j      the moment about joint j of a weight at the tool, g the direction of gravity

Either the sign of m_j, or the side of a value of q_j, is one on the rows that are off and the other on all others. A sign of m_j
says so by itself. A side of q_j says so where the joint crosses it twice at least: what crossing back does not undo has moved.

Other files that visit both regions decide, in whatever order: what bends goes with the region there too, what has moved does not.

    r + J dx + (J_t 1_off) d + (J_t 1_file) e + (J_t 1_region) b = noise,    b = d or b = 0

J_t are the columns of what seems to have moved, the first and the last products taken in this file and in another one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose import limits
from robocal.diagnose.segments.find import Segment
from robocal.estimate.problem import Problem
from robocal.fit.noise import owners
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Mechanism, Model
from robocal.measure.reach import names_of, places_by_joints
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["find_joint"]

STEP = 1e-4  # rad, m: a difference beside which curvature is nothing


def find_joint(
    model: Model, data: DataSet, segment: Segment, others: Sequence[Segment], problem: Problem, x: Array
) -> str | None:
    """The joint that is in another region on the rows of a segment, with those of the `others` of its file; None where none is, or where
    other files over both regions say that something moved. `problem` at x (1, P) has what was fitted."""
    obs = next((o for o in data.observations if (o.label, o.source) == (segment.group, segment.source)), None)
    q, machine = data.configurations.joints, model.mechanism
    if obs is None or q is None or machine is None or not names_of(model):
        return None
    rows = _rows(obs, segment)
    off = np.zeros(len(obs), dtype=bool)
    for s in others:
        if (s.group, s.source, s.cause, s.name) == (segment.group, segment.source, segment.cause, segment.name):
            off[s.first : s.last + 1] = True
    where, off = obs.configuration[rows], off[rows]
    if not np.isfinite(q[where]).all():
        return None
    crossings = int(np.count_nonzero(off[1:] != off[:-1]))
    for name, region, by_moment in _regions(machine, q, where, off):
        bends = _bends_elsewhere(data, segment, (obs, where[off]), region, problem, x)
        if bends or (bends is None and (by_moment or crossings > 1)):
            return name
    return None


def _regions(machine: Mechanism, q: Array, where: Ints, off: Bools) -> Iterator[tuple[str, Bools, bool]]:
    """Joints of which a region holds the rows `where` (k,) that are `off` (k,) and no others, with all configurations (U,) that are in
    it, and whether a moment says so."""
    for j, name in enumerate(names_of(machine)):
        moved = np.zeros(q.shape[1])
        moved[j] = STEP
        rise = -(places_by_joints(machine, q + moved) - places_by_joints(machine, q - moved)) @ np.array(
            machine.gravity
        )
        for value, at, by_moment in ((rise, 0.0, True), (q[:, j], _middle(q[where, j], off), False)):
            if _apart(value[where], off, at):
                above = value > at
                yield name, above if np.mean(above[where[off]]) > 0.5 else ~above, by_moment


def _bends_elsewhere(
    data: DataSet, segment: Segment, mine: tuple[Observations, Ints], region: Bools, problem: Problem, x: Array
) -> bool | None:
    """Whether what is off in a region of one file is off there in all other files too (it bends), or in none of them (it moved); None
    where they do not say. `mine` are the observations of the file and the configurations (k,) that are off."""
    here, off = mine
    columns = _columns(problem, segment, here)
    if not columns or len(data.observations) < 2 or problem.blocks:
        return None
    # What stands out most may be set aside already.
    problem = problem.with_terms([term.with_every_row() for _, term in owners(data, problem)])
    lin = problem.linearize(x)
    moves, first = lin.j[:, columns], 0
    own, region_of_file = np.zeros(len(lin.r), dtype=bool), np.zeros(len(lin.r), dtype=bool)
    files: list[Bools] = []
    for number, term in owners(data, problem):
        obs = data.observations[number]
        used = term.used & problem.in_use[term.configuration]
        count = int(used.sum()) * (term.sigma.shape[1])
        some = np.zeros(len(lin.r), dtype=bool)
        some[first : first + count] = True
        first += count
        inside = region[lin.configuration] & some
        if obs is here:
            own |= some & np.isin(lin.configuration, off)
        elif (
            (moves[some] != 0).any()
            and _visits(lin.configuration, inside)
            and _visits(lin.configuration, some & ~inside)
        ):
            files.append(some)
            region_of_file |= inside
    if not files:
        return None
    each = [moves * f[:, None] for f in files]
    step, again = moves * own[:, None], moves * region_of_file[:, None]
    left = [_left(np.hstack([lin.j, *each, v]), lin.r) for v in (step + again, step)]
    noise = _left(np.hstack([lin.j, *each, step, again]), lin.r) / max(len(lin.r) - lin.j.shape[1], 1)
    better = (left[1] - left[0]) / max(noise, 1e-300)
    return None if abs(better) < 2 * math.log(1 / limits.SEGMENT_CHANCE) else better > 0


def _columns(problem: Problem, segment: Segment, obs: Observations) -> list[int]:
    """The free columns of what seems to have moved: of targets, else of the instrument."""
    targets = [t.name for t in obs.targets if segment.name in ("", t.name)]
    frames = [obs.frame.name] if obs.frame is not None else []
    for names in (frames, []) if segment.cause == "instrument" else (targets, frames):
        free = [problem.free.index(c) for n in names for s in FRAME_SYMBOLS if (c := f"{n}.{s}") in problem.free]
        if free:
            return free
    return []


def _visits(configuration: Ints, rows: Bools) -> bool:
    """Whether rows of linearised observations stand at enough configurations."""
    return len(np.unique(configuration[rows])) >= limits.SEGMENT_ROWS


def _left(columns: Array, r: Array) -> float:
    """What columns leave of r, the sum of squares."""
    return float(np.sum((r - columns @ np.linalg.lstsq(columns, r, rcond=None)[0]) ** 2))


def _rows(obs: Observations, segment: Segment) -> Ints:
    """The rows of what moved, (k,): of one target, its own."""
    names = [t.name for t in obs.targets]
    if obs.target is None or segment.name not in names:
        return np.arange(len(obs))
    return np.flatnonzero(obs.target == names.index(segment.name))


def _middle(value: Array, off: Bools) -> float:
    """Between those that are off and the others."""
    return float(np.median(value[off]) + np.median(value[~off])) / 2 if off.any() and not off.all() else 0.0


def _apart(value: Array, off: Bools, at: float) -> bool:
    """Whether those that are off lie on one side of a value and the others on the other one, but for the few that are near it."""
    if not off.any() or off.all():
        return False
    above = float(np.mean(value[off] > at)), float(np.mean(value[~off] > at))
    return max(above) >= limits.REGION_SHARE and min(above) <= 1 - limits.REGION_SHARE

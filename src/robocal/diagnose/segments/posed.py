"""The same for a machine whose configurations have poses of their own: a row is a configuration, its pose projected out.

    B^T (r + J dx + E c) = noise,    B^T B = I,  B^T L = 0

r are all numbers that were measured at a configuration, L their columns of its pose, B a basis of what the pose does not touch: as
many numbers of equal noise as the readings are more than a pose needs. An instrument of which configurations have more or fewer
numbers, as a camera has, says of each pose what it says: Q^T r of L = Q R, as many numbers as a pose.

What may have moved: the place from which a sensor of the machine counts (a free number of it that its making does not leave, such as
the zero of a cable that slipped), all such places together (encoders that were switched on again), or the instrument.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose.limits import SEGMENT_COMPLETE
from robocal.diagnose.segments.row_sequence import Candidate, Parts, Plain, RowSequence, whiten_terms
from robocal.estimate.problem import Problem
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, sensor_zeros
from robocal.measure.rows import KINDS
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["ZERO", "ZEROS", "runs_of_poses"]

ZERO, ZEROS = "zero", "zeros"
FELT = 1e-9  # tolerance: of a number's own standard deviation: what is less is nothing


def runs_of_poses(machine: Model, problem: Problem, data: DataSet, x: Array) -> list[RowSequence]:
    """One run of all configurations in their order, at x (1, P); none where nothing may have moved."""
    zeros = [p for p in sensor_zeros(machine) if p in problem.free]
    seen = dict.fromkeys(o.frame.name for o in data.observations if o.frame)
    frames = {name: [f"{name}.{s}" for s in FRAME_SYMBOLS] for name in seen}
    wide = problem.with_free([*problem.free, *(s for symbols in frames.values() for s in symbols)])
    parts, sigma, r, j, local = _numbers_by_configuration(wide, data, x)
    size = local.shape[2]
    if r.shape[1] <= size or np.isfinite(sigma).mean() < SEGMENT_COMPLETE:
        return []
    beside = np.linalg.svd(local, full_matrices=True)[0][:, :, size:].swapaxes(1, 2)
    candidates = []
    own = _origin([o for o in data.observations if o.frame is None], data, len(r))
    asked = [(ZERO, p, [p], own) for p in zeros]
    if len(zeros) > 1:
        asked.append((ZEROS, "", list(zeros), own))
    for name, symbols in frames.items():
        origin = _origin([o for o in data.observations if o.frame is not None and o.frame.name == name], data, len(r))
        asked.append(("instrument", name, symbols, origin))
    for cause, name, symbols, origin in asked:
        plain = j[..., wide.column_of[[wide.table.index[s] for s in symbols]]]
        felt = np.flatnonzero(np.abs(plain).max(axis=(0, 1), initial=0.0) > FELT)
        if len(felt):
            candidates.append(
                Candidate(cause, name, beside @ plain[..., felt], Plain(plain[..., felt], sigma, parts), origin)
            )
    jac = beside @ j[..., wide.column_of[problem.index]]
    left = (beside @ r[..., None])[..., 0]
    whole = ((0, left.shape[1], "1"),)
    alone = np.ones(len(left)), np.arange(len(left))
    return [RowSequence(data.observations[0], np.ones_like(left), left, jac, tuple(candidates), whole, *alone)]


def _numbers_by_configuration(wide: Problem, data: DataSet, x: Array) -> tuple[Parts, Array, Array, Array, Array]:
    """All numbers of a configuration side by side, those of one unit together: parts, sigma and r (U, H), J (U, H, n), L (U, H, l).

    The last three are whitened, and zero where there is no number; sigma is infinite there.
    """
    count, size = wide.configurations, wide.sizes[0][1]
    blocks: dict[str, tuple[Array, ...]] = {}
    slot: dict[int, Ints] = {}
    for kind in dict.fromkeys(o.kind for o in data.observations):
        # Files of one kind share their columns: the same sensors, at other configurations.
        mine = [(i, o.configuration) for i, o in enumerate(data.observations) if o.kind == kind]
        slots, most = _slots(np.concatenate([c for _, c in mine]), count)
        ends = np.cumsum([len(c) for _, c in mine])
        slot |= {i: part for (i, _), part in zip(mine, np.split(slots, ends[:-1]), strict=True)}
        shape = (count, most, KINDS[kind].size)
        blocks[kind] = np.full(shape, np.inf), np.zeros(shape), np.zeros((*shape, wide.n)), np.zeros((*shape, size))
    for own, term, r, j, local in whiten_terms(data, wide, x):
        at = term.configuration, slot[own][term.index]
        sigma_there, r_there, j_there, local_there = blocks[data.observations[own].kind]
        r_there[at], j_there[at] = r, j
        sigma_there[at] = np.divide(1.0, term.scale, out=np.full_like(term.scale, np.inf), where=term.scale > 0)
        if local.shape[-1] == size:
            local_there[at] = local
    parts, cut, end = [], [], 0
    for kind, block in blocks.items():
        if np.isfinite(block[0]).mean() < SEGMENT_COMPLETE:
            parts.append((end, end + size, "1"))
            cut.append(_of_pose(block))
            end += size
            continue
        for a, b, unit in KINDS[kind].parts:
            width = block[0].shape[1] * (b - a)
            parts.append((end, end + width, unit))
            cut.append([v[:, :, a:b].reshape(count, width, *v.shape[3:]) for v in block])
            end += width
    sigma, r, j, local = (np.concatenate(of_unit, axis=1) for of_unit in zip(*cut, strict=True))
    return tuple(parts), sigma, r, j, local


def _of_pose(block: tuple[Array, ...]) -> list[Array]:
    """What numbers of a kind say of every pose: sigma and Q^T r (U, l), Q^T J (U, l, n), R (U, l, l). Nothing where they do not tell it."""
    count, size = len(block[0]), block[3].shape[-1]
    r, j, local = (v.reshape(count, -1, *v.shape[3:]) for v in block[1:])
    if local.shape[1] < size:
        return [np.full((count, size), np.inf), *(np.zeros((count, size, *v.shape[2:])) for v in (r, j, local))]
    q, triangle = np.linalg.qr(local)
    own = np.abs(np.einsum("uii->ui", triangle))
    told = (own > FELT * own.max(axis=1, initial=0.0, keepdims=True)).all(axis=1)
    across = np.where(told[:, None, None], q, 0.0).swapaxes(1, 2)
    sigma = np.where(told[:, None], 1.0, np.inf) * np.ones(size)
    return [sigma, (across @ r[..., None])[..., 0], across @ j, across @ local]


def _slots(configuration: Ints, count: int) -> tuple[Ints, int]:
    """The how many-th of its configuration each row is, and how many there are at most."""
    order = np.argsort(configuration, kind="stable")
    number = np.bincount(configuration, minlength=count)
    begin = np.concatenate([[0], np.cumsum(number)[:-1]])
    slot = np.empty(len(configuration), dtype=np.int64)
    slot[order] = np.arange(len(configuration)) - begin[configuration[order]]
    return slot, int(number.max(initial=0))


def _origin(some: Sequence[Observations], data: DataSet, count: int) -> list[tuple[str, int]]:
    """The file and the row in it from which people know every configuration: of the first of some instruments that saw it, else of
    any."""
    out = [("", i) for i in range(count)]
    for obs in reversed((*some, *data.observations)):
        rows = np.arange(len(obs)) if obs.rows is None else obs.rows
        for c, row in zip(obs.configuration[::-1].tolist(), rows[::-1].tolist(), strict=True):
            out[c] = obs.source, int(row)
    return out

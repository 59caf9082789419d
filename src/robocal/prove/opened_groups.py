"""Which groups of numbers the data open, where a camera is among the sensors: robot, lens, hand-eye, map, size, delay, in this order.

    new    singular values above 1 of the columns so far, less those of the groups before
    told   numbers that the data, with everything else unknown too, narrow to half of what was expected
    else   a rival: the group whose numbers would have to be known; or noise: no group would help

The choice of columns and the shares are those of the fit (`estimate.identifiability`); nothing is fitted here. With R of the data and E of
what is expected, the information is A = R^T R + (E E^T)^-1; that a group is known takes its rows and columns out of A.
A delay between instruments is never free here: the score test of `diagnose.time_offset` asks for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.diagnose.time_offset import follows_path, time_offset
from robocal.estimate.identifiability import CLAIM, Identifiability
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.measure.pixels import EDGE
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.bands import find_identified
from robocal.prove.decision import Decision

__all__ = ["OpenedGroup", "open_groups"]

ROBOT, LENS, EYE, MAP, SIZE, DELAY, OTHER = "robot", "lens", "hand-eye", "map", "size", "delay", "other instruments"
ORDER = (ROBOT, LENS, EYE, MAP, SIZE, OTHER)
OPEN, PART, NONE, FIXED = "open", "in part", "not open", "fixed"


@record
class OpenedGroup:
    """A group: how many of its numbers were free; how many directions the data see beyond those of the groups before; which names they
    tell, and which not; its state (open, in part, not open, fixed), and why the rest is not told: rivals, the groups one of which would
    have to be known; noise; fixed; and of a delay path, asked or late."""

    name: str
    n: int
    new: int
    told: tuple[str, ...]
    rest: tuple[str, ...]
    state: str
    why: str = ""
    rivals: tuple[str, ...] = ()


def open_groups(made: Decision[Model]) -> tuple[OpenedGroup, ...]:
    """The groups in their order; none where no camera is among the sensors."""
    fit, data = made.need_fit, made.need_data
    if not any(o.kind == "pixels" for o in data.observations):
        return ()
    seen, table = fit.identifiability, fit.problem.table
    group_of = _groups(made.model, data, table.names)
    number = {name: i for i, name in enumerate(ORDER)}
    of = np.array([number[group_of[n]] for n in seen.names], dtype=np.int64)
    told, new, rivals = find_identified(fit), _directions(seen, of), _rivals(seen, of)
    out = []
    for name in ORDER:
        mine = [n for n in table.names if group_of[n] == name]
        free = [n for n in mine if n in seen.names]
        open_, rest = (tuple(n for n in free if (n in told) == is_told) for is_told in (True, False))
        if not mine or (name == OTHER and not free):
            continue
        state = FIXED if not free else OPEN if not rest else PART if open_ else NONE
        beside = tuple(dict.fromkeys(ORDER[k] for n in rest for k in rivals[n]))
        why = FIXED if not free else "" if not rest else "rivals" if beside else "noise"
        out.append(OpenedGroup(name, len(free), new[number[name]], open_, rest, state, why, beside))
    return (*out, _delay(made)) if len(data.observations) > 1 or data.configurations.joints is not None else tuple(out)


def _groups(model: Model, data: DataSet, names: tuple[str, ...]) -> Mapping[str, str]:
    """The group of every parameter."""
    owners: dict[str, str] = {}
    for o in data.observations:
        if o.kind == "pixels":
            owners |= {f.name: MAP for f in o.targets} | {str(o.options.get("camera", "")): LENS}
            owners |= {o.frame.name: EYE} if o.frame is not None else {}
    return {n: ROBOT if n in model.table else _group(n, owners) for n in names}


def _group(name: str, owners: Mapping[str, str]) -> str:
    owner, _, symbol = name.rpartition(".")
    if symbol in ("size", EDGE):
        return SIZE
    found = owners.get(owner, OTHER)
    return OTHER if found != LENS and symbol not in FRAME_SYMBOLS else found


def _directions(seen: Identifiability, of: Ints) -> list[int]:
    """How many directions the data see above the noise with the columns of each group and of those before, beyond what these see."""
    scaled = seen.root / seen.noise * seen.problem.scales
    ranks = [0]
    for k in range(len(ORDER)):
        some = scaled[:, of <= k]
        ranks.append(int((np.linalg.svd(some, compute_uv=False) > seen.level).sum()) if some.size else 0)
    return [after - before for before, after in pairwise(ranks)]


def _rivals(seen: Identifiability, of: Ints) -> Mapping[str, tuple[int, ...]]:
    """Of every name the groups each of which, were it known, would let the data tell it."""
    out: dict[str, tuple[int, ...]] = dict.fromkeys(seen.names, ())
    poor = np.asarray(seen.share) < CLAIM
    if not poor.any():
        return out
    scale = seen.problem.scales
    expected = np.linalg.solve(seen.problem.spread_root, np.diag(scale))
    rows = np.vstack([seen.root / seen.noise * scale, expected])
    information = rows.T @ rows
    for k in sorted(set(of.tolist())):
        left = np.flatnonzero(of != k)
        known = 1 - np.diag(_inverse(information[np.ix_(left, left)]))
        for i in left[poor[left] & (known >= CLAIM)].tolist():
            out[seen.names[i]] += (k,)
    return out


def _inverse(matrix: Array) -> Array:
    """Of a positive definite matrix, columns of unequal length."""
    size = 1 / np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix * size[:, None] * size) * size[:, None] * size)


def _delay(made: Decision[Model]) -> OpenedGroup:
    """Whether the readings say anything of a delay."""
    why = "late" if time_offset(made) else "asked" if follows_path(made) else "path"
    return OpenedGroup(DELAY, 0, 0, (), (), FIXED, why)

"""Which groups of numbers the data open, where a camera is among the sensors: robot, lens, hand-eye, map, size, delay, in this order.

    new    singular values above 1 of the columns so far, less those of the groups before
    open   numbers that the data, with everything else unknown too, narrow to half of what was expected
    rest   rivals: the fewest groups that would have to be known; own: the others of its group too; noise: with all known the data
           would say too little

The choice of columns and the shares are those of the fit (`estimate.identifiability`); nothing is fitted here. With R of the data and E of
what is expected, the information is A = R^T R + (E E^T)^-1; that a group is known takes its rows and columns out of A.
A delay between instruments is never free here: the score test of `diagnose.time_offset` asks for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise

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

__all__ = ["Obstacle", "OpenedGroup", "open_groups"]

ROBOT, LENS, EYE, MAP, SIZE, DELAY, OTHER = "robot", "lens", "hand-eye", "map", "size", "delay", "other instruments"
ORDER = (ROBOT, LENS, EYE, MAP, SIZE, OTHER)
OPEN, PART, NONE, FIXED = "open", "in part", "not open", "fixed"


@record
class Obstacle:
    """Names that are not told, and why: rivals, groups that would have to be known for it; own, where the others of its group would have to
    be as well; or noise, where nothing else would help."""

    why: str
    names: tuple[str, ...]
    rivals: tuple[str, ...] = ()


@record
class OpenedGroup:
    """A group: how many of its numbers were free; how many directions the data see beyond those of the groups before; which are identified,
    and what stands in the way of the others; its state (open, in part, not open, fixed), and of a delay what was asked (path: no path was
    measured; asked: nothing was found; late)."""

    name: str
    n: int
    new: int
    identified: tuple[str, ...]
    state: str
    rest: tuple[Obstacle, ...] = ()
    asked: str = ""


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
    for k, name in enumerate(ORDER):
        mine = [n for n in table.names if group_of[n] == name]
        free = [n for n in mine if n in seen.names]
        if not mine or (name == OTHER and not free):
            continue
        open_ = tuple(n for n in free if n in told)
        rest: dict[tuple[int, ...] | None, list[str]] = {}
        for n in free:
            if n not in told:
                rest.setdefault(rivals[n], []).append(n)
        state = FIXED if not free else OPEN if not rest else PART if open_ else NONE
        obstacles = (
            Obstacle("own", tuple(names))
            if known == (k,)
            else Obstacle("rivals" if known else "noise", tuple(names), tuple(ORDER[i] for i in known or ()))
            for known, names in rest.items()
        )
        out.append(OpenedGroup(name, len(free), new[k], open_, state, tuple(obstacles)))
    several = len(data.observations) > 1 or data.configurations.joints is not None
    return (*out, _delay(made)) if several else tuple(out)


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


def _rivals(seen: Identifiability, of: Ints) -> Mapping[str, tuple[int, ...] | None]:
    """Of every name the fewest other groups that, were they known, would let the data tell it; the first of several. Its own
    group: where all else is known, others of that too. None: not with all."""
    out: dict[str, tuple[int, ...] | None] = dict.fromkeys(seen.names)
    poor = np.flatnonzero(np.asarray(seen.share) < CLAIM)
    scale, groups = seen.problem.scales, sorted(set(of.tolist()))
    expected = np.linalg.solve(seen.problem.spread_root, np.diag(scale))
    rows = np.vstack([seen.root / seen.noise * scale, expected])
    information = rows.T @ rows
    # What all others together cannot open, fewer cannot.
    every = {i: tuple(k for k in groups if k != of[i]) for i in poor.tolist()}
    apart = {i for i in every if _share(information, of, every[i], [i])[0] >= CLAIM}
    alone = 1 - 1 / np.diag(information)
    out |= {seen.names[i]: (int(of[i]),) for i in every if i not in apart and alone[i] >= CLAIM}
    poor = np.array(sorted(apart), dtype=np.int64)
    for count in range(len(groups)):
        for known in combinations(groups, count):
            some = poor[~np.isin(of[poor], known)]
            told = some[_share(information, of, known, some) >= CLAIM] if len(some) else some
            out |= {seen.names[i]: known for i in told.tolist()}
            poor = np.setdiff1d(poor, told)
    return out


def _share(information: Array, of: Ints, known: Sequence[int], asked: Sequence[int] | Ints) -> Array:
    """What the data know of the numbers `asked` where groups are known: one less the variance, in units of what was expected."""
    left = np.flatnonzero(~np.isin(of, known))
    size = 1 / np.sqrt(np.diag(information)[left])
    at = np.searchsorted(left, asked)
    unit = np.zeros((len(left), len(at)))
    unit[at, np.arange(len(at))] = 1.0
    spread = np.linalg.solve(information[np.ix_(left, left)] * size[:, None] * size, unit)
    return np.asarray(1 - spread[at, np.arange(len(at))] * size[at] ** 2)


def _delay(made: Decision[Model]) -> OpenedGroup:
    """Whether the readings say anything of a delay."""
    why = "late" if time_offset(made) else "asked" if follows_path(made) else "path"
    return OpenedGroup(DELAY, 0, 0, (), FIXED, asked=why)

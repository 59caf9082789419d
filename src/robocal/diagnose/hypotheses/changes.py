"""What may be wrong, each as a change of a data set that would undo it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from enum import StrEnum
from functools import reduce
from itertools import combinations, permutations, product

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.diagnose.limits import SIGN_JOINTS
from robocal.geometry import so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.machine import Mechanism

__all__ = ["ORDERS", "WHOLE", "Change", "Trial", "What", "apply_all", "changes"]

SHIFTS = (1, -1, 2, -2)


class What(StrEnum):
    """What is changed."""

    SIGN = "sign"
    ZERO = "zero"
    SWAP = "swap"
    WITH = "with"
    JOINT_UNIT = "joint-unit"
    GAINS = "gains"
    LENGTH_UNIT = "length-unit"
    AXES = "axes"
    BEARING = "bearing"
    SHIFT = "shift"
    REVERSED = "reversed"
    INVERSE = "inverse"
    TRANSPOSED = "transposed"
    TURNS = "turns"
    TARGETS = "targets"


OF_JOINTS = (What.SIGN, What.ZERO, What.SWAP, What.WITH, What.JOINT_UNIT, What.GAINS)
ORDERS = (What.SHIFT, What.REVERSED)
WHOLE = (*ORDERS, What.TURNS)  # these look at neighbouring rows, or at every row


@record
class Change:
    """One change: of joints or axes `at`, by an `amount` (rad, rows, or how much of the second joint the first counts with) or
    `factors`, in the files `sources` (all where empty).

    `signs` go with axes: the reading becomes signs * reading[at]; an angle of a bearing becomes `amount` less what it was. `turns`
    (k, 3, 3) are the same rotations read in the form of number `at`, `swapped` two targets that change places; `zeros` (rad) are
    added where `factors` were found by a fit.
    """

    what: What
    at: tuple[int, ...] = ()
    amount: float = 0.0
    signs: tuple[int, ...] = ()
    sources: tuple[str, ...] = ()
    turns: Array | None = field(default=None, compare=False)
    swapped: tuple[Frame, ...] = ()
    factors: tuple[float, ...] = ()
    zeros: tuple[float, ...] = ()

    def apply(self, data: DataSet) -> DataSet:
        """The data set as it would be."""
        if self.what in OF_JOINTS:
            return DataSet(self._joints(data), data.observations)
        read = (self._read(o) if not self.sources or o.source in self.sources else o for o in data.observations)
        return DataSet(data.configurations, tuple(read))

    def _exchange_target(self, target: Frame) -> Frame:
        """The other one of two targets that change places."""
        names = [t.name for t in self.swapped]
        return self.swapped[1 - names.index(target.name)] if target.name in names else target

    def _joints(self, data: DataSet) -> Configurations:
        given = data.configurations
        assert given.joints is not None
        joints = given.joints.copy()
        rows = data.configurations_of(self.sources) if self.sources else np.arange(len(joints))
        columns = np.array(self.at)
        at = np.ix_(rows, columns)
        if self.what == What.SIGN:
            joints[at] *= -1.0
        elif self.what == What.ZERO:
            joints[at] += self.amount
        elif self.what == What.SWAP:
            joints[at] = joints[np.ix_(rows, columns[::-1])]
        elif self.what == What.WITH:
            joints[rows, self.at[0]] += self.amount * joints[rows, self.at[1]]
        else:
            joints[at] = joints[at] * np.array(self.factors) + (np.array(self.zeros) if self.zeros else 0.0)
        return replace(given, joints=joints)

    def _read(self, obs: Observations) -> Observations:
        if self.what in (What.SHIFT, What.REVERSED):
            order = np.arange(len(obs))
            order = order[::-1] if self.what == What.REVERSED else np.roll(order, int(self.amount))
            return replace(obs, configuration=obs.configuration[order])
        if self.what == What.TARGETS:
            return replace(obs, targets=tuple(self._exchange_target(t) for t in obs.targets))
        if self.what == What.BEARING and obs.kind != "spherical":
            return obs
        value = obs.value.copy()
        if self.what == What.LENGTH_UNIT:
            value[:, list(self.at)] *= np.array(self.factors)
        elif self.what == What.BEARING:
            value[:, list(self.at)] = self.amount - value[:, list(self.at)]
        elif self.what == What.AXES:
            value[:, :3] = value[:, list(self.at)] * np.array(self.signs)
        elif self.what == What.TURNS:
            assert self.turns is not None
            value[:, 3:6] = so3.log(self.turns)
        else:
            r = np.swapaxes(so3.exp(value[:, 3:6]), 1, 2)
            if self.what == What.INVERSE:
                value[:, :3] = -np.einsum("kij,kj->ki", r, value[:, :3])
            value[:, 3:6] = -value[:, 3:6]
        return replace(obs, value=value)


Trial = tuple[Change, ...]  # changes that are made at once, one after the other


def apply_all(some: Sequence[Change], data: DataSet) -> DataSet:
    """The data set after several changes, one after the other."""
    return reduce(lambda there, change: change.apply(there), some, data)


Factors = Mapping[str, Sequence[float]]


def changes(chain: Mechanism, data: DataSet, angles: Factors, lengths: Factors) -> list[Change]:
    """Every single change worth a trial; `angles` undo a wrong unit of each joint, `lengths` of each coordinate, by file
    (0 where there is no other unit)."""
    sources = list(dict.fromkeys(o.source for o in data.observations))[:4]
    where: list[tuple[str, ...]] = [()] if len(sources) < 2 else [(), *((s,) for s in sources)]
    out = [*_of_the_arm(chain), *_of_targets(data)]
    for files in where:
        turns, scales = (_common(f, files or tuple(sources)) for f in (angles, lengths))
        found = (*_of_columns(chain, turns), *_of_readings(data, files, scales))
        out += [replace(change, sources=files) for change in found]
    return out


def _common(factors: Factors, sources: Sequence[str]) -> tuple[float, ...]:
    """The factors that some files share; none where they speak differently."""
    own = {tuple(factors.get(s, ())) for s in sources}
    return own.pop() if len(own) == 1 else ()


def _some(what: What, columns: Sequence[int], factors: Sequence[float]) -> Iterator[Change]:
    """Some of the columns in another unit: all, one, all but one, and those of one stated unit."""
    known = [i for i in columns if i < len(factors) and factors[i] not in (0.0, 1.0)]
    alone = [(i,) for i in known]
    others = [tuple(j for j in known if j != i) for i in known]
    units = [tuple(j for j in known if factors[j] == f) for f in sorted({factors[i] for i in known})]
    tried = dict.fromkeys((tuple(known), *alone, *others, *units))
    yield from (Change(what, at, factors=tuple(factors[i] for i in at)) for at in tried if at)


def _of_the_arm(chain: Mechanism) -> Iterator[Change]:
    """Signs, zeros, and joints that count with an earlier one: the arm's own, so in every file."""
    count = len(chain.joints)
    for size in range(1, count + 1 if count <= SIGN_JOINTS else 4):
        yield from (Change(What.SIGN, some) for some in combinations(range(count), size))
    for before, i in combinations(range(count), 2):
        if chain.joints[i].type == chain.joints[before].type:
            yield from (Change(What.WITH, (i, before), share) for share in (1.0, -1.0))
    for i, joint in enumerate(chain.joints):
        if joint.type != "prismatic":
            for turn in (math.pi / 2, -math.pi / 2, math.pi):
                yield Change(What.ZERO, (i,), turn)


def _of_columns(chain: Mechanism, factors: Sequence[float]) -> Iterator[Change]:
    for a, b in combinations(range(len(chain.joints)), 2):
        if chain.joints[a].type == chain.joints[b].type:
            yield Change(What.SWAP, (a, b))
    turning = [i for i, j in enumerate(chain.joints) if j.type != "prismatic"]
    yield from _some(What.JOINT_UNIT, turning, factors)


def _of_readings(data: DataSet, files: tuple[str, ...], lengths: Sequence[float]) -> Iterator[Change]:
    mine = [o for o in data.observations if not files or o.source in files]
    yield from (Change(What.SHIFT, amount=shift) for shift in SHIFTS)
    yield Change(What.REVERSED)
    if any(o.kind == "spherical" for o in mine):
        yield Change(What.BEARING, (1,))  # an azimuth that counts clockwise
        yield Change(What.BEARING, (2,), math.pi / 2)  # an angle from the zenith
    placed = [o for o in mine if o.kind in ("position", "pose")]
    if not placed:
        return
    yield from _some(What.LENGTH_UNIT, range(3), lengths)
    # A turn of all axes is what a free frame is for, where no orientation was read beside them.
    absorbed = all(o.kind == "position" and o.frame is not None and all(o.frame.free) for o in placed)
    for order in permutations(range(3)):
        for signs in product((1, -1), repeat=3):
            as_read = order == (0, 1, 2) and signs == (1, 1, 1)
            # Of the odd ones, which no turn meets, one is enough.
            if not as_read and (not absorbed or (order == (1, 0, 2) and signs == (1, 1, 1))):
                yield Change(What.AXES, tuple(order), signs=tuple(signs))
    if all(o.kind == "pose" for o in placed):
        yield from (Change(What.INVERSE), Change(What.TRANSPOSED))


def _of_targets(data: DataSet) -> Iterator[Change]:
    """Two targets whose places are stated, in whichever files they were seen."""
    seen = {t.name: t for o in data.observations for t in o.targets if o.kind in ("position", "pose", "spherical")}
    known = [t for t in seen.values() if not all(t.free[:3])]
    for pair in combinations(known[:6], 2):
        if pair[0].mount == pair[1].mount and pair[0].value != pair[1].value:
            yield Change(What.TARGETS, swapped=pair)

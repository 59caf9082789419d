"""What is possible in a data set but looks wrong: joints outside their limits, repeats that differ, values that look
like another unit.

Nothing here is an error. A suspicion says which unit would make sense and can apply it, so that an identification can
try.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.diagnose.limits import (
    COPY_CHANCE,
    DEGREES_MOVED,
    DEGREES_RANGE,
    QUIETEST,
    RADIANS_OUTSIDE,
    RADIANS_TURNS,
    REPEAT_SIGMA,
    SPREAD_LARGE,
    SPREAD_MOVED,
    SPREAD_ROWS,
    SPREAD_SMALL,
)
from robocal.files.units import UNITS, Unit
from robocal.measure.base import kind_of
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import limits_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Suspicion", "alternatives", "limit_warning", "repeat_warnings", "suspicions"]

Array = NDArray[np.float64]
TURN = 2 * math.pi  # tolerance: none, a turn is exact
BULK = (10, 90)  # per cent of the values that are there in any case


@dataclass(frozen=True)
class Suspicion:
    """`part` (joints, or the section that holds lengths) of `source` is stated in `stated` but looks like
    `alternative`: its SI values times `factor`."""

    part: str
    source: str
    stated: str
    alternative: str
    factor: float
    reason: Remark
    columns: tuple[int, ...] = ()

    def apply(self, data: DataSet) -> DataSet:
        """The data set as it would be in the other unit; also when it was joined with others."""
        if self.part != "joints":
            return DataSet(
                data.configurations, tuple(self._scaled(o) if o.source == self.source else o for o in data.observations)
            )
        joints = data.configurations.joints
        if joints is None:
            return data
        rows = np.unique(
            np.concatenate(
                [
                    part
                    for o in data.observations
                    if o.source == self.source
                    for part in (o.configuration, o.second)
                    if part is not None
                ]
                or [np.empty(0, int)]
            )
        )
        joints = joints.copy()
        joints[np.ix_(rows.astype(int), np.array(self.columns, dtype=int))] *= self.factor
        return DataSet(replace(data.configurations, joints=joints), data.observations)

    def _scaled(self, obs: Observations) -> Observations:
        scale = np.ones(obs.value.shape[-1])
        for first, last, unit in kind_of(obs).parts:
            if unit == "m":
                scale[first:last] = self.factor
        return replace(obs, value=obs.value * scale, sigma=None if obs.sigma is None else obs.sigma * scale)

    @property
    def remark(self) -> Remark:
        """What is said where nothing proves it."""
        return Remark.of(
            Code.OTHER_UNIT,
            file=self.source,
            part=self.part,
            stated=self.stated,
            alternative=self.alternative,
            why=self.reason.sentence,
        )


def suspicions(
    obs: Observations, joints: Array, chain: Model, angle: Unit, length: Unit | None
) -> tuple[Suspicion, ...]:
    """Angles that look like the other of deg and rad, and positions that no arm of this size reaches or hardly
    leaves."""
    out = []
    turning = tuple(i for i, j in enumerate(joints_of(chain)) if j.type != "prismatic")
    found = _angles(joints[:, turning], limits_of(chain)[list(turning)], angle) if turning else None
    if found:
        other, reason = found
        out.append(
            Suspicion("joints", obs.source, angle.name, other.name, other.factor / angle.factor, reason, turning)
        )
    if length is not None and len(obs) >= SPREAD_ROWS:
        spread = float(np.linalg.norm(np.ptp(obs.value[:, :3], axis=0)))
        # One number that was mistyped makes no unit: what most of them spread over decides on one that is too large.
        bulk = float(np.linalg.norm(np.ptp(np.percentile(obs.value[:, :3], BULK, axis=0), axis=0)))
        geometry = sum(
            abs(p.value) for p in chain.table.rows if p.unit == "m" and p.name.rpartition(".")[0] not in ("base",)
        )
        geometry += sum(float(np.ptp(joints[:, i])) for i, j in enumerate(joints_of(chain)) if j.type == "prismatic")
        moved = float(np.ptp(joints, axis=0).max(initial=0.0)) > SPREAD_MOVED
        reason = Remark.of(Code.SPREAD_UNLIKE, spread=spread, reach=geometry)
        other_unit = None
        if geometry > 0 and bulk > SPREAD_LARGE * geometry:
            other_unit = {"m": "mm", "inch": "mm", "cm": "mm", "mm": "um"}.get(length.name)
        elif 0 < spread < geometry / SPREAD_SMALL and moved:
            other_unit = {"mm": "m", "um": "mm", "cm": "m"}.get(length.name)
        if other_unit:
            unit = UNITS[other_unit]
            out.append(Suspicion("position", obs.source, length.name, unit.name, unit.factor / length.factor, reason))
    return tuple(out)


def alternatives(
    obs: Observations, joints: Array, chain: Model, angle: Unit, length: Unit | None, section: str
) -> tuple[Suspicion, ...]:
    """Every unit that people mix up with the stated one, whether or not the values look odd; for when nothing fits. `section`
    holds the lengths that were read, "" where a kind reads none."""
    out = []
    turning = tuple(i for i, j in enumerate(joints_of(chain)) if j.type != "prismatic")
    reason = Remark.of(Code.AS_STATED_UNFIT)
    other = {"rad": UNITS["deg"], "deg": UNITS["rad"]}.get(angle.name)
    if turning and other is not None:
        out.append(
            Suspicion("joints", obs.source, angle.name, other.name, other.factor / angle.factor, reason, turning)
        )
    if length is not None and section:
        for unit in (UNITS[n] for n in ("mm", "m", "cm", "inch") if n != length.name):
            out.append(Suspicion(section, obs.source, length.name, unit.name, unit.factor / length.factor, reason))
    return tuple(out)


def _angles(q: Array, limits: Array, unit: Unit) -> tuple[Unit, Remark] | None:
    other = {"rad": UNITS["deg"], "deg": UNITS["rad"]}.get(unit.name)
    if other is None or not q.size:
        return None
    largest, swapped = float(np.abs(q).max()), q * (other.factor / unit.factor)
    outside = float(np.mean(_outside(q, limits).any(axis=1)))
    mended = not _outside(swapped, limits).any()
    if unit.name == "rad" and (
        largest > RADIANS_TURNS * TURN or (outside > RADIANS_OUTSIDE and mended and largest > TURN)
    ):
        return other, Remark.of(Code.LARGEST_ANGLE, largest=largest, unit="rad")
    # Degrees that never leave one radian's worth of turn: a robot that is measured moves further.
    if (
        unit.name == "deg"
        and np.ptp(q, axis=0).max() < DEGREES_RANGE
        and largest < DEGREES_RANGE
        and np.ptp(swapped, axis=0).max() > DEGREES_MOVED
    ):
        return other, Remark.of(Code.LARGEST_ANGLE, largest=math.degrees(largest), unit="deg")
    return None


def _outside(q: Array, limits: Array) -> NDArray[np.bool_]:
    slack = 1e-9
    return np.asarray((q < limits[:, 0] - slack) | (q > limits[:, 1] + slack))


def limit_warning(joints: Array, chain: Model, lines: NDArray[np.int64], file: object) -> tuple[Remark, ...]:
    """One line on the rows that are outside the joint limits."""
    outside = _outside(joints, limits_of(chain))
    rows = np.flatnonzero(outside.any(axis=1))
    if not len(rows):
        return ()
    names = tuple(joints_of(chain)[i].name for i in np.flatnonzero(outside.any(axis=0)))
    first = int(lines[rows[0]])
    return (Remark.of(Code.OUTSIDE_LIMITS, file=str(file), rows=len(rows), joints=names, row=first),)


def repeat_warnings(obs: Observations, configurations: Configurations, file: object) -> tuple[Remark, ...]:
    """Repeated joints (target, point, other configuration) whose results differ by more than 10 sigma of a
    difference, or not even in the last digit."""
    joints = configurations.joints
    if len(obs) < 2 or obs.rows is None or joints is None:
        return ()
    same: list[Array] = [joints[obs.configuration]]
    if obs.second is not None:
        same.append(joints[obs.second])
    if obs.target is not None:
        same.append(obs.target[:, None].astype(float))
    same += [v.reshape(len(obs), -1) for v in obs.extra.values()]
    _, group = np.unique(np.hstack(same), axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    sorted_group = group[order].ravel()
    starts = np.flatnonzero(np.r_[True, np.diff(sorted_group) > 0])
    if len(starts) == len(obs):
        return ()
    first = np.repeat(order[starts], np.diff(np.r_[starts, len(order)]))
    out = _twice(obs, order, first, file)
    if obs.sigma is None:
        return out
    # Angles are left out: they may differ by a turn, and a difference of rotation vectors has no sigma near a half one.
    compared = [i for a, b, unit in kind_of(obs).parts if unit != "rad" for i in range(a, b)]
    gap = np.abs(obs.value[order] - obs.value[first])[:, compared]
    sigma = np.hypot(obs.sigma[order], obs.sigma[first])[:, compared]
    bad = np.flatnonzero((gap > REPEAT_SIGMA * sigma).any(axis=1))
    if not len(bad):
        return out
    a, b = int(obs.rows[first[bad[0]]]), int(obs.rows[order[bad[0]]])
    return (*out, Remark.of(Code.REPEATS_DIFFER, file=str(file), count=len(bad), first=a, second=b))


def _twice(obs: Observations, order: NDArray[np.int64], first: NDArray[np.int64], file: object) -> tuple[Remark, ...]:
    """One line on rows that are copies of others. A single number may read alike twice, and a contact has no reading; and
    where an instrument shows few digits, honest repeats agree in all of them now and then."""
    assert obs.rows is not None
    if obs.value.shape[1] < 2:
        return ()
    _, index, key = np.unique(
        np.column_stack([first, obs.value[order]]), axis=0, return_index=True, return_inverse=True
    )
    original = index[key.ravel()]
    copy = (original != np.arange(len(order))) & (obs.value[order] != 0).any(axis=1)
    found = np.flatnonzero(copy)
    if not len(found):
        return ()
    size = np.bincount(first, minlength=len(obs))
    honest = (order != first) & ~copy
    pairs = float((size * (size - 1) / 2).sum())
    if special.pdtrc(len(found) - 1, pairs * _agreeing(obs, order[honest], first[honest])) > COPY_CHANCE:
        return ()
    a, b = min(sorted(int(obs.rows[order[i]]) for i in (original[k], k)) for k in found)
    return (Remark.of(Code.COPIED, file=str(file), count=len(found), first=a, second=b),)


def _agreeing(obs: Observations, one: NDArray[np.int64], other: NDArray[np.int64]) -> float:
    """The chance that two honest readings of one place agree to the last digit: of each number step / (2 sqrt(pi) sigma),
    with the step in which it is written and sigma as stated, as other repeats scatter, or as little as anything does."""
    chance = 1.0
    for start, stop, unit in kind_of(obs).parts:
        for i in range(start, stop):
            step = _step(obs.value[:, i])
            if obs.sigma is not None:
                sigma = float(np.sqrt(np.mean(obs.sigma[:, i] ** 2)))
            elif len(one):
                sigma = float(np.sqrt(np.mean((obs.value[one, i] - obs.value[other, i]) ** 2) / 2))
            else:
                sigma = QUIETEST.get(unit, 0.0)
            chance *= min(1.0, step / (2 * math.sqrt(math.pi) * sigma)) if sigma > 0 else 1.0
    return chance


def _step(values: Array) -> float:
    """The power of ten in which numbers are written, 0 where they are written in none."""
    for digits in range(13):
        step = 10.0**-digits
        whole = values / step
        if np.abs(whole - np.round(whole)).max() < 1e-3:
            return step
    return 0.0

"""Values of a file that look like another unit than the stated one.

Nothing here is an error. A suspicion says which unit would make sense and can apply it, so that an identification can
try.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._types import Array
from robocal.diagnose.hypotheses.reading import OtherUnit
from robocal.diagnose.limits import (
    DEGREES_MOVED,
    DEGREES_RANGE,
    RADIANS_OUTSIDE,
    RADIANS_TURNS,
    SPREAD_LARGE,
    SPREAD_MOVED,
    SPREAD_ROWS,
    SPREAD_SMALL,
)
from robocal.diagnose.rows.table import outside
from robocal.files.units import UNITS, Unit
from robocal.measure.data import Observations
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import limits_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["alternatives", "suspicions"]

TURN = 2 * math.pi  # tolerance: none, a turn is exact
SWAPPED = {"rad": UNITS["deg"], "deg": UNITS["rad"]}
BULK = (10, 90)  # per cent of the values that are there in any case


def suspicions(
    obs: Observations, joints: Array, chain: Model, angle: Unit, length: Unit | None
) -> tuple[OtherUnit, ...]:
    """Angles that look like the other of deg and rad, and positions that no arm of this size reaches or hardly
    leaves."""
    out = []
    turning = tuple(i for i, j in enumerate(joints_of(chain)) if j.type != "prismatic")
    found = _angles(joints[:, turning], limits_of(chain)[list(turning)], angle) if turning else None
    if found:
        out.append(_other("joints", obs, angle, *found, turning))
    if length is not None and len(obs) >= SPREAD_ROWS:
        spread = float(np.linalg.norm(np.ptp(obs.value[:, :3], axis=0)))
        geometry = sum(abs(p.value) for p in chain.table.rows if p.unit == "m" and p.name.rpartition(".")[0] != "base")
        geometry += sum(float(np.ptp(joints[:, i])) for i, j in enumerate(joints_of(chain)) if j.type == "prismatic")
        moved = float(np.ptp(joints, axis=0).max(initial=0.0)) > SPREAD_MOVED
        reason = Remark.of(Code.SPREAD_UNLIKE, spread=spread, reach=geometry)
        other_unit = None
        bulk, large = spread, SPREAD_LARGE * geometry
        if bulk > large > 0:
            # One number that was mistyped makes no unit: what most of them spread over decides on one that is too large.
            bulk = float(np.linalg.norm(np.ptp(np.percentile(obs.value[:, :3], BULK, axis=0), axis=0)))
        if bulk > large > 0:
            other_unit = {"m": "mm", "inch": "mm", "cm": "mm", "mm": "um"}.get(length.name)
        elif 0 < spread < geometry / SPREAD_SMALL and moved:
            other_unit = {"mm": "m", "um": "mm", "cm": "m"}.get(length.name)
        if other_unit:
            out.append(_other("position", obs, length, UNITS[other_unit], reason))
    return tuple(out)


def alternatives(
    obs: Observations, joints: Array, chain: Model, angle: Unit, length: Unit | None, section: str
) -> tuple[OtherUnit, ...]:
    """Every unit that people mix up with the stated one, whether or not the values look odd; for when nothing fits. `section`
    holds the lengths that were read, "" where a kind reads none."""
    out = []
    turning = tuple(i for i, j in enumerate(joints_of(chain)) if j.type != "prismatic")
    reason = Remark.of(Code.AS_STATED_UNFIT)
    other = SWAPPED.get(angle.name)
    if turning and other is not None:
        out.append(_other("joints", obs, angle, other, reason, turning))
    if length is not None and section:
        units = (UNITS[n] for n in ("mm", "m", "cm", "inch") if n != length.name)
        out += [_other(section, obs, length, unit, reason) for unit in units]
    return tuple(out)


def _other(
    section: str, obs: Observations, stated: Unit, unit: Unit, reason: Remark, joints: tuple[int, ...] = ()
) -> OtherUnit:
    return OtherUnit(section, obs.source, stated.name, unit.name, unit.factor / stated.factor, reason, joints)


def _angles(q: Array, limits: Array, unit: Unit) -> tuple[Unit, Remark] | None:
    other = SWAPPED.get(unit.name)
    if other is None or not q.size:
        return None
    largest, swapped = float(np.abs(q).max()), q * (other.factor / unit.factor)
    share = float(np.mean(outside(q, limits).any(axis=1)))
    mended = not outside(swapped, limits).any()
    turned = largest > RADIANS_TURNS * TURN or (share > RADIANS_OUTSIDE and mended and largest > TURN)
    if unit.name == "rad" and turned:
        return other, Remark.of(Code.LARGEST_ANGLE, largest=largest, unit="rad")
    # Degrees that never leave one radian's worth of turn: a robot that is measured moves further.
    still = max(np.ptp(q, axis=0).max(), largest) < DEGREES_RANGE
    if unit.name == "deg" and still and np.ptp(swapped, axis=0).max() > DEGREES_MOVED:
        return other, Remark.of(Code.LARGEST_ANGLE, largest=math.degrees(largest), unit="deg")
    return None

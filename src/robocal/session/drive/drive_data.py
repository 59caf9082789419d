"""Logs of drives as data that every identification reads: an arc of 30 degrees in one direction of one log is a configuration, and the
arcs are groups, so that each is held out whole and in both directions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._types import Array, Bools
from robocal.drives.drive_sweep import Sweep, arc_of
from robocal.measure.data import Configurations, DataSet, Observations

__all__ = ["KINDS", "drive_data", "friction_free", "friction_of"]

KINDS = {"A": "current", "N m": "torque"}
NUMBERS = ("offset", "coulomb", "viscous", "inertia")
WEIGHT = ("weight_cos", "weight_sin")  # of a load, once per turn


def drive_data(sweeps: Sequence[Sweep], used: Sequence[Bools], free: Sequence[str] = NUMBERS[:2]) -> DataSet:
    """The rows of sweeps that are used; `free` are the numbers of a log that are to be found, others are zero."""
    ids, groups, parts = list[str](), list[str](), list[Observations]()
    for number, (sweep, rows) in enumerate(zip(sweeps, used, strict=True)):
        log = f"log{number + 1}"
        some = sweep.take(rows)
        key = 2 * arc_of(some.angle) + (some.direction < 0)
        there, index = np.unique(key, return_inverse=True)
        first = len(ids)
        for k in there.tolist():
            arc = f"{30 * (k // 2)} to {30 * (k // 2) + 30} deg"
            ids.append(f"{log}, {arc}, {'reverse' if k % 2 else 'forward'}")
            groups.append(arc)
        both = len(np.unique(some.direction)) > 1
        # Of one direction the friction is in the offset, and nothing parts them.
        own = [n for n in free if both or n != "coulomb"]
        own += WEIGHT if sweep.loaded else ()
        values = {n: 0.0 for n in (*NUMBERS, *WEIGHT) if n not in own}
        extra = {
            "angle": some.angle,
            "direction": some.direction,
            "speed": some.speed,
            "acceleration": some.acceleration,
        }
        lines = None if some.lines is None else some.lines
        parts.append(
            Observations(
                KINDS[sweep.unit], (first + index.ravel()).astype(np.int64), np.ascontiguousarray(some.effort[:, None]), extra=extra,
                options={"log": log, "values": values}, group=log, source=sweep.name, rows=lines,
            )
        )  # fmt: skip
    return DataSet(Configurations(tuple(ids), groups=tuple(groups)), tuple(parts))


def friction_of(values: Mapping[str, float], sweeps: Sequence[Sweep]) -> float:
    """The Coulomb friction of a motor: that of the first log with both directions, else half of what logs of one direction differ by."""
    known = (values.get(f"log{i + 1}.coulomb") for i in range(len(sweeps)))
    first = next((v for v in known if v), None)
    if first is not None:
        return first
    mean = {
        d: [values.get(f"log{i + 1}.offset", 0.0) for i, s in enumerate(sweeps) if (s.direction[s.used] == d).all()]
        for d in (1, -1)
    }
    return (mean[1][0] - mean[-1][0]) / 2 if all(mean.values()) else 0.0


def friction_free(sweep: Sweep, rows: Bools) -> Array:
    """Efforts of the rows that are used, less the mean of each direction, (k,); of a log with a load less its weight as well."""
    effort, direction = np.array(sweep.effort[rows]), sweep.direction[rows]
    if sweep.loaded:
        angle = sweep.angle[rows]
        turn = np.column_stack([np.cos(angle), np.sin(angle)])
        mean = np.column_stack([direction == 1, direction == -1, turn]).astype(float)
        effort -= turn @ np.linalg.lstsq(mean, effort, rcond=None)[0][2:]
    for d in (1, -1):
        mine = direction == d
        if mine.any():
            effort[mine] -= effort[mine].mean()
    return effort

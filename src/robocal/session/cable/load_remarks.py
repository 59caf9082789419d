"""What is said of loads of a cable: that they contradict the robot's file or each other, and which row is far from all others."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from robocal._types import Array
from robocal.cables.rope import ELASTICITY, WEIGHT, Rope
from robocal.diagnose import limits
from robocal.errors import FormatError
from robocal.measure.base import predict_rows
from robocal.measure.data import DataSet
from robocal.prove.decision import Decision
from robocal.prove.results import ParameterResult
from robocal.remarks.english import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["copied", "different", "far_rows", "insist_different", "scatter", "unexplained", "unlike"]

READS = {WEIGHT: ("sag", "span", "every_cable.density"), ELASTICITY: ("elongation", "length", "every_cable.elasticity")}


def unlike(found: ParameterResult, stated: float) -> tuple[Remark | None, Remark | None]:
    """Why a weight or an elasticity cannot be that of a robot's file, and what to write there instead; None where neither is so."""
    what, (reading, length, key) = found.name.rpartition(".")[2], READS[found.name]
    if not stated > 0 or not found.identified > 0 or found.interval is None:
        return None, None
    told, known = Quantity(found.identified, found.unit), Quantity(stated, found.unit)
    times = found.identified / stated
    if not 1 / limits.LOADS_UNLIKE < times < limits.LOADS_UNLIKE:
        words = {"what": what, "reading": reading, "length": length}
        return Remark.of(Code.LOADS_UNLIKE, found=told, stated=known, times=times, **words), None
    low, high = (Quantity(v, found.unit) for v in found.interval)
    if low.value <= stated <= high.value:
        return None, None
    return None, Remark.of(Code.LOADS_OTHER, low=low, high=high, what=what, stated=known, found=told, key=key)


def far_rows(decision: Decision[Rope], reading: str) -> Iterator[Remark]:
    """The loads that are far from a fit to all others, by what was read."""
    data, fit = decision.need_data, decision.need_fit
    some = [o for o in data.observations if len(o)]
    away = decision.leverage
    for obs, chance, far in zip(some, away.chance, away.outlying, strict=True):
        told = predict_rows(decision.model, data, obs, fit.problem.table, fit.solution.x)[:, 0]
        for i in np.flatnonzero(far | (chance < limits.LOADS_CHANCE)).tolist():
            row = int(obs.rows[i]) if obs.rows is not None else i
            aside = obs.used is not None and not obs.used[i]
            values = {"found": Quantity(float(obs.value[i, 0])), "told": Quantity(float(told[i]))}
            yield Remark.of(
                Code.LOADS_ROW,
                file=Path(obs.source).name,
                row=row,
                reading=reading,
                aside="" if aside else None,
                **values,
            )


def _rows(data: DataSet) -> list[tuple[str, int, bytes]]:
    """File, row, and all that it says, of every load."""
    out: list[tuple[str, int, bytes]] = []
    for obs in data.observations:
        every = np.column_stack([obs.value, *(obs.extra[k] for k in sorted(obs.extra))])
        lines = np.arange(len(obs)) if obs.rows is None else obs.rows
        out += [
            (Path(obs.source).name, int(n), obs.kind.encode() + v.tobytes()) for n, v in zip(lines, every, strict=True)
        ]
    return out


def copied(data: DataSet) -> tuple[Remark | None, bool]:
    """That many loads are copies of others, and whether the whole table stands there several times: of a coarse gauge a few may be
    alike."""
    rows = _rows(data)
    count: dict[bytes, int] = {}
    again: list[tuple[str, int, bytes]] = []
    for row in rows:
        count[row[2]] = count.get(row[2], 0) + 1
        again += [row] if count[row[2]] > 1 else []
    if len(again) <= limits.COPIES * len(rows):
        return None, False
    said = Remark.of(Code.LOADS_COPIED, count=len(again), of=len(rows), row=again[0][1], file=again[0][0])
    return said, min(count.values()) > 1


def different(data: DataSet) -> int:
    """How many loads differ."""
    return len({row for _, _, row in _rows(data)})


def insist_different(data: DataSet, count: int) -> None:
    """Raises FormatError where so few loads differ that they tell no error of `count` numbers."""
    if (found := different(data)) <= count:
        first, of = data.observations[0], sum(map(len, data.observations))
        told = f"{found} of {of} that differ"
        expected = f"{count + 1} or more that differ"
        raise FormatError(
            "too few loads to tell their error", file=first.source, key=first.kind, found=told, expected=expected
        )


def _read_and_told(decision: Decision[Rope]) -> tuple[Array, Array]:
    """What was read of every load that counts, and what the fit says of it, (k,) m."""
    data, fit = decision.need_data, decision.need_fit
    some = [o for o in data.observations if len(o)]
    kept = np.concatenate([np.ones(len(o), bool) if o.used is None else o.used for o in some])
    read = np.concatenate([o.value[:, 0] for o in some])[kept]
    every = [predict_rows(decision.model, data, o, fit.problem.table, fit.solution.x)[:, 0] for o in some]
    return read, np.concatenate(every)[kept]


def scatter(decision: Decision[Rope]) -> Remark | None:
    """That sags are not those of one weight: rows that were shuffled, or tensions that were not written down, leave so much of them."""
    read, told = _read_and_told(decision)
    share = float(np.sqrt(np.mean((read - told) ** 2) / max(float(np.mean(read**2)), 1e-300)))
    return Remark.of(Code.LOADS_SCATTER, share=share) if share > limits.SAGS_SCATTER else None


def unexplained(what: str, decision: Decision[Rope], always: bool = False) -> Remark | None:
    """That loads vary by another share of what a fit foretells, by least squares with a constant: not by all of it, beyond chance, and
    half of it or more is lost. A gauge that stands shows nothing of it; with a free offset the share is one."""
    read, told = _read_and_told(decision)
    y, x = read - read.mean(), told - told.mean()
    if not (len(x) > 2 and x @ x > 0):
        return None
    share = float(x @ y / (x @ x))
    sigma = float(np.sqrt(np.sum((y - share * x) ** 2) / (len(x) - 2) / (x @ x)))
    lost = abs(share - 1)
    if not always and not (lost > limits.UNEXPLAINED_MOST and lost > limits.PRIOR_SIGMA * sigma):
        return None
    return Remark.of(Code.LOADS_UNEXPLAINED, what=what, share=share)

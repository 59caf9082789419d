"""Rows that do not belong to the others, by name: where they stand, how far off they are, and what may have happened, from what
was measured and what the others predict:

    zero      every number is exactly 0: a dropped beam
    copy      the reading is another row's, to the last digit: an instrument that got stuck
    target    it is where another target of the same configuration is: two labels swapped
    swapped   it fits another row's configuration, and that row's reading fits this one
    elsewhere it fits another row's configuration: rows that were moved or shifted
    shifted   one column holds what the row before or after should read, in several rows
    sign      one column fits with the other sign
    column    one column alone is off

A match counts only where it would hardly happen by chance: where places lie closer together than the noise, another row's
reading fits anything, and nothing is said.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array, Bools, Ints
from robocal.diagnose.limits import MATCH_CHANCE, MATCH_LUCK, SHIFTED_ROWS, ZERO_ROWS_SHARE
from robocal.diagnose.studentised import StudentisedResiduals
from robocal.diagnose.view_blocks import view_blocks
from robocal.diagnose.view_causes import causes_of_views
from robocal.estimate.problem import Problem
from robocal.fit.noise import by_observation, owners
from robocal.measure.base import Rows, kind_of, predict_rows
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Named", "Outlier", "causes_of", "name_outliers"]

MAD = 0.6745  # the median distance of a standard normal number from 0


@record
class Outlier:
    """An observation that does not belong to the others: where it stands and what was measured (SI), how many robust standard
    deviations it is away from a fit without it, the chance that the farthest of all rows would be, whether it was set aside,
    whether the verdict counts its error (of a row that was set aside too, where one of the two models comes near it), and the
    likeliest cause. Of a view that does not belong to the others as a whole: how many `rows` it has, of which `row` is the first, and the
    median distance of these; `view` is false of a row on its own."""

    configuration: str
    group: str
    kind: str
    target: str
    source: str
    row: int | None
    distance: float
    p_value: float
    leverage: float
    value: tuple[float, ...] = ()
    set_aside: bool = True
    counted: bool = False
    cause: Remark | None = None
    rows: int = 1

    @property
    def view(self) -> bool:
        """Whether this is a view, all of it."""
        return self.rows > 1


def name_outliers(
    model: Model,
    data: DataSet,
    problem: Problem,
    x: Array,
    away: StudentisedResiduals,
    counted: Mapping[str, Bools] | None = None,
) -> tuple[Outlier, ...]:
    """The rows of a problem that are far from its solution x (1, P), or set aside, by name, the farthest first.

    `data` marks those that were set aside, and `away` says how far each is. `counted` are those whose error the verdict counts, by unit
    in the order of `evidence.errors`.
    """
    out, told_of = [], []
    seen = dict.fromkeys(counted or (), 0)
    some = by_observation(data, problem, [o | ~t.used for o, t in zip(away.outlying, problem.terms, strict=True)])
    blocks = [view_blocks(o, s) for o, s in zip(data.observations, some, strict=True)]
    for t, (own, term) in enumerate(owners(data, problem)):
        told = np.zeros(len(term.index), dtype=bool)
        for *_, unit in term.parts:
            if counted is not None and unit in counted:
                told |= counted[unit][seen[unit] : seen[unit] + len(told)]
                seen[unit] += len(told)
        told_of.append(told)
        obs = data.observations[own]
        # What is far and was used all the same is no gross row, but it is told.
        strange = np.flatnonzero((away.outlying[t] | ~term.used) & (blocks[own][term.index] < 0))
        said = _causes(obs, term, x, strange, _of_targets(model, data, own, term.index[strange], problem, x))
        for i in strange:
            row = int(term.index[i])
            out.append(
                Outlier(
                    data.configurations.ids[int(term.configuration[i])], term.group, term.kind, term.target, obs.source,
                    None if obs.rows is None else int(obs.rows[row]),
                    float(away.distance[t][i]), float(away.chance[t][i]), float(away.leverage[t][i]),
                    tuple(float(v) for v in obs.value[row]), not bool(term.used[i]),
                    bool(told[i]), said[int(i)],
                )
            )  # fmt: skip
    if any((b >= 0).any() for b in blocks):
        out += _name_views(model, data, problem, x, away, told_of, blocks)
    return tuple(sorted(out, key=lambda o: -o.distance))


def _name_views(
    model: Model,
    data: DataSet,
    problem: Problem,
    x: Array,
    away: StudentisedResiduals,
    told: Sequence[Bools],
    blocks: Sequence[Ints],
) -> Iterator[Outlier]:
    """The views that are far as a whole, each as one."""
    distance, chance, leverage = (by_observation(data, problem, v) for v in (away.distance, away.chance, away.leverage))
    counted, used = (by_observation(data, problem, v) for v in (told, [t.used for t in problem.terms]))
    for own, (obs, block) in enumerate(zip(data.observations, blocks, strict=True)):
        each = [np.flatnonzero(block == b) for b in np.unique(block[block >= 0])]
        causes = causes_of_views(model, data, own, each, problem, x)
        for rows, cause in zip(each, causes, strict=True):
            # A view as a whole is named by its configuration, a part of one by its target too.
            seen = np.count_nonzero(obs.configuration == obs.configuration[rows[0]])
            part = obs.target is not None and len(rows) < seen
            yield Outlier(
                configuration=data.configurations.ids[int(obs.configuration[rows[0]])],
                group=obs.label,
                kind=obs.kind,
                target=obs.targets[int(obs.target[rows[0]])].name if part and obs.target is not None else "",
                source=obs.source,
                row=None if obs.rows is None else int(obs.rows[rows].min()),
                distance=float(np.median(distance[own][rows])),
                p_value=float(chance[own][rows].min()),
                leverage=float(np.median(leverage[own][rows])),
                set_aside=not used[own][rows].any(),
                counted=bool(counted[own][rows].any()),
                cause=cause,
                rows=len(rows),
            )


def _causes(obs: Observations, term: Rows, x: Array, strange: Ints, of_targets: Array | None) -> dict[int, Remark]:
    """The likeliest cause of every strange row of a term: from what it says itself, else from what the others predict;
    `of_targets` (n, T, d) is what the n strange rows would read of each target."""
    alone = {int(i): cause(obs, int(term.index[i])) for i in strange}
    start, stop, _ = kind_of(obs).parts[0]
    if not alone or stop - start < 2:
        return alone

    value, predicted = (v[:, start:stop] for v in (term.value[0], term.predict(np.atleast_2d(x))))
    off = np.abs(value - predicted)[term.used]
    spread = np.median(off, axis=0) / MAD if len(off) else np.zeros(stop - start)
    rows = term.index if obs.rows is None else obs.rows[term.index]
    seen, mine = None, None
    if of_targets is not None and obs.target is not None:
        seen, mine = np.full((len(value), *of_targets.shape[1:]), np.nan)[..., start:stop], obs.target[term.index]
        seen[strange] = of_targets[..., start:stop]
    names = tuple(t.name for t in obs.targets)
    found = causes_of(strange, value, predicted, spread, of_targets=seen, target=mine)
    told = {n.row: n.remark(rows, names) for n in found}
    return {i: told.get(i, said) if said.code is Code.CAUSE_ALONE else said for i, said in alone.items()}


def _of_targets(model: Model, data: DataSet, own: int, rows: Ints, problem: Problem, x: Array) -> Array | None:
    """What some rows of one instrument would read of each of its targets, (n, T, d); None where it has one target."""
    obs = data.observations[own]
    if obs.target is None or len(obs.targets) < 2 or not len(rows):
        return None
    n, count = len(rows), len(obs.targets)
    each = replace(obs.take(np.tile(rows, count)), target=np.repeat(np.arange(count), n))
    return np.moveaxis(predict_rows(model, data, each, problem.table, x).reshape(count, n, -1), 0, 1)


def cause(obs: Observations, row: int) -> Remark:
    """The likeliest cause of a gross row, from what it says itself."""
    for start, stop, _ in kind_of(obs).parts:
        zero = (obs.value[:, start:stop] == 0).all(axis=1)
        if stop - start > 1 and zero[row] and zero.mean() < ZERO_ROWS_SHARE:
            return Remark.of(Code.CAUSE_ZEROS)
    return Remark.of(Code.CAUSE_ALONE)


MOST = 1000  # flagged rows that are looked at


@record
class Named:
    """The cause of one row, a code: the row whose reading or configuration it is (`partner`), the target, the column (from 0), where
    the cause has one; each the index that the arrays have."""

    row: int
    cause: str
    partner: int | None = None
    target: int | None = None
    column: int | None = None

    def remark(self, rows: Ints | None = None, targets: tuple[str, ...] = ()) -> Remark:
        """In words; `rows` are the numbers that the file gives its rows."""

        def line(i: int | None) -> int | None:
            return None if i is None else int(i if rows is None else rows[i])

        target = None if self.target is None else targets[self.target] if targets else str(self.target)
        column = None if self.column is None else self.column + 1
        return Remark.of(self.cause, row=line(self.row), partner=line(self.partner), target=target, column=column)


def causes_of(
    flagged: Ints, value: Array, predicted: Array, spread: Array, *, of_targets: Array | None = None,
    target: Ints | None = None,
) -> tuple[Named, ...]:  # fmt: skip
    """The cause of every flagged row (m,) that has a likely one.

    value and predicted (k, d) of all rows in file order, lengths or angles that do not wrap; spread (d,) is the standard
    deviation of rows that are in order. `of_targets` (k, T, d) is what each target would read, `target` (k,) which one the
    row says.
    """
    rows = _Rows(value, predicted, spread)
    some = [int(i) for i in flagged[:MOST]]
    out = {i: n for i in some if (n := _plain(rows, i) or _labels(rows, i, of_targets, target)) is not None}
    for look in (_elsewhere, _columns):
        out |= look(rows, [i for i in some if i not in out])
    return tuple(out[i] for i in sorted(out))


class _Rows:
    """Values and predictions in units of the noise."""

    def __init__(self, value: Array, predicted: Array, spread: Array) -> None:
        scale = np.maximum(spread, 1e-300)
        self.raw, self.value, self.predicted = value, value / scale, predicted / scale
        # A prediction is not certain either: the radius is that of a difference.
        self.radius = math.sqrt(2 * float(scipy.special.chdtri(value.shape[1], MATCH_CHANCE)))
        self.width = math.sqrt(2 * float(scipy.special.chdtri(1, MATCH_CHANCE)))

    def fits(self, i: int, predicted: Array) -> NDArray[np.bool_]:
        """Which of some predictions (n, d) row i fits."""
        return np.asarray(np.linalg.norm(self.value[i] - predicted, axis=-1) < self.radius)


def _plain(rows: _Rows, i: int) -> Named | None:
    """Copies: what needs no prediction. Of zeros `cause` speaks, or they are what the instrument reads wherever it is."""
    if (rows.raw[i] == 0).all():
        return None
    same = np.flatnonzero((rows.raw == rows.raw[i]).all(axis=1))
    others = [int(j) for j in same if j != i and bool(rows.fits(int(j), rows.predicted[j]))]
    if others and rows.raw.shape[1] > 1:
        return Named(i, Code.ROW_COPY, min(others, key=lambda j: abs(j - i)))
    return None


def _labels(rows: _Rows, i: int, of_targets: Array | None, target: Ints | None) -> Named | None:
    """Another target that stands where this one should."""
    if of_targets is None or target is None or of_targets.shape[1] < 2:
        return None
    scale = np.divide(rows.raw[i], rows.value[i], out=np.ones_like(rows.raw[i]), where=rows.value[i] != 0)
    fits = rows.fits(i, of_targets[i] / scale)
    fits[target[i]] = False
    # Targets that cannot be told apart explain nothing.
    return Named(i, Code.ROW_TARGET, target=int(np.flatnonzero(fits)[0])) if fits.sum() == 1 else None


def _elsewhere(rows: _Rows, some: list[int]) -> dict[int, Named]:
    """Rows that fit the configuration of another row."""
    match: dict[int, set[int]] = {}
    luck = 0.0
    for i in some:
        fits = rows.fits(i, rows.predicted)
        fits[i] = False
        match[i] = set(map(int, np.flatnonzero(fits)))
        near = np.linalg.norm(rows.predicted - rows.predicted[i], axis=1) < rows.radius
        luck += float(near.sum() - 1) / max(len(some), 1)
    out: dict[int, Named] = {}
    for i, found in match.items():
        mutual = sorted(j for j in found if i in match.get(j, ()))
        if mutual and luck < 1:
            out[i] = Named(i, Code.ROW_SWAPPED, mutual[0])
        elif found and luck < MATCH_LUCK:
            nearest = min(found, key=lambda j: float(np.linalg.norm(rows.value[i] - rows.predicted[j])))
            out[i] = Named(i, Code.ROW_ELSEWHERE, nearest)
    return out


def _columns(rows: _Rows, some: list[int]) -> dict[int, Named]:
    """Rows of which one column alone is off."""
    off: dict[int, int] = {}
    shift: dict[int, set[int]] = {}
    k, d = rows.value.shape
    for i in some:
        wrong = np.flatnonzero(np.abs(rows.value[i] - rows.predicted[i]) > rows.width)
        if d < 2 or len(wrong) != 1:
            continue
        c = off[i] = int(wrong[0])
        shift[i] = {
            s for s in (-1, 1) if 0 <= i + s < k and abs(rows.value[i, c] - rows.predicted[i + s, c]) < rows.width
        }
    count = Counter((off[i], s) for i, found in shift.items() for s in found)
    out: dict[int, Named] = {}
    for i, c in off.items():
        alike = [s for s in shift[i] if count[c, s] >= SHIFTED_ROWS]
        sign = abs(rows.value[i, c] + rows.predicted[i, c]) < rows.width
        cause = Code.ROW_SHIFTED if alike else Code.ROW_SIGN if sign else Code.ROW_COLUMN
        out[i] = Named(i, cause, i + alike[0] if alike else None, column=c)
    return out

"""Which groups beyond geometry the data support.

A group enters when (a) at least one combination of its parameters is seen above the noise, and (b) the mean error of
blocks of rows that were not used falls: the paired bootstrap 95 % interval of the reduction lies above zero. Rows are
held out in blocks of time order, since neighbours in time share what no model knows. The best group enters first, the
others are asked again on top of it, until none passes. Orders of ripple are sought anew in every round, from the rows
that it may learn from.

Orders of ripple are sought one pair (cos, sin) at a time, in what the other columns leave:

    gain(pair) = v^T (C + f I)^-1 v,    C, v: the pair's part of the Gram matrix with all chosen columns projected out

The largest gain enters while it exceeds f 2 ln(candidates / RIPPLE_CHANCE), which the largest of so many pairs of pure noise
exceeds once in 1 / RIPPLE_CHANCE times. Reference: Chen, Billings and Luo, Orthogonal least squares methods and their
application to non-linear system identification (1989).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.arms.chain import Chain, Group
from robocal.arms.groups import GROUPS, add, fix_groups, free_groups, without
from robocal.arms.joints import orders_of, turning
from robocal.diagnose.gross import set_aside
from robocal.diagnose.limits import GROUP_PLACES, RIPPLE_CHANCE
from robocal.errors import ModelError
from robocal.fit.baseline import baseline
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.fit.repeats import places
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.progress import Watch, tell
from robocal.prove.bands import range_of_joints
from robocal.prove.evidence import bootstrap_gain
from robocal.prove.judge import units_of
from robocal.prove.nongeometric.linearised import Linearised, linearise_fit, ridge_matrix
from robocal.prove.split import make_split
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["HIGHEST", "GroupChoice", "Tried", "candidates", "choose_groups", "orders", "seek", "widen"]

ROUNDS = 10
WHOLE = -1  # instead of the number of a round: all rows


@record
class Tried:
    """One group that was asked for: its parameters, what it gained on unseen blocks (mean, low, high in `unit`), and
    why it entered or not; `before` is the mean unseen error without it."""

    name: str
    parameters: int
    entered: bool
    reason: Remark
    gain: tuple[float, float, float] | None = None
    before: float | None = None
    unit: str = "m"
    orders: tuple[tuple[str, tuple[float, ...]], ...] = ()


@record
class GroupChoice:
    """The model with the groups that entered free and the others held, and the record of all."""

    model: Chain
    tried: tuple[Tried, ...]
    rows: int = 0


class _Race:
    """The state of a forward selection."""

    def __init__(self, model: Chain, data: DataSet, names: Sequence[str], bound: set[str], options: Options) -> None:
        self.groups = {g.name: g for g in model.groups if g.name in set(names)}
        self.labels: list[tuple[str, float]] = []
        wide = model
        sought = self.groups.get("ripple")
        if sought is not None and not sought.options.get("harmonics"):
            wide, found = candidates(model, sought)
            self.labels = [(j, k) for j, each in found.items() for k in each]
        configurations = np.arange(len(data.configurations))
        geometry = fix_groups(model)
        data = set_aside(geometry, data, configurations)
        start = baseline(geometry, data, configurations)[1]
        # Whatever is entered or not, the noise is that of the geometry, and only what is left of it is followed.
        part = fit(geometry, data, configurations, options, start)
        members = {g.name: tuple(p for p in g.parameters if p not in bound) for g in wide.groups}
        self.members = {name: own for name, own in members.items() if name in self.groups}
        added = [p for each in self.members.values() for p in each]
        split = make_split(data, "blocks", folds=min(ROUNDS, len(configurations)))
        self.line: Linearised = linearise_fit(wide, part, added, split)
        self.base = self.line.columns([n for n in self.line.names if n not in set(added)])
        self.unit = units_of(part.problem)[0]
        measured = range_of_joints(data.configurations)
        self.measured = {} if measured is None else dict(zip(model.joint_names, measured.tolist(), strict=True))
        self.entered: list[str] = []
        self.seed = options.seed
        self.noise = self.line.left(self.base)
        found_ = self.members.get("ripple", ())
        index = {n: i for i, n in enumerate(self.line.names)}
        self.pairs = np.array([index[n] for n in found_], dtype=np.int64).reshape(-1, 2) if self.labels else None
        self.known: dict[int, Ints] = {}  # the pairs of ripple of every round, WHOLE for all rows, once sought

    def columns(self, names: Sequence[str], k: int = WHOLE) -> Ints:
        """The columns of the geometry and some groups, as round k would choose them."""
        plain = [p for n in names for p in self.members[n] if n != "ripple" or self.pairs is None]
        own = np.concatenate([self.base, self.line.columns(plain)])
        if "ripple" in names and self.pairs is not None:
            if k not in self.known:
                self.known[k] = self.find_pairs(own, k)
            own = np.concatenate([own, self.pairs[self.known[k]].ravel()])
        return np.sort(own)

    def find_pairs(self, own: Ints, k: int) -> Ints:
        """The pairs of ripple that stand out on top of some columns, in the rows that round k may learn from."""
        assert self.pairs is not None
        line = self.line
        gram, share = (line.whole, 1.0) if k == WHOLE else (line.rounds[k], 1.0 - 1.0 / len(line.split))
        return seek(gram, own, self.pairs, self.noise, int(share * line.count))

    def errors(self, names: Sequence[str]) -> tuple[Array, Ints]:
        """Errors of held-out observations of a model with some groups."""
        return self.line.unseen(lambda k: self.columns(names, k), self.noise, self.unit)

    def ask(self, name: str, before: Array) -> Tried:
        """A group on top of those that have entered."""
        line, now = self.line, self.columns(self.entered)
        if name == "ripple":
            self.known.clear()
        added = np.setdiff1d(self.columns([*self.entered, name]), now)
        many = len(added)
        orders_ = tuple(self.orders().items()) if name == "ripple" else ()
        if not many:
            return Tried(name, 0, False, Remark.of(Code.NO_RIPPLE))
        if not line.observable_count(added, now, self.noise):
            needs = "" if np.any(line.rows[:, added]) else GROUPS[name].needs
            return Tried(name, many, False, Remark.of(Code.GROUP_UNSEEN, column=needs or None), orders=orders_)
        after, at = self.errors([*self.entered, name])
        gain = bootstrap_gain(before, after, at, self.seed)
        good = gain[1] > 0
        why = Remark.of(Code.BLOCKS_FALL if good else Code.BLOCKS_DO_NOT_FALL)
        return Tried(name, many, good, why, gain, float(before.mean()), self.unit, orders_)

    def range(self) -> dict[str, tuple[float, float]]:
        """Where the joints that ripple were measured (rad): the orders say nothing of elsewhere."""
        return {j: (low, high) for j, (low, high) in self.measured.items() if j in self.orders()}

    def orders(self) -> dict[str, tuple[float, ...]]:
        """The orders of ripple that all rows show."""
        return orders(self.known[WHOLE], self.labels) if self.pairs is not None else {}


def choose_groups(
    model: Chain,
    data: DataSet,
    extra: Mapping[str, Mapping[str, Any]] | None = None,
    options: Options | None = None,
    watch: Watch | None = None,
) -> GroupChoice:
    """Forward selection among the groups of a model that have a free parameter, and `extra` ones by name, with their
    options; see the module.

    What does not enter keeps its values; an extra group is not added then. Raises ModelError for unknown groups, or
    when nothing else is free.
    """
    options, extra = options or Options(), dict(extra or {})
    bound = {p for g in model.groups for p in g.parameters} - set(model.table.free)
    wide = model
    for name, given in extra.items():
        wide = add(wide, name, given)
    wanted = [g.name for g in wide.groups if not g.parameters or set(g.parameters) - bound]
    if not wanted:
        return GroupChoice(model, ())
    if len(np.unique(places(data.configurations))) < GROUP_PLACES:
        few = Remark.of(Code.GROUP_FEW, least=GROUP_PLACES)
        tried = [Tried(g.name, len(g.parameters), False, few) for g in wide.groups if g.name in wanted]
        return GroupChoice(fix_groups(model), tuple(tried))
    race = _Race(wide, data, wanted, bound, options)
    record: dict[str, Tried] = {}
    open_ = list(wanted)
    while open_:
        before, _ = race.errors(race.entered)
        asked = []
        for name in open_:
            tell(watch, "groups", what=name)
            asked.append(race.ask(name, before))
        record.update({t.name: t for t in asked})
        good = [t for t in asked if t.entered]
        if not good:
            break
        best = max(good, key=lambda t: t.gain[0] if t.gain else 0.0)
        race.entered.append(best.name)
        open_.remove(best.name)
        race.noise = race.line.left(race.columns(race.entered))
    made = _chosen(model, race, extra, bound)
    return GroupChoice(made, tuple(record[n] for n in (*race.entered, *open_)), race.line.count)


def widen(model: Model) -> tuple[Model, dict[str, tuple[str, ...]]]:
    """The machine with every group that may be asked by name alone, and the parameters of each; itself, where it knows none."""
    found: dict[str, tuple[str, ...]] = {}
    made: Any = model
    if getattr(model, "groups", None) != ():
        return model, found
    for name in GROUPS:
        with suppress(ModelError):  # masses that nobody states
            made = add(made, name)
            found[name] = made.groups[-1].parameters
    return made, {n: own for n, own in found.items() if own}


def _chosen(model: Chain, race: _Race, extra: Mapping[str, Mapping[str, Any]], bound: set[str]) -> Chain:
    """The model with what has entered free and the rest held."""
    made = fix_groups(model)
    for name in race.entered:
        sought = name == "ripple" and race.pairs is not None
        if name in extra or sought:
            options = {**(extra.get(name) or race.groups[name].options)}
            made = made if name in extra else without(made, name)
            made = add(made, name, options | ({"harmonics": race.orders(), "range": race.range()} if sought else {}))
    made = free_groups(made, race.entered)
    return replace(made, table=made.table.with_free(n for n in made.table.free if n not in bound))


HIGHEST = 64


def candidates(model: Chain, group: Group) -> tuple[Chain, dict[str, tuple[float, ...]]]:
    """The model with every order up to the group's `highest` that a joint does not have yet, and these orders."""
    highest = int(group.options.get("highest", HIGHEST))
    there = orders_of(model)
    found = {
        j: tuple(float(k) for k in range(1, highest + 1) if k not in there.get(j, ()))
        for j in turning(model, tuple(group.options.get("joints", ())))
    }
    options = {**group.options, "harmonics": found}
    return add(without(model, group.name), group.name, options), found


def seek(gram: Array, base: Ints, pairs: Ints, noise: float, rows: int) -> Ints:
    """The numbers of the pairs (p, 2) that enter, in order of gain; gram (n + 1, n + 1) has the residual last."""
    if not len(pairs):
        return np.zeros(0, dtype=np.int64)
    rest = np.array([*pairs.ravel(), len(gram) - 1])
    cross = gram[np.ix_(base, rest)]
    c = gram[np.ix_(rest, rest)] - cross.T @ np.linalg.solve(ridge_matrix(gram, base, noise), cross)
    limit = 2.0 * np.log(len(pairs) / RIPPLE_CHANCE)
    first = np.arange(0, 2 * len(pairs), 2)
    second = first + 1
    chosen: list[int] = []
    a, b, d = c[first, first], c[first, second], c[second, second]
    u, v, square = c[first, -1], c[second, -1], float(c[-1, -1])
    # c less what the chosen ones answer is c - F G: only of pairs, and of columns that enter, anybody asks what it is.
    f, g = np.zeros((len(c), 0)), np.zeros((0, len(c)))
    open_ = np.ones(len(pairs), dtype=bool)
    while open_.any():
        left = max(square, 0.0) / max(rows - len(base) - 2 * len(chosen), 1)
        aa, dd = a + left, d + left
        gain = np.where(open_, (dd * u**2 - 2 * b * u * v + aa * v**2) / (aa * dd - b**2), 0.0)
        best = int(np.argmax(gain))
        if gain[best] <= left * limit:
            break
        chosen.append(best)
        open_[best] = False
        two = [2 * best, 2 * best + 1]
        more = c[:, two] - f @ g[:, two]
        answer = np.linalg.solve(more[two] + left * np.eye(2), more.T)
        f, g = np.hstack([f, more]), np.vstack([g, answer])
        one, other, last = more[first], more[second], answer[:, -1]
        a, b = a - (one.T * answer[:, first]).sum(axis=0), b - (one.T * answer[:, second]).sum(axis=0)
        d = d - (other.T * answer[:, second]).sum(axis=0)
        u, v, square = u - one @ last, v - other @ last, square - float(more[-1] @ last)
    return np.array(chosen, dtype=np.int64)


def orders(found: Ints, labels: Sequence[tuple[str, float]]) -> dict[str, tuple[float, ...]]:
    """The orders of every joint, ascending, of the pairs that entered."""
    out: dict[str, list[float]] = {}
    for i in np.sort(found):
        joint, order = labels[i]
        out.setdefault(joint, []).append(order)
    return {joint: tuple(sorted(values)) for joint, values in out.items()}

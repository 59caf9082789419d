"""Which data are fitted and which are not used: a split is any number of rounds, each with its own held-out configurations.

    held (K, U)   what round k predicts
    fit (K, U)    what round k may learn from: not held out, and not tied to what is held out

A configuration is held out with all rows that begin there. Two are tied when they share a *place* (equal joint
values), through the first or the second configuration of a row: whoever fits a row that ends at a place has seen that
place. Units that are tied to held-out ones are fitted by nobody in that round (embargo). A hub, touched by more than
half of the rows that compare two configurations, ties nothing: everything would hang together.

One round is a plain hold-out; K rounds that hold out everything once are k-fold; a round per place is leave-one-out.
Reference: Arlot and Celisse, A survey of cross-validation procedures (2010), section 8 for dependent data.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Bools, Ints
from robocal.diagnose.limits import GROUP_FOLDS, HOLD_OUT_PLACES, HOLD_OUT_SHARE
from robocal.errors import ModelError
from robocal.fit.repeats import places
from robocal.measure.data import Configurations, DataSet

__all__ = ["Split", "default_hold_out", "groups_of", "leave_one_out_rounds", "make_split", "stratify"]

BLOCKS = 10  # grid: blocks, and names that a sentence lists
DECIMALS = 9  # tolerance: of poses in m and rad


@record
class Split:
    """Rounds of holding out; see the module. `how` says in words how they were drawn, `together` (U,) the block or group
    of each configuration where whole ones are held out."""

    held_out: Bools  # (K, U)
    fit: Bools  # (K, U)
    names: tuple[str, ...]
    how: str
    together: Ints | None = None

    def __len__(self) -> int:
        return len(self.held_out)

    @property
    def round_of(self) -> Ints:
        """The (first) round that holds out each configuration, or -1, (U,)."""
        return (
            np.where(self.held_out.any(axis=0), self.held_out.argmax(axis=0), -1)
            if len(self)
            else np.full(self.held_out.shape[1], -1)
        )

    def configurations(self, k: int) -> tuple[Ints, Ints]:
        """Fitted and held-out configurations of one round."""
        return np.flatnonzero(self.fit[k]), np.flatnonzero(self.held_out[k])

    @classmethod
    def of(cls, data: DataSet, held: Bools, names: tuple[str, ...], how: str, together: Ints | None = None) -> Split:
        """A split that holds out these configurations, with everything that is tied to them left out of the fit; rounds that hold
        out nothing are dropped."""
        told: Bools = np.asarray(held.any(axis=1))
        held, names = held[told], tuple(n for n, t in zip(names, told, strict=True) if t)
        configuration, place = _place_pairs(data)
        tied = np.zeros_like(held)
        for row, out in zip(tied, held, strict=True):
            row[configuration[np.isin(place, place[out[configuration]])]] = (
                True  # meets a place of rows that are held out
            )
        return cls(held, ~held & ~tied, names, how, together)


def _stood(configurations: Configurations) -> Bools:
    """Where the machine stood somewhere, (U,). What was known without it, such as the distance of two sockets, is held out
    with its group only: left out alone, it would leave nothing that knows how long a metre is."""
    joints = configurations.joints
    return np.ones(len(configurations), dtype=bool) if joints is None else np.asarray(np.isfinite(joints).all(axis=1))


def _place_pairs(data: DataSet) -> tuple[Ints, Ints]:
    """Which places each configuration touches, its own and the ends of its rows, without hubs: configurations and places, one by one."""
    label = places(data.configurations)
    pairs = [(o.configuration, o.second) for o in data.observations if o.second is not None]
    configuration, place = [np.arange(len(label))], [label]
    if pairs:
        first, second = (np.concatenate(p) for p in zip(*pairs, strict=True))
        both = np.stack([label[first], label[second]])
        rows = np.bincount(both[0], minlength=len(label)) + np.bincount(
            both[1][both[0] != both[1]], minlength=len(label)
        )
        hub = rows > len(first) / 2
        keep = ~hub[both[1]]
        configuration.append(first[keep])
        place.append(both[1][keep])
    return np.concatenate(configuration), np.concatenate(place)


def groups_of(data: DataSet) -> tuple[str, ...]:
    """The group of every configuration: as stated ("" belongs to none), or the file that its measurements come from.

    Raises ModelError when there are fewer than two.
    """
    groups = data.configurations.groups
    if groups is None:
        source = np.full(len(data.configurations), "", dtype=object)
        for obs in data.observations:
            source[obs.configuration] = obs.source
        groups = tuple(source)
    if len(set(groups) - {""}) < 2:
        expected = "a column that names the group of every row, or several data files"
        raise ModelError("there are no groups to hold out", key="hold_out", found="group", expected=expected)
    return groups


def default_hold_out(data: DataSet, folds: int | None) -> tuple[float | str, int | None]:
    """What is held out where nobody says it, as `make_split` takes it, and in how many rounds.

    Groups that are stated are held out whole, as long as they are few all of them in turn. Else it is a share of the places, or none
    where folds or leave-one-out are the proof.
    """
    groups = len(set(data.configurations.groups or ()) - {""})
    if groups >= max(2, folds or 0):
        return "group", min(GROUP_FOLDS, groups) if folds is None and groups < HOLD_OUT_PLACES else folds
    enough = folds is None and len(np.unique(places(data.configurations))) >= HOLD_OUT_PLACES
    return HOLD_OUT_SHARE if enough else 0.0, folds


def make_split(
    data: DataSet, how: float | str, *, folds: int | None = None, blocks: int = BLOCKS, seed: int = 0
) -> Split:
    """A split of a data set: one round, or `folds` rounds that hold out everything once.

    how: a share in [0, 0.5], spread over joint space; "blocks": rows in time order (their `time` column, else their
    order in the file) cut into so many blocks, a fifth of which is held out, or every one in turn; "group": whole
    groups. Raises ModelError for what cannot be done.
    """
    where = data.configurations
    if how == "group":
        groups = np.array(groups_of(data), dtype=str)
        names = np.unique(groups[groups != ""])
        # What belongs to no group is fitted in every round.
        label = np.where(groups == "", -1, np.searchsorted(names, groups))
        return _rounds(data, label, folds, seed, "group", tuple(map(str, names)), ordered=False)
    if how == "blocks":
        many = blocks if folds is None else folds
        order = where.columns.get("time", np.full(1, np.nan))
        order = order if np.isfinite(order).all() else np.arange(len(where))
        if not 2 <= many <= len(where):
            expected = f"2 to {len(where)} configurations"
            raise ModelError("impossible number of blocks", key="blocks", found=many, expected=expected)
        label = np.empty(len(where), dtype=np.int64)
        label[np.argsort(order, kind="stable")] = np.arange(len(where)) * many // len(where)
        label[~_stood(where)] = -1
        return _rounds(data, label, folds, seed, "block", tuple(f"block {i + 1}" for i in range(many)), ordered=True)
    if isinstance(how, str):
        raise ModelError("unknown way to hold out", key="hold_out", found=how, expected="a share, blocks or group")
    if folds is not None:
        label = np.where(_stood(where), _dealt(where, folds, seed), -1)
        return _rounds(data, label, folds, seed, "fold", tuple(f"fold {i + 1}" for i in range(folds)), ordered=True)
    held = np.zeros((1, len(where)), dtype=bool)
    held[0, stratify(where, how, seed)[1]] = True
    held &= _stood(where)
    return Split.of(data, held, ("held out",), "held out")


def _rounds(
    data: DataSet, label: Ints, folds: int | None, seed: int, noun: str, names: tuple[str, ...], *, ordered: bool
) -> Split:
    """Rounds that hold out whole labels: a fifth of them once, or all of them in `folds` rounds."""
    many = len(names)
    rng = np.random.default_rng(seed)
    together = None if noun == "fold" else label
    if folds is None:
        chosen = np.sort(rng.permutation(many)[: max(1, round(HOLD_OUT_SHARE * many))])
        held = np.isin(label, chosen)[None]
        words = ", ".join(names[i] for i in chosen) if many <= BLOCKS else f"{len(chosen)} of {many} {noun}s"
        return Split.of(data, held, (words,), f"{noun}s held out", together)
    if not 2 <= folds <= many:
        raise ModelError("impossible number of folds", key="folds", found=folds, expected=f"2 to {many}")
    # Labels that outnumber the rounds are dealt out; otherwise every round is one of them.
    dealt = np.arange(many) if ordered or folds == many else rng.permutation(many)
    turn = np.empty(many, dtype=np.int64)
    turn[dealt] = np.arange(many) % folds
    held = (turn[label] == np.arange(folds)[:, None]) & (label >= 0)
    called = names if folds == many else tuple(f"fold {i + 1}" for i in range(folds))
    how = f"{folds} folds" if noun == "fold" else f"{folds} folds of {noun}s"
    return Split.of(data, held, called, how, together)


def leave_one_out_rounds(data: DataSet) -> Split:
    """A round for every place at which something was measured."""
    label = places(data.configurations)
    measured, stood = np.zeros(len(label), dtype=bool), _stood(data.configurations)
    for obs in data.observations:
        measured[obs.configuration] = True
    measured &= stood
    every = np.unique(label[measured])
    return Split.of(data, (label == every[:, None]) & measured, tuple(map(str, every)), "leave-one-out")


def _cells(configurations: Configurations, rng: np.random.Generator, stop: int, size: int) -> tuple[list[Ints], Ints]:
    """Space halved along its widest direction until there are `stop` cells, or cells of at most `size` places; and a
    configuration of each place."""
    label = places(configurations)
    first = np.unique(label, return_index=True)[1]
    place = configurations.joints
    if place is None:
        given = configurations.start
        # Poses were computed: their last bits are no direction, and decide nothing.
        place = np.zeros((len(label), 1)) if given is None else np.round(given, DECIMALS)
    place = np.nan_to_num(place)[first]
    spread = np.ptp(place, axis=0)
    place = place / np.where(spread > 0, spread, 1.0)
    # The largest cell is halved, of equal ones the oldest; all of one size are halved together.
    cells, made = {0: np.arange(len(first))}, 1
    sizes = {len(first): [0]}
    while len(cells) < stop and (long := max(sizes)) > size:
        every = sizes.pop(long)
        halved, left = every[: stop - len(cells)], every[stop - len(cells) :]
        if left:
            sizes[long] = left
        rows = np.array([cells.pop(i) for i in halved])
        here = place[rows.T]  # the rows of a cell first: numpy compares whole cells at once
        widest = np.argmax(here.max(axis=0) - here.min(axis=0), axis=1)
        along = place[rows, widest[:, None]]
        chance, order = rng.random(rows.shape), np.argsort(along, axis=1)
        # Equal values get a random order, so that no file order leaks into the split.
        tied = (np.diff(np.take_along_axis(along, order, axis=1)) == 0).any(axis=1)
        order[tied] = np.lexsort((chance[tied], along[tied]))
        rows = np.take_along_axis(rows, order, axis=1)
        half = long // 2
        for cell in rows:
            for part in (cell[:half], cell[half:]):
                cells[made] = part
                sizes.setdefault(len(part), []).append(made)
                made += 1
    return list(cells.values()), label


def stratify(configurations: Configurations, fraction: float, seed: int) -> tuple[Ints, Ints]:
    """Fit and held-out configurations: space is halved along its widest direction until a cell holds about 1 / fraction places,
    one of each is held out, with all of its repeats.

    So both sets cover the same joint space. Raises ModelError for a fraction outside [0, 0.5].
    """
    if not 0 <= fraction <= 0.5:
        raise ModelError("the held-out share must lie between 0 and 0.5", key="hold_out", found=fraction)
    everyone = np.arange(len(configurations))
    many = round(fraction * len(np.unique(places(configurations))))
    if many == 0:
        return everyone, everyone[:0]
    rng = np.random.default_rng(seed)
    cells, label = _cells(configurations, rng, many, 0)
    chosen = [int(cell[rng.integers(len(cell))]) for cell in cells if len(cell)]
    held = everyone[np.isin(label, chosen)]
    return np.setdiff1d(everyone, held), held


def _dealt(configurations: Configurations, folds: int, seed: int) -> Ints:
    """A fold for every configuration: cells of joint space of about `folds` places are dealt out, so that every fold
    covers the whole."""
    count = len(np.unique(places(configurations)))
    if not 2 <= folds <= count:
        raise ModelError("impossible number of folds", key="folds", found=folds, expected=f"2 to {count} places")
    rng = np.random.default_rng(seed)
    cells, label = _cells(configurations, rng, count, folds)
    turn = np.empty(count, dtype=np.int64)
    next_ = 0
    for cell in cells:
        # The hand goes round the table from cell to cell, so that all folds have equally many.
        turn[rng.permutation(cell)] = (next_ + np.arange(len(cell))) % folds
        next_ += len(cell)
    return turn[label]

"""Which configurations stood at the same place: repeats, that are held out together and that show what readings scatter by.

Encoders jitter, so configurations closer than NEAR are always one place. Who visits places again may come back less closely. Such
visits are a place as well, by three conditions, with |.| the largest component:

    diameter   max |q_i - q_j| <= L / PLACE_GAP
    apart      min |q_i - q_k| > L for every k of another place
    habit      at least PLACE_SHARE of the configurations stand at a place with company

Here L takes all values from small to PLACE_DIAMETER PLACE_GAP, each half the next. Where that is so, all that lies together within
WIDER times the size of those places is one of them. A row of a path has neighbours beyond any diameter, and is a place of its own. By
chance, poses of a list hardly stand so: of uniform ones in two joints one in twenty, in six joints none.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.fit.limits import PLACE_DIAMETER, PLACE_GAP, PLACE_SHARE
from robocal.measure.data import Configurations

__all__ = ["NEAR", "joined", "places"]

NEAR = 2e-4  # tolerance: rad or m, in every joint
WIDER = 1.5  # tolerance: times the widest place that stands apart from others
FINER = 2.0  # grid: times from one size of places to the next
CROWD = 256  # grid: neighbours; no place of a list has so many, and all pairs of a path would be too many
WIDE = 1 << 16  # grid: distances at once: more would leave the cache
ROUNDING = 1e-9  # tolerance: of a step: two numbers that far apart may lie a rounding further
LARGEST = np.iinfo(np.int64).max
ASKED = 100  # grid: rows of which neighbours are looked at
GLANCE = 20  # grid: distances from one that is looked at to the next


def places(configurations: Configurations) -> Ints:
    """A number for every configuration, equal where the machine stood at the same place; see the module. Repeats are held out
    together, or the fit would have seen them."""
    known: Ints | None = configurations.memo.get("places")
    if known is None:
        known = configurations.memo["places"] = _visits(configurations, joined(configurations, NEAR))
    return known.copy()


def joined(configurations: Configurations, near: float) -> Ints:
    """A number for every configuration, equal where steps lead from one to the other in which no joint moves by more than `near`
    (rad, m)."""
    place = _where(configurations)
    if place is None or not len(place):
        return np.arange(len(configurations))
    return _first(place, _link(np.nan_to_num(place), near)[0])


def _where(configurations: Configurations) -> Array | None:
    return configurations.joints if configurations.joints is not None else configurations.start


def _visits(configurations: Configurations, label: Ints) -> Ints:
    """These labels (U,), one for each set of equal joint values, where places that were visited again have one."""
    place = _where(configurations)
    if place is None or len(label) < 2:
        return label
    first = np.unique(label, return_index=True)[1]
    first = first[np.isfinite(place[first]).all(axis=1)]
    stood = place[first]
    times = np.bincount(label)[label[first]]  # how often each was visited as closely as encoders repeat
    company = times > 1
    enough = PLACE_SHARE * int(times.sum())
    # A look at some rows is enough to know a path or a list.
    asked = np.arange(0, len(stood), -(-len(stood) // ASKED) or 1)
    alone, nearest = _stand_apart(stood, asked)
    if (
        len(stood) < 2
        or not alone.any()
        or times[asked[alone | company[asked]]].sum() < times[asked].sum() * PLACE_SHARE / 2
    ):
        return label
    own, widest = np.arange(len(first)), 0.0
    finer = int(np.log(PLACE_DIAMETER / max(nearest, NEAR / PLACE_GAP)) / np.log(FINER))
    # From fine to coarse: a place that is met again at a coarser level holds the finer ones.
    for size in PLACE_DIAMETER / FINER ** np.arange(finer, -1, -1):
        some, lead, span = _compact(stood, float(size), PLACE_GAP * float(size))
        own[some], company[some], widest = lead, True, max(widest, span)
    if times[company].sum() < enough:
        return label
    # Who visits places visits those too that have another one nearer than that: they are about as large as the widest.
    size = min(WIDER * widest, PLACE_DIAMETER)
    some, lead, _ = _compact(stood, size, size)
    own[some] = lead
    merged = np.arange(len(label))
    merged[label[first]] = label[first[own]]
    return _first(place, merged[label])


def _stand_apart(stood: Array, asked: Ints) -> tuple[Bools, float]:
    """Which of some rows may stand at a place with company, which no other one is near to, and the least distance of any to its next."""
    k = min(CROWD, len(stood) - 1)
    if k < 1:
        return np.zeros(len(asked), dtype=bool), np.inf
    each = max(1, WIDE // len(stood))
    columns = np.ascontiguousarray(stood.T)
    parts = [_nearest(columns[:, asked[first : first + each]], columns, k) for first in range(0, len(asked), each)]
    far = np.sort(np.concatenate(parts), axis=1)
    after = np.column_stack([far[:, 2:], np.full(len(far), np.inf if k == len(stood) - 1 else 0.0)])
    near = far[:, 1:]
    alone = np.asarray(((near <= PLACE_DIAMETER) & (after > PLACE_GAP * near)).any(axis=1))
    return alone, float(near.min())


def _nearest(some: Array, stood: Array, k: int) -> Array:
    """The k + 1 least distances of some rows (n, a) to all (n, m), (a, k + 1), in any order."""
    far, gap = np.zeros((2, some.shape[1], stood.shape[1]))
    for own, values in zip(some, stood, strict=True):
        np.maximum(far, np.abs(np.subtract(own[:, None], values, out=gap), out=gap), out=far)
    return np.stack([_least(row, k) for row in far])


def _least(far: Array, k: int) -> Array:
    """The k + 1 least of many, by those up to what every GLANCE-th of them says of three times as many: quicker than by all."""
    some, at = far[::GLANCE], 3 * k // GLANCE
    near = far[far <= np.partition(some, at)[at]] if at < len(some) else far
    return np.asarray(np.partition(near if len(near) > k else far, k)[: k + 1])


def _compact(stood: Array, size: float, gap: float) -> tuple[Ints, Ints, float]:
    """Rows (m, n) with company within `size` and nothing else within `gap`: which, the first of each one's company, and how far the
    widest of these reaches."""
    near, whole = _link(stood, gap)
    order = np.argsort(near, kind="stable")
    starts = np.flatnonzero(np.append(True, np.diff(near[order]) > 0))
    rows = stood[order]
    span = (np.maximum.reduceat(rows, starts) - np.minimum.reduceat(rows, starts)).max(axis=1)
    count = np.diff(np.append(starts, len(order)))
    good = (span <= size) & (count > 1) & whole[order[starts]]
    some = np.repeat(good, count)
    return order[some], np.repeat(order[starts], count)[some], float(span[good].max(initial=0.0))


def _first(place: Array, label: Ints) -> Ints:
    """Labels numbered by the first of each; one without joint values (two sockets a known distance apart) is a place of its own."""
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    order = first[inverse.ravel()]
    unknown = np.flatnonzero(np.isnan(place).any(axis=1))
    order[unknown] = len(place) + np.arange(len(unknown))
    return np.unique(order, return_inverse=True)[1].ravel()


def _link(place: Array, near: float) -> tuple[Ints, Bools]:
    """A number for every row (m,), equal where rows are linked by steps of at most `near` in every component, and whether all of its
    steps were looked at: in a crowd they are not, and rows keep the number of their chain."""
    label = _chains(place, near)
    some, whole = _loose(place, label, near), np.ones(len(place), dtype=bool)
    if not len(some):
        return label, whole
    cells = _Cells(place[some], label[some], near)
    asked = np.arange(0, len(some), max(1, len(some) // ASKED))
    if near > NEAR and sum(len(a) for a, _ in cells.pairs(asked)) > CROWD * len(asked):
        whole[some] = False
        return label, whole
    linked = np.arange(len(some))
    for a, b in cells.pairs(linked.copy()):
        _merge(linked, a, b)
    label[some] = len(place) + linked
    return label, whole


class _Cells:
    """Rows (m, n) in cells by their chain and the three components that extend furthest: what is within a step of a row lies in its cell
    or beside it."""

    def __init__(self, rows: Array, chain: Ints, near: float) -> None:
        self.columns, self.near = np.ascontiguousarray(rows.T), near
        number, beside = np.unique(chain, return_inverse=True)[1], np.zeros(1, dtype=np.int64)
        for values in self.columns[np.argsort(-np.ptp(rows, axis=0), kind="stable")[:3]]:
            # Many empty cells between two count as one: the numbers of all three components fit into one.
            found, own = np.unique(np.floor(values / (near * (1 + ROUNDING))), return_inverse=True)
            at = np.cumsum(np.append(1, np.minimum(np.diff(found), 2))).astype(np.int64)
            many = int(at[-1]) + 2
            if (int(number.max()) + 1) * many > LARGEST:
                break
            number, beside = number * many + at[own], np.add.outer(beside * many, np.arange(-1, 2)).ravel()
        self.number, self.order = number, np.argsort(number, kind="stable")
        self.beside = beside[len(beside) > 1 :: 3]  # each with the one before and the one behind it

    def pairs(self, asked: Ints) -> Iterator[tuple[Ints, Ints]]:
        """The pairs of rows within a step of each other, the first of which is asked for, each with itself too; some at a time."""
        lying = self.number[self.order]
        for step in self.beside:
            low = np.searchsorted(lying, self.number[asked] + step - 1)
            count = np.searchsorted(lying, self.number[asked] + step + 1, side="right") - low
            ends = np.cumsum(count)
            for part in np.split(np.arange(len(asked)), np.flatnonzero(np.diff(ends // WIDE)) + 1):
                some = count[part]
                a = np.repeat(asked[part], some)
                b = self.order[np.repeat(low[part] - np.cumsum(some) + some, some) + np.arange(len(a))]
                for values in self.columns:
                    close = np.abs(values[a] - values[b]) <= self.near
                    a, b = a[close], b[close]
                yield a, b


def _merge(label: Ints, a: Ints, b: Ints) -> None:
    """Gives rows that are linked, a and b, the least label of all that are linked to them; a label is the number of a row that has it."""
    while len(a):
        one, other = label[a], label[b]
        apart = one != other
        a, b = a[apart], b[apart]
        np.minimum.at(label, np.maximum(one, other)[apart], np.minimum(one, other)[apart])
        while (label[label] != label).any():
            label[:] = label[label]


def _chains(place: Array, near: float) -> Ints:
    """A number for every row, equal at least where rows are linked by steps of at most `near` in every component: rows are parted
    wherever a component has a gap, until no gap is left."""
    label, count, some = np.zeros(len(place), dtype=np.int64), 1, np.arange(len(place))
    while len(some):
        for values in place.T:
            order = np.lexsort((values[some], label[some]))
            rows = some[order]
            gap = (np.diff(values[rows]) > near * (1 + ROUNDING)) | (np.diff(label[rows]) > 0)
            own = np.concatenate([[0], np.cumsum(gap)])
            # Who is alone stays so, and is not looked at again.
            company, now = np.bincount(own)[own] > 1, len(place) - len(some) + int(own[-1]) + 1
            label[rows] = np.where(company, own, len(place) + rows)
            some = rows[company]
            if not len(some):
                break
        if now == count:
            break
        count = now
    return np.unique(label, return_inverse=True)[1].ravel()


def _loose(place: Array, label: Ints, near: float) -> Ints:
    """Rows of those chains that are longer than one step, whose rows are to be linked one by one."""
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.append(True, np.diff(label[order]) > 0))
    rows = place[order]
    span = np.maximum.reduceat(rows, starts) - np.minimum.reduceat(rows, starts)
    wide = np.asarray((span > near).any(axis=1))
    return np.sort(order[wide[label[order]]])

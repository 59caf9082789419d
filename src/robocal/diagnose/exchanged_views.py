"""Two views that fit each other's place, in whichever instruments they are.

    e_ij = what view i leaves at the place of view j,    off: e_ii > f median e_kk

A view that is off and leaves at j no more than is usual, and a fraction of what it leaves at its own, belongs there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array, Bools
from robocal.diagnose.check_registry import Finding, doubt
from robocal.diagnose.limits import EXPLAINED_CLEARLY, VIEW_FITS
from robocal.diagnose.outliers import Outlier
from robocal.diagnose.view_causes import VIEW_EXCHANGED
from robocal.fit.noise import median
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["VIEWS_EXCHANGED", "exchanged_views", "far_views", "places_of_views", "readings_of_views"]

TYPICAL = 3  # grid: views of which it is known what is usual

VIEWS_EXCHANGED = declare(
    "views-exchanged",
    "views {view} and {partner} of {instruments} are exchanged[, of all {every} instruments that saw both: it is their joint values]: each "
    "fits the place of the other, and with that the error of the worse falls from {stated:.3g} to {left:.3g}",
    "Exchange the joint values, lengths or poses of the two in {files}, or the numbers of their images there.",
)


def far_views(own: Array) -> Bools:
    """Which views leave more at their own place (n,) than is usual; NaN is not known."""
    known = own[np.isfinite(own)]
    return own > VIEW_FITS * median(known) if len(known) >= TYPICAL else np.zeros(len(own), dtype=bool)


def places_of_views(error: Array) -> Iterator[tuple[int, int, bool]]:
    """Every view that is off and fits another place, by what it leaves at each (n, n): view, place, and whether the view there fits in
    return. Two that do come once."""
    own = np.diag(error)
    off = np.flatnonzero(far_views(own))
    usual = VIEW_FITS * median(own[np.isfinite(own)]) if len(off) else 0.0
    fits = {}
    for i in off.tolist():
        good = [j for j in np.argsort(error[i]).tolist() if error[i, j] <= min(usual, own[i] / EXPLAINED_CLEARLY)]
        if good:
            fits[i] = good
    told = set[int]()
    for i, good in fits.items():
        if i in told:
            continue
        mutual = next((j for j in good if i in fits.get(j, ()) and j not in told), None)
        if mutual is not None:
            told.add(mutual)
        yield i, good[0] if mutual is None else mutual, mutual is not None


def readings_of_views(error: Array) -> Iterator[tuple[int, int]]:
    """Every view that is off and fits no other place, and a view that is not off and fits its readings: these were taken there."""
    own = np.diag(error)
    off = far_views(own)
    told = {k for i, j, mutual in places_of_views(error) for k in (i, j if mutual else i)}
    usual = VIEW_FITS * median(own[np.isfinite(own)]) if off.any() else 0.0
    for i in np.flatnonzero(off).tolist():
        there = np.where(off, np.inf, error[:, i])
        j = int(np.nanargmin(there))
        if i not in told and there[j] <= min(usual, own[i] / EXPLAINED_CLEARLY):
            yield i, j


def exchanged_views(data: DataSet, strange: Sequence[Outlier]) -> Iterator[Finding]:
    """A doubt of every pair; where all instruments that saw both say so, it is what moves the machine that is exchanged."""
    pairs: dict[tuple[str, str], list[Outlier]] = {}
    ids = data.configurations.ids
    for o in strange:
        if o.cause is not None and o.cause.code == VIEW_EXCHANGED:
            one, other = sorted((o.configuration, str(dict(o.cause.items)["partner"])), key=ids.index)
            pairs.setdefault((one, other), []).append(o)
    for (one, other), some in pairs.items():
        mine = tuple(sorted({o.group for o in some}))
        files = tuple(sorted({o.source.replace("\\", "/").rpartition("/")[2] for o in some}))
        count = sum(_saw(data, i, one) and _saw(data, i, other) for i in range(len(data.observations)))
        every = count if 1 < count == len(mine) else None
        amounts = {k: max((_amount(o, k) for o in some), key=lambda q: q.value) for k in ("stated", "left")}
        yield doubt(VIEWS_EXCHANGED, view=one, partner=other, instruments=mine, every=every, files=files, **amounts)


def _saw(data: DataSet, own: int, name: str) -> bool:
    """Whether an instrument has a view of a name."""
    obs = data.observations[own]
    return kind_of(obs).views and any(data.configurations.ids[c] == name for c in np.unique(obs.configuration))


def _amount(o: Outlier, name: str) -> Quantity:
    amount = dict(o.cause.items)[name] if o.cause is not None else None
    assert isinstance(amount, Quantity)
    return amount

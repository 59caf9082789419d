"""Errors that follow those measured just before, more than like poses explain: something warmed up or moved slowly.

    t_i = sum_h w_i . (w_{i+h} - w_{j(i, h)}) / 4,   h = 1 to 4,    z = sum t / sqrt(sum t^2),    share = sum t / sum |w_i|^2

w are whitened residuals in the order of time. What a model leaves is a smooth function of the pose, and who measures cubes or
grids measures like poses one after the other: on real sets the lag-one product alone is large for that reason. So each pair of
neighbours in time is held against a pair as far apart in joint space, that was measured at quite another time: the errors
of both resemble each other for the pose's sake, those of the first for the time's sake besides. Where nobody measured like
poses at other times, the two cannot be told apart, and nothing is said. Visits of one place have their error in common: their t are one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.diagnose.check_registry import Context, Finding, Machines, When, check, doubt
from robocal.diagnose.limits import FOLLOW_ALIKE, FOLLOW_PAIRS, FOLLOW_SHARE, FOLLOW_SIGMA
from robocal.estimate.terms import Residuals
from robocal.fit.repeats import places
from robocal.measure.data import DataSet
from robocal.measure.machine import Model
from robocal.remarks.code import Code

__all__ = ["errors_follow", "follows"]

MOST = 1000  # grid: pairs that are compared
NEAR = 4  # grid: rows that are just before or after
APART = 0.1  # grid: of the rows: quite another time
OTHERS = 10_000  # grid: rows of other times among which a like pair is looked for
WIDE = 1 << 17  # grid: distances at once: more would leave the cache


@check("errors-follow", When.FIT, order=170, machines=Machines.JOINTED, needs=("fit",))
def errors_follow(context: Context[Model]) -> Iterator[Finding]:
    """Errors that resemble those measured just before, more than like poses do, of every instrument the clearest."""
    found: dict[str, tuple[float, float]] = {}
    for group, z, share in follows(context.need_data, context.residuals):
        if z > FOLLOW_SIGMA and share > FOLLOW_SHARE and z > found.get(group, (0.0, 0.0))[0]:
            found[group] = z, share
    for group, (z, share) in found.items():
        yield doubt(Code.ERRORS_FOLLOW, group=group, z=z, share=share)


def follows(data: DataSet, residuals: Sequence[Residuals]) -> list[tuple[str, float, float]]:
    """Group, z and share of what errors have in common with those just before, for every term that can tell."""
    q = data.configurations.joints
    if q is None:
        return []
    label, spread = places(data.configurations), np.nanstd(q, axis=0)
    place = q / np.where(spread > 0, spread, 1.0)
    out = []
    for r in residuals:
        order = np.argsort(r.configuration[r.used], kind="stable")
        at = r.configuration[r.used][order]
        found = _excess(r.white[r.used][order], place[at], label[at])
        if found is not None:
            out.append((r.group, *found))
    return out


def _excess(w: Array, place: Array, label: Ints) -> tuple[float, float] | None:
    """z and share of one term, (m, d) residuals at (m, n) places in the order of time, `label` (m,) equal for visits of one."""
    m = len(w)
    if m < FOLLOW_PAIRS or not (w * w).sum() > 0 or not np.isfinite(place).all():
        return None
    some = np.unique(np.linspace(0, m - 1 - NEAR, min(m - NEAR, MOST)).astype(np.int64))
    each, own = w[some], float((w[some] ** 2).sum())
    # No pair has more in common than neighbours: where these have less than half of what would count, no other is looked for.
    near = sum(float(np.einsum("kd,kd->", each, w[some + h])) for h in range(1, NEAR + 1)) / NEAR
    if 2 * near <= FOLLOW_SHARE * own:
        return None
    t, compared = np.zeros(len(some)), np.zeros(len(some))
    like = _like(place, some, max(5, int(APART * m)))
    for h in range(1, NEAR + 1):
        told = like[h - 1] >= 0
        more = np.einsum("kd,kd->k", each, w[some + h] - w[like[h - 1]])
        t += np.where(told, more, 0.0)
        compared += told
    kept = compared > 0
    _, which = np.unique(label[some[kept]], return_inverse=True)
    if which.max(initial=-1) + 1 < FOLLOW_PAIRS:
        return None
    t = np.asarray(np.bincount(which, t[kept] / compared[kept]), float)
    own = float((w[some[kept]] ** 2).sum())
    square = float(t @ t)
    return (float(t.sum()) / np.sqrt(square), float(t.sum()) / own) if square > 0 and own > 0 else None


def _like(place: Array, some: Ints, far: int) -> Ints:
    """For each of some rows and its successors 1 to NEAR, the row of another time whose distance in joint space is nearest to
    that of the successor, (NEAR, k); -1 where all are farther."""
    out = np.full((NEAR, len(some)), -1, dtype=np.int64)
    # Where there are ten times as many rows as this, one of ten is as like.
    others = np.arange(0, len(place), -(-len(place) // OTHERS))
    size, there = np.einsum("kn,kn->k", place, place), place[others]
    each = max(1, WIDE // len(others))
    for first in range(0, len(some), each):
        mine = some[first : first + each]
        row = np.arange(len(mine))
        square = size[mine][:, None] + size[others] - 2 * place[mine] @ there.T
        away = np.sqrt(np.maximum(square, 0.0, out=square), out=square)
        edges = np.searchsorted(others, [mine - far + 1, mine + far])
        for k, (lo, hi) in enumerate(edges.T.tolist()):
            away[k, lo:hi] = np.inf
        gap = np.empty_like(away)
        for h in range(1, NEAR + 1):
            reach = np.linalg.norm(place[mine + h] - place[mine], axis=1)
            np.abs(np.subtract(away, reach[:, None], out=gap), out=gap)
            best = np.argmin(gap, axis=1)
            ok = away[row, best] <= FOLLOW_ALIKE * reach + 1e-9
            out[h - 1, first : first + each] = np.where(ok, others[best], -1)
    return out

"""Free columns that no row sees together, as those of the markers of a map: by what terms touch, never by zeros of a Jacobian."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array, Ints
from robocal.estimate.terms import ProblemTerm

__all__ = ["independent_groups"]


def independent_groups(terms: Sequence[ProblemTerm], bounds: tuple[Array, Array], prior_root: Array) -> Ints:
    """Groups (E, s) of columns of which no row of these bound terms, no bound and no prior that others share touches two; of the groups of
    all sizes those that have most columns. Columns of a group ascend."""
    touched = np.zeros((len(terms), len(prior_root)), dtype=bool)
    for row, term in zip(touched, terms, strict=True):
        row[term.columns] = True
    shared = prior_root != 0
    bound = np.isfinite(bounds[0]) | np.isfinite(bounds[1])
    every = np.vstack([touched, shared[shared.sum(axis=1) > 1], bound])
    # Columns that the same rows touch are one group.
    alike: dict[bytes, list[int]] = {}
    for column, seen in enumerate(np.packbits(every.T, axis=1)):
        alike.setdefault(seen.tobytes(), []).append(column)
    groups = [g for g in alike.values() if not bound[g[0]]]
    sizes = {len(g) for g in groups}
    found = (_apart([g for g in groups if len(g) == size], every) for size in sizes)
    most = max(found, key=lambda some: sum(map(len, some)), default=[])
    return np.array(most, dtype=np.int64).reshape(len(most), -1)


def _apart(groups: list[list[int]], every: Array) -> list[list[int]]:
    """Of groups those that have no row in common: one after the other, those that meet few others first."""
    felt = every[:, [g[0] for g in groups]].astype(float)
    meets = felt.T @ felt > 0
    taken: list[int] = []
    for k in np.argsort(meets.sum(axis=0), kind="stable").tolist():
        if not meets[k, taken].any():
            taken.append(k)
    return [groups[k] for k in sorted(taken)]

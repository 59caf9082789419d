"""What estimators leave of every row of the measurements, component by component: the columns of comparison.csv."""

from __future__ import annotations

from typing import Any

import numpy as np

from robocal.files.display import display_unit
from robocal.prove.compare import MethodComparison

__all__ = ["comparison_columns"]

NAMES = {("m", 3): ("x", "y", "z"), ("rad", 3): ("rx", "ry", "rz"), ("px", 2): ("u", "v")}


def comparison_columns(compared: MethodComparison) -> dict[str, list[Any]]:
    """One row per component of an observation, in mm, deg or px: which it is, and a column for each estimator that found anything; of
    rows that were held out, what the fit without them leaves."""
    found = {m.method: m.rows for m in compared.methods if m.rows is not None}
    first = next(iter(found.values()))
    words: list[tuple[str, ...]] = []
    at: list[tuple[int, int]] = []
    factors: list[float] = []
    for i, parts in enumerate(first.parts):
        own = (first.configuration[i], "held_out" if first.held_out[i] else "fit", first.group[i], first.kind[i])
        for start, stop, si in parts:
            unit, width = display_unit(si), stop - start
            names = NAMES.get((si, width)) or ((first.kind[i],) if width == 1 else tuple(map(str, range(1, width + 1))))
            some = np.flatnonzero(np.isfinite(first.after[i, start:stop])).tolist()
            words += [(*own, first.target[i], names[k], unit.name) for k in some]
            at += [(i, start + k) for k in some]
            factors += [1.0 / unit.factor] * len(some)
    rows, columns = np.array(at, dtype=np.int64).reshape(-1, 2).T
    titles = ("configuration", "set", "group", "kind", "target", "component", "unit")
    told: dict[str, list[Any]] = {t: [w[k] for w in words] for k, t in enumerate(titles)}
    return told | {m: (r.after[rows, columns] * np.array(factors)).tolist() for m, r in found.items()}

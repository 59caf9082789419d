"""How far predictions may be off: the covariance of the model's prediction, and of a new measurement as fitted.

    V_model = J C J^T,    V_new = J C J^T + diag(s^2 + tau^2)

J is the Jacobian of what is measured, over all parameters that were free, C their total covariance: what was not seen
is as uncertain as expected. s is stated with the data, tau what the model left (`noise`). The bands are checked where
there are held-out measurements: 95 % of their errors should lie inside.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array, Ints
from robocal.estimate.problem import Problem
from robocal.estimate.terms import ProblemTerm, spread
from robocal.estimate.uncertainty import LEVEL, Total, quantile
from robocal.fit.fit import Fit
from robocal.fit.scale import without_scales
from robocal.measure.data import Configurations
from robocal.prove.statistics import Coverage

__all__ = ["Bands", "coverage", "find_identified", "mean_conditions", "range_of_joints", "row_bands"]

QUANTITIES = {"m": "position", "rad": "orientation", "px": "pixels"}
CHUNK = 2000  # rows whose dense Jacobian is held at once


@record
class Bands:
    """Predicted against measured, one row per observation of one term: residual (m, d), covariance of a new measurement (m, d, d); SI."""

    parts: tuple[tuple[int, int, str], ...]
    residual: Array
    new: Array

    def inside(self, dof: float) -> NDArray[np.bool_]:
        """Whether each component lies in its own band, (m, d)."""
        # What is known to a billionth of a millimetre beside directions that are not known at all may round below zero.
        sigma = np.sqrt(np.maximum(np.einsum("mii->mi", self.new), 0.0))
        return np.asarray(np.abs(self.residual) <= quantile(dof) * sigma)

    def whole(self, start: int, stop: int, dof: float) -> NDArray[np.bool_]:
        """Whether components start:stop lie in their joint region r^T V^-1 r <= d F(d, dof), (m,)."""
        r, v = self.residual[:, start:stop], self.new[:, start:stop, start:stop]
        d = stop - start
        distance = np.einsum("mi,mi->m", r, np.linalg.solve(v, r[..., None])[..., 0])
        limit = (
            scipy.special.chdtri(d, 1 - LEVEL)
            if not np.isfinite(dof)
            else d * scipy.special.fdtri(d, max(dof, 1.0), LEVEL)
        )
        return np.asarray(distance <= limit)


def range_of_joints(configurations: Configurations) -> Array | None:
    """Smallest and largest value of every joint, (n, 2); None where none was recorded."""
    q = configurations.joints
    q = None if q is None else q[np.isfinite(q).all(axis=1)]
    return None if q is None or not len(q) else np.stack([q.min(axis=0), q.max(axis=0)], axis=1)


def mean_conditions(configurations: Configurations) -> dict[str, float]:
    """The mean of every recorded column, where it was recorded."""
    finite = {k: v[np.isfinite(v)] for k, v in configurations.columns.items()}
    return {k: float(v.mean()) for k, v in finite.items() if len(v)}


def row_bands(problem: Problem, x: Array, total: Total, configurations: Ints, blind: Sequence[str] = ()) -> list[Bands]:
    """Bands of all rows at some configurations; the problem's sigma is that of a new measurement, as fitted. Rows that
    depend on one of the `blind` parameters are left out."""
    total = without_scales(total)
    every = problem.with_weights(None).with_free(tuple(n for n in total.names if n in problem.table))
    where = [total.names.index(n) for n in every.free]
    c = total.covariance[np.ix_(where, where)]
    out = []
    for bound, residual in zip(every.bound_terms, every.residuals(x), strict=True):
        term = bound.plain
        rows = np.flatnonzero(np.isin(term.configuration, configurations) & term.used)
        model = np.empty((len(rows), residual.value.shape[1], residual.value.shape[1]))
        keep = np.ones(len(rows), dtype=bool)
        for first in range(0, len(rows), CHUNK):
            some = rows[first : first + CHUNK]
            jac = dense(term, x, int(some[0]), int(some[-1]) + 1, every.n)[some - some[0]]
            model[first : first + CHUNK] = np.einsum("mai,ij,mbj->mab", jac, c, jac, optimize=True)
            keep[first : first + CHUNK] = ~(jac[..., np.isin(every.free, blind)] != 0).any(axis=(1, 2))
        rows, model = rows[keep], model[keep]
        np.einsum("mii->mi", model)[:] += term.scale[rows] ** -2.0
        out.append(Bands(term.parts, residual.value[rows], model))
    return out


def dense(term: ProblemTerm, x: Array, first: int, last: int, n: int) -> Array:
    """The Jacobian of rows first .. last of one term over all columns, (m, d, n)."""
    _, narrow, _ = term.evaluate(np.atleast_2d(x), np.zeros(1, dtype=np.int64), first, last - first)
    return spread(narrow[0], term.columns, n)


def coverage(bands: Iterable[Bands], dof: float) -> tuple[Coverage, ...]:
    """How many of these measurements lie in their bands, by quantity."""
    found: dict[str, list[tuple[NDArray[np.bool_], NDArray[np.bool_]]]] = {}
    for b in bands:
        inside = b.inside(dof)
        for start, stop, unit in b.parts:
            found.setdefault(unit, []).append((inside[:, start:stop], b.whole(start, stop, dof)))
    out = []
    for unit, parts in found.items():
        whole = np.concatenate([w for _, w in parts])
        if len(whole):
            components = np.concatenate([i.ravel() for i, _ in parts])
            quantity, share = QUANTITIES.get(unit, unit), float(components.mean())
            out.append(Coverage(quantity, LEVEL, share, float(whole.mean()), len(whole)))
    return tuple(out)


def find_identified(found: Fit) -> frozenset[str]:
    """The parameters that may be called identified: told by the data, with everything else unknown too, and known no less well
    than before anything was measured, whoever else is to blame."""
    sigma, table = dict(zip(found.total.names, found.total.sigma, strict=True)), found.problem.table
    return frozenset(n for n in found.identifiability.identified if n in sigma and sigma[n] <= table[n].scale)

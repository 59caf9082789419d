"""The scale of instruments that may read all lengths too long: how far it may be off, and what a fit that trusted it made of that.

    e_k = ... + G s,    G = (J_k^T J_k + P)^-1 J_k^T C                                what kept columns take for a scale s
    cov(s)^-1 = C^T (1 - J H^-1 J^T) C + diag(1 / sigma^2),    H = J^T J + 1          columns in units of their expected errors

J are the columns of everything free and C those of the scales, local poses projected out. What making leaves says how long a machine
is, often better than the scale was stated. Where the scale probably is: `prove/scale_chance`.

A scale that was known, and that the data contradict, is known no longer: it may be off by what they say, and sigma is that.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.estimate.elimination import Squares, beside_blocks, reweight, triangle
from robocal.estimate.problem import Problem
from robocal.estimate.terms import Linear
from robocal.estimate.uncertainty import Total
from robocal.measure.data import DataSet
from robocal.measure.rows import kind_of, scale_of
from robocal.measure.stretch import stretch_columns

__all__ = ["InstrumentScales", "add_scales", "is_scale", "scales_of", "without_scales"]

SYMBOL = "scale"
SURE = 1e12  # tolerance: the condition up to which an inverse has digits to spare


@record
class InstrumentScales:
    """Scales that are not known, by `names` (m): stated or usual standard deviations, and their standard deviations after a fit;
    `response` (n, m) is what the fit's error takes for each, over all free names.

    `root` (n + m + 1, n + m + 1) is the triangle of all columns, of the scales and of the residuals, `change` (n,) how far the fit
    went, in units of what is `expected` (n,).
    """

    names: tuple[str, ...]
    stated: Array
    sigma: Array
    response: Array
    root: Array
    change: Array
    expected: Array


def scales_of(
    every: Problem,
    kept: tuple[str, ...],
    x: Array,
    data: DataSet,
    known: Squares,
    lin: Linear | None,
    errors: Mapping[str, float],
) -> InstrumentScales | None:
    """Of the instruments of a fit at x (1, P) of the `kept` columns of `every` free one, of which `known` are the squares there; None where
    all scales are known. `errors` are known ones, by instrument, with what they may be off by."""
    shared = _shared_scales(data, errors)
    groups = [*shared]
    if not groups:
        return None
    lin = reweight(every.linearize(x) if lin is None else lin, every)
    c = stretch_columns(every, x, [shared[g][0] for g in groups])
    # Where a robust loss is used the columns count as the rows do; a scale that is not seen at all answers to nothing.
    told = np.linalg.norm(c, axis=0) > 0
    if not told.any():
        return None
    c, sigma = c[:, told], np.array([shared[g][1] for g in groups])[told]
    n, m, scale = every.n, c.shape[1], every.scales
    root = _widen(known.of(every.free) * scale, scale, lin, np.column_stack([c, lin.r]))
    prior = np.diag(np.concatenate([np.ones(n), 1 / sigma]))
    # The last columns of a triangle are what the others leave of them.
    alone = triangle(np.vstack([root[:, : n + m], prior]))[n:, n:]
    chosen = np.isin(every.free, kept)
    hold = every.with_free(kept).prior_root * scale[chosen]
    response = np.zeros((n, m))
    own = root[:, :n][:, chosen]
    answer = np.linalg.lstsq(own.T @ own + hold.T @ hold, own.T @ root[:, n : n + m], rcond=1e-14)[0]
    response[chosen] = scale[chosen, None] * answer
    seen = [g for g, there in zip(groups, told, strict=True) if there]
    names = tuple(f"{g}.{SYMBOL}" for g in seen)
    after = np.where([g in errors for g in seen], sigma, np.linalg.norm(np.linalg.inv(alone), axis=1))
    return InstrumentScales(names, sigma, after, response, root, every.difference(x)[0] / scale, scale)


def _widen(root: Array, scale: Array, lin: Linear, more: Array) -> Array:
    """W (n + k, n + k) with W^T W = (M [J, more])^T M [J, more], M what local blocks leave, from the R (n, n) of J with columns as large as
    their scale (n,); more (N, k)."""
    n, k = len(root), more.shape[1]
    beside = beside_blocks(replace(lin, j=more))[1]
    inverse = _invert(root)
    across = inverse.T @ (scale[:, None] * (lin.j.T @ beside))
    rest = beside - beside_blocks(replace(lin, j=lin.j @ (scale[:, None] * (inverse @ across))))[1]
    out = np.zeros((n + k, n + k))
    out[:n, :n], out[:n, n:], out[n:, n:] = root, across, triangle(rest)
    return out


def _invert(root: Array) -> Array:
    """The inverse of a root (n, n), without what it does not determine."""
    try:
        inverse = np.linalg.inv(root)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(root))
    sure = np.abs(root).sum(axis=0).max(initial=0.0) * np.abs(inverse).sum(axis=0).max(initial=0.0) < SURE
    return np.asarray(inverse if sure else np.linalg.pinv(root), float)


def _shared_scales(data: DataSet, errors: Mapping[str, float]) -> dict[str, tuple[tuple[str, ...], float]]:
    """Who reads by one scale that is not known, and its standard deviation: an instrument by its own name; cameras that see the same
    targets by those of them, for what was printed is of one scale, whoever looks at it."""
    stated, seen = dict(errors), dict[str, str]()
    for obs in data.observations:
        stated[obs.label] = max(stated.get(obs.label, 0.0), scale_of(obs))
        printed = kind_of(obs).views and obs.targets and obs.label not in errors
        seen[obs.label] = ", ".join(t.name for t in obs.targets) if printed else ""
    out: dict[str, tuple[tuple[str, ...], float]] = {}
    for label, sigma in stated.items():
        if sigma <= 0:
            continue
        target = seen.get(label, "")
        alike = tuple(g for g in stated if target and stated[g] == sigma and seen.get(g) == target) or (label,)
        out[target if len(alike) > 1 else label] = (alike, sigma)
    return out


def is_scale(name: str) -> bool:
    """Whether a name of a `Total` is the scale of an instrument."""
    return name.rpartition(".")[2] == SYMBOL


def without_scales(total: Total) -> Total:
    """What an estimate may be off by beside the scales of its instruments: readings of the same instruments share those."""
    own = np.array([i for i, n in enumerate(total.names) if not is_scale(n)], dtype=np.int64)
    if len(own) == len(total.names):
        return total
    at, names = np.ix_(own, own), tuple(total.names[i] for i in own)
    root = None if total.root is None else total.root[at]
    return replace(
        total, names=names, noise=total.noise[at], response=total.response[at], expected=total.expected[own], root=root
    )


def add_scales(total: Total, scales: InstrumentScales | None) -> Total:
    """What an estimate may be off by, with the scales among what was not fitted."""
    if scales is None:
        return total
    n, m = len(total.names), len(scales.names)
    noise, response = np.zeros((n + m, n + m)), np.zeros((n + m, n + m))
    noise[:n, :n], response[:n, :n] = total.noise, total.response
    response[:n, n:], response[n:, n:] = scales.response, -np.eye(m)
    root = None if total.root is None else scipy.linalg.block_diag(total.root, np.diag(scales.sigma))
    expected = np.concatenate([total.expected, scales.sigma])
    return Total((*total.names, *scales.names), noise, response, expected, total.dof, root)

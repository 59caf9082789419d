"""The dense linearisation of some terms: whitened residuals and Jacobians, row by row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal.estimate.families import Family
from robocal.estimate.rows import Linear, Term, spread

__all__ = ["whitened"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
HERE = np.zeros(1, dtype=np.int64)


def whitened(
    terms: Sequence[Term], x: Array, n: int, families: Sequence[Family], blocks: Sequence[Array], weight: Array, chosen: Bools
) -> Linear:  # fmt: skip
    """The rows of bound terms at x (1, P) that count, of the chosen configurations (U,), each with the root of its weight (U,);
    `blocks` are the values of each family's blocks (1, L, w)."""
    groups = sorted({t.group for t in terms})
    size, extra = ([*(f.size for f in families), 0, 0])[:2]
    many = families[1].count if extra else 0
    parts: list[tuple[Array, ...]] = []
    count = 0
    for term in terms:
        d = term.scale.shape[1]
        keep = chosen[term.configuration] & term.used
        # One configuration's rows lie together: only their span is evaluated.
        first, last = (np.flatnonzero(keep)[[0, -1]] + [0, 1]) if keep.any() else (0, min(1, len(keep)))
        r, jac, jloc = term.evaluate(x, HERE, int(first), int(last - first))
        scale = term.scale[keep] * np.sqrt(weight[term.configuration[keep]])[:, None]
        # Of many rows every copy of the Jacobian costs as much as the Jacobian: where all count, none is made.
        inside = slice(None) if keep[first:last].all() else keep[first:last]
        dense = spread(jac[0][inside], term.columns, n)
        dense *= scale[..., None]
        one, two = (block[keep] for block in term.local)
        cut = jloc.shape[3] - extra if term.touches[1] else jloc.shape[3]
        wide = np.zeros((len(dense), d, size))
        if cut:
            wide[:] = jloc[0][inside][..., :cut] * scale[..., None]
        second = np.zeros((len(dense), d, many, extra))
        rows = np.flatnonzero(two >= 0)
        if len(rows):
            second[rows, :, two[rows]] = (jloc[0][inside][..., cut:] * scale[..., None])[rows]
        observation = count + np.arange(len(dense))
        count += len(dense)
        parts.append(
            (
                (r[0][inside] * scale).ravel(),
                dense.reshape(len(dense) * d, n),
                wide.reshape(len(dense) * d, size),
                np.repeat(one, d),
                np.repeat(term.configuration[keep], d),
                np.repeat(observation, d),
                np.full(len(dense) * d, groups.index(term.group)),
                np.full(len(dense) * d, term.reading),
                second.reshape(len(dense) * d, many * extra),
            )
        )
    whole = parts[0] if len(parts) == 1 else tuple(np.concatenate(p) for p in zip(*parts, strict=True))
    held = [None if f.prior is None else f.prior.rows(b)[1][0] for f, b in zip(families, blocks, strict=True)]
    hold, own = ([*held, None, None])[:2]
    return replace(Linear(*whole), hold=hold, keep=None if own is None else _diagonal(own))


def _diagonal(blocks: Array) -> Array:
    """Blocks (M, q, q) on the diagonal of one matrix."""
    many, size, _ = blocks.shape
    out = np.zeros((many, size, many, size))
    out[np.arange(many), :, np.arange(many)] = blocks
    return out.reshape(many * size, many * size)

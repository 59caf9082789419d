"""What a lens that was calibrated before may be off by: what its file says, and where it says nothing, what is usual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal.errors import ModelError
from robocal.vision.lenses import Lens

__all__ = ["free_numbers", "lens_with_prior"]


def free_numbers(lens: Lens, fix: Sequence[str]) -> tuple[str, ...]:
    """The numbers of a lens without those that stay as they are. Raises ModelError for a name that is none of them."""
    symbols = lens.kind.symbols
    if strange := [s for s in fix if s not in symbols]:
        raise ModelError("no number of this lens", key="--fix", found=strange[0], expected=", ".join(symbols))
    return tuple(s for s in symbols if s not in fix)


def lens_with_prior(lens: Lens, fix: Sequence[str] = ()) -> Lens:
    """The lens with a covariance of its numbers: its own, or where it states none the usual one of `MODELS`, 10 px of focal lengths and
    centre, 0.1 of distortion and 0.01 of what is tangential. Numbers in `fix` have none. Raises ModelError."""
    kind, free = lens.kind, free_numbers(lens, fix)
    if lens.known:
        symbols, covariance = lens.known, np.array(lens.covariance)
    else:
        symbols, covariance = kind.symbols, np.diag(np.square(kind.expected))
    at = [i for i, s in enumerate(symbols) if s in free]
    return Lens.of(
        lens.model, lens.numbers, lens.size, tuple(symbols[i] for i in at), covariance[np.ix_(at, at)], lens.source
    )

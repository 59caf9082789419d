"""From which view on images and poses are out of step: an image that was lost on the way, or a pose that was taken twice.

    e_i0 = |log(A M_i B, Y_i)|,    e_is = |log(A M_i+s B, Y_i)|,    k = argmax #{i < k: e_i0 small} + #{i >= k: e_is small}

A and B are what most pairs agree on (`fit/starts/consensus`), of the pairs as they stand or of those one further. s is 1 or -1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from robocal._types import Array
from robocal.diagnose.vision_limits import HAND_EYE_ASK
from robocal.fit.starts.consensus import FAR, SHARE, agree, missed
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["find_step", "tell_step"]

FEWEST = 2  # tolerance: views on either side: one alone is told by itself
NEARLY = 0.9  # tolerance: of the views, that fit so


WORDS = {1: "later", -1: "earlier"}


def tell_step(names: Sequence[str], seen: Array, machine: Array) -> Iterator[Remark]:
    """What is said of it: the view, and what those from it on miss with their poses and with those one further."""
    step = find_step(seen, machine)
    if step is None:
        return
    first, by = step
    own = np.arange(first, len(seen) - max(0, by))
    right = np.concatenate([np.arange(first), own])
    found = agree(seen[right], machine[np.where(right < first, right, right + by)])
    if found is None:
        return
    before, after = (missed(found, seen[own], machine[own + shift]) for shift in (0, by))
    amounts = [
        Quantity(float(np.median(v)), unit)
        for pair in (before, after)
        for v, unit in zip(pair, ("m", "rad"), strict=True)
    ]
    told = dict(zip(("before", "before_turn", "after", "after_turn"), amounts, strict=True))
    yield Remark.of(Code.VIEWS_OUT_OF_STEP, first=names[first], word=WORDS[by], count=len(own), **told)


def find_step(seen: Array, machine: Array) -> tuple[int, int] | None:
    """The view from which on poses are off, and by how many (1 or -1), of Y and M (n, 4, 4); None where no step explains them."""
    n, distance = len(seen), float(np.median(np.linalg.norm(seen[:, :3, 3], axis=1)))
    steps = np.arange(FEWEST, n - FEWEST + 1)
    least, best = HAND_EYE_ASK, None
    for by in (1, -1) if len(steps) else ():
        partner = np.arange(max(0, -by), n - max(0, by))
        for first in (0, by):
            own = partner if first else np.arange(n)
            found = agree(seen[own], machine[own + first])
            if found is None:
                return None
            error = np.full((2, n), np.inf)
            for row, some, shift in ((0, np.arange(n), 0), (1, partner, by)):
                place, turn = missed(found, seen[some], machine[some + shift])
                error[row, some] = np.hypot(place / distance, turn)
            usual = float(np.quantile(error.min(axis=0), SHARE))
            fits = error <= FAR * usual
            count = np.cumsum(np.append(0, fits[0]))[steps] + np.append(np.cumsum(fits[1, ::-1])[::-1], 0)[steps]
            k = int(np.argmax(count))
            without = int(fits.sum(axis=1).max())  # all as they are, or all one further
            if usual < least and count[k] > without and count[k] >= NEARLY * (n - 1):
                least, best = usual, (int(steps[k]), by)
    return best

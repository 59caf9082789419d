"""Whether two lists of poses can be of the same places, and what makes them so where they are not: a unit, a mirrored frame, a row."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from robocal._types import Array
from robocal.apply.verification import FEWEST, align_poses
from robocal.diagnose.limits import LIKE_EXPLAINS, LIKE_POSITIONS, LIKE_TURNS, LIKE_TURNS_LEAST
from robocal.geometry import se3, so3
from robocal.geometry.fits import rigid

__all__ = ["Cause", "Unlike", "unlike"]

Cause = Literal["still", "scaled", "mirrored", "shifted", "turn-unit", "turn-inverted", "unknown"]


@dataclass(frozen=True)
class Unlike:
    """Poses that are not those of the reference: the likely cause, what is left after the best alignment and how far the reference's
    poses scatter, of positions (m) or, where `turns`, of orientations (rad); `factor`, of a unit."""

    cause: Cause
    left: float
    spread: float
    turns: bool
    factor: float = 1.0


def unlike(found: Array, reference: Array) -> Unlike | None:
    """What is wrong with poses (k, 4, 4) beside those of a reference; None where nothing is, or there are too few to tell."""
    if len(found) < FEWEST + 1:
        return None
    left = align_poses(found, reference)[0].rms
    p, q = found[:, :3, 3], reference[:, :3, 3]
    spread, own = _spread(q), _spread(p)
    own_fit = _positions(p, q)
    if own < LIKE_EXPLAINS * LIKE_POSITIONS * spread:
        return Unlike("still", own, spread, False)
    if own_fit > LIKE_POSITIONS * spread:
        for cause, moved, factor in _places(p, spread / own):
            if _positions(moved, q) < min(LIKE_EXPLAINS * own_fit, LIKE_POSITIONS * spread):
                return Unlike(cause, own_fit, spread, False, factor)
        return Unlike("unknown", own_fit, spread, False)
    turn = _turns(found[:, :3, :3], reference[:, :3, :3])
    scatter = _turns(np.tile(np.eye(3), (len(q), 1, 1)), reference[:, :3, :3])
    if max(turn, left[1]) > max(LIKE_TURNS * scatter, LIKE_TURNS_LEAST):
        for cause, change, factor in TURNS:
            if _turns(change(found[:, :3, :3]), reference[:, :3, :3]) < LIKE_EXPLAINS * max(turn, LIKE_TURNS_LEAST):
                return Unlike(cause, turn, scatter, True, factor)
        return Unlike("unknown", max(turn, left[1]), scatter, True)
    return None


def _places(p: Array, size: float) -> Iterator[tuple[Cause, Array, float]]:
    """Positions as they would be without each mistake."""
    if not 0.5 < size < 2.0:
        yield "scaled", p * size, 1.0 / size
    yield "mirrored", p * [-1.0, 1.0, 1.0], 1.0
    for by in (*range(1, min(len(p), 6)), *range(-1, -min(len(p), 6), -1)):
        yield "shifted", np.roll(p, by, axis=0), float(by)


DEG = 180.0 / np.pi


def _times(factor: float) -> Callable[[Array], Array]:
    return lambda r: so3.exp(factor * so3.log(r))


TURNS: tuple[tuple[Cause, Callable[[Array], Array], float], ...] = (
    ("turn-inverted", lambda r: r.swapaxes(1, 2), 1.0),
    ("turn-unit", _times(DEG), 1.0 / DEG),
)


def _spread(p: Array) -> float:
    return float(np.sqrt(np.mean(np.sum((p - p.mean(axis=0)) ** 2, axis=1))))


def _positions(p: Array, q: Array) -> float:
    """Root mean square of what the best motion leaves of positions."""
    t = rigid(p, q)
    return float(np.sqrt(np.mean(np.sum((p @ t[:3, :3].T + t[:3, 3] - q) ** 2, axis=1))))


def _turns(r: Array, s: Array) -> float:
    """Root mean square of what the best turns on both sides leave of orientations, to first order of the second side."""
    return align_poses(se3.compose(r, np.zeros(3)), se3.compose(s, np.zeros(3)))[0].rms[1]

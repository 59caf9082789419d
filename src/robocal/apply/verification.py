"""Poses of a robot against those that an external instrument saw: errors, who of three agrees with whom, and whether means differ.

    absolute   p_i - q_i,  log(R_i Q_i^T)                      both in one frame
    relative   the same of T_1^-1 T_i and S_1^-1 S_i           to the first pose
    aligned    the same of A T_i B, with A and B chosen best   another frame and another point of the platform

Of three that read the same poses, a, b and c, with errors that have nothing in common, each has its own (Grubbs 1948):

    s_a^2 = (d_ab^2 + d_ac^2 - d_bc^2) / 2

with d the root mean square of what two differ by. A negative square says that two of them share an error, or that frames differ.

Whether two lists of poses can be of the same places, and what makes them so where they are not: a unit, a mirrored frame, a row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Literal

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record
from robocal._types import Array
from robocal.diagnose.limits import LIKE_EXPLAINS, LIKE_POSITIONS, LIKE_TURNS, LIKE_TURNS_LEAST
from robocal.errors import ModelError
from robocal.geometry import se3, so3
from robocal.geometry.fits import rigid

__all__ = [
    "Agreement", "Anova", "Cause", "PoseErrors", "Unlike", "agreement", "align_poses", "anova", "errors", "relative", "unlike",
]  # fmt: skip

FEWEST = 3  # poses for an alignment by a motion
ROUNDS, END = 50, 1e-13
TRIED = 1000  # poses, at most, on which every beginning of an alignment is tried; all say where the best one ends
CHUNK = 4096  # poses at once: what is worked out of them is ten times as large as they are


@record
class PoseErrors:
    """Errors of poses: of the position (k,) m, and of the orientation (k,) rad."""

    position: Array
    orientation: Array

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean squares."""
        return float(np.sqrt(np.mean(self.position**2))), float(np.sqrt(np.mean(self.orientation**2)))


@record
class Anova:
    """One-way analysis of variance: F with its degrees of freedom between and within groups, and the chance of as much where all means
    are equal."""

    f: float
    between: int
    within: int
    chance: float


@record
class Agreement:
    """Three that read the same poses: `differences` (ab, ac, bc), root mean squares of what two differ by; `own` (a, b, c), what each
    errs by itself if errors have nothing in common, not a number where its square is negative; `shared` names the two that then agree
    better than errors of their own allow (None: nobody)."""

    differences: tuple[float, float, float]
    own: tuple[float, float, float]
    shared: tuple[int, int] | None


def errors(found: Array, reference: Array) -> PoseErrors:
    """Errors of poses (k, 4, 4) in the reference's frame."""
    return _lengths(_apart(found[at], reference[at]) for at in _chunks(len(found)))


def _lengths(apart: Iterable[Array]) -> PoseErrors:
    both = np.concatenate([np.linalg.norm(d.reshape(-1, 2, 3), axis=2) for d in apart])
    return PoseErrors(both[:, 0], both[:, 1])


def _chunks(count: int) -> Iterator[slice]:
    return (slice(first, first + CHUNK) for first in range(0, max(count, 1), CHUNK))


def _apart(here: Array, reference: Array) -> Array:
    """What poses (k, 4, 4) differ by, position and rotation vector (k, 6)."""
    turn = so3.log(here[:, :3, :3] @ np.swapaxes(reference[:, :3, :3], 1, 2))
    return np.concatenate([here[:, :3, 3] - reference[:, :3, 3], turn], axis=1)


def relative(found: Array, reference: Array) -> PoseErrors:
    """Errors of the poses beside the first one, that is left out. Raises ModelError for fewer than two."""
    if len(found) < 2:
        raise ModelError("one pose has nothing to be compared with", found=len(found), expected="2 poses or more")
    a, b, found, reference = se3.inverse(found[0]), se3.inverse(reference[0]), found[1:], reference[1:]
    return _lengths(_apart(a @ found[at], b @ reference[at]) for at in _chunks(len(found)))


def align_poses(found: Array, reference: Array, *, point: bool = False) -> tuple[PoseErrors, Array, Array]:
    """Errors after the best alignment A T_i B, and A and B (4, 4); B is the identity unless `point`: the instrument may then watch
    another frame on the platform. A turn of 1 rad counts as 1 m. Raises ModelError for too few poses."""
    least = FEWEST + 2 * point
    if len(found) < least:
        raise ModelError("too few poses for an alignment", found=len(found), expected=f"{least} or more")
    some = slice(None, None, -(-len(found) // TRIED))
    tried = [_descend(found[some], reference[some], a, np.eye(4), point=point) for a in _beginnings(found, reference)]
    _, a, b = min(tried, key=lambda t: t[0])
    if len(found) > TRIED:
        _, a, b = _descend(found, reference, a, b, point=point)
    return _lengths(_apart(a @ found[at] @ b, reference[at]) for at in _chunks(len(found))), a, b


def _beginnings(found: Array, reference: Array) -> list[Array]:
    """Alignments from which the best one is sought: none, that of the first pose, that of the positions, and that of the turns with
    quarter turns beside it."""
    p, q = found[:, :3, 3], reference[:, :3, 3]
    turn = so3.project(np.einsum("kij,klj->il", reference[:, :3, :3], found[:, :3, :3]))
    turns = [np.eye(3), turn, *(so3.exp(np.pi / 2 * v) @ turn for v in np.concatenate([np.eye(3), -np.eye(3)]))]
    out = [np.eye(4), reference[0] @ se3.inverse(found[0]), rigid(p, q)]
    return out + [se3.compose(t, q.mean(axis=0) - t @ p.mean(axis=0)) for t in turns]


def _descend(found: Array, reference: Array, a: Array, b: Array, *, point: bool) -> tuple[float, Array, Array]:
    """The sum of squares, A and B where Levenberg's method ends; a step is taken only if it lowers the sum."""
    damping = 0.0
    cost, g, n = _normal(found, reference, a, b, point=point)
    for _ in range(ROUNDS):
        size = np.diag(np.maximum(np.diag(n), 1e-12 * np.diag(n).max(initial=1.0)))
        step = np.asarray(np.linalg.lstsq(n + damping * size, -g, rcond=1e-14)[0], float)
        a_new = _motion(step[:6]) @ a
        b_new = b @ _motion(step[6:]) if point else b
        lower, g_new, n_new = _normal(found, reference, a_new, b_new, point=point)
        if lower <= cost:
            a, b, g, n, cost, damping = a_new, b_new, g_new, n_new, lower, damping / 10 if damping > 1e-6 else 0.0
        else:
            damping = max(10 * damping, 1e-6)
        if np.abs(step).max() < END:
            break
    return cost, a, b


def _normal(found: Array, reference: Array, a: Array, b: Array, *, point: bool) -> tuple[float, Array, Array]:
    """The sum of squares r^T r, J^T r and J^T J of the errors."""
    cost, g, n = 0.0, np.zeros(6 + 6 * point), np.zeros((6 + 6 * point,) * 2)
    for at in _chunks(len(found)):
        r, j = _linearise(a @ found[at] @ b, reference[at], point=point)
        cost, g, n = cost + float(r @ r), g + j.T @ r, n + j.T @ j
    return cost, g, n


def _linearise(here: Array, reference: Array, *, point: bool) -> tuple[Array, Array]:
    """Errors (6 k,) of poses where they are, and their derivatives by a small motion of A and, with `point`, of B."""
    r = _apart(here, reference)
    log = r[:, 3:]
    # A small motion (v, w) of A moves all in its frame; one of B moves the points that are watched.
    inner = so3.left_jacobian_inverse(log)
    j = np.zeros((len(here), 6, 12 if point else 6))
    j[:, :3, :3] = np.eye(3)
    j[:, :3, 3:6] = -so3.skew(here[:, :3, 3])
    j[:, 3:, 3:6] = inner
    if point:
        j[:, :3, 6:9] = here[:, :3, :3]
        j[:, 3:, 9:] = inner @ here[:, :3, :3]
    return r.ravel(), j.reshape(-1, j.shape[2])


def _motion(step: Array) -> Array:
    return np.asarray(se3.compose(so3.exp(step[3:]), step[:3]))


def agreement(apart: Sequence[float]) -> Agreement:
    """The agreement of three from what two differ by, (ab, ac, bc)."""
    ab, ac, bc = (float(v) for v in apart)
    squares = np.array([ab**2 + ac**2 - bc**2, ab**2 + bc**2 - ac**2, ac**2 + bc**2 - ab**2]) / 2
    own = tuple(float(np.sqrt(s)) if s >= 0 else float("nan") for s in squares)
    shared = None
    if (squares < 0).any():
        odd = int(np.argmin(squares))  # it lies between the other two
        pairs = [(p, d) for p, d in (((0, 1), ab), ((0, 2), ac), ((1, 2), bc)) if odd in p]
        shared = min(pairs, key=lambda pair: pair[1])[0]
    return Agreement((ab, ac, bc), (own[0], own[1], own[2]), shared)


def anova(means: Sequence[float], spreads: Sequence[float], counts: Sequence[int]) -> Anova:
    """One-way analysis of variance from means, standard deviations (of n - 1) and counts of the groups. Raises ModelError for fewer than
    two groups, or of fewer than two values."""
    m, s, n = (np.asarray(v, float) for v in (means, spreads, counts))
    if len(m) < 2 or len(s) != len(m) or len(n) != len(m) or (n < 2).any():
        message = "an analysis of variance takes two groups or more of two values or more"
        raise ModelError(message, found=[len(m), n.tolist()])
    if not np.isfinite([*m, *s]).all() or (s < 0).any():
        message = "means and standard deviations are finite, and no standard deviation is negative"
        raise ModelError(message, found=s.tolist())
    total = n.sum()
    between, within = len(m) - 1, int(total) - len(m)
    grand = float((n * m).sum() / total)
    variance = float(((n - 1) * s**2).sum()) / within
    explained = float((n * (m - grand) ** 2).sum()) / between
    if variance == 0:
        return Anova(float("inf") if explained else 0.0, between, within, 0.0 if explained else 1.0)
    f = explained / variance
    return Anova(f, between, within, float(scipy.special.fdtrc(between, within, f)))


Cause = Literal["still", "scaled", "mirrored", "shifted", "turn-unit", "turn-inverted", "unknown"]


@record
class Unlike:
    """Poses that are not those of the reference: the likely cause, what is left after the best alignment and how far the reference's
    poses scatter, of positions (m) or, where `turns`, of orientations (rad); `factor`, of a unit."""

    cause: Cause
    left: float
    spread: float
    turns: bool
    factor: float = 1.0


def unlike(found: Array, reference: Array, aligned: PoseErrors | None = None) -> Unlike | None:
    """What is wrong with poses (k, 4, 4) beside those of a reference; None where nothing is, or there are too few to tell. `aligned` are
    the errors after the best alignment, where the caller has them."""
    if len(found) < FEWEST + 1:
        return None
    left = (aligned or align_poses(found, reference)[0]).rms
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
    scatter = _turns(np.broadcast_to(np.eye(3), (len(q), 3, 3)), reference[:, :3, :3])
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


TURNS: tuple[tuple[Cause, Callable[[Array], Array], float], ...] = (
    ("turn-inverted", lambda r: r.swapaxes(1, 2), 1.0),
    ("turn-unit", lambda r: so3.exp(DEG * so3.log(r)), 1.0 / DEG),
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

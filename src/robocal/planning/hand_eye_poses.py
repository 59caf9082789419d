"""Poses that would tell most of a camera and a target beside those that there are.

    Y = A M B,    y = a + Ad(A M) b + Ad(F) e,    W = cov(Ad(F) e),    H = sum J' W^-1 J,    J = (1, Ad(A M))

a and b are twists of the frames, e is what the robot's pose is off by, in the axes of the flange: F = A M, or A where M is from the
flange to the base. The target is shown where most views show it, tilted and turned;
each pose is chosen after those before it: the one after which the target's place is known best, in the mean over all of them.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.geometry import se3, so3

__all__ = ["NextPose", "next_poses"]

TILTS = np.radians([0.0, 20.0, 40.0])  # grid: of the target against most views
AZIMUTHS = np.radians(np.arange(0, 360, 45))  # grid: towards which it is tilted
ROLLS = np.radians([-60, -30, 0, 30, 60])  # grid: about the line of sight
ROOM = 0.2  # grid: of the distance of the target: so far beyond the places of the flange that there are
ENOUGH = 12  # grid: candidates, be they farther away
HELD = np.array(
    [10.0] * 3 + [3.0] * 3
)  # grid: m and rad: what is known of the frames without views, so that there is an inverse


@record(eq=False)
class NextPose:
    """M (4, 4), the angle (rad) and axis (3,) by which it turns from the middle of those that there are, and how well the target's place is
    known with it and those before it, m."""

    machine: Array
    angle: float
    axis: Array
    sure: float


def next_poses(
    a: Array, b: Array, machine: Array, point: Array, error: Array, count: int, *, inhand: bool
) -> tuple[float, tuple[NextPose, ...]]:
    """How well the target's place is known now, m; and so many poses. a, b (4, 4); machine (m, 4, 4); `point` (3,) of the target; `error`
    (6,) of the robot's poses, m and rad, in the axes of the flange."""

    def rows_of(machine: Array) -> Array:
        return np.asarray(
            np.linalg.solve(
                _adjoint(np.broadcast_to(a, machine.shape) if inhand else a @ machine) * error, _columns(a, machine)
            )
        )

    every = rows_of(machine)
    h = np.diag(np.tile(HELD, 2) ** -2.0) + np.einsum("mki,mkj->ij", every, every)
    some = _candidates(a, b, machine, point)
    flange, there = (se3.inverse(m) if inhand else m for m in (machine, some))
    some = some[_near(flange, there, (a @ machine @ b)[:, :3, 3])]
    rows = rows_of(some)
    looks = np.concatenate([_columns(a, machine), _columns(a, some)])
    shown = a @ np.concatenate([machine, some]) @ b
    place = shown[:, :3, :3] @ point + shown[:, :3, 3]
    looks = looks[:, :3] - so3.skew(place) @ looks[:, 3:]
    middle = so3.project(machine[:, :3, :3].mean(axis=0))

    def sure(h: Array) -> Array:
        """Root mean square of the target's place, m, of information matrices (..., 12, 12)."""
        c = np.linalg.inv(h)
        return np.asarray(np.sqrt(np.einsum("mki,...ij,mkj->...", looks, c, looks) / len(looks)))

    now, out, taken = float(sure(h)), [], np.zeros(len(some))
    for _ in range(min(count, len(some))):
        told = sure(h + np.einsum("mki,mkj->mij", rows, rows)) + taken
        best = int(np.argmin(told))
        h = h + rows[best].T @ rows[best]
        taken[best] = np.inf
        turn = so3.log(middle.T @ some[best, :3, :3])
        angle = float(np.linalg.norm(turn))
        out.append(NextPose(some[best], angle, turn / max(angle, 1e-12), float(told[best])))
    return now, tuple(out)


def _candidates(a: Array, b: Array, machine: Array, point: Array) -> Array:
    """M (k, 4, 4) that show the target's point where the views have it in the middle."""
    seen = a @ machine @ b
    middle = np.median(seen[:, :3, :3] @ point + seen[:, :3, 3], axis=0)
    plain = so3.project(seen[:, :3, :3].mean(axis=0))
    turns = []
    for tilt in TILTS:
        for azimuth in AZIMUTHS if tilt else AZIMUTHS[:1]:
            lean = so3.exp(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
            turns += [so3.exp(np.array([0.0, 0.0, roll])) @ lean @ plain for roll in ROLLS]
    r = np.stack(turns)
    views = se3.compose(r, middle - r @ point)
    return np.asarray(se3.inverse(a) @ views @ se3.inverse(b))


def _near(flange: Array, some: Array, seen: Array) -> Ints:
    """Candidates (k, 4, 4) whose flange stands where it stood, or not far from there."""
    room = ROOM * float(np.median(np.linalg.norm(seen, axis=1)))
    place = flange[:, :3, 3]
    inside = np.clip(some[:, :3, 3], place.min(axis=0) - room, place.max(axis=0) + room)
    away = np.linalg.norm(some[:, :3, 3] - inside, axis=1)
    order = np.argsort(away, kind="stable")
    return np.sort(order[: max(ENOUGH, int((away == 0).sum()))])


def _columns(a: Array, machine: Array) -> Array:
    """J (m, 6, 12)."""
    moved = _adjoint(a @ machine)
    return np.concatenate([np.broadcast_to(np.eye(6), moved.shape), moved], axis=2)


def _adjoint(t: Array) -> Array:
    """Ad (..., 6, 6) of T: twists (v, w) about the axes of the child in those of the parent."""
    r, p = t[..., :3, :3], t[..., :3, 3]
    out = np.zeros((*t.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = r
    out[..., :3, 3:] = so3.skew(p) @ r
    return out

"""Lists of poses that a cable robot can reach from where it starts, each by a straight motion that is free to go and to return.

    X_r random in a box Z about X_0,   lambda = mu min(lambda_s, lambda_c),   X = X_0 moved by lambda of the way to X_r

lambda_s is how far statics allow, lambda_c the first contact (`interference.first_contact`). A planar robot draws X_r among the
motions that it has; its cables are where its file puts them: those in one plane touch where they cross.
Source: (3.27) to (3.38) and section 3.4.5 of the thesis behind `examples/cable-laval`.

What a controller follows to visit a list of poses: waypoints on every way, their cable lengths and tensions.

Each way leads straight from X_0 to its pose and straight back, so it can be walked both ways. A motion is feasible as far as
it was looked at: `restrict_to_feasible` asks every waypoint again, so that none is commanded that the cables cannot hold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import field, record, replace
from robocal._types import Array, Ints
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, home
from robocal.cables.interference import Body, Contacts, are_lengths, first_contact
from robocal.cables.pulley import Pulleys
from robocal.cables.tension import hold
from robocal.cables.tension_choice import METHOD
from robocal.cables.workspace import Demand, holds
from robocal.errors import ModelError, require
from robocal.geometry import se3

__all__ = ["LIMITS", "MotionProgram", "PoseBox", "PoseList", "program", "reachable_poses", "restrict_to_feasible"]

LIMITS = ("box", "statics", "cable-cable", "cable-platform", "cable-pulley")
# (X_0 (4, 4), translations (n, 3), rotations (n, 3)) -> lambda_s (n,) in [0, 1], nan where X_0 itself is not feasible.
Feasible = Callable[[Array, Array, Array], Array]


@record
class PoseBox:
    """The box Z by its half sizes: `translation` (3,) in m and `rotation` (3,), of the rotation vector, in rad. Its centre is
    `offset` (3,) m away from X_0."""

    translation: Array
    rotation: Array
    offset: Array = field(default_factory=lambda: np.zeros(3))


def default_box(a: ArrayLike, scale: float = 1.1, turn: float = np.pi / 6, start: ArrayLike | None = None) -> PoseBox:
    """Z of section 3.4.5: as large as the machine or a little larger (`scale`), and turns of at most `turn` rad about each axis.

    The thesis gives no numbers: 1.1 and 30 degrees are this package's own. About a `start` (4, 4) other than `home(a)`, Z is
    larger by twice its distance from there, so that it still holds the machine; without one, a direction in which all frame
    anchors a (m, 3) agree has no room.
    """
    frame = np.asarray(a, float)
    away = 0.0 if start is None else np.abs(np.asarray(start, float)[:3, 3] - frame.mean(axis=0))
    return PoseBox(scale * (0.5 * np.ptp(frame, axis=0) + away), np.full(3, float(turn)))


@record
class PoseList:
    """n poses and how each was found.

    `start` (4, 4) is X_0; `translation` (n, 3) m and `rotation` (n, 3) rad lead from it to X_r, in base axes; `fraction` (n,) is
    lambda with its margin mu; `furthest` (n,) is min(lambda_s, lambda_c); `limit` (n,) indexes LIMITS; `contacts` tells who met.
    """

    start: Array
    translation: Array
    rotation: Array
    fraction: Array
    furthest: Array
    limit: Ints
    contacts: Contacts

    def along(self, shares: ArrayLike) -> Array:
        """Poses (n, k, 4, 4) at `shares` (k,) of each way: 0 is X_0, 1 the pose itself; falling shares are the way back."""
        lam = self.fraction[:, None] * np.asarray(shares, float)
        v, w = (lam[..., None] * whole[:, None] for whole in (self.translation, self.rotation))
        return se3.displace(self.start, v, w)

    @property
    def poses(self) -> Array:
        """The poses themselves, (n, 4, 4)."""
        return self.along([1.0])[:, 0]

    @property
    def reach_share(self) -> float:
        """The share of Z that a straight motion from X_0 reaches, estimated by the share of the X_r that are."""
        return float(np.mean(self.limit == 0))


def reachable_poses(
    a: ArrayLike,
    b: ArrayLike,
    n: int,
    rng: np.random.Generator,
    *,
    feasible: Feasible | None = None,
    start: ArrayLike | None = None,
    box: PoseBox | None = None,
    margin: float = 0.95,
    diameter: ArrayLike = 0.0,
    pulleys: Pulleys | None = None,
    body: Body | None = None,
    relief: float | None = None,
    axes: Sequence[int] = range(6),
) -> PoseList:
    """n poses, each on a straight motion from X_0 towards a random pose of Z, at `margin` (mu) of the way that is free.

    a, b (m, 3) m: anchors on the frame and on the platform; `start` is `home(a)` and `box` `default_box(a, start=start)` unless
    given; without `feasible` only contacts stop a motion; diameter, pulleys, body and relief as for `first_contact`. `axes` are the
    components of the twist that the platform has (`CableRobot.axes`): Z has no room in the others.
    Raises ModelError where X_0 is in contact or not feasible, for a margin outside (0, 1], fewer than one pose, and a box that is none.
    """
    x0 = home(a) if start is None else np.asarray(start, float)
    z = default_box(a, start=start) if box is None else box
    require(n >= 1, "number of poses", expected="at least 1", found=n)
    require(0 < margin <= 1, "margin", expected="a number above 0 and at most 1", found=margin)
    half = np.concatenate([np.asarray(z.translation, float), np.asarray(z.rotation, float)])
    middle = np.concatenate([np.asarray(z.offset, float), np.zeros(3)])
    room = half.shape == (6,) and are_lengths(half) and np.isfinite(middle).all()
    require(room, "box of poses", expected="three half sizes in m and three in rad, at least 0", found=half)
    twist = rng.uniform(middle - half, middle + half, (n, 6))
    twist[:, [i for i in range(6) if i not in axes]] = 0.0
    v, w = twist[:, :3].copy(), twist[:, 3:].copy()
    contacts = first_contact(a, b, x0, v, w, diameter=diameter, pulleys=pulleys, body=body, relief=relief)
    _may_start(contacts, len(np.asarray(a)))
    statics = np.ones(n) if feasible is None else _statics(feasible(x0, v, w), n)
    furthest = np.minimum(statics, contacts.fraction)
    limit = np.where(statics < contacts.fraction, 1, np.where(contacts.free, 0, contacts.kind + 1))
    return PoseList(x0, v, w, margin * furthest, furthest, limit.astype(np.int64), contacts)


def _may_start(contacts: Contacts, m: int) -> None:
    touching = np.flatnonzero((contacts.fraction == 0) & ~contacts.free)
    if len(touching):
        who = contacts.names([f"cable {i}" for i in range(1, m + 1)])[touching[0]]
        expected = "a start free of contacts: give another one, or thinner cables"
        raise ModelError(f"at the start X_0 {who}", expected=expected)


def _statics(found: Array, n: int) -> Array:
    share = np.asarray(found, float)
    require(share.shape == (n,), "feasible()", expected=f"one number per motion, shape ({n},)", found=share.shape)
    held, expected = not np.isnan(share).any(), "a start that the cables can hold: give another one"
    require(held, "the start X_0 is not feasible", expected=expected)
    return np.asarray(np.clip(share, 0.0, 1.0))


@record(eq=False)
class MotionProgram:
    """K + 1 waypoints on each of n ways, the first X_0, the last the pose: shares (K + 1,) of the way, poses
    (n, K + 1, 4, 4), tensions (n, K + 1, m) in N, and lengths (n, K + 1, m) in m as the sensors show them: `stretched` by the
    tensions where the robot's elasticity is known."""

    shares: Array
    pose: Array
    tension: Array
    lengths: Array
    stretched: bool


def restrict_to_feasible(robot: CableRobot, demand: Demand, listing: PoseList, steps: int) -> PoseList:
    """The same list with every way cut where one of its `steps` + 1 waypoints cannot be held, by the margin that it keeps.

    For workspaces with holes or thin walls, which a search along rays may step over; as a rule nothing changes.
    """
    shares = np.linspace(0.0, 1.0, steps + 1)
    share = np.ones(len(listing.fraction))
    np.divide(listing.fraction, listing.furthest, where=listing.furthest > 0, out=share)
    while True:
        ok = holds(robot, demand, listing.along(shares).reshape(-1, 4, 4)).reshape(-1, steps + 1)
        bad = ~ok.all(axis=1)
        if not bad.any():
            return listing
        last = np.maximum(ok.argmin(axis=1) - 1, 0)
        furthest = np.where(bad, shares[last] * listing.fraction, listing.furthest)
        # A way that is not even held at its start has no length, and is not asked again for ever.
        falls = (furthest[bad] < listing.fraction[bad]).all() and ok[:, 0].all()
        require(falls, "the start X_0 is not feasible", expected="a start that the cables can hold")
        limit = np.where(bad, LIMITS.index("statics"), listing.limit)
        listing = replace(listing, furthest=furthest, fraction=share * furthest, limit=limit)


def program(robot: CableRobot, listing: PoseList, steps: int, method: str = METHOD) -> MotionProgram:
    """Waypoints in `steps` equal steps on every way, with tensions by `method` (see `tension.distribute`) and lengths.

    Raises ModelError where the method gives no tensions, and when mass or limits of the robot are not known.
    """
    shares = np.linspace(0.0, 1.0, steps + 1)
    pose = listing.along(shares)
    every = pose.reshape(-1, 4, 4)
    found = hold(robot, every, method)
    none = int((~found.has_solution).sum())
    require(
        none == 0, "this method gives no tensions within the limits at every waypoint", key="method",
        found=f"{method}: none at {none} of {len(every)} waypoints",
        expected="norm or mid, which find tensions wherever there are any",
    )  # fmt: skip
    stretched = robot.elasticity is not None
    lengths, _ = inverse(robot, every, found.tension if stretched else None)
    shape = (*pose.shape[:2], len(robot.cables))
    return MotionProgram(shares, pose, found.tension.reshape(shape), lengths.reshape(shape), stretched)

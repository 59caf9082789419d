"""Frames, things on the tool and, softly held, the arm itself, fitted to many trials in lock step.

    e = W (p + R x) + w - y  [m],    L log(W R X Y^T)  [L rad, L = half the reach]

Closed forms start (points: linear in W, W (x) x; poses: linear hand-eye), Gauss-Newton follows. Rows far from the median
error weigh less (w = 1.5 median / |e|), and what is told is the median: a gross row, or a target moved in some of the rows,
is not what is looked for here.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.hypotheses.sights import Sights
from robocal.diagnose.limits import HYPOTHESIS_BENT
from robocal.geometry import se3, so3
from robocal.geometry.path.program import compile_path
from robocal.measure.machine import Mechanism
from robocal.measure.reach import reach

__all__ = ["SoftPrior", "TrialOutcome", "fit_trials", "reach_of", "transfer"]

ROUNDS = 10
NOISE = 5e-4  # m: against which the soft hold is weighed
LOOSE = 3.0  # expected errors: how softly the arm's own numbers are held


@record
class SoftPrior:
    """How far the arm's own numbers may go: names of the table with standard deviations (g,), and those of the joints'
    zeros (n,)."""

    names: tuple[str, ...]
    sigma: Array
    zeros: Array

    @classmethod
    def of_chain(cls, chain: Mechanism, zeros: float) -> SoftPrior:
        """Every number of the geometry by thrice what is expected, the joints' zeros by `zeros` rad (or dm)."""
        names = tuple(n for n in chain.geometric if not chain.table[n].turn)
        sigma = LOOSE * np.array([chain.table[n].scale for n in names])
        wide = np.array([0.1 * zeros if j.type == "prismatic" else zeros for j in chain.joints])
        return cls(names, sigma, wide)


@record
class TrialOutcome:
    """What each trial leaves: the median error of a reading (m), with what the arm had to give way for it; the joints'
    zeros that it took (B, n) and the numbers of its table (B, P); and how far the places that were read spread (m)."""

    left: Array
    zeros: Array
    values: Array
    spread: Array


def reach_of(chain: Mechanism, trials: Sights) -> float:
    """How far the nominal tool is from the base at the farthest, in the first trial (m)."""
    q = trials.joints[0]
    places = reach(chain, q, (), trials.columns)[0][:, :3, 3]
    return max(float(np.linalg.norm(places, axis=1).max()), 0.05)


def fit_trials(
    chain: Mechanism, trials: Sights, held: SoftPrior | None = None, rounds: int = ROUNDS, enough: float = -np.inf
) -> TrialOutcome:
    """Every trial after frames, things and, with `held`, the arm were fitted, or when none leaves more than is `enough` (m)."""
    state = _State(chain, trials, held)
    state.start()
    best = state.left()
    zeros, values = state.zeros.copy(), state.theta.copy()
    for _ in range(rounds):
        if (best <= enough).all():
            break
        state.step()
        left = state.left()
        better = left < best
        best = np.where(better, left, best)
        zeros[better], values[better] = state.zeros[better], state.theta[better]
    return TrialOutcome(best, zeros, values, trials.spread)


def transfer(chain: Mechanism, fitted: Sights, trials: Sights, rounds: int = ROUNDS) -> Array:
    """The error of every reading of some trials (B, k) in m, by the frames and things that fit one other trial."""
    state = _State(chain, fitted, None)
    state.start()
    best, won = state.left(), (state.w.copy(), state.x.copy())
    for _ in range(rounds):
        state.step()
        if state.left() < best:
            best, won = state.left(), (state.w.copy(), state.x.copy())
    there = _State(chain, trials, None)
    there.w, there.x = (np.repeat(v, len(trials.joints), axis=0) for v in won)
    return np.asarray(np.linalg.norm(there.residuals(there.poses()[0])[0], axis=-1))


class _State:
    """Where the iteration of all trials stands."""

    def __init__(self, chain: Mechanism, trials: Sights, held: SoftPrior | None) -> None:
        self.chain, self.trials, self.held = chain, trials, held
        b, k, n = trials.joints.shape
        self.size = b, k
        self.zeros = np.zeros((b, n))
        self.theta = np.repeat(chain.table.values[None], b, axis=0)
        self.w = np.repeat(trials.frames[None], b, axis=0)
        self.x = np.repeat(trials.things[None], b, axis=0)
        self.program = compile_path(chain.elements, chain.table)
        self.length = 0.5 * reach_of(chain, trials)
        self.high = 6 if trials.turned.any() else 3
        self.index = np.zeros(0, dtype=np.int64)
        self.entries = None
        if held is not None:
            self.index = np.array([chain.table.index[m] for m in held.names], dtype=np.int64)
            column = np.full(len(chain.table), -1, dtype=np.int64)
            column[self.index] = np.arange(len(self.index))
            a, fa = self.program.entries(column)
            z, fz = self.program.joint_entries([j.name for j in chain.joints])
            z = z.copy()
            z[:, 2] += len(self.index)
            self.entries = np.concatenate([a, z]), np.concatenate([fa, fz])
            self.sigma = np.concatenate([held.sigma, held.zeros])
        self.width = 0 if held is None else len(self.sigma)
        self.moved = np.zeros((b, self.width))
        self.rows = np.broadcast_to(np.arange(b)[:, None], (b, k))
        self.still: tuple[Array, Array] | None = None  # the poses, until the arm's own numbers move

    def poses(self, jacobian: bool = False) -> tuple[Array, Array]:
        """T (B, k, 4, 4) of the tool and, if asked for, how it moves with the arm's numbers (B, k, 6, width)."""
        jacobian = jacobian and self.entries is not None
        if self.still is not None and not jacobian:
            return self.still
        b, k = self.size
        q = (self.trials.joints + self.zeros[:, None]).reshape(b * k, -1)
        extra = {name: np.tile(v, b) for name, v in self.trials.columns.items()}
        phi = self.chain.phi(q, extra, self.program).reshape(b, k, -1)
        if jacobian:
            return self.program.run(self.theta, phi, self.entries, self.width)
        self.still = self.program.run(self.theta, phi)
        return self.still

    def start(self) -> None:
        """Of the closed forms the one that leaves least: hand-eye asks for orientations that differ, points for places."""
        t = self.poses()[0]
        best = np.full(self.size[0], np.inf)
        kept = self.w.copy(), self.x.copy()
        won = self.w.copy(), self.x.copy()
        for oriented in (True, False) if self.trials.turned.any() else (False,):
            self.w, self.x = kept[0].copy(), kept[1].copy()
            self._close_frames(t, oriented)
            for _ in range(2):
                self._things(t)
            left = self.left()
            better = (left < best) | ~np.isfinite(best)
            won[0][better], won[1][better] = self.w[better], self.x[better]
            best = np.minimum(best, left)
        self.w, self.x = won

    def _close_frames(self, t: Array, oriented: bool) -> None:
        """Every free frame, from the rows of its most frequent thing."""
        data = self.trials
        for f in range(len(data.frames)):
            rows = np.flatnonzero(data.frame == f)
            if not data.frames_free[f].any() or len(rows) < 4:
                continue
            most = int(np.bincount(data.thing[0, rows]).argmax())
            mine = rows[data.thing[0, rows] == most]
            if len(mine) < 4:
                continue
            if oriented and data.turned[mine].all():
                self.w[:, f] = _hand_eye(data.place[:, mine], data.turn[:, mine], t[:, mine])
            else:
                offset = bool(data.things_free[most, :3].any())
                self.w[:, f] = _points(data.place[:, mine], t[:, mine] @ data.things[most], offset)

    def _things(self, t: Array) -> None:
        """Every free thing where the frames have it."""
        data = self.trials
        w = self.w[:, data.frame]
        local = np.linalg.inv(w @ t)
        place = np.einsum("bkij,bkj->bki", local[..., :3, :3], data.place) + local[..., :3, 3]
        for i in range(len(data.things)):
            mine = data.thing == i
            if data.things_free[i, :3].any():
                some = np.where(mine[..., None], place, np.nan)
                good = mine.any(axis=1)
                self.x[good, i, :3, 3] = np.nanmedian(some[good], axis=1)
            if data.things_free[i, 3:].any() and data.turned.any():
                both = mine & data.turned
                total = np.einsum("bk,bkij,bkjl->bil", both.astype(float), local[..., :3, :3], data.turn)
                good = both.any(axis=1)
                self.x[good, i, :3, :3] = so3.project(total[good])

    def residuals(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """e (B, k, 3 or 6), the predicted place (B, k, 3), W R (B, k, 3, 3) and R x (B, k, 3)."""
        data = self.trials
        w = self.w[:, data.frame]
        x = self.x[self.rows, data.thing]
        r = t[..., :3, :3]
        lever = np.einsum("bkij,bkj->bki", r, x[..., :3, 3])
        place = np.einsum("bkij,bkj->bki", w[..., :3, :3], t[..., :3, 3] + lever) + w[..., :3, 3]
        wr = w[..., :3, :3] @ r
        e = np.zeros((*self.size, self.high))
        e[..., :3] = place - data.place
        if self.high > 3:
            turn = wr @ x[..., :3, :3] @ np.swapaxes(data.turn, -1, -2)
            e[..., 3:] = np.where(data.turned[:, None], self.length * so3.log(turn), 0.0)
        return e, place, wr, lever

    def left(self) -> Array:
        """The median error of a reading, with the price of what was moved, (B,)."""
        e = self.residuals(self.poses()[0])[0]
        size = np.linalg.norm(e, axis=-1)
        square = np.median(size, axis=1) ** 2
        if self.width:
            given = np.abs(self.moved / self.sigma)
            square = square + NOISE**2 * np.sum(given**2, axis=1) / self.size[1]
            square = np.where(given.max(axis=1) > HYPOTHESIS_BENT, np.inf, square)
        return np.asarray(np.where(np.isfinite(square), np.sqrt(square), np.inf))

    def step(self) -> None:
        """One Gauss-Newton step of all trials."""
        t, jac = self.poses(True)
        e, place, wr, lever = self.residuals(t)
        data = self.trials
        b, k = self.size
        frames, things = len(data.frames), len(data.things)
        n = 6 * (frames + things) + self.width
        high = self.high
        j = np.zeros((b, k, high, n))
        centre = place - place.mean(axis=1, keepdims=True)
        for f in range(frames):
            mine = data.frame == f
            a = 6 * f
            free = data.frames_free[f].astype(float)
            j[:, mine, :3, a : a + 3] = np.eye(3) * free[:3]
            j[:, mine, :3, a + 3 : a + 6] = -so3.skew(centre[:, mine]) * free[3:]
            if high > 3:
                j[:, mine, 3:, a + 3 : a + 6] = self.length * np.eye(3) * free[3:]
        for i in range(things):
            mine = (data.thing == i)[..., None, None]
            a = 6 * (frames + i)
            free = data.things_free[i].astype(float)
            j[..., :3, a : a + 3] = np.where(mine, wr * free[:3], 0.0)
            if high > 3:
                j[..., 3:, a + 3 : a + 6] = np.where(mine, self.length * wr * free[3:], 0.0)
        if self.width:
            w = self.w[:, data.frame][..., :3, :3]
            v = jac[..., :3, :] + np.cross(jac[..., 3:, :], lever[..., None], axisa=-2, axisb=-2, axisc=-2)
            j[..., :3, n - self.width :] = w @ v
            if high > 3:
                j[..., 3:, n - self.width :] = self.length * (w @ jac[..., 3:, :])
        if high > 3:
            j[:, ~data.turned, 3:, :] = 0.0
        size = np.linalg.norm(e, axis=-1)
        middle = np.median(size, axis=1, keepdims=True)
        weight = np.minimum(1.0, 1.5 * middle / np.maximum(size, 1e-300))
        flat = (j * weight[..., None, None]).reshape(b, high * k, n)
        a = np.swapaxes(flat, 1, 2) @ j.reshape(b, high * k, n) / NOISE**2
        g = np.einsum("bkn,bk->bn", flat, e.reshape(b, high * k)) / NOISE**2
        if self.width:
            a[:, range(n - self.width, n), range(n - self.width, n)] += self.sigma**-2
            g[:, n - self.width :] += self.moved / self.sigma**2
        scale = np.sqrt(np.einsum("bii->bi", a) + 1e-12)
        a = a / (scale[:, :, None] * scale[:, None, :])
        a[:, range(n), range(n)] += 1e-9
        with np.errstate(all="ignore"):
            try:
                d = -np.linalg.solve(a, (g / scale)[..., None])[..., 0] / scale
            except np.linalg.LinAlgError:
                d = np.zeros((b, n))
        self._move(np.where(np.isfinite(d), d, 0.0), place.mean(axis=1))

    def _move(self, d: Array, centre: Array) -> None:
        frames, things = len(self.trials.frames), len(self.trials.things)
        b = len(d)
        dw = d[:, : 6 * frames].reshape(b, frames, 6)
        turn = so3.exp(dw[..., 3:])
        # The turn is about the middle of what is predicted, which keeps it apart from the shift.
        away = self.w[..., :3, 3] - centre[:, None]
        self.w[..., :3, 3] = centre[:, None] + np.einsum("bfij,bfj->bfi", turn, away) + dw[..., :3]
        self.w[..., :3, :3] = turn @ self.w[..., :3, :3]
        dx = d[:, 6 * frames : 6 * (frames + things)].reshape(b, things, 6)
        self.x[..., :3, 3] += dx[..., :3]
        self.x[..., :3, :3] = so3.exp(dx[..., 3:]) @ self.x[..., :3, :3]
        if self.width:
            move = d[:, 6 * (frames + things) :]
            self.moved += move
            self.still = None
            own = len(self.index)
            self.theta[:, self.index] += move[:, :own]
            self.zeros += move[:, own:]


# --- closed forms of many trials --------------------------------------------------------------------------------------


def _points(y: Array, t: Array, offset: bool) -> Array:
    """W (B, 4, 4) with y = W (p + R c); y (B, m, 3), t (B, m, 4, 4). See `starts.frames.point_start`."""
    b, m = y.shape[:2]
    p, r = t[..., :3, 3], t[..., :3, :3]
    if not offset or m < 14:
        return _rigid(p, y)
    design = np.concatenate([p, r.reshape(b, m, 9), np.ones((b, m, 1))], axis=2)
    s = np.swapaxes(np.linalg.pinv(design, rcond=1e-8) @ y, 1, 2)
    w = so3.project(s[..., :3])
    c = np.einsum("bkj,bkjl->bl", w, s[..., 3:12].reshape(b, 3, 3, 3)) / 3
    rough = np.where(np.isfinite(c), c, 0.0)
    # Coplanar or regular poses may leave c without a say: then a rigid fit is the better start.
    tried = [(_rigid(q, y), q) for q in (p + np.einsum("bmij,bj->bmi", r, rough), p)]
    one, two = (np.median(np.linalg.norm(_apply(w, q) - y, axis=-1), axis=1) for w, q in tried)
    return np.where((one <= two)[:, None, None], tried[0][0], tried[1][0])


def _apply(w: Array, p: Array) -> Array:
    return np.asarray(np.einsum("bij,bmj->bmi", w[:, :3, :3], p) + w[:, None, :3, 3])


def _rigid(p: Array, y: Array) -> Array:
    """The rigid motion (B, 4, 4) that brings p (B, m, 3) to y."""
    a, b = p.mean(axis=1, keepdims=True), y.mean(axis=1, keepdims=True)
    r = so3.project(np.swapaxes(y - b, 1, 2) @ (p - a))
    return se3.compose(r, b[:, 0] - np.einsum("bij,bj->bi", r, a[:, 0]))


def _hand_eye(y: Array, turn: Array, t: Array) -> Array:
    """W (B, 4, 4) with Y = W T X; see `starts.frames.hand_eye`."""
    b, m = y.shape[:2]
    r = t[..., :3, :3]
    eye = np.eye(3)
    left = np.einsum("ij,bmlk->bmikjl", eye, turn).reshape(b, 9 * m, 9)
    right = np.einsum("bmij,kl->bmikjl", r, eye).reshape(b, 9 * m, 9)
    both = np.concatenate([left, -right], axis=2)
    v = np.linalg.eigh(np.swapaxes(both, 1, 2) @ both)[1][..., 0]
    w = v[:, :9].reshape(b, 3, 3)
    w = w * np.where(np.linalg.det(w) < 0, -1.0, 1.0)[:, None, None]
    rt = np.swapaxes(so3.project(w), 1, 2)
    design = np.concatenate([rt[:, None] @ r, np.broadcast_to(eye, (b, m, 3, 3))], axis=3).reshape(b, 3 * m, 6)
    values = (y - np.einsum("bij,bmj->bmi", rt, t[..., :3, 3])).reshape(b, 3 * m, 1)
    s = (np.linalg.pinv(design, rcond=1e-8) @ values)[..., 0]
    return se3.compose(rt, s[:, 3:])

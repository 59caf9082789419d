"""Cable robots whose drums count from anywhere beside an instrument that stands anywhere, and what their nominal robot leaves in truth.

The truth is a bundle of the test's own: frame, zeros and poses by Gauss and Newton's method with difference quotients, from where they were.
"""

from __future__ import annotations

import numpy as np
from cables.logs import AXES, NOISE, TURN, Log

from robocal.geometry import se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations

STEP = 1e-6


def frames(vectors):
    """T (m, 4, 4) of vectors (m, 6)."""
    out = np.tile(np.eye(4), (len(vectors), 1, 1))
    out[:, :3, :3], out[:, :3, 3] = rotations(vectors[:, 3:]), vectors[:, :3]
    return out


def rotations(vectors):
    """R (m, 3, 3) of rotation vectors (m, 3), by Rodrigues: scipy's look at its arguments takes ten times as long as few turns do."""
    angle = np.sqrt((vectors * vectors).sum(axis=1))[:, None, None]
    x, y, z = vectors.T
    none = np.zeros(len(vectors))
    k = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=1).reshape(-1, 3, 3)
    return np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (k @ k)


def rotation_vectors(r):
    """Of turns R (m, 3, 3) of less than a quarter, (m, 3)."""
    axis = 0.5 * np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    sine = np.sqrt((axis * axis).sum(axis=1))
    assert (np.trace(r, axis1=1, axis2=2) > 1).all()
    return axis / np.sinc(np.arcsin(sine) / np.pi)[:, None]


class Unknown:
    """A log of `Log` with other zeros and another place of the instrument, which reads poses or the positions of a ball."""

    def __init__(self, kind, instrument, seed, count=48, off=None):
        log = self.log = Log(kind, seed=seed, count=count, path=False)
        rng = np.random.default_rng(1000 + seed)
        self.axes, self.zeros = list(AXES[kind]), rng.uniform(-4, 4, len(log.a))
        self.y, self.t = log.y + log.zeros - self.zeros, log.poses(np.arange(count))
        self.frame = frames(np.r_[rng.uniform(-8, 8, 3), rng.normal(0, 1.5, 3)][None])[0]
        self.robot = log.nominal(off or {"eight": 0.01, "planar": 0.04}[kind])
        self.ball = np.array([0.06, 0.0 if kind == "planar" else 0.03, 0.11]) if instrument == "position" else None
        self.seen = self.frame @ log.told
        if self.ball is not None:
            at = self.t[:, :3, :3] @ self.ball + self.t[:, :3, 3]
            self.seen = at @ self.frame[:3, :3].T + self.frame[:3, 3] + NOISE * rng.normal(size=at.shape)

    def data(self, named=True):
        """Lengths, whose zeros are `named` or the robot's own, and what the instrument read."""
        m, n = self.y.shape
        options = {"cables": self.robot.cables} | ({"zeros": "power"} if named else {})
        read = Observations(
            "lengths", np.repeat(np.arange(m), n), self.y.reshape(-1, 1), np.full((m * n, 1), NOISE),
            extra={"cable": np.tile(np.arange(float(n)), m)}, options=options,
        )  # fmt: skip
        frame = Frame("tracker", (0.0,) * 6, (True,) * 6)
        if self.ball is None:
            sigma = np.tile([NOISE] * 3 + [TURN] * 3, (m, 1))
            seen = Observations("pose", np.arange(m), se3.to_vector(self.seen), sigma, frame)
        else:
            ball = Frame("ball", (*self.ball, 0.0, 0.0, 0.0), (False,) * 6, mount="tool")
            sigma, target = np.full((m, 3), NOISE), np.zeros(m, dtype=np.int64)
            seen = Observations("position", np.arange(m), self.seen, sigma, frame, (ball,), target)
        return DataSet(Configurations(tuple(f"p{i}" for i in range(m))), (read, seen))

    def left(self, frame, zeros, t):
        """What lengths, positions and turns the nominal robot leaves, (m, d) each, the last None where no turn was read."""
        ends = self.robot.b @ np.swapaxes(t[:, :3, :3], 1, 2) + t[:, None, :3, 3]
        r = np.linalg.norm(ends - self.robot.a, axis=2) - zeros - self.y
        if self.ball is not None:
            at = t[:, :3, :3] @ self.ball + t[:, :3, 3]
            return r, at @ frame[:3, :3].T + frame[:3, 3] - self.seen, None
        q = frame @ t
        turned = np.swapaxes(q[:, :3, :3], 1, 2) @ self.seen[:, :3, :3]
        return r, q[:, :3, 3] - self.seen[:, :3, 3], rotation_vectors(turned)

    def _white(self, *x):
        r, p, a = self.left(*x)
        return np.concatenate([r / NOISE, p / NOISE] + ([] if a is None else [a / TURN]), axis=1)

    def _step(self, frame, zeros, t, shared, own):
        full = np.zeros((len(t), 6))
        full[:, self.axes] = own
        moved, d = t.copy(), frames(full)
        moved[:, :3, 3] += full[:, :3]
        moved[:, :3, :3] = d[:, :3, :3] @ t[:, :3, :3]
        return frame @ frames(shared[None, :6])[0], zeros + shared[6:], moved

    def _slopes(self, x, shared):
        """Difference quotients for what is shared (m, d, k) or for the poses' own numbers (m, d, l)."""
        count = 6 + len(self.zeros) if shared else len(self.axes)
        out = []
        for e in STEP * np.eye(count):
            pair = (e, np.zeros(len(self.axes))) if shared else (np.zeros(6 + len(self.zeros)), e)
            ends = [self._white(*self._step(*x, s * pair[0], s * pair[1])) for s in (1, -1)]
            out.append((ends[0] - ends[1]) / (2 * STEP))
        return np.stack(out, axis=-1)

    def fit(self, weight, x=None, steps=12, shared=True):
        """Frame, zeros and poses that leave least of the configurations with weight (m,)."""
        x = (self.frame, self.zeros, self.t) if x is None else x
        left = np.inf
        for _ in range(steps):
            r = self._white(*x)
            before, left = left, float((weight if shared else np.ones(len(r))) @ (r * r).sum(axis=1))
            if before - left < 1e-9 * left:  # a billionth of the squares is no part of a fifth of an error
                break
            own = self._slopes(x, False)
            flat = np.swapaxes(own, 1, 2)
            a, g = flat @ own, (flat @ r[..., None])[..., 0]
            ds = np.zeros(6 + len(self.zeros))
            back = np.zeros((len(r), len(self.axes), len(ds)))
            if shared:
                j = self._slopes(x, True)
                c = flat @ j
                back = np.linalg.solve(a, c)
                h = np.tensordot(weight[:, None, None] * j, j, ((0, 1), (0, 1)))
                h -= np.tensordot(weight[:, None, None] * c, back, ((0, 1), (0, 1)))
                f = np.einsum("m,mdi,md->i", weight, j, r) - np.einsum("m,mia,mi->a", weight, back, g)
                ds = -np.linalg.lstsq(h, f, rcond=1e-12)[0]
            dl = -np.linalg.solve(a, g[..., None])[..., 0] - back @ ds
            x = self._shorten(x, ds, dl, weight if shared else None)
        return x

    def _shorten(self, x, ds, dl, weight):
        """A step as long as it leaves less: of everything with weight (m,), or of each pose by itself."""
        before = (self._white(*x) ** 2).sum(axis=1)
        length = np.ones(len(before))
        for _ in range(12):
            near = self._step(*x, length[0] * ds, length[:, None] * dl)
            worse = (self._white(*near) ** 2).sum(axis=1) > before
            if weight is not None:
                worse[:] = weight @ (self._white(*near) ** 2).sum(axis=1) > weight @ before
            if not worse.any():
                return near
            length[worse] /= 2
        return self._step(*x, 0.0 * ds, np.where(worse, 0.0, length)[:, None] * dl) if weight is None else x

    def unseen(self, fitted, held):
        """Mean error (m) of lengths and positions of the `held` configurations, whose poses are fitted to their own rows, by the nominal
        robot fitted to others."""
        x = self.fit(fitted.astype(float))
        r, p, a = self.left(*self.fit(fitted.astype(float), x, 8, shared=False))
        numbers = r.shape[1] + 3 * (2 - (a is None))
        each = np.concatenate([np.abs(r[held]).ravel(), np.linalg.norm(p[held], axis=1)])
        return float(each.mean() * np.sqrt(numbers / (numbers - len(self.axes))))

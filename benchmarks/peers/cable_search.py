"""A reachable pose as one would program it with a solver per pose: steps and halvings of the ray, contacts by sampling.

For each motion: lambda_s, the last of 64 steps that can be held, then halvings to 1e-6; lambda_c, the first of 1000 samples at which
two cables or a cable and the platform's box touch, then halvings to 1e-6 (not certified: a contact between two samples is not seen).
The pose is at 0.95 of the smaller.
"""

import cable_job as cables
import numpy as np
from scipy.spatial.transform import Rotation

STEPS, SAMPLES, FINE, SHARE = 64, 1000, 1e-6, 0.95
PAIRS = np.array([(k, l) for k in range(cables.CABLES) for l in range(k + 1, cables.CABLES)])


def moved(start, translation, turn, lam):
    """Rotations (k, 3, 3) and positions (k, 3) at lam (k,) of the motion."""
    return Rotation.from_rotvec(lam[:, None] * turn).as_matrix(), start + lam[:, None] * translation


def apart(first, one, second, two):
    """Distances of segments `first` + s `one`, `second` + t `two`, 0 <= s, t <= 1, all (..., 3) (Ericson, 5.1.9)."""
    between = first - second
    a, e, f = (one * one).sum(-1), (two * two).sum(-1), (two * between).sum(-1)
    b, c = (one * two).sum(-1), (one * between).sum(-1)
    square = a * e - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.where(square > 1e-12 * a * e, np.clip((b * f - c * e) / square, 0, 1), 0.0)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    return np.linalg.norm(between + s[..., None] * one - t[..., None] * two, axis=-1)


def touches(rotation, position):
    """Whether anything touches at poses (k,)."""
    ends = position[:, None] + np.einsum("kij,mj->kmi", rotation, cables.B)
    way = ends - cables.A
    k, l = PAIRS.T
    near = apart(cables.A[k], way[:, k], cables.A[l], way[:, l]).min(axis=1) <= cables.DIAMETER
    # The point of each cable where its own eyelet ends, in the platform's axes: how far out of the box it is.
    out = ends - cables.RELIEF * way / np.linalg.norm(way, axis=2)[..., None] - position[:, None]
    high = (np.abs(np.einsum("kji,kmj->kmi", rotation, out)) - cables.HALF).max(axis=2)
    return near | (high <= cables.DIAMETER / 2).any(axis=1)


class Search:
    """`balance` says whether a pose can be held, `least` gives its tensions."""

    def __init__(self, balance, least):
        self.balance, self.least = balance, least
        self.load = cables.weight(1)[0]

    def statics(self, motion):
        """lambda_s."""

        def held(lam):
            return self.balance(cables.structure(*moved(*motion, np.array([lam])))[0], self.load) is not None

        return edge(held, next((i for i in range(1, STEPS + 1) if not held(i / STEPS)), None), STEPS)

    def contact(self, motion):
        """lambda_c."""

        def free(lam):
            return not touches(*moved(*motion, np.array([lam])))[0]

        found = touches(*moved(*motion, np.arange(1, SAMPLES + 1) / SAMPLES))
        return edge(free, int(found.argmax()) + 1 if found.any() else None, SAMPLES)

    def reach(self, start, translation, turn):
        """min(lambda_s, lambda_c), and the tensions and lengths (m,) at the pose itself."""
        motion = start, translation, turn
        furthest = min(self.statics(motion), self.contact(motion))
        rotation, position = moved(*motion, np.array([SHARE * furthest]))
        length = np.linalg.norm(cables.A - position - cables.B @ rotation[0].T, axis=1)
        tension = self.least(cables.structure(rotation, position)[0], self.load)
        return furthest, np.full(cables.CABLES, np.nan) if tension is None else tension, length


def edge(good, first, steps):
    """Where `good` ends, within FINE, if `first` of `steps` is the first that is not; 1 if none is."""
    if first is None:
        return 1.0
    low, high = (first - 1) / steps, first / steps
    while high - low > FINE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if good(middle) else (low, middle)
    return low

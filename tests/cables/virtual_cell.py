"""An eight-cable robot in a workshop: drums that err by a per cent, zeros that nobody knows, a tracker that stands anywhere.

Lengths and poses are computed here by the geometry alone, not by the product.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from robocal.geometry import se3, so3

HEADER = ("x [mm]", "y [mm]", "z [mm]", "rx [deg]", "ry [deg]", "rz [deg]")
LENGTH, PLACE, TURN = 5e-4, 2e-4, np.radians(0.02)  # noise: m of a length, m and rad of a pose


class Cell:
    """The built machine: anchors a (m, 3), b (m, 3), zeros and gains (m,), and where its tracker and its target are."""

    def __init__(self, a, b, seed, zeros=2.0, gain=0.01):
        self.rng = np.random.default_rng(seed)
        self.a, self.b = a + self.rng.normal(0, 0.01, a.shape), b
        self.zeros = self.first = self.rng.uniform(-zeros, zeros, len(a))
        self.gain = 1 + gain * self.rng.choice([-1.0, 1.0], len(a)) * self.rng.uniform(0.8, 1.2, len(a))
        self.tracker, self.target = self.stand(), self._motion(0.1, 1.0)

    def stand(self):
        """Another place of the tracker."""
        return self._motion(3.0, 3.0)

    def _motion(self, shift, turn):
        axis = self.rng.normal(size=3)
        return se3.compose(so3.exp(axis * turn / np.linalg.norm(axis)), self.rng.uniform(-shift, shift, 3))

    def shown(self, poses, noise=LENGTH):
        """What the sensors show at poses (k, 4, 4), mm."""
        ends = poses[:, None, :3, 3] + np.einsum("kij,mj->kmi", poses[:, :3, :3], self.b) - self.a
        y = (np.linalg.norm(ends, axis=2) - self.zeros) / self.gain
        return 1e3 * (y + self.rng.normal(0, noise, y.shape))

    def seen(self, poses, place=PLACE, turn=TURN):
        """What the tracker reads of the target, mm and deg."""
        t = se3.inverse(self.tracker) @ poses @ self.target
        t = se3.displace(t, self.rng.normal(0, place, (len(t), 3)), self.rng.normal(0, turn, (len(t), 3)))
        return se3.to_vector(t) * np.repeat([1e3, 180 / np.pi], 3)


def write(path, ids, header, rows):
    """A table as somebody fills it in."""
    with Path(path).open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["id", *header])
        out.writerows([i, *(f"{v:.6f}" for v in row)] for i, row in zip(ids, rows, strict=True))

"""Logs of cable robots on a path or at poses one by one, lengths and poses of an instrument, made without the project's kinematics."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from robocal.cables.geometry import CableRobot, cable_robot
from robocal.geometry import se3, so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations

NOISE = 1e-3
TURN = np.radians(0.05)
AXES = {"eight": (0, 1, 2, 3, 4, 5), "planar": (0, 2, 4)}


def anchors(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Frame and platform anchors: a box with eight cables, or four cables in a plane."""
    x, y, z = rng.uniform([1.5, 1.2, 2.0], [3.0, 2.5, 3.5])
    if kind == "planar":
        a = [[0.2, 0, 0.2], [x, 0, 0.2], [x, 0, z], [0.2, 0, z]]
        return np.array(a), np.array([[-0.1, 0, 0.08], [0.1, 0, 0.08], [0.1, 0, -0.08], [-0.1, 0, -0.08]])
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    a = [[sx * x, sy * y, h] for h in (0.1, z) for sx, sy in corners]
    b = [[sx * (0.15 - d), sy * (0.05 + d), h] for h, d in ((0.1, 0.1), (-0.1, 0.0)) for sx, sy in corners]
    return np.array(a), np.array(b)


@dataclass
class Log:
    """A true robot, where it is at any row, and what instruments read of it; what is read can be changed before `data` is asked."""

    kind: str = "eight"
    seed: int = 0
    count: int = 90
    path: bool = True
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = rng = np.random.default_rng(self.seed)
        self.a, self.b = anchors(self.kind, rng)
        self.zeros = rng.uniform(0.1, 0.5, len(self.a))
        free = np.isin(np.arange(6), AXES[self.kind])
        half = (self.a.max(axis=0) - self.a.min(axis=0)) / 2
        self._middle = (self.a.max(axis=0) + self.a.min(axis=0)) / 2 * free[:3]
        self._reach = np.concatenate([half * rng.uniform(0.3, 0.6), np.radians(rng.uniform(4, 15, 3))]) * free
        self._pace, self._begin = rng.uniform(1, 4, 6) / self.count, rng.uniform(0, 6.28, 6)
        self._places = rng.uniform(-1, 1, (self.count, 6))
        self.free = free
        t = self.poses(np.arange(self.count))
        self.y = self.lengths(t) + NOISE * rng.normal(size=(self.count, len(self.a)))
        self.told = t.copy()
        e = (
            np.concatenate([NOISE * rng.normal(size=(self.count, 3)), TURN * rng.normal(size=(self.count, 3))], 1)
            * free
        )
        self.told[:, :3, 3] += e[:, :3]
        self.told[:, :3, :3] = so3.exp(e[:, 3:]) @ t[:, :3, :3]

    def poses(self, rows: np.ndarray) -> np.ndarray:
        """T (m, 4, 4) at rows, which need be no whole numbers on a path."""
        turn = 2 * np.pi * self._pace * np.asarray(rows, float)[:, None] + self._begin
        v = (np.sin(turn) if self.path else self._places) * self._reach
        return se3.from_vector(v + np.concatenate([self._middle, np.zeros(3)]))

    def lengths(self, t: np.ndarray) -> np.ndarray:
        """What sensors without noise show at poses (m, 4, 4)."""
        ends = np.einsum("nij,cj->nci", t[:, :3, :3], self.b) + t[:, None, :3, 3]
        return np.linalg.norm(ends - self.a, axis=2) - self.zeros

    def delay(self, rows: float, cables: object = slice(None)) -> None:
        """Lengths that belong to poses so many rows before."""
        now, then = (self.lengths(self.poses(np.arange(self.count) - s)) for s in (0.0, rows))
        self.y[:, cables] += (then - now)[:, cables]

    def shift_instrument(self, at: int, size: float) -> None:
        """The instrument stands elsewhere from a row on, by so much."""
        d = self.rng.normal(size=3) * self.free[:3]
        self.told[at:, :3, 3] += size * d / np.linalg.norm(d)

    def nominal(self, off: float = 0.02) -> CableRobot:
        """What is written of it: frame anchors off by so much."""
        shift = off * self.rng.normal(size=self.a.shape) * self.free[:3]
        free = [f"a{s}" for s, open_ in zip("xyz", self.free[:3], strict=True) if open_] + ["l0"]
        known = {"degrees": "1R2T", "plane": "xz"} if self.kind == "planar" else {}
        return cable_robot("log", self.a + shift, self.b, self.zeros, free=free, **known)

    def data(self, known: bool = True) -> DataSet:
        """Lengths and poses, each with its file; whether the place of the instrument is known."""
        m, n = self.y.shape
        rows = np.arange(m) + 2
        read = Observations(
            "lengths", np.repeat(np.arange(m), n), self.y.reshape(-1, 1), np.full((m * n, 1), NOISE),
            extra={"cable": np.tile(np.arange(n), m)}, source="lengths.csv", rows=np.repeat(rows, n),
        )  # fmt: skip
        frame = Frame("tracker", (0.0,) * 6, (not known,) * 6)
        sigma = np.tile([NOISE] * 3 + [TURN] * 3, (m, 1))
        seen = Observations(
            "pose", np.arange(m), se3.to_vector(self.told), sigma, frame, source="poses.csv", rows=rows
        )  # fmt: skip
        return DataSet(Configurations(tuple(f"p{i}" for i in range(m))), (read, seen))

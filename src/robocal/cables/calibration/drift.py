"""What changed of a cable robot between two calibrations, and how two or more of them scatter.

    d = x_2 - x_1,  cov(d) = C_1 + C_2,      d = G m + E_i e + noise

x are frame anchors and zeros, m motions of the base that may differ, E_i the anchor of one cable. Where zeros stand unchanged, d
is conditioned on that: the direction towards the platform, in which anchor and zero look alike, is then known as well as any other;
elsewhere zeros are nobody's business and are left out of d. The cable whose e explains most is named while chance would show as much
less than `SURE` times in one comparison of all cables; e of those that were named is free in every test of another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import special

from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.geometry import fits

__all__ = ["SURE", "CableChange", "Compared", "Known", "Scattered", "compared", "scattered"]

Array = NDArray[np.float64]
SURE = 0.01
POWER = 0.95  # of seeing the smallest drift that is told
XYZ, ANCHOR = "xyz", ("ax", "ay", "az")
TINY = 1e-30


@dataclass(frozen=True)
class Known:
    """What a calibration found: names, values (n,) and covariance (n, n), SI; `hidden` (n, h) is a root of what numbers that were held
    contribute, the same truth in every calibration of the robot (None: nothing)."""

    names: tuple[str, ...]
    values: Array
    covariance: Array
    hidden: Array | None = None

    @property
    def whole(self) -> Array:
        """The covariance of estimate minus truth (n, n), what was held included."""
        return self.covariance if self.hidden is None else self.covariance + self.hidden @ self.hidden.T

    def taken(self, names: Sequence[str]) -> tuple[Array, Array, Array]:
        """Values, covariance and hidden root of some names."""
        at = [self.names.index(n) for n in names]
        hidden = np.zeros((len(at), 0)) if self.hidden is None else self.hidden[at]
        return self.values[at], self.covariance[np.ix_(at, at)], hidden


@dataclass(frozen=True, eq=False)
class CableChange:
    """One cable: change of its anchor (3,), m, with its covariance (3, 3), and of its zero with its standard deviation; unit vector
    `sight` (3,) from the anchor towards the platform.

    `chance` is that of so large a change of the anchor without any, `of_all` the same of the most conspicuous of all cables; `moved`
    whether the anchor is named, `doubtful` whether anchor or zero changed and the data do not say which. `smallest` are drifts, m,
    that would be named with a chance of POWER: along the line of sight, and across it at worst; infinite where the anchor was not
    found in both.
    """

    cable: str
    shift: Array
    covariance: Array
    zero: float
    zero_sigma: float
    sight: Array
    chance: float
    of_all: float
    moved: bool
    doubtful: bool
    smallest: tuple[float, float]

    @property
    def sigma(self) -> Array:
        """Standard deviations (3,) of the change of the anchor, m."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def along(self) -> float:
        """The part of the change along the line of sight."""
        return float(self.shift @ self.sight)

    @property
    def along_sigma(self) -> float:
        """The standard deviation of that part."""
        return float(np.sqrt(self.sight @ self.covariance @ self.sight))

    @property
    def across(self) -> float:
        """The length of the part across it."""
        return float(np.linalg.norm(self.shift - self.along * self.sight))


@dataclass(frozen=True, eq=False)
class Compared:
    """Two calibrations compared: every cable; motion of the base (6,) as (v, w) with standard deviations where it may differ; change of
    the size of the frame, 1, with its standard deviation; and the chance of all of it without any change."""

    cables: tuple[CableChange, ...]
    base: Array | None
    base_sigma: Array | None
    scale: float
    scale_sigma: float
    chance: float

    @property
    def moved(self) -> tuple[str, ...]:
        """The cables whose anchors are named."""
        return tuple(c.cable for c in self.cables if c.moved)


@dataclass(frozen=True, eq=False)
class _Difference:
    """d with its covariance, and where the numbers of every cable are in it."""

    names: tuple[str, ...]
    d: Array
    c: Array
    shared: Mapping[str, str]

    @cached_property
    def at(self) -> dict[str, int]:
        """Of every name."""
        return {n: i for i, n in enumerate(self.names)}

    def of(self, cable: str, symbols: Sequence[str]) -> list[int]:
        """Where those of a cable are that both know."""
        names = (self.shared.get(f"{cable}.{s}", f"{cable}.{s}") for s in symbols)
        return [self.at[n] for n in names if n in self.at]

    def without(self, given: list[int]) -> _Difference:
        """Conditioned on some of d being zero."""
        if not given:
            return self
        rest = [i for i in range(len(self.d)) if i not in set(given)]
        gain = np.linalg.solve(self.c[np.ix_(given, given)], self.c[np.ix_(given, rest)]).T
        return _Difference(
            tuple(self.names[i] for i in rest),
            self.d[rest] - gain @ self.d[given],
            self.c[np.ix_(rest, rest)] - gain @ self.c[np.ix_(given, rest)],
            self.shared,
        )

    def only(self, symbol: str) -> _Difference:
        """Without the numbers of other kinds."""
        at = [i for i, n in enumerate(self.names) if n.rpartition(".")[2].startswith(symbol)]
        return _Difference(tuple(self.names[i] for i in at), self.d[at], self.c[np.ix_(at, at)], self.shared)

    def columns(self, rates: Sequence[Mapping[str, float]]) -> Array:
        """Tangents (n, k) of motions."""
        return np.array([[r.get(n, 0.0) for r in rates] for n in self.names]).reshape(len(self.names), len(rates))

    def beside(self, tangents: Array) -> tuple[Array, Array]:
        """P d (n,) and P (n, n): what weighs d where tangents (n, k) are nobody's fault."""
        w = np.linalg.inv(self.c)
        if tangents.shape[1]:
            t = w @ tangents
            w = w - t @ np.linalg.solve(tangents.T @ t, t.T)
        return np.asarray(w @ self.d), np.asarray(w)

    def change(self, at: list[int], tangents: Array) -> tuple[Array, Array, float]:
        """Estimate (k,) of a change of the numbers `at` alone, its covariance, and the chance of as much."""
        u, p = self.beside(tangents)
        cov = np.linalg.pinv(p[np.ix_(at, at)], hermitian=True, rcond=1e-12)
        found = cov @ u[at]
        return found, np.asarray(cov), float(special.chdtrc(len(at), max(float(found @ u[at]), 0.0))) if at else 1.0


def compared(
    robot: CableRobot, first: Known, second: Known, *, zeros_unchanged: bool = False, base_moves: bool = False
) -> Compared:
    """Compares two calibrations of a robot; `zeros_unchanged` says that its sensors counted on in between, `base_moves` that the
    coordinates of the two need not be the same. Raises ModelError where they know nothing in common."""
    names = tuple(n for n in first.names if n in second.names and n in robot.table)
    if not names:
        raise ModelError("the two calibrations found nothing in common", expected="anchors or zeros found in both")
    (x, a, h), (y, b, k) = first.taken(names), second.taken(names)
    # What both hide alike cancels; where they hide different things, each counts by itself.
    hidden = k - h if h.shape == k.shape else np.hstack([h, k])
    full = _Difference(names, y - x, a + b + hidden @ hidden.T + TINY * np.eye(len(names)), robot.shared)
    if zeros_unchanged:
        full = full.without([i for i, n in enumerate(names) if n.endswith(".l0")])
    diff = full.only("a")
    rates = [v for k, v in robot.motions.items() if k.startswith("the base")] if base_moves else []
    ground = diff.columns(rates)
    moved = _moved(diff, ground, robot.cables, ANCHOR)
    either = _moved(full, full.columns(rates), robot.cables, (*ANCHOR, "l0"), moved)
    changes = tuple(_cable(robot, full, diff, rates, cable, moved, either) for cable in robot.cables)
    free = np.hstack([ground, _own(diff, moved, ANCHOR)])
    base = sigma = None
    if base_moves:
        w = np.linalg.inv(diff.c)
        cov = np.linalg.inv(free.T @ w @ free)
        base, sigma = (cov @ free.T @ w @ diff.d)[: len(rates)], np.sqrt(np.diag(cov))[: len(rates)]
    u, p = diff.beside(ground)
    middle = robot.a.mean(axis=0)
    away = dict(
        zip((robot.row(f"{c}.a{s}") for c in robot.cables for s in XYZ), (robot.a - middle).ravel(), strict=True)
    )
    u_rest, p_rest = diff.beside(free)
    grown = diff.columns([away])[:, 0]
    information = float(grown @ p_rest @ grown)
    scale, scale_sigma = (
        (float(grown @ u_rest) / information, information**-0.5) if information > TINY else (0.0, np.inf)
    )
    chance = float(special.chdtrc(max(len(diff.d) - len(rates), 1), float(diff.d @ u)))
    return Compared(changes, base, sigma, scale, scale_sigma, chance)


def _own(diff: _Difference, cables: Sequence[str], symbols: Sequence[str]) -> Array:
    """Columns (n, k) of the numbers of some cables."""
    at = list(dict.fromkeys(i for c in cables for i in diff.of(c, symbols)))
    return np.eye(len(diff.names))[:, at]


def _moved(
    diff: _Difference, ground: Array, cables: Sequence[str], symbols: Sequence[str], known: Sequence[str] = ()
) -> tuple[str, ...]:
    """The cables of which these numbers changed, beside those that are known, the most conspicuous first."""
    out = list(known)
    while len(out) < len(cables):
        free = np.hstack([ground, _own(diff, out, symbols)])
        told = {i for c in out for i in diff.of(c, symbols)}
        rest = [c for c in cables if c not in out and diff.of(c, symbols) and not set(diff.of(c, symbols)) <= told]
        if not rest or len(diff.d) - free.shape[1] <= len(symbols):
            break
        found = [diff.change(diff.of(c, symbols), free) for c in rest]
        best = int(np.argmax([float(e @ np.linalg.pinv(c, hermitian=True, rcond=1e-12) @ e) for e, c, _ in found]))
        if len(cables) * found[best][2] >= SURE:
            break
        out.append(rest[best])
    return tuple(out[len(known) :])


def _cable(
    robot: CableRobot, full: _Difference, diff: _Difference, rates: Sequence[Mapping[str, float]], cable: str, moved: Sequence[str],
    either: Sequence[str],
) -> CableChange:  # fmt: skip
    i, m = robot.cables.index(cable), len(robot.cables)
    towards = robot.home[:3, 3] + robot.b[i] - robot.a[i]
    sight = towards / np.linalg.norm(towards)
    at = diff.of(cable, ANCHOR)
    others = [c for c in moved if c != cable and diff.of(c, ANCHOR) != at]
    found, cov, chance = diff.change(at, np.hstack([diff.columns(rates), _own(diff, others, ANCHOR)]))
    axes = [XYZ.index(diff.names[where][-1]) for where in at]
    shift, spread = np.zeros(3), np.zeros((3, 3))
    shift[axes], spread[np.ix_(axes, axes)] = found, cov
    zero = full.of(cable, ("l0",))
    zeroed = (float(full.d[zero[0]]), float(np.sqrt(full.c[zero[0], zero[0]]))) if zero else (0.0, 0.0)
    return CableChange(
        cable, shift, spread, *zeroed, sight, chance, min(1.0, m * chance), any(diff.of(c, ANCHOR) == at for c in moved), cable in either,
        _smallest(cov, sight, m, len(at)),
    )  # fmt: skip


def _smallest(c: Array, sight: Array, cables: int, known: int) -> tuple[float, float]:
    """Drifts (m) along the line of sight and across it, at worst, that would be named with a chance of POWER."""
    if known < 3:
        return np.inf, np.inf
    level = float(special.chdtri(3, SURE / cables))
    need = float(special.chndtrinc(level, 3, 1 - POWER))
    weight = np.linalg.pinv(c, hermitian=True, rcond=1e-12)
    across = np.linalg.svd(sight[None])[2][1:]
    least = float(np.linalg.eigvalsh(across @ weight @ across.T)[0])
    return float(np.sqrt(need / max(float(sight @ weight @ sight), TINY))), float(np.sqrt(need / max(least, TINY)))


@dataclass(frozen=True, eq=False)
class Scattered:
    """How calibrations scatter about their mean, m: root mean square of a component (3.39a) and of a point, of a zero; and of what is
    left of a component once every frame is brought onto the mean by a motion, and by a motion and a size. `along` and `across` are
    what is left by then along the lines of sight and, of one component, across them; `size` (k,) is that of each frame beside the
    mean, less 1."""

    component: float
    point: float
    zero: float
    moved: float
    scaled: float
    along: float
    across: float
    size: Array


def scattered(robot: CableRobot, anchors: Array, zeros: Array) -> Scattered:
    """The scatter of k calibrations, anchors (k, m, 3) and zeros (k, m)."""
    mean = anchors.mean(axis=0)
    off = anchors - mean
    rigid, size, left = [], [], []
    for each in anchors:
        t = fits.rigid(each, mean)
        there = each @ t[:3, :3].T + t[:3, 3]
        a, b = there - there.mean(axis=0), mean - mean.mean(axis=0)
        s = float((a * b).sum() / (a * a).sum())
        rigid.append(there - mean)
        size.append(1 / s - 1)
        left.append(s * a - b)
    towards = mean.mean(axis=0) + robot.b - mean
    sight = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    rest = np.array(left)
    along = np.einsum("kmi,mi->km", rest, sight)
    across = rest - along[..., None] * sight
    rms = [float(np.sqrt(np.mean(np.square(v)))) for v in (off, zeros - zeros.mean(axis=0), rigid, rest, along)]
    return Scattered(
        rms[0], float(np.sqrt(3.0)) * rms[0], rms[1], rms[2], rms[3], rms[4],
        float(np.sqrt(np.square(across).sum() / (2 * across.shape[0] * across.shape[1]))), np.array(size),
    )  # fmt: skip

"""How errors of what was measured become errors of frame anchors and zeros, without drawing any.

With u_ij the direction of cable i at pose j and L_ij its slopes by the platform's (v, w), a reading's error e_ij and a pose's error
(v, w)_j move the calibration of cable i by

    [dx_i] = (D_i^T W D_i)^-1 D_i^T W (L_ij (v, w)_j - e_ij),    D_ij = [u_ij^T, 1],    x_i = (a_i, l0_i)

with W = 1 for the residual in lengths and W = |s - a|^2 for the squared one, which is (3.63) of the thesis behind
`examples/cable-laval`: block by block, since no row has two cables in it. A pose enters all its cables, so their errors are
correlated; a fit that knows it (`errors in variables`) weighs the readings of a pose by the inverse of s^2 I + L P L^T, and is
the maximum likelihood with free poses to first order.

Which sensors and how many poses a calibration needs to be as good as it must be.

A covariance that follows from three noises s = (of a length, of a place, of a turn) is homogeneous: all noises times k make all errors
times k. So every error that is wanted is reached by scaling all noises by one factor. One noise alone, the others as they are, is
found by bisection, where the error still falls; and with n poses like those of the list the error goes as 1 / sqrt(n). Which error:

    anchors, zeros          (3.39): root mean square of the components of the frame anchors, and of the zeros
    position, orientation   of the platform afterwards, by forward kinematics from lengths without noise: the pose (v, w) that the
                            error dx of the calibration leaves is L^+ D dx; root mean square over the list of |v| and of |w|
"""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot, straight
from robocal.errors import ModelError, require, require_one_of
from robocal.geometry import so3

__all__ = ["ESTIMATORS", "WHAT", "ErrorPropagation", "Expected", "Noise", "Requirement", "rms"]

ESTIMATORS = ("maximum-likelihood", "per-cable")
WHAT = ("anchors", "zeros", "position", "orientation")
HALVINGS = 60
NOWHERE = 1e-6  # of a noise: a sensor that is none better


@record
class Noise:
    """One standard deviation of a reading (m), of a component of the platform's place (m) and of its rotation vector (rad)."""

    length: float = 0.0
    position: float = 0.0
    orientation: float = 0.0

    @property
    def pose(self) -> Array:
        """Of (v, w), (6,)."""
        return np.array([self.position] * 3 + [self.orientation] * 3)


def rms(anchors: ArrayLike, zeros: ArrayLike) -> tuple[float, float]:
    """(3.39): the root mean square of the components of anchors' errors (..., 3) and of the zeros' errors (...), in m."""
    a, z = np.asarray(anchors, float), np.asarray(zeros, float)
    return float(np.sqrt(np.mean(a**2))), float(np.sqrt(np.mean(z**2)))


@record(eq=False)
class ErrorPropagation:
    """A robot at a list of poses (n, 4, 4): everything that the error model needs of them."""

    robot: CableRobot
    poses: Array

    @cached_property
    def _parts(self) -> tuple[Array, Array, Array]:
        self.robot.need_straight()
        full, slope, lever = straight(self.robot, self.poses)
        return full, slope, lever

    @property
    def full(self) -> Array:
        """Geometric lengths (n, m)."""
        return self._parts[0]

    @property
    def slope(self) -> Array:
        """L (n, m, 6); what the platform cannot do is zero."""
        out = np.zeros_like(self._parts[1])
        out[..., list(self.robot.axes)] = self._parts[1][..., list(self.robot.axes)]
        return out

    @property
    def axes(self) -> list[int]:
        """The components of an anchor that are sought."""
        return [i for i in self.robot.axes if i < 3]

    @cached_property
    def rows(self) -> Array:
        """D (n, m, k)."""
        u = self._parts[1][..., self.axes]
        return np.concatenate([u, np.ones((*u.shape[:2], 1))], axis=-1)

    def _weight(self, squared: bool) -> Array:
        return self.full**2 if squared else np.ones_like(self.full)

    def gain(self, squared: bool = False) -> Array:
        """(D^T W D)^-1 D^T W of every cable, (m, k, n). Raises ModelError where the list does not tell a cable's numbers."""
        d, w = self.rows.swapaxes(0, 1), self._weight(squared).T[..., None]
        a = d.swapaxes(1, 2) @ (w * d)
        bad = np.flatnonzero(np.linalg.cond(a) > 1e14)
        if len(bad):
            key, found = self.robot.cables[bad[0]], f"{len(self.poses)} poses"
            raise ModelError("the poses do not tell an anchor and a zero", key=key, found=found)
        return np.asarray(np.linalg.solve(a, (w * d).swapaxes(1, 2)))

    def propagate(
        self, *, lengths: ArrayLike = 0.0, places: ArrayLike = 0.0, turns: ArrayLike = 0.0, squared: bool = False
    ) -> tuple[Array, Array]:
        """By how much given errors move anchors (..., m, 3) and zeros (..., m): of readings (..., n, m), of places (..., n, 3) in m
        and of rotation vectors (..., n, 3) in rad, to first order; scalars are the same error everywhere."""
        n, m = self.full.shape
        v, w = (np.broadcast_to(np.asarray(e, float), (*np.shape(e)[:-2], n, 3)) for e in (places, turns))
        by_v, by_w = self.slope[..., :3], self.slope[..., 3:]
        e = np.einsum("nmi,...ni->...nm", by_v, v) + np.einsum("nmi,...ni->...nm", by_w, w)
        e = e - np.broadcast_to(np.asarray(lengths, float), (*np.shape(lengths)[:-2], n, m))
        return self._anchors_and_zeros(np.einsum("mkn,...nm->...mk", self.gain(squared), e))

    def _anchors_and_zeros(self, x: Array) -> tuple[Array, Array]:
        """Anchors (..., m, 3) and zeros (..., m) of what is sought (..., m, k)."""
        anchors = np.zeros((*x.shape[:-1], 3))
        anchors[..., self.axes] = x[..., :-1]
        return anchors, x[..., -1]

    def covariance(self, noise: Noise, *, squared: bool = False) -> Array:
        """Of what a fit of every cable by itself finds, over (cable, component, zero last), (m k, m k)."""
        gain = self.gain(squared)
        m, k, n = gain.shape
        through = np.einsum("mkn,nmi->mkni", gain, self.slope * noise.pose).reshape(m * k, 6 * n)
        out: Array = through @ through.T
        for i in range(m):
            out[i * k : i * k + k, i * k : i * k + k] += noise.length**2 * gain[i] @ gain[i].T
        return out

    def bound(self, noise: Noise) -> Array:
        """The same of errors in variables and of maximum likelihood with free poses under priors of this noise, (m k, m k).
        Raises ModelError where readings have no noise: the poses alone then say what is missing."""
        require(noise.length > 0, "readings without noise", key="length", found=noise.length, expected="above zero")
        n, m = self.full.shape
        by = self.slope * noise.pose
        w = np.linalg.inv(noise.length**2 * np.eye(m) + by @ by.swapaxes(1, 2))
        k = self.rows.shape[-1]
        info = np.einsum("npq,npk,nql->pkql", w, self.rows, self.rows, optimize=True).reshape(m * k, m * k)
        return np.linalg.inv(info)

    def rms_errors(self, covariance: Array) -> tuple[float, float]:
        """The root mean square error, (3.39), of anchors and zeros that a covariance (m k, m k) predicts, in m: over three components,
        those that are not sought without error."""
        k = self.rows.shape[-1]
        var = np.diag(covariance).reshape(-1, k)
        return float(np.sqrt(var[:, :-1].sum() / (3 * len(var)))), float(np.sqrt(var[:, -1].mean()))

    def bias_of_squares(self, noise: Noise) -> tuple[Array, Array]:
        """By how much the squared residual (3.18) errs on average, anchors (m, 3) and zeros (m,), to second order in the noise.

        The noise of what is squared is in the slopes as well: with c = s - a of covariance P, rho = |c| and q = tr P - s^2 + 2 c . E,
        E the mean shift of a turned lever, E[J u] is not zero but 2 P c + q c for the anchor and (q - 2 s^2) rho for the zero, and
        the estimate moves by half of the inverse of the mean of J J^T / 4 times that: it does not fade with the number of poses.
        """
        full, slope, lever = self._parts
        c = full[..., None] * slope[..., :3]
        cross = so3.skew(lever)
        p = noise.position**2 * np.eye(3) + noise.orientation**2 * cross @ cross.swapaxes(-1, -2)
        shift = -(noise.orientation**2) * lever
        q = np.trace(p, axis1=-2, axis2=-1) - noise.length**2 + 2 * (c * shift).sum(axis=-1)
        of_zero = (q - 2 * noise.length**2) * full
        v = np.concatenate([2 * np.einsum("nmij,nmj->nmi", p, c) + q[..., None] * c, of_zero[..., None]], axis=-1)
        j = np.concatenate([c, full[..., None]], axis=-1)
        mean = np.einsum("nmi,nmj->mij", j, j)
        mean[:, :3, :3] += p.sum(axis=0)
        mean[:, 3, 3] += len(full) * noise.length**2
        some = [*self.axes, 3]
        x = 0.5 * np.linalg.solve(mean[:, some][:, :, some], v.sum(axis=0)[:, some][..., None])[..., 0]
        return self._anchors_and_zeros(x)


@record
class Expected:
    """Root mean square errors: anchors, zeros and position in m, orientation in rad; position and orientation not a number where
    there are fewer cables than degrees of freedom."""

    anchors: float
    zeros: float
    position: float
    orientation: float


@record(eq=False)
class Requirement:
    """A list of poses, the noise of what is measured at them, and the estimator that is to be used."""

    design: ErrorPropagation
    noise: Noise
    estimator: str = ESTIMATORS[0]

    def __post_init__(self) -> None:
        require_one_of(self.estimator, ESTIMATORS, "unknown estimator")

    @cached_property
    def covariance(self) -> Array:
        """Of anchors and zeros, (m k, m k). Raises ModelError where there is no noise at all."""
        noisy = any(asdict(self.noise).values())
        require(noisy, "no noise", key="noise", expected="a standard deviation above zero")
        alone = self.estimator == "per-cable" or not (self.noise.position or self.noise.orientation)
        return self.design.covariance(self.noise) if alone else self.design.bound(self.noise)

    @cached_property
    def rms_errors(self) -> Expected:
        """The errors that are to be expected."""
        return Expected(*self.design.rms_errors(self.covariance), *self._poses())

    def _poses(self) -> tuple[float, float]:
        axes = list(self.design.robot.axes)
        n, m, k = self.design.rows.shape
        if m < len(axes):
            return float("nan"), float("nan")
        inverse = np.linalg.pinv(self.design.slope[..., axes])
        through = np.einsum("ndm,nmk->ndmk", inverse, self.design.rows).reshape(n, len(axes), m * k)
        var = np.einsum("ndi,ij,ndj->d", through, self.covariance, through, optimize=True) / n
        moves = np.array(axes) < 3
        return float(np.sqrt(var[moves].sum())), float(np.sqrt(var[~moves].sum()))

    def scale(self, what: str, accuracy: float) -> float:
        """The factor of all noises with which the error of `what` is `accuracy` (m, or rad of orientation)."""
        return accuracy / self._error(what)

    def poses(self, what: str, accuracy: float) -> int:
        """How many poses like those of the list do it with the noise as it is; so many as unknowns at least."""
        n, k = len(self.design.poses), int(self.design.rows.shape[-1])
        return max(k + 1, int(np.ceil(n / self.scale(what, accuracy) ** 2 - 1e-9)))

    def alone(self, what: str, accuracy: float) -> dict[str, float | None]:
        """What each noise would have to be with the others as they are, by its name; None where it alone cannot do it, however good:
        then the others are what is too large. Noises that are zero are left out."""
        return {name: self._alone(what, accuracy, name) for name, value in asdict(self.noise).items() if value}

    def _alone(self, what: str, accuracy: float, name: str) -> float | None:
        stated = getattr(self.noise, name)

        def error(factor: float) -> float:
            return replace(self, noise=replace(self.noise, **{name: factor * stated}))._error(what)

        low, high = NOWHERE, 1.0
        if error(low) > accuracy:
            return None
        while error(high) < accuracy:
            low, high = high, 2 * high
            if high > 1 / NOWHERE:  # this one hardly counts
                return float("inf")
        for _ in range(HALVINGS):
            middle = np.sqrt(low * high)
            low, high = (middle, high) if error(middle) < accuracy else (low, middle)
            if high / low < 1 + 1e-9:
                break
        return float(np.sqrt(low * high) * stated)

    def _error(self, what: str) -> float:
        require_one_of(what, WHAT, "no such error")
        return float(getattr(self.rms_errors, what))

    def contour(self, what: str, accuracy: float, pair: tuple[str, str], count: int = 46) -> Array:
        """Pairs of noises (count, 2), the third zero, with which the error of `what` is `accuracy` when every cable is fitted by
        itself: figures C.1 to C.6 of the thesis behind `examples/cable-laval`, without their filter."""
        out = np.empty((count, 2))
        size = [getattr(self.noise, name) or 1.0 for name in pair]
        for i, angle in enumerate(np.linspace(0, np.pi / 2, count)):
            there = (np.cos(angle) * size[0], np.sin(angle) * size[1])
            noise = replace(Noise(), **dict(zip(pair, (abs(v) for v in there), strict=True)))
            out[i] = np.array(there) * replace(self, noise=noise, estimator="per-cable").scale(what, accuracy)
        return out

"""Which sensors and how many poses a calibration needs to be as good as it must be.

A covariance that follows from three noises s = (of a length, of a place, of a turn) is homogeneous: all noises times k make all errors
times k. So every error that is wanted is reached by scaling all noises by one factor. One noise alone, the others as they are, is
found by bisection, where the error still falls; and with n poses like those of the list the error goes as 1 / sqrt(n). Which error:

    anchors, zeros          (3.39): root mean square of the components of the frame anchors, and of the zeros
    position, orientation   of the platform afterwards, by forward kinematics from lengths without noise: the pose (v, w) that the
                            error dx of the calibration leaves is L^+ D dx; root mean square over the list of |v| and of |w|
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cached_property

import numpy as np

from robocal._types import Array
from robocal.cables.calibration.propagation import ErrorPropagation, Noise
from robocal.errors import ModelError, nearest

__all__ = ["ESTIMATORS", "WHAT", "Expected", "Requirement"]

ESTIMATORS = ("maximum-likelihood", "per-cable")
WHAT = ("anchors", "zeros", "position", "orientation")
HALVINGS = 60
NOWHERE = 1e-6  # of a noise: a sensor that is none better


@dataclass(frozen=True)
class Expected:
    """Root mean square errors: anchors, zeros and position in m, orientation in rad; position and orientation not a number where
    there are fewer cables than degrees of freedom."""

    anchors: float
    zeros: float
    position: float
    orientation: float


@dataclass(frozen=True, eq=False)
class Requirement:
    """A list of poses, the noise of what is measured at them, and the estimator that is to be used."""

    design: ErrorPropagation
    noise: Noise
    estimator: str = ESTIMATORS[0]

    def __post_init__(self) -> None:
        if self.estimator not in ESTIMATORS:
            raise ModelError(
                "unknown estimator",
                found=self.estimator,
                expected=" or ".join(ESTIMATORS),
                suggestion=nearest(self.estimator, ESTIMATORS),
            )

    @cached_property
    def covariance(self) -> Array:
        """Of anchors and zeros, (m k, m k). Raises ModelError where there is no noise at all."""
        if not any(asdict(self.noise).values()):
            raise ModelError("no noise", key="noise", expected="a standard deviation above zero")
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
        if what not in WHAT:
            raise ModelError("no such error", found=what, expected=" or ".join(WHAT), suggestion=nearest(what, WHAT))
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

"""A lens that was calibrated: its numbers, what they may be off by, and the size of the images that they are for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import require
from robocal.vision.camera import MODELS, LensModel

__all__ = ["Lens"]

SPREAD = ("fx", "fy", "cx", "cy")  # the numbers that are in pixels


@record
class Lens:
    """The numbers (n,) of a lens in the order of its model's symbols, image size (width, height) in px or None where nobody says it, the
    covariance (k, k) of the numbers `known` by symbol (empty: not stated), and what it was made from."""

    model: str
    numbers: tuple[float, ...]
    size: tuple[int, int] | None = None
    known: tuple[str, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()
    source: str = ""

    @classmethod
    def of(
        cls,
        model: str,
        numbers: Array | Sequence[float],
        size: tuple[int, int] | None = None,
        known: Sequence[str] = (),
        covariance: Array | None = None,
        source: str = "",
    ) -> Lens:
        """The same from arrays. Raises ModelError for an unknown model, or numbers that are not as many as it has."""
        require(model in MODELS, "no such model of lenses", found=model, expected=", ".join(MODELS))
        values, wanted = tuple(float(v) for v in np.asarray(numbers)), MODELS[model].symbols
        require(len(values) == len(wanted), "a lens with other numbers", found=len(values), expected=", ".join(wanted))
        matrix = () if covariance is None else tuple(map(tuple, np.asarray(covariance, dtype=float).tolist()))
        require(len(matrix) == len(known), "a covariance of other numbers", found=len(matrix), expected=str(len(known)))
        return cls(model, values, size, tuple(known), matrix, source)

    @property
    def kind(self) -> LensModel:
        """The model itself."""
        return MODELS[self.model]

    @property
    def intrinsics(self) -> Array:
        """The numbers as `vision.camera` takes them, (n,)."""
        return np.array(self.numbers)

    @property
    def sigma(self) -> dict[str, float]:
        """The standard deviation of every number that is known with one, by symbol."""
        return {s: self.covariance[i][i] ** 0.5 for i, s in enumerate(self.known)}

    @property
    def correlation(self) -> Array:
        """The correlations (k, k) of these."""
        c, sigma = np.array(self.covariance).reshape((len(self.known),) * 2), np.array(list(self.sigma.values()))
        return np.asarray(c / np.outer(sigma, sigma))

    def scale(self, factor: float) -> Lens:
        """The lens of images that are `factor` as wide and high: the centre of the first pixel stays (0, 0), so

        f -> s f,   c -> s (c + 1/2) - 1/2
        """
        numbers = [v * factor if s in SPREAD else v for s, v in zip(self.kind.symbols, self.numbers, strict=True)]
        for i in (2, 3):
            numbers[i] += 0.5 * factor - 0.5
        by = np.array([factor if s in SPREAD else 1.0 for s in self.known])
        c = np.array(self.covariance).reshape(len(by), len(by)) * np.outer(by, by)
        size = None if self.size is None else (round(self.size[0] * factor), round(self.size[1] * factor))
        return replace(self, numbers=tuple(numbers), size=size, covariance=tuple(map(tuple, c.tolist())))

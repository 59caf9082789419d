"""Where an estimate stood on its way, for people who want to see how it came about: kept where a fit is told, and nowhere else."""

from __future__ import annotations

from collections.abc import Sequence

from robocal._types import Array

__all__ = ["Trail", "keep"]


class Trail:
    """Values x (P,) of one problem after `at` iterations or configurations, and beside them what a filter knew: covariances (n, n).

    Of more than `most` every second is forgotten, so that steps stay even and whatever runs long costs no memory. Who adds counts
    from 0; `first` stood before it.
    """

    def __init__(self, most: int = 101, first: Sequence[Array] = ()) -> None:
        self.at, self.x = list(range(len(first))), [x.copy() for x in first]
        self.covariance: list[Array] = []
        self._most, self._step, self._before = most, 1, len(first)

    def wants(self, count: int) -> bool:
        """Whether what stands after so many is kept."""
        return (count + self._before) % self._step == 0

    def add(self, count: int, x: Array, covariance: Array | None = None, last: bool = False) -> None:
        """Keeps a copy of x where it is wanted, or where it is the last."""
        if not (last or self.wants(count)):
            return
        self.at.append(count + self._before)
        self.x.append(x.copy())
        if covariance is not None:
            self.covariance.append(covariance)
        if len(self.at) > self._most and not last:
            self._step *= 2
            even = [i for i, n in enumerate(self.at) if n % self._step == 0]
            self.at, self.x = [self.at[i] for i in even], [self.x[i] for i in even]
            self.covariance = [self.covariance[i] for i in even] if self.covariance else []


def keep(trail: Trail | None, count: int, x: Array, covariance: Array | None = None) -> None:
    """Tells a trail, where there is one, where it stands."""
    if trail is not None:
        trail.add(count, x, covariance)

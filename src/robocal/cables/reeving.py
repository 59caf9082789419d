"""How the length of a cable is made of segments: an integer sum, where a cable runs over pulleys that move with the platform or is
reeved several times.

    l_i = sum_s n_is |e_s| - l0_i

Segment s runs from one point to another; n_is says how often cable i runs along it. A cable of one straight segment is the case
n = 1. A segment between two points of one body, frame or platform, is as long wherever the platform is.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Self

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError

__all__ = ["Reeving"]


@record(eq=False)
class Reeving:
    """The segments of m cables, at first the first one of each cable, then what some cables have besides.

    `names` (p,) are those under which the numbers of a segment stand (`c1`, and `c1.2` for what c1 has besides), `labels` (p,) what a
    person calls it; cable (p,) is the number of its cable, times (p,) how often that runs along it, moves (p, 2) which of its ends move
    with the platform. Two cables along one segment have one each, with numbers that they share.
    """

    names: tuple[str, ...]
    cable: Ints
    times: Array
    moves: Bools
    labels: tuple[str, ...]

    @classmethod
    def plain(cls, cables: Sequence[str]) -> Self:
        """Every cable straight, along one segment."""
        m = len(cables)
        return cls(tuple(cables), np.arange(m), np.ones(m), np.tile([False, True], (m, 1)), tuple(cables))

    @classmethod
    def of(cls, cables: Sequence[str], runs: Sequence[Sequence[tuple[int, tuple[bool, bool], str]]]) -> Self:
        """Of what each cable runs along: how often, which of its ends move with the platform, and what it is called."""
        first = [(cable, i, *run[0]) for i, (cable, run) in enumerate(zip(cables, runs, strict=True))]
        more = [
            (f"{cable}.{j}", i, *one)
            for i, (cable, run) in enumerate(zip(cables, runs, strict=True))
            for j, one in enumerate(run[1:], start=2)
        ]
        names, cable, times, moves, labels = zip(*first, *more, strict=True)
        return cls(names, np.array(cable), np.array(times, dtype=float), np.array(moves, dtype=bool), labels)

    @cached_property
    def still(self) -> Bools:
        """Which segments (p,) have both ends on one body."""
        return np.asarray(self.moves[:, 0] == self.moves[:, 1])

    @cached_property
    def is_plain(self) -> bool:
        """Whether every cable runs straight, once along one segment."""
        one_each = bool((self.cable == np.arange(len(self.cable))).all())
        return one_each and bool((self.times == 1).all()) and not self.still.any()

    def rows(self, cable: Ints) -> tuple[Ints, Ints]:
        """The segments (n,) of rows that are of cables (k,), and of which row each is, (n,)."""
        order = np.argsort(self.cable, kind="stable")
        begin = np.searchsorted(self.cable[order], np.arange(int(self.cable.max()) + 2))
        many = np.diff(begin)[cable]
        row = np.repeat(np.arange(len(cable)), many)
        within = np.arange(len(row)) - np.repeat(np.cumsum(many) - many, many)
        return row, order[begin[cable][row] + within]

    def sums(self, each: Array) -> Array:
        """Of every cable (k, m, ...), of every segment (k, p, ...)."""
        m = int(self.cable.max()) + 1
        scaled = each * self.times.reshape(-1, *(1,) * (each.ndim - 2))
        out = np.array(scaled[:, :m])
        for s in range(m, len(self.cable)):
            out[:, self.cable[s]] += scaled[:, s]
        return out

    def sum_of(self, cable: int) -> str:
        """What a cable runs along: m + 2 k."""
        own = [(n, int(t)) for n, c, t in zip(self.labels, self.cable, self.times, strict=True) if c == cable]
        return " + ".join(n if t == 1 else f"{t} {n}" for n, t in own)

    def need_straight(self, cables: Sequence[str], railed: Bools | None = None) -> None:
        """Raises ModelError naming the cable that is most of a sum, where any is one, or one whose anchor is on a rail, railed (p,)."""
        if self.is_plain and railed is None:
            return
        if self.is_plain:
            assert railed is not None
            key, expected = cables[int(np.argmax(railed))], "what docs/cables/kinds.md lists for such cables"
            raise ModelError(
                "a frame anchor is on a rail; this is for anchors that stay where they are", key=key, expected=expected
            )
        i = int(np.argmax(np.bincount(self.cable, np.abs(self.times) + self.still)))
        raise ModelError(
            "a cable is a sum of segments; this is for cables that run straight from frame to platform", key=cables[i],
            found=f"{cables[i]} = {self.sum_of(i)}", expected="what docs/cables/kinds.md lists for such cables",
        )  # fmt: skip

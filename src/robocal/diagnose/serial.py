"""Errors that follow one another: what sums of them scatter by (Newey and West 1987)."""

from __future__ import annotations

from robocal._types import Array

__all__ = ["correlation_factor"]


def correlation_factor(score: Array) -> float:
    """By how much serial correlation widens the spread of a sum of scores (k, q): Bartlett's window, never below 1."""
    k = len(score)
    centred = score - score.mean(axis=0)
    square = float((centred**2).sum())
    if square <= 0:
        return 1.0
    reach = max(1, min(k // 4, int(4 * (k / 100) ** (2 / 9)) + 8))
    lags = [(1 - h / (reach + 1)) * float((centred[h:] * centred[:-h]).sum()) for h in range(1, reach + 1)]
    return max(1.0, 1 + 2 * sum(lags) / square)

"""Standard deviations of numbers in a file and the correlations of these, as one covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.yamlio import Path_, YamlDocument
from robocal.parameters import check_covariance

__all__ = ["covariance_of"]


def covariance_of(
    document: YamlDocument,
    sigma: Mapping[str, float],
    correlation: Sequence[Sequence[float]] | None,
    symbols: Sequence[str],
    at: Path_,
    of: str = "sigma",
) -> Array:
    """The covariance (k, k) of some numbers from standard deviations, which stand under the key `of`, and correlations (none: 0). Raises
    FormatError."""
    for symbol, value in sigma.items():
        document.insist_known(symbol, symbols, "not a number of this lens", (*at, of, symbol))
        if not 1e-30 < value < 1e30:
            document.fail("not a standard deviation", (*at, of, symbol), found=value, expected="a number above 0")
    size = len(sigma)
    if correlation is None:
        correlation = np.eye(size).tolist()
    for i, row in enumerate(correlation):
        if len(row) != size:
            document.fail(
                "wrong number of values", (*at, "correlation", i), found=len(row), expected=f"{size}, as in {of}"
            )
    if len(correlation) != size:
        document.fail(
            "wrong number of rows", (*at, "correlation"), found=len(correlation), expected=f"{size}, as in {of}"
        )
    c, s = np.array(correlation, dtype=float).reshape(size, size), np.array(list(sigma.values()))
    if (np.abs(np.diag(c) - 1) > 1e-9).any():
        document.fail("a number's correlation with itself is 1", (*at, "correlation"), found=float(np.diag(c).min()))
    try:
        check_covariance(c, size, "correlation")
    except ModelError as error:
        document.fail(error.message, (*at, "correlation"), found=error.found, expected=error.expected)
    return np.asarray(c * np.outer(s, s))

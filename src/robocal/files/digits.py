"""What the last digit of a written number means, of many numbers at once."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal

import numpy as np

from robocal._types import Array, Bools, Ints

__all__ = ["last_digits"]


def last_digits(columns: Sequence[Sequence[str]]) -> Array:
    """One unit in the last digit of each number, (rows, columns), from columns of numbers as they are written.

    Programs write so many decimals, or so many significant digits, and some drop zeros at the end: with D the most
    decimals and S the most significant digits in these columns, 10^max(-D, e - S + 1) of a number between 10^e and
    10^(e + 1).
    """
    decimals, significant, zero = (np.column_stack(part) for part in zip(*map(_written, columns), strict=True))
    d, s = int(decimals.max()), int(significant.max())
    size = np.where(zero, -d, significant - 1 - decimals)
    return np.asarray(10.0 ** np.maximum(-d, size - s + 1).astype(float))


def _written(cells: Sequence[str]) -> tuple[Ints, Ints, Bools]:
    """Decimals and significant digits of each cell (n,), and whether it is zero."""
    # Numbers with exponents, few in most files, are read one by one.
    every = "".join(cells)
    odd = []
    if "e" in every or "E" in every or not every.isascii():
        odd = [k for k, cell in enumerate(cells) if "e" in cell or "E" in cell or not cell.isascii()]
    plain = list(cells)
    for k in odd:
        plain[k] = "0"
    text = np.array(plain, dtype=np.bytes_)
    # One row for each place in the text: what follows runs over all cells at once.
    letters = np.ascontiguousarray(text.view(np.uint8).reshape(len(cells), -1).T)
    digit = letters - ord("0") <= 9
    behind = np.logical_or.accumulate(letters == ord("."), axis=0)
    leading = np.logical_or.accumulate(digit & (letters > ord("0")), axis=0)
    decimals, significant = (digit & behind).sum(axis=0), (digit & leading).sum(axis=0)
    zero = significant == 0
    significant = np.maximum(significant, 1)
    for k in odd:
        part = Decimal(cells[k].strip()).as_tuple()
        decimals[k], significant[k], zero[k] = -int(part.exponent), len(part.digits), part.digits == (0,)
    return decimals, significant, zero
